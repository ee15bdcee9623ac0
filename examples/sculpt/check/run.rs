//! The run as a whole: frames, surfaces, its end, and whether all was well.

use super::arm::Served;
use super::strokes::Strokes;
use super::{CheckArgs, say};
use crate::say as lines;
use bevy::input::common_conditions::input_just_pressed;
use bevy::prelude::*;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured, save_to_disk};
use bevy::window::RequestRedraw;
use bevy_clay::prelude::*;
use std::time::Instant;

/// The key with which whoever sends events waits until the app has seen them.
const MARK: KeyCode = KeyCode::F12;

/// Least dent that a stroke of the script leaves \[mm\].
const DENT_MIN: f32 = 0.5;

/// Counts, ends the run when it is to end, and says at any end how it was.
pub(super) struct RunPlugin;

impl Plugin for RunPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(Run { began: Instant::now(), frames: 0, surfaces: 0, marks: 0, held_ms: 0.0, is_closing: false })
            .add_systems(Last, mark.run_if(input_just_pressed(MARK)))
            .add_systems(Update, (count, (keep_drawing, end).run_if(ends)).chain().after(ClaySystems::Show))
            .add_systems(Last, conclude.run_if(on_message::<AppExit>));
    }
}

/// The run so far.
#[derive(Resource)]
struct Run {
    began: Instant,
    frames: u64,
    surfaces: u64,
    /// How often [`MARK`] was pressed.
    marks: u64,
    /// Longest time that the clay held the main thread \[ms\].
    held_ms: f64,
    is_closing: bool,
}

/// Whether the run ends by itself.
fn ends(args: Res<CheckArgs>) -> bool {
    args.ends()
}

fn count(shown: Query<(), Changed<ClaySurface>>, metrics: Single<&ClayMetrics>, mut run: ResMut<Run>) {
    run.frames += 1;
    run.held_ms = run.held_ms.max(metrics.main_thread_ms);
    for () in &shown {
        run.surfaces += 1;
        if run.surfaces == 1 {
            say("the clay is shown");
        }
    }
}

/// Says when a frame has ended that has seen [`MARK`]: events before it have been seen too, and those that
/// come after are seen in another frame.
fn mark(mut run: ResMut<Run>) {
    run.marks += 1;
    say(&format!("mark {}", run.marks));
}

/// Frames are counted though nothing moves.
fn keep_drawing(mut redraw: MessageWriter<RequestRedraw>) {
    redraw.write(RequestRedraw);
}

/// Ends the run when the script or the frames do; takes the picture first.
fn end(
    args: Res<CheckArgs>,
    (strokes, served): (Res<Strokes>, Option<Res<Served>>),
    mut run: ResMut<Run>,
    mut commands: Commands,
    mut exit: MessageWriter<AppExit>,
) {
    let is_served = served.is_some_and(|served| served.is_over);
    let is_over =
        is_served || (args.script && !strokes.outcomes.is_empty()) || args.frames.is_some_and(|frames| run.frames >= frames);
    if !is_over || run.is_closing {
        return;
    }
    run.is_closing = true;
    let Some(path) = args.screenshot.clone() else {
        exit.write(AppExit::Success);
        return;
    };
    // One observer: the picture has to be written before the app ends.
    let mut save = save_to_disk(path.clone());
    let take = move |picture: On<ScreenshotCaptured>, mut exit: MessageWriter<AppExit>| {
        save(picture);
        if path.exists() {
            exit.write(AppExit::Success);
        } else {
            lines::error(&format!("{}: the picture could not be written", path.display()));
            exit.write(AppExit::error());
        }
    };
    commands.spawn(Screenshot::primary_window()).observe(take);
}

/// Says how the run was, whoever ended it, and lets it fail if something was wrong.
fn conclude(
    args: Res<CheckArgs>,
    clay: Single<(&ClayStatus, &ClayMetrics)>,
    (run, strokes, served): (Res<Run>, Res<Strokes>, Option<Res<Served>>),
    mut exit: MessageWriter<AppExit>,
) {
    let (status, metrics) = *clay;
    let seconds = run.began.elapsed().as_secs_f64();
    let mut answers = strokes.answers.clone();
    answers.sort_by(f64::total_cmp);
    let answer = answers.get(answers.len() / 2).map_or(String::new(), |ms| format!(", answer in {ms:.0} ms (median)"));
    say(&format!(
        "{} frames in {seconds:.1} s, {} surfaces shown{answer}, main thread held at most {:.2} ms, {}, {} particles, {:.2} s of clay, {}",
        run.frames, run.surfaces, run.held_ms, status.engine, status.particle_count, metrics.time, status.health
    ));
    let mut fail = |fault: &str| {
        lines::error(&format!("check failed: {fault}"));
        exit.write(AppExit::error());
    };
    if run.surfaces == 0 {
        fail("no surface was shown: the run was too short, or the clay did not start");
    }
    if let Some(error) = &status.error {
        fail(&error.to_string());
    }
    if args.script && served.is_none() && strokes.outcomes.is_empty() {
        fail("the script's stroke did not end: more --frames are needed");
    }
    if args.script && strokes.outcomes.iter().any(|stroke| stroke.dent <= DENT_MIN) {
        fail("the stroke left no dent of half a millimetre");
    }
}
