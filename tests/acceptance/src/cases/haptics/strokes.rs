//! Strokes in clay that yields: the force felt against the clay's own on the same way, impulses, slew, holds.

use super::{OPEN, PLASTIC, clocks, press, rig, stroke};
use crate::lab::Size;
use crate::report::{Bound, Row};
use bevy_clay::haptics::device::simulated::{ArmSettings, HandPath, Operator};
use bevy_clay::haptics::reference::clay::{Law, ReferenceClay, flat_tool};
use bevy_clay::haptics::reference::frames::{Frames, ModelErrors};
use bevy_clay::haptics::reference::rig::{Fidelity, Rig, Run, Tick};
use bevy_clay::haptics::servo::{Coupling, Hold, Mode, ServoSettings};
use glam::DVec3;
use rayon::prelude::*;

/// Speeds of a hand \[m/s\].
const SPEEDS: [f64; 3] = [0.005, 0.05, 0.2];
const DEPTH: f64 = 10e-3;

fn arm() -> ArmSettings {
    ArmSettings { operator: Operator::STYLUS, ..ArmSettings::default() }
}

/// Runs to the end of the way and somewhat on.
fn to_end(rig: &Rig) -> Run {
    rig.run(rig.path.duration() + 0.1)
}

/// The worst of each figure.
pub(super) fn worst(runs: &[Fidelity]) -> Fidelity {
    let greatest = |of: fn(&Fidelity) -> f64| runs.iter().map(of).fold(0.0, f64::max);
    Fidelity {
        correlation: runs.iter().map(|f| f.correlation).fold(f64::INFINITY, f64::min),
        error: greatest(|f| f.error),
        slope: greatest(|f| (f.slope - 1.0).abs()),
        returned: greatest(|f| f.returned.abs()),
    }
}

/// Press, hold and leave at three speeds by every clock of the clay; the clay's held force and the
/// published anchor beside it at 90 Hz.
pub fn strokes(size: Size) -> Vec<Row> {
    let clocks = clocks(size == Size::Full);
    let mut rows = vec![];
    let mut slew = 0.0f64;
    for speed in SPEEDS {
        let run = |frames: &Frames| to_end(&rig(arm(), stroke(DEPTH, speed), PLASTIC, Coupling::default(), *frames));
        let runs: Vec<Run> = clocks.par_iter().map(run).collect();
        let found = worst(&runs.iter().map(Run::fidelity).collect::<Vec<_>>());
        let name = format!("force, stroke at {} mm/s", 1e3 * speed);
        let balance = runs.iter().map(|run| 100.0 * run.imbalance()).fold(0.0, f64::max);
        let returned = runs.iter().map(Run::returned_to_hand).fold(0.0, f64::max);
        slew = runs.iter().map(Run::slew).fold(slew, f64::max);
        rows.extend([
            Row::at_least(format!("{name}: correlation with the clay's"), found.correlation, "-", 0.983),
            Row::at_most(format!("{name}: error"), 100.0 * found.error, "% of its range", 7.0),
            Row::at_most(format!("{name}: slope, off 1 by"), 100.0 * found.slope, "%", 7.0),
            Row::at_most(format!("{name}: energy returned, off by"), found.returned, "of that put in", 0.05),
            Row::at_most(format!("{name}: impulses of hand and clay apart"), balance, "%", 1.0),
            Row::figure(format!("{name}: energy returned to the hand"), returned, "of that put in"),
        ]);
        rows.extend(beside(speed));
    }
    rows.push(Row::at_most("force, strokes: slew", slew, "N/ms", 0.3));
    rows.extend(drags(&clocks));
    rows
}

/// Down, 30 mm along the clay with friction, back the same way and up, at 50 and 200 mm/s.
fn drags(clocks: &[Frames]) -> Vec<Row> {
    let drag = |speed: f64| {
        let (mut points, there) = press(6e-3, speed);
        let end = there + 0.03 / speed;
        let [near, far] = [DVec3::NEG_Y * 6e-3, DVec3::new(0.03, -6e-3, 0.0)];
        points.extend([(end, far), (2.0 * end - there, near), (2.0 * end - there + 8e-3 / speed, DVec3::Y * 2e-3)]);
        HandPath::new(points)
    };
    let run = |(frames, speed): (&Frames, f64)| {
        let run = to_end(&rig(arm(), drag(speed), PLASTIC, Coupling::default(), *frames));
        let square = |t: &Tick| t.sample.hand_force.distance_squared(t.truth);
        let error = (run.ticks.iter().map(square).sum::<f64>() / run.ticks.len() as f64).sqrt();
        let most = run.ticks.iter().map(|t| t.truth.length()).fold(0.0, f64::max);
        [100.0 * error / most, 100.0 * run.imbalance()]
    };
    let runs: Vec<(&Frames, f64)> = clocks.iter().flat_map(|f| [(f, 0.05), (f, 0.2)]).collect();
    let found: Vec<[f64; 2]> = runs.into_par_iter().map(run).collect();
    let [error, balance] = [0, 1].map(|i| found.iter().map(|f| f[i]).fold(0.0, f64::max));
    vec![
        Row::at_most("force, drags: error", error, "% of the greatest", 7.0),
        Row::at_most("force, drags: impulses of hand and clay apart", balance, "%", 1.0),
    ]
}

/// Models whose stiffness and slope are 30 % too small and whose forces are 3 % off, 33 ms late.
pub fn erring_models(_: Size) -> Vec<Row> {
    let errors = ModelErrors { stiffness: 0.7, yield_slope: 0.7, noise: 0.03 };
    let frames = Frames { latency: 0.033, errors, ..Frames::default() };
    let rows = |speed: &f64| {
        let run = to_end(&rig(arm(), stroke(DEPTH, *speed), PLASTIC, Coupling::default(), frames));
        let (found, name) = (run.fidelity(), format!("force of erring models, {} mm/s", 1e3 * speed));
        let slope = 100.0 * (found.slope - 1.0).abs();
        let mut rows = vec![
            Row::at_least(format!("{name}: correlation with the clay's"), found.correlation, "-", 0.983),
            Row::at_most(format!("{name}: error"), 100.0 * found.error, "% of its range", 7.0),
            Row::at_most(format!("{name}: slope, off 1 by"), slope, "%", 7.0),
            Row::at_most(format!("{name}: energy returned, off by"), found.returned.abs(), "of that put in", 0.05),
        ];
        // A fast stroke is over before the frames that say so: what its models say wrong is felt.
        if *speed > 0.1 {
            rows = rows.into_iter().map(|row| Row { bound: Bound::None, limit: f64::NAN, ok: true, ..row }).collect();
        }
        rows.push(Row::figure(format!("{name}: impulses of hand and clay apart"), 100.0 * run.imbalance(), "%"));
        rows
    };
    SPEEDS.iter().flat_map(rows).collect()
}

/// Other modes on the same way, as they are: errors, and what the hand and the clay got apart.
fn beside(speed: f64) -> Vec<Row> {
    let modes = [
        ("held", Mode::ContactImpulse, Hold::Held),
        ("anchor", Mode::PaperAnchor { relaxes: false }, Hold::Blended),
        ("relaxed anchor", Mode::PaperAnchor { relaxes: true }, Hold::Blended),
        ("god-object", Mode::GodObject, Hold::Blended),
    ];
    let rows = |(name, mode, hold): &(&str, Mode, Hold)| {
        let mut rig = rig(arm(), stroke(DEPTH, speed), PLASTIC, Coupling::default(), Frames::default());
        rig.servo = ServoSettings { mode: *mode, hold: *hold, tool: flat_tool(), ..rig.servo };
        rig.clay = rig.clay.with_particles();
        let (run, stroke) = (to_end(&rig), format!("force, stroke at {} mm/s", 1e3 * speed));
        [
            Row::figure(format!("{stroke}: error, {name}"), 100.0 * run.fidelity().error, "% of its range"),
            Row::figure(format!("{stroke}: impulses of hand and clay apart, {name}"), 100.0 * run.imbalance(), "%"),
        ]
    };
    modes.par_iter().flat_map_iter(rows).collect()
}

/// A hand that holds still for 5 s on clay that rests: its models are renewed, and the force stays.
pub fn held(_: Size) -> Vec<Row> {
    let (points, there) = press(DEPTH, 0.05);
    let run = rig(arm(), HandPath::new(points), PLASTIC, Coupling::default(), Frames::default()).run(there + 5.5);
    let ticks: Vec<_> = run.ticks.iter().filter(|t| t.sample.time > there + 0.5).collect();
    let forces = || ticks.iter().map(|t| t.sample.hand_force.length());
    let (least, most) = forces().fold((f64::INFINITY, 0.0f64), |(a, b), f| (a.min(f), b.max(f)));
    let age = ticks.iter().map(|t| t.sample.age).fold(0.0, f64::max);
    vec![
        Row::at_most("force, held for 5 s: change", 100.0 * (most - least) / most, "%", 2.0),
        Row::at_most("force, held for 5 s: greatest age of a model", 1e3 * age, "ms", 33.0),
    ]
}

/// Clay that goes slower than the hand's time presses as at full speed.
pub fn slow_motion(size: Size) -> Vec<Row> {
    let run = |clay_rate: f64, rate: f64| {
        let frames = Frames { clay_rate, rate, latency: 0.022, ..Frames::default() };
        to_end(&rig(arm(), stroke(DEPTH, 0.05), PLASTIC, Coupling::default(), frames))
    };
    // Both a clay that is slowed on purpose and one whose frames take long.
    let slow: Vec<[f64; 2]> = size.pick(vec![[0.25, 90.0]], vec![[0.5, 90.0], [0.1, 90.0], [0.3, 25.0]], {
        vec![[0.5, 90.0], [0.25, 90.0], [0.1, 90.0], [0.3, 25.0], [0.9, 60.0]]
    });
    let runs: Vec<Run> = slow.par_iter().map(|[clay_rate, rate]| run(*clay_rate, *rate)).collect();
    let error = runs.iter().map(|run| 100.0 * run.fidelity().error).fold(0.0, f64::max);
    let slope = runs.iter().map(|run| 100.0 * (run.fidelity().slope - 1.0).abs()).fold(0.0, f64::max);
    let balance = runs.iter().map(|run| 100.0 * run.imbalance()).fold(0.0, f64::max);
    vec![
        Row::at_most("force of slow clay: error", error, "% of its range", 7.0),
        Row::at_most("force of slow clay: slope, off 1 by", slope, "%", 1.0),
        Row::at_most("force of slow clay: impulses of hand and clay apart", balance, "%", 1.0),
    ]
}

/// A servo that begins with the hand inside the clay.
pub fn start(_: Size) -> Vec<Row> {
    let path = HandPath::new([(0.0, DVec3::NEG_Y * 8e-3)]);
    let run = rig(arm(), path, PLASTIC, Coupling::default(), Frames::default()).run(1.0);
    let first = run.ticks.iter().take(100).map(|t| t.sample.hand_force.length());
    let first = first.clone().find(|force| *force > 0.0).unwrap_or(f64::NAN);
    vec![
        Row::at_most("force, start inside the clay: first force", first, "N", 0.1),
        Row::at_most("force, start inside the clay: slew", run.slew(), "N/ms", 0.3),
    ]
}

/// The modes that keep spheres apart, in clay of particles that gives way under them.
pub fn particles(_: Size) -> Vec<Row> {
    let run = |mode: Mode| {
        let law = Law::Spring { stiffness: 1000.0, yield_force: 0.2, slope: 60.0 };
        let servo = ServoSettings { mode, tool: flat_tool(), force: OPEN, ..ServoSettings::default() };
        let clay = ReferenceClay::new(law, 0.3).with_particles();
        to_end(&Rig { arm: arm(), path: stroke(DEPTH, 0.05), servo, clay, frames: Frames::default() })
    };
    let modes = [("god-object", Mode::GodObject), ("anchor", Mode::PaperAnchor { relaxes: false })];
    let rows = |(name, mode): &(&str, Mode)| {
        let run = run(*mode);
        let gap = run.ticks.iter().map(|t| t.sample.gap).fold(f64::INFINITY, f64::min);
        let most = run.ticks.iter().map(|t| t.sample.hand_force.length()).fold(0.0, f64::max);
        // A run that never touched would have nothing to show.
        let gap = if most > 0.1 && gap.is_finite() { 1e6 * gap } else { f64::NAN };
        [
            Row::at_least(format!("force, {name} in clay of particles: least gap"), gap, "um", -1.0),
            Row::at_most(format!("force, {name} in clay of particles: slew"), run.slew(), "N/ms", 0.3),
        ]
    };
    modes.iter().flat_map(rows).collect()
}
