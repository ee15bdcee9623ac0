//! What the run was like: frames, surfaces, answers, what strokes left behind; the check at the end.

use crate::args::Args;
use crate::pace::Pace;
use crate::pick;
use crate::say;
use crate::stroke::{Done, StrokeNews, Work};
use crate::tools::ToolKind;
use bevy::prelude::*;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured, save_to_disk};
use bevy::tasks::futures::check_ready;
use bevy::tasks::{AsyncComputeTaskPool, Task};
use bevy_clay::prelude::*;
use std::sync::Arc;
use std::time::Instant;

/// What the surface has to move for an answer \[m\].
const ANSWER: f32 = 3e-5;
/// How long clay may settle before a stroke is measured, in its own time \[s\]; clay at rest has settled.
const SETTLING: f64 = 0.05;

/// The run so far.
#[derive(Resource)]
pub(crate) struct Watch {
    began: Instant,
    frames: u64,
    surfaces: u64,
    /// A press whose answer is not shown yet: when, where, how far the surface was.
    asked: Option<(Instant, Ray3d, f32)>,
    /// Press to surface \[ms\].
    pub(crate) answers: Vec<f64>,
    settling: Option<Settling>,
    /// Said of the stroke under way.
    is_deep_said: bool,
    counting: Option<Counting>,
    /// Greatest force on the tool since the stroke began \[N\].
    force: f64,
    pub(crate) strokes: Vec<Outcome>,
    held_ms: f64,
    /// The window is to close.
    pub(crate) is_over: bool,
    is_closing: bool,
}

impl Default for Watch {
    fn default() -> Self {
        Self {
            began: Instant::now(),
            frames: 0,
            surfaces: 0,
            asked: None,
            answers: vec![],
            settling: None,
            is_deep_said: false,
            counting: None,
            force: 0.0,
            strokes: vec![],
            held_ms: 0.0,
            is_over: false,
            is_closing: false,
        }
    }
}

/// What a stroke left behind.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Outcome {
    /// Greatest distance by which the surface went away from the eye along the stroke \[mm\].
    pub(crate) dent: f32,
    /// Bodies that the surface encloses.
    pub(crate) bodies: usize,
}

/// A stroke that is to be measured when the clay has settled and its surface shows that.
struct Settling {
    done: Arc<Done>,
    /// Time of the clay when the tool left \[s\].
    since: f64,
    /// The state of the clay when it had settled: the surface of that or a newer one is measured.
    settled: Option<(u64, u64)>,
}

/// A stroke whose bodies are being counted.
struct Counting {
    done: Arc<Done>,
    /// As in [`Outcome`] \[mm\].
    dent: f32,
    /// Bodies before the stroke and after it.
    bodies: Task<[usize; 2]>,
}

/// Counts, and times the answer to each press.
pub(crate) fn count(
    surface: Query<&ClaySurface, Changed<ClaySurface>>,
    metrics: Single<&ClayMetrics>,
    work: Res<Work>,
    mut news: MessageReader<StrokeNews>,
    mut reports: MessageReader<ClayReport>,
    mut watch: ResMut<Watch>,
) {
    watch.frames += 1;
    // For whoever watches the terminal, a script that moves the mouse too: what may come next.
    if work.stroke.as_ref().is_some_and(|stroke| stroke.is_deep) != watch.is_deep_said {
        watch.is_deep_said ^= true;
        if watch.is_deep_said {
            say(&format!("stroke {} is as deep as it goes", work.count));
        }
    }
    let forces = reports.read().flat_map(|r| &r.report.tools).map(|t| t.force.length());
    watch.force = forces.fold(watch.force, f64::max);
    watch.held_ms = watch.held_ms.max(metrics.main_thread_ms);
    for item in news.read() {
        match item {
            StrokeNews::Began => {
                say(&format!("stroke {} begins", work.count));
                watch.force = 0.0;
                let stroke = work.stroke.as_ref();
                watch.asked = stroke.map(|s| (s.began, s.places[0].0, s.places[0].1.distance));
            }
            StrokeNews::Ended(done) => {
                watch.settling = Some(Settling { done: done.clone(), since: metrics.time, settled: None });
            }
        }
    }
    for surface in &surface {
        watch.surfaces += 1;
        if watch.surfaces == 1 {
            say("the clay is shown");
        }
        let Some((began, ray, before)) = watch.asked else { continue };
        if pick::cast(surface, ray).is_some_and(|hit| hit.distance > before + ANSWER) {
            watch.answers.push(began.elapsed().as_secs_f64() * 1e3);
            watch.asked = None;
        }
    }
}

/// Measures what a stroke left behind when the clay has settled and is shown so, or the next stroke begins;
/// bodies are counted away from the main thread.
pub(crate) fn measure(
    clay: Query<(&ClaySurface, &ClayEngine, &ClayMetrics)>,
    (work, pace): (Res<Work>, Res<Pace>),
    mut watch: ResMut<Watch>,
) {
    let watch = &mut *watch;
    if let Some([before, now]) = watch.counting.as_mut().and_then(|counting| check_ready(&mut counting.bodies))
        && let Some(Counting { done, dent, .. }) = watch.counting.take()
    {
        watch.report(&done, before, Outcome { dent, bodies: now });
    }
    let (Some(settling), Ok((surface, engine, metrics))) = (&mut watch.settling, clay.single()) else { return };
    if pace.is_at_rest || metrics.time > settling.since + SETTLING {
        settling.settled.get_or_insert_with(|| engine.revision());
    }
    let is_shown = settling.settled.is_some_and(|state| surface.revision() >= state);
    if watch.counting.is_some() || !(is_shown || work.stroke.is_some() || watch.is_over) {
        return;
    }
    let Some(Settling { done, .. }) = watch.settling.take() else { return };
    let away = done.places.iter().filter_map(|(ray, hit)| Some(pick::cast(surface, *ray)?.distance - hit.distance));
    let dent = 1e3 * away.fold(0.0, f32::max);
    let (before, now) = (done.before.clone(), surface.clone());
    let bodies = AsyncComputeTaskPool::get().spawn(async move { [pick::bodies(&before), pick::bodies(&now)] });
    watch.counting = Some(Counting { done, dent, bodies });
}

impl Watch {
    /// Says what a stroke left behind.
    fn report(&mut self, done: &Done, bodies_before: usize, outcome: Outcome) {
        let at = done.places[0].1.point * 1e3;
        let answer = match self.answers.last() {
            Some(ms) if done.kind != ToolKind::Knife => format!(", answered in {ms:.0} ms"),
            _ => String::new(),
        };
        say(&format!(
            "stroke {} {} at ({:.1}, {:.1}, {:.1}) mm: dent {:.2} mm, force up to {:.2} N, {bodies_before} bodies before, {} bodies now{answer}",
            done.number,
            done.kind.name(),
            at.x,
            at.y,
            at.z,
            outcome.dent,
            self.force,
            outcome.bodies
        ));
        self.strokes.push(outcome);
    }
}

/// Ends the run when it is over: takes the picture, checks, leaves.
pub(crate) fn end(
    args: Res<Args>,
    clay: Single<(&ClayStatus, &ClayMetrics)>,
    mut watch: ResMut<Watch>,
    mut commands: Commands,
    mut exit: MessageWriter<AppExit>,
) {
    watch.is_over |= args.frames.is_some_and(|frames| watch.frames >= frames);
    if !watch.is_over || watch.is_closing || watch.counting.is_some() {
        return;
    }
    watch.is_closing = true;
    let (status, metrics) = *clay;
    let faults = faults(&args, status, &watch);
    summary(status, metrics, &watch);
    faults.iter().for_each(|fault| say::error(&format!("check failed: {fault}")));
    let code = if faults.is_empty() { AppExit::Success } else { AppExit::error() };
    let Some(path) = args.screenshot.clone() else {
        exit.write(code);
        return;
    };
    // One observer: the picture has to be written before the app ends.
    let mut save = save_to_disk(path.clone());
    let take = move |picture: On<ScreenshotCaptured>, mut exit: MessageWriter<AppExit>| {
        save(picture);
        if path.exists() {
            exit.write(code.clone());
        } else {
            say::error(&format!("{}: the picture could not be written", path.display()));
            exit.write(AppExit::error());
        }
    };
    commands.spawn(Screenshot::primary_window()).observe(take);
}

/// What did not hold.
fn faults(args: &Args, status: &ClayStatus, watch: &Watch) -> Vec<String> {
    let mut faults = vec![];
    let mut check = |holds: bool, fault: &str| {
        if !holds {
            faults.push(fault.to_string());
        }
    };
    check(watch.surfaces > 0, "no surface was shown: the run was too short, or the clay did not start");
    check(status.error.is_none(), &status.error.as_ref().map(ToString::to_string).unwrap_or_default());
    if args.script {
        check(!watch.strokes.is_empty(), "the script's stroke did not end: more --frames are needed");
        check(watch.strokes.iter().all(|s| s.dent > 0.5), "the stroke left no dent of half a millimetre");
    }
    faults
}

fn summary(status: &ClayStatus, metrics: &ClayMetrics, watch: &Watch) {
    let seconds = watch.began.elapsed().as_secs_f64();
    let mut answers = watch.answers.clone();
    answers.sort_by(f64::total_cmp);
    let answer = answers.get(answers.len() / 2).map_or(String::new(), |ms| format!(", answer in {ms:.0} ms (median)"));
    say(&format!(
        "{} frames in {seconds:.1} s, {} surfaces shown{answer}, main thread held at most {:.2} ms, {}, {} particles, {:.2} s of clay, {}",
        watch.frames, watch.surfaces, watch.held_ms, status.engine, status.particle_count, metrics.time, status.health
    ));
}

/// A line for the terminal.
pub(crate) fn say(line: &str) {
    say::line(&format!("sculpt: {line}"));
}
