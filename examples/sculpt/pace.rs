//! How fast the clay's time goes, and how fast the tool in hand may go in it, so that the clay keeps up.
//!
//! An implicit step covers a way of the tool, whatever time that takes: the clay keeps the app's time as
//! long as its tool goes no farther than there are steps for. So the clock goes at full speed, and the tool
//! is held to what the clay can follow: where the machine is too slow for the hand, the tool is behind the
//! pointer, and never the clay behind the tool. Where a step takes longer than the longest one lasts, as
//! under a knife on a slow machine, the clock is slowed to that: at full speed the slow tool would have the
//! clay take many steps for time, in each of which it goes a fraction of what a step can cover.
//!
//! In explicit steps a second of clay takes many seconds of a slow machine, whatever its tools do. Its clock
//! is slowed, so that each frame of the window has a short frame of clay to itself, and stands at rest. The
//! tool goes by that clock: by its own it would be thrown through slow clay.

use crate::stroke::{Stroke, work};
use bevy::prelude::*;
use bevy::winit::{UpdateMode, WinitSettings};
use bevy_clay::prelude::*;
use bevy_clay::sim::frame::FrameReport;
use bevy_clay::sim::limits::PENDING_MAX;
use bevy_clay::sim::planner::FRAME_MAX;
use std::time::Duration;

/// Part of the time that the engine may take.
const SHARE: f64 = 0.6;
/// Most time that a frame of explicit steps may take \[s\], however long the window's frames are.
const EXPLICIT_FRAME_MAX: f64 = 0.025;
/// Slowest clock.
const SPEED_MIN: f64 = 1e-4;
/// Clay slower than this is at rest [m/s], in explicit steps.
const REST_SPEED: f64 = 0.01;
/// Frames that it is at rest before its clock stops.
const REST_FRAMES: u32 = 6;
/// Greatest speed of a tool in the clay's time [m/s]: above it soft clay is thrown rather than pressed.
const TOOL_SPEED_MAX: f64 = 0.4;
/// The clay's lag \[s\] from which on the tool slows down, and at which it waits.
const LAG: (f64, f64) = (0.05, 0.15);

/// Sets the clay's clock, and how often the window is drawn.
pub(crate) struct PacePlugin;

impl Plugin for PacePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Pace>().add_systems(Update, (keep, draw).chain().after(work).in_set(ClaySystems::Tool));
    }
}

/// The clay's pace.
#[derive(Resource, Debug, Default)]
pub(crate) struct Pace {
    /// Of the last frame that took steps.
    steps: Steps,
    /// Wall time of the window's frames, smoothed \[s\].
    frame: f64,
    /// Slows the clock while frames pile up, whatever the engine says they cost, by as many halvings.
    brake: f64,
    still: u32,
    /// Greatest speed of the tool in hand [m/s], by the app's time.
    pub(crate) tool_speed: f64,
    /// Whether nothing moves: the clay takes no steps, or its clock stands.
    pub(crate) is_at_rest: bool,
}

/// What steps take, smoothed.
#[derive(Clone, Copy, Debug, Default)]
enum Steps {
    #[default]
    Unknown,
    /// Wall time over simulated time.
    Explicit(f64),
    /// Wall time of each \[s\].
    Implicit(f64),
}

impl Steps {
    /// With what a frame took. What it took beside its steps is left out of explicit ones: a slower clock
    /// makes shorter frames, and each would seem dearer than the one before.
    fn note(&mut self, report: &FrameReport) {
        let timings = &report.timings;
        let smooth = |old: f64, new: f64| old * (new / old).powf(0.3);
        if report.is_resting() || report.steps == 0 || timings.total <= 0.0 {
            return;
        }
        *self = if report.passes == 0 {
            let now = (timings.grid + timings.particles).max(1e-6) / report.duration();
            Self::Explicit(if let Self::Explicit(old) = self { smooth(*old, now) } else { now })
        } else {
            let now = timings.total / f64::from(report.steps);
            Self::Implicit(if let Self::Implicit(old) = self { smooth(*old, now) } else { now })
        };
    }
}

impl Pace {
    /// How fast the clay's clock may go. In implicit steps it waits only for a tool that is held to its pace:
    /// one in a headset's hand goes as it likes, and would be thrown through slow clay.
    fn clock_speed(&self, is_paced: bool) -> f64 {
        let share = SHARE.min(EXPLICIT_FRAME_MAX / self.frame.max(1e-3));
        match self.steps {
            Steps::Explicit(cost) => (share / cost * (-self.brake).exp2()).clamp(SPEED_MIN, 1.0),
            Steps::Implicit(cost) if is_paced => (FRAME_MAX / cost).clamp(SPEED_MIN, 1.0),
            Steps::Unknown | Steps::Implicit(_) => 1.0,
        }
    }

    /// How fast the tool may go [m/s]: a step for every `travel` \[m\] of it, by a clock of `speed` that lags
    /// `lag` \[s\] behind.
    fn tool_speed(&self, travel: f64, speed: f64, lag: f64) -> f64 {
        let (slow, wait) = LAG;
        let followed = if let Steps::Implicit(cost) = self.steps { SHARE * travel / cost } else { f64::INFINITY };
        followed.min(TOOL_SPEED_MAX * speed) * ((wait - lag) / (wait - slow)).clamp(0.0, 1.0)
    }
}

/// What makes clay that rests go on.
type Stirred = Or<(Changed<ClayMaterial>, Changed<ClaySettings>, Changed<Clay>)>;

/// What the pace is made of, beside reports.
type Doing<'a> = (&'a ClayStatus, &'a ClayMetrics, &'a ClaySettings, Option<&'a ClayEngine>, &'a mut ClayClock);

/// Sets clock and speed from the last reports.
fn keep(
    mut reports: MessageReader<ClayReport>,
    stirred: Query<(), (With<Clay>, Stirred)>,
    clay: Single<Doing>,
    (stroke, session): (Option<Res<Stroke>>, Res<HapticSession>),
    mut pace: ResMut<Pace>,
    real: Res<Time<Real>>,
) {
    let (status, metrics, settings, engine, mut clock) = clay.into_inner();
    pace.frame += (real.delta_secs_f64().min(0.5) - pace.frame) * 0.3;
    for ClayReport { report, .. } in reports.read() {
        pace.steps.note(report);
        pace.still = if report.speed(status.cell_width) < REST_SPEED { pace.still + 1 } else { 0 };
    }
    // What the tool has gone the clay has still to go.
    if stroke.is_some() || !stirred.is_empty() || metrics.lag > LAG.0 {
        pace.still = 0;
    }
    let is_piling_up = engine.is_some_and(|engine| engine.pending() >= PENDING_MAX);
    pace.brake = (pace.brake + if is_piling_up { 0.15 } else { -0.3 }).clamp(0.0, 6.0);
    // Clay at rest stands: what it would do takes time from what it is asked for next. In implicit steps it
    // does so by itself.
    let is_held = session.tool().is_some();
    let stands = !is_held && matches!(pace.steps, Steps::Explicit(_)) && pace.still >= REST_FRAMES;
    // In an arm's hand clay is planned for the time that it takes as it is, and what stands is not felt.
    let wanted = if is_held {
        1.0
    } else if stands {
        0.0
    } else {
        pace.clock_speed(stroke.is_some())
    };
    pace.tool_speed = pace.tool_speed(settings.accuracy.travel() * status.cell_width, wanted, metrics.lag);
    pace.is_at_rest = !is_held && (stands || metrics.is_resting && stroke.is_none());
    if (clock.speed - wanted).abs() > 0.02 * clock.speed.min(wanted) {
        clock.speed = wanted;
    }
}

/// Draws the window as often as it can while the clay moves, and for input alone while it rests: what is not
/// drawn leaves its time to the clay.
fn draw(pace: Res<Pace>, mut winit: ResMut<WinitSettings>) {
    const RESTING: Duration = Duration::from_millis(100);
    let mode = if pace.is_at_rest { UpdateMode::reactive(RESTING) } else { UpdateMode::Continuous };
    if winit.focused_mode != mode {
        *winit = WinitSettings { focused_mode: mode, unfocused_mode: mode };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// However long a step takes, the tool goes in it most of what a step may cover, and not more.
    #[test]
    fn steps_are_taken_for_the_tool() {
        const TRAVEL: f64 = 1e-3;
        for cost in [0.01, 0.03, 0.1, 0.3, 1.0] {
            let pace = Pace { steps: Steps::Implicit(cost), ..Pace::default() };
            let clock = pace.clock_speed(true);
            let tool = pace.tool_speed(TRAVEL, clock, 0.0) / clock;
            let step = FRAME_MAX.min(TRAVEL / tool);
            let way = tool * step;
            assert!(way > 0.5 * TRAVEL && way < 1.001 * TRAVEL, "a step that takes {cost} s covers {way} m");
            assert!(step / clock > 0.99 * cost, "{step} s of clay in {cost} s at {clock}");
            assert_eq!(pace.clock_speed(false), 1.0, "for a hand that goes as it likes");
        }
    }
}
