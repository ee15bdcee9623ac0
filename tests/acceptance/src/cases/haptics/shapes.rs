//! Punch, balls and cone pressed in at 5 mm/s: the force felt over the tool's depth, against the closed
//! forms.

use super::{press, rig};
use crate::lab::Size;
use crate::report::Row;
use bevy_clay::haptics::device::simulated::{ArmSettings, HandPath, Operator};
use bevy_clay::haptics::reference::clay::Law;
use bevy_clay::haptics::reference::frames::Frames;
use bevy_clay::haptics::servo::Coupling;
use rayon::prelude::*;

/// As in the paper's experiment \[m/s\].
const SPEED: f64 = 5e-3;
/// Young's modulus \[Pa\] and Poisson's ratio of soft clay.
const CLAY: [f64; 2] = [1e5, 0.3];

/// Greatest difference of the force felt from the closed form at the tool's depth, of the greatest force.
pub fn closed_forms(size: Size) -> Vec<Row> {
    let plane = CLAY[0] / (1.0 - CLAY[1] * CLAY[1]);
    let shapes = [
        ("flat punch", Law::Punch { radius: 2.5e-3, modulus: plane }, 4e-3),
        ("ball, Hertz", Law::Hertz { radius: 8e-3, modulus: plane }, 3e-3),
        ("ball between plates, Tatara", Law::Tatara { radius: 8e-3, young_modulus: CLAY[0], poisson_ratio: CLAY[1] }, 2e-3),
        ("cone", Law::Cone { hardness: 6e3, half_angle: 0.6, modulus: plane }, 10e-3),
    ];
    let late = size.pick(0.022, 0.022, 0.033);
    let row = |(name, law, depth): &(&str, Law, f64)| {
        let arm = ArmSettings { operator: Operator::STYLUS, ..ArmSettings::default() };
        // The hand goes deeper than the tool by what the coupling and its own spring give.
        let (points, _) = press(2.0 * depth, SPEED);
        let frames = Frames { latency: late, ..Frames::default() };
        let path = HandPath::new(points);
        let run = rig(arm, path.clone(), *law, Coupling::default(), frames).run(path.duration());
        let error = |t: &bevy_clay::haptics::reference::rig::Tick| (t.sample.clay_force.y - law.backbone(-t.sample.tool.y)).abs();
        let error = run.ticks.iter().map(error).fold(0.0, f64::max);
        let most = run.ticks.iter().map(|t| law.backbone(-t.sample.tool.y)).fold(0.0, f64::max);
        Row::at_most(format!("force, {name}: off the closed form"), 100.0 * error / most, "% of the greatest", 10.0)
    };
    shapes.par_iter().map(row).collect()
}
