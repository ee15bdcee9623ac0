//! The force on a hand, in virtual time: arm, hand, servo and clay of known force, through the channels
//! that an app uses. Nothing depends on the machine's clock but the times of `speed`.
//! `clay` is the same about an engine's clay.

mod clay;
mod curves;
mod knife;
mod shapes;
mod solver;
mod stability;
mod strokes;

pub use clay::{clay_held, clay_strokes};
pub use curves::{Curve, curves};
pub use knife::knife;
pub use shapes::closed_forms;
pub use solver::{exactness, times};
pub use stability::{by_default, limits};
pub use strokes::{erring_models, held, particles, slow_motion, start, strokes};

use bevy_clay::haptics::device::simulated::{ArmSettings, HandPath};
use bevy_clay::haptics::reference::clay::{Law, ReferenceClay};
use bevy_clay::haptics::reference::frames::Frames;
use bevy_clay::haptics::reference::rig::Rig;
use bevy_clay::haptics::servo::{Coupling, ForceScale, ServoSettings};
use glam::DVec3;

/// Height above the clay at which a hand starts \[m\].
const HEIGHT: f64 = 2e-3;

/// Time that a hand waits above the clay \[s\]: some frames come before it goes down.
const WAIT: f64 = 0.1;

/// No coupling but the clay's own stiffness, which is what the hand then feels.
const RIGID: Coupling = Coupling { stiffness: f64::INFINITY, damping: 0.0, stiffness_max: f64::INFINITY };

/// All of the clay's force, up to what the arm drives.
const OPEN: ForceScale = ForceScale { gain: 1.0, knee: 3.3, ceiling: 3.3 };

/// Clay that yields at 0.2 N and 100 N/m of depth: 1.2 N at 10 mm.
const PLASTIC: Law = Law::Spring { stiffness: 1000.0, yield_force: 0.2, slope: 100.0 };

/// Straight down to `depth` \[m\] at `speed` \[m/s\], and when it is there \[s\].
fn press(depth: f64, speed: f64) -> (Vec<(f64, DVec3)>, f64) {
    let end = WAIT + (HEIGHT + depth) / speed;
    (vec![(WAIT, DVec3::Y * HEIGHT), (end, DVec3::NEG_Y * depth)], end)
}

/// Down, 0.2 s there, and up again the same way.
fn stroke(depth: f64, speed: f64) -> HandPath {
    let (mut points, end) = press(depth, speed);
    points.extend([(end + 0.2, DVec3::NEG_Y * depth), (2.0 * end - WAIT + 0.2, DVec3::Y * HEIGHT)]);
    HandPath::new(points)
}

/// A hand that follows a path on clay of this law, by the default settings but for `coupling`.
fn rig(arm: ArmSettings, path: HandPath, law: Law, coupling: Coupling, frames: Frames) -> Rig {
    let servo = ServoSettings { coupling, force: OPEN, ..ServoSettings::default() };
    Rig { arm, path, servo, clay: ReferenceClay::new(law, 0.3), frames }
}

/// Clay's clocks, by latency and by how frames come; `all` of them, or the worst of each kind.
fn clocks(all: bool) -> Vec<Frames> {
    let late: &[f64] = if all { &[0.0, 0.011, 0.022, 0.033] } else { &[0.011, 0.033] };
    let base = Frames::default();
    let kinds = [
        Frames { rate: 90.0, ..base },
        Frames { rate: 30.0, ..base },
        Frames { stall: Some([0.5, 0.2]), ..base },
        Frames { rate: 60.0, ..base },
        Frames { rate: 120.0, ..base },
        Frames { jitter: 0.5, ..base },
        Frames { lost: 0.2, ..base },
    ];
    let kinds = &kinds[..if all { kinds.len() } else { 3 }];
    late.iter().flat_map(|latency| kinds.iter().map(|kind| Frames { latency: *latency, ..*kind })).collect()
}
