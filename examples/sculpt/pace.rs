//! How fast the clay's time goes: as fast as the app's where the engine keeps up, else so slow that each
//! frame ends soon, and not at all at rest.
//!
//! In explicit steps a second of clay takes many seconds of a slow machine; planned at full speed, two long
//! frames would be under way whenever a tool is pressed, and the answer would wait for them. Slowed, each
//! frame of the window has a short frame of clay to itself. Implicit steps take as long whatever time they
//! cover: the planner's frames are short enough by themselves.

use crate::stroke::{Stroke, work};
use bevy::prelude::*;
use bevy::winit::{UpdateMode, WinitSettings};
use bevy_clay::prelude::*;
use bevy_clay::sim::limits::PENDING_MAX;
use std::time::Duration;

/// Part of a window's frame that the engine may take.
const SHARE: f64 = 0.6;
/// Most time that a frame of clay may take \[s\], however long the window's frames are.
const FRAME_MAX: f64 = 0.025;
/// Slowest clock.
const SPEED_MIN: f64 = 1e-4;
/// Clay slower than this is at rest [m/s].
const REST_SPEED: f64 = 0.01;
/// Frames that clay is at rest before its clock stops.
const REST_FRAMES: u32 = 6;

/// Sets the clay's clock, and how often the window is drawn.
pub(crate) struct PacePlugin;

impl Plugin for PacePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Pace>().add_systems(Update, (keep, draw).chain().after(work).in_set(ClaySystems::Tool));
    }
}

/// The clock's state.
#[derive(Resource, Debug, Default)]
pub(crate) struct Pace {
    /// Wall time per simulated time of explicit frames, smoothed; none until one has ended.
    cost: Option<f64>,
    /// Whether the last frame was in explicit steps.
    is_explicit: bool,
    /// Wall time of the window's frames, smoothed \[s\].
    frame: f64,
    /// Slows the clock while frames pile up, whatever the engine says they cost, by as many halvings.
    brake: f64,
    still: u32,
    /// Whether the clay's clock stands because nothing moves.
    pub(crate) is_at_rest: bool,
}

/// What makes clay that rests go on.
type Stirred = Or<(Changed<ClayMaterial>, Changed<ClaySettings>, Changed<Clay>)>;

/// Sets the clock from the last reports.
fn keep(
    mut reports: MessageReader<ClayReport>,
    stirred: Query<(), (With<Clay>, Stirred)>,
    (status, engine, mut clock): (Single<&ClayStatus>, Query<&ClayEngine>, Single<&mut ClayClock>),
    stroke: Option<Res<Stroke>>,
    mut pace: ResMut<Pace>,
    real: Res<Time<Real>>,
) {
    const SMOOTH: f64 = 0.3;
    pace.frame += (real.delta_secs_f64().min(0.5) - pace.frame) * SMOOTH;
    if stroke.is_some() || !stirred.is_empty() {
        pace.still = 0;
    }
    for ClayReport { report, .. } in reports.read() {
        let duration = report.dt * f64::from(report.steps);
        pace.is_explicit = report.passes == 0 && !report.is_resting();
        if pace.is_explicit && duration > 0.0 && report.timings.total > 0.0 {
            let cost = report.timings.total / duration;
            let old = pace.cost.unwrap_or(cost);
            pace.cost = Some(old * (cost / old).powf(SMOOTH));
        }
        pace.still = if report.speed(status.cell_width) < REST_SPEED { pace.still + 1 } else { 0 };
    }
    // A first guess for a machine that is not known yet: a slow one.
    let is_piling_up = engine.iter().any(|e| e.pending() >= PENDING_MAX);
    pace.brake = (pace.brake + if is_piling_up { 0.15 } else { -0.3 }).clamp(0.0, 6.0);
    let share = SHARE.min(FRAME_MAX / pace.frame.max(1e-3));
    let slowed = |cost: f64| (share / cost * (-pace.brake).exp2()).clamp(SPEED_MIN, 1.0);
    let speed = if pace.is_explicit { pace.cost.map_or(0.03, slowed) } else { 1.0 };
    pace.is_at_rest = pace.still >= REST_FRAMES;
    // Clay at rest stands: what it would do takes time from what it is asked for next.
    let wanted = if pace.is_at_rest { 0.0 } else { speed };
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
