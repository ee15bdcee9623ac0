//! Force over depth of each mode: a vertical press at 5 mm/s and back, as in the paper's Fig. 8.

use super::{OPEN, PLASTIC, stroke};
use bevy_clay::haptics::device::simulated::{ArmSettings, Operator};
use bevy_clay::haptics::reference::clay::{ReferenceClay, flat_tool};
use bevy_clay::haptics::reference::frames::Frames;
use bevy_clay::haptics::reference::rig::Rig;
use bevy_clay::haptics::servo::{Hold, Mode, ServoSettings};
use rayon::prelude::*;

/// Ticks between two points of a curve: 10 ms.
const EVERY: usize = 10;

/// A mode's force over the hand's depth.
pub struct Curve {
    /// The mode.
    pub name: &'static str,
    /// Time \[s\], depth of the hand \[mm\], force on it and the clay's own on its tool \[N\].
    pub points: Vec<[f64; 4]>,
}

/// The curves of all modes, in clay whose own force is known.
pub fn curves() -> Vec<Curve> {
    let modes = [
        ("coupled", Mode::Coupled, Hold::Blended),
        ("god-object", Mode::GodObject, Hold::Blended),
        ("anchor as published", Mode::PaperAnchor { relaxes: false }, Hold::Blended),
        ("anchor that relaxes", Mode::PaperAnchor { relaxes: true }, Hold::Blended),
        ("clay's force, held", Mode::ContactImpulse, Hold::Held),
    ];
    let curve = |(name, mode, hold): &(&'static str, Mode, Hold)| {
        let servo = ServoSettings { mode: *mode, hold: *hold, tool: flat_tool(), force: OPEN, ..ServoSettings::default() };
        let arm = ArmSettings { operator: Operator::STYLUS, ..ArmSettings::default() };
        let clay = ReferenceClay::new(PLASTIC, 0.3).with_particles();
        let path = stroke(10e-3, 5e-3);
        let rig = Rig { arm, path: path.clone(), servo, clay, frames: Frames::default() };
        let run = rig.run(path.duration() + 0.1);
        let point = |t: &bevy_clay::haptics::reference::rig::Tick| {
            [t.sample.time, -1e3 * t.sample.hand.y, t.sample.hand_force.y, t.truth.y]
        };
        Curve { name, points: run.ticks.iter().step_by(EVERY).map(point).collect() }
    };
    modes.par_iter().map(curve).collect()
}
