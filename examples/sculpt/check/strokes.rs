//! What strokes look like from outside: how soon the clay answers a press, how fast clay and window go
//! meanwhile, and what the clay looks like when it has settled.

use super::say;
use crate::hand::{Hand, ToolKind};
use crate::pace::Pace;
use crate::pointer::{Hit, Pointer, cast};
use crate::stroke::{Stroke, work};
use crate::tools::InHand;
use bevy::diagnostic::FrameCount;
use bevy::prelude::*;
use bevy::tasks::futures::check_ready;
use bevy::tasks::{AsyncComputeTaskPool, Task};
use bevy_clay::prelude::*;
use bevy_clay::surface::extract::extract_field;
use bevy_clay::surface::field::SurfaceSettings;
use std::time::Instant;

/// What the surface has to move for an answer \[m\].
const ANSWER: f32 = 3e-5;
/// How long clay may settle before a stroke is measured, in its own time \[s\]; clay at rest has settled. After
/// a cut, which is there when the knife is through, a fifth of it.
const SETTLING: f64 = 0.05;
/// How near its target \[m\] a tool has arrived.
const ARRIVED: f32 = 1e-6;
/// Most places that are remembered of a stroke.
const PLACES_MAX: usize = 256;
/// Least part of the whole that counts as a body of its own.
const BODY_PART: f64 = 0.005;

/// Measures strokes.
pub(super) struct StrokesPlugin;

impl Plugin for StrokesPlugin {
    fn build(&self, app: &mut App) {
        let watch = (
            begin.run_if(resource_added::<Stroke>),
            follow.run_if(resource_exists::<Stroke>),
            end.run_if(resource_removed::<Stroke>),
        );
        app.init_resource::<Strokes>()
            .add_systems(Update, watch.chain().after(work).in_set(ClaySystems::Tool))
            .add_systems(Update, (answer, feel, settle, count_bodies).chain().after(ClaySystems::Show));
    }
}

/// The strokes so far.
#[derive(Resource, Default)]
pub(super) struct Strokes {
    /// How many have begun.
    count: u32,
    under_way: Option<Seen>,
    settling: Option<Settling>,
    counting: Option<Counting>,
    /// A press whose answer is not shown yet: when, where, how far the surface was.
    asked: Option<(Instant, Ray3d, f32)>,
    /// Press to surface \[ms\].
    pub(super) answers: Vec<f64>,
    pub(super) outcomes: Vec<Outcome>,
}

impl Strokes {
    /// Whether a tool is as deep as it goes.
    pub(super) fn is_deep(&self) -> bool {
        self.under_way.as_ref().is_some_and(|seen| seen.is_deep)
    }

    /// The stroke that began last, until it is measured.
    fn last(&mut self) -> Option<&mut Seen> {
        self.under_way.as_mut().or(self.settling.as_mut().map(|settling| &mut settling.seen))
    }
}

/// What a stroke left behind.
pub(super) struct Outcome {
    /// Greatest distance by which the surface went away from the eye along the stroke \[mm\].
    pub(super) dent: f32,
}

/// A stroke as it was seen.
struct Seen {
    number: u32,
    kind: ToolKind,
    /// The surface it began with.
    before: ClaySurface,
    /// Rays along the stroke and where they met that surface.
    places: Vec<(Ray3d, Hit)>,
    /// Greatest force on the tool \[N\].
    force: f64,
    /// Press to surface \[ms\].
    answer: Option<f64>,
    is_deep: bool,
    /// Where the clay was when the stroke began, and how fast it went until it ended.
    began: Progress,
    pace: Option<String>,
}

/// How far the clay and the window are.
#[derive(Clone, Copy)]
struct Progress {
    at: Instant,
    /// Time of the clay \[s\].
    time: f64,
    /// Time that was given up \[s\].
    given_up: f64,
    pictures: u64,
}

/// What a [`Progress`] is seen by.
type Watched<'w, 's> = (Single<'w, 's, &'static ClayMetrics>, Query<'w, 's, &'static ScreenCamera>, Res<'w, FrameCount>);

impl Progress {
    fn now((metrics, screens, frames): &Watched) -> Self {
        // Without cameras of their own windows are drawn in every frame.
        let pictures = screens.iter().next().map_or(u64::from(frames.0), |screen| screen.picture_count);
        Self { at: Instant::now(), time: metrics.time, given_up: metrics.given_up, pictures }
    }

    /// What happened since.
    fn until(&self, end: &Self) -> String {
        let seconds = (end.at - self.at).as_secs_f64();
        #[expect(clippy::cast_precision_loss, reason = "counts of pictures are small")]
        let pictures = (end.pictures - self.pictures) as f64;
        format!(
            "{seconds:.1} s at {:.2} x real time, {:.0} pictures a second, {:.2} s given up",
            (end.time - self.time) / seconds,
            pictures / seconds,
            end.given_up - self.given_up
        )
    }
}

/// A stroke that is to be measured when the clay has settled and its surface shows that.
struct Settling {
    seen: Seen,
    /// Time of the clay when the tool left \[s\].
    since: f64,
    /// The state of the clay when it had settled: the surface of that or a newer one is measured.
    settled: Option<(u64, u64)>,
}

/// A stroke whose bodies are being counted.
struct Counting {
    seen: Seen,
    /// As in [`Outcome`] \[mm\].
    dent: f32,
    /// Bodies before the stroke and after it.
    bodies: Task<[usize; 2]>,
}

fn begin(stroke: Res<Stroke>, (pointer, hand): (Res<Pointer>, Res<Hand>), watched: Watched, mut strokes: ResMut<Strokes>) {
    let Some(aim) = pointer.aim else { return };
    strokes.count += 1;
    say(&format!("stroke {} begins", strokes.count));
    strokes.asked = Some((Instant::now(), aim.ray, stroke.hit.distance));
    strokes.under_way = Some(Seen {
        number: strokes.count,
        kind: hand.kind,
        before: stroke.before.clone(),
        places: vec![(aim.ray, stroke.hit)],
        force: 0.0,
        answer: None,
        is_deep: false,
        began: Progress::now(&watched),
        pace: None,
    });
}

fn follow(
    stroke: Res<Stroke>,
    (pointer, hand): (Res<Pointer>, Res<Hand>),
    tool: Single<&Transform, With<InHand>>,
    mut strokes: ResMut<Strokes>,
) {
    let Some(seen) = &mut strokes.under_way else { return };
    if let Some(aim) = pointer.aim.filter(|_| pointer.is_down && seen.places.len() < PLACES_MAX) {
        seen.places.extend(cast(&seen.before, aim.ray).map(|hit| (aim.ray, hit)));
    }
    let is_there = tool.translation.distance(stroke.target(&hand).translation) < ARRIVED;
    let is_deep = seen.kind != ToolKind::Knife && is_there && stroke.depth >= hand.depth_max();
    if is_deep && !seen.is_deep {
        // For whoever watches the terminal, a script that moves the mouse too: what may come next.
        say(&format!("stroke {} is as deep as it goes", seen.number));
    }
    seen.is_deep |= is_deep;
}

fn end(watched: Watched, mut strokes: ResMut<Strokes>) {
    let now = Progress::now(&watched);
    // What the tool has gone the clay has still to go.
    let since = now.time + watched.0.lag;
    strokes.settling = strokes.under_way.take().map(|seen| {
        let pace = Some(seen.began.until(&now));
        Settling { seen: Seen { pace, ..seen }, since, settled: None }
    });
}

/// Times the answer to each press.
fn answer(surface: Query<&ClaySurface, Changed<ClaySurface>>, mut strokes: ResMut<Strokes>) {
    let (Ok(surface), Some((began, ray, before))) = (surface.single(), strokes.asked) else { return };
    if cast(surface, ray).is_some_and(|hit| hit.distance > before + ANSWER) {
        let answer = began.elapsed().as_secs_f64() * 1e3;
        strokes.answers.push(answer);
        strokes.asked = None;
        strokes.last().into_iter().for_each(|seen| seen.answer = Some(answer));
    }
}

/// Keeps the greatest force, that of reports that come after the tool was lifted too.
fn feel(mut reports: MessageReader<ClayReport>, mut strokes: ResMut<Strokes>) {
    let force = reports.read().flat_map(|r| &r.report.tools).map(|tool| tool.force.length()).fold(0.0, f64::max);
    if let Some(seen) = strokes.last() {
        seen.force = seen.force.max(force);
    }
}

/// Measures what a stroke left behind when the clay has settled and is shown so, or the next stroke begins;
/// bodies are counted away from the main thread.
fn settle(clay: Query<(&ClaySurface, &ClayEngine, &ClayMetrics)>, pace: Res<Pace>, mut strokes: ResMut<Strokes>) {
    let Strokes { under_way, settling, counting, .. } = &mut *strokes;
    let (Some(waiting), Ok((surface, engine, metrics))) = (settling.as_mut(), clay.single()) else { return };
    let time = if waiting.seen.kind == ToolKind::Knife { 0.2 * SETTLING } else { SETTLING };
    if pace.is_at_rest || metrics.time > waiting.since + time {
        waiting.settled.get_or_insert_with(|| engine.revision());
    }
    let is_shown = waiting.settled.is_some_and(|state| surface.revision() >= state);
    if counting.is_some() || !(is_shown || under_way.is_some()) {
        return;
    }
    let Some(Settling { seen, .. }) = settling.take() else { return };
    let away = seen.places.iter().filter_map(|(ray, hit)| Some(cast(surface, *ray)?.distance - hit.distance));
    let dent = 1e3 * away.fold(0.0, f32::max);
    let (before, now) = (seen.before.clone(), surface.clone());
    let bodies = AsyncComputeTaskPool::get().spawn(async move { [body_count(&before), body_count(&now)] });
    *counting = Some(Counting { seen, dent, bodies });
}

/// Bodies of the surface, crumbs left out: takes long enough that it is not for the main thread.
fn body_count(surface: &ClaySurface) -> usize {
    let made = || extract_field(surface.field(), SurfaceSettings::default().iso_threshold).into();
    let mesh = surface.mesh().cloned().unwrap_or_else(made);
    let least = BODY_PART * mesh.volume().abs();
    mesh.components().iter().filter(|body| body.volume().abs() > least).count()
}

/// Says what a stroke left behind once its bodies are counted.
fn count_bodies(mut strokes: ResMut<Strokes>) {
    let Some([before, now]) = strokes.counting.as_mut().and_then(|counting| check_ready(&mut counting.bodies)) else { return };
    let Some(Counting { seen, dent, .. }) = strokes.counting.take() else { return };
    let at = seen.places[0].1.point * 1e3;
    let answer = match seen.answer {
        Some(ms) if seen.kind != ToolKind::Knife => format!(", answered in {ms:.0} ms"),
        _ => String::new(),
    };
    say(&format!(
        "stroke {} {} at ({:.1}, {:.1}, {:.1}) mm: dent {dent:.2} mm, force up to {:.2} N, {before} bodies before, {now} bodies now{answer}; {}",
        seen.number,
        seen.kind.name(),
        at.x,
        at.y,
        at.z,
        seen.force,
        seen.pace.unwrap_or_default(),
    ));
    strokes.outcomes.push(Outcome { dent });
}
