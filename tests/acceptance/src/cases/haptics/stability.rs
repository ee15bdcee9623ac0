//! The stiffest wall that a hand holds steady, and the energy that one half as stiff makes.

use super::{OPEN, RIGID, clocks, press, rig};
use crate::lab::Size;
use crate::report::Row;
use bevy_clay::haptics::device::simulated::{ArmSettings, HandPath, Operator};
use bevy_clay::haptics::reference::clay::{Law, ReferenceClay};
use bevy_clay::haptics::reference::frames::Frames;
use bevy_clay::haptics::reference::rig::{Rig, Run};
use bevy_clay::haptics::servo::{Coupling, ServoSettings};
use rayon::prelude::*;

/// Swing of a hand that holds still \[m\], root mean square: what a fingertip feels.
const STEADY: f64 = 1e-4;
/// How a hand comes to the wall \[m/s\], when it is looked at, and to when \[s\].
const SPEED: f64 = 0.012;
const HOLD: [f64; 2] = [2.0, 3.0];
/// Greatest stiffness that is tried \[N/m\].
const STIFFEST: f64 = 20e3;
/// Twice the stiffest wall that a servo renders by its settings \[N/m\]. From 2000 N/m on a step of the
/// encoders is a tenth of a newton, and hands that hold still hunt about it.
const RENDERED: f64 = 2.0 * 500.0;
/// Viscous friction of the arm \[N s/m\].
const ARM_DAMPING: f64 = 0.2;

/// K_max \[N/m\] of a loop without frames, whose wall is in the servo itself, at delays of 0, 1 and 2 ms:
/// measured in a loop of its own; none where it is beyond [`STIFFEST`] or was not measured.
const MEASURED: [[Option<f64>; 3]; 4] = [
    [Some(566.0), Some(177.0), Some(107.0)],
    [Some(4476.0), Some(1496.0), Some(909.0)],
    [Some(19_990.0), Some(3205.0), Some(1971.0)],
    [None; 3],
];

/// What K_max has to reach: nine tenths of what was measured, or .85 of `(b + B) / (T / 2 + t_d)`
/// (Gil et al. 2009; Hulin et al. 2006).
fn required(operator: usize, delay: usize) -> f64 {
    let damping = Operator::ALL[operator].1.damping + ARM_DAMPING;
    let formula = damping / (0.5e-3 + 1e-3 * delay as f64);
    MEASURED[operator][delay].map_or(0.85 * formula, |stiffness| 0.9 * stiffness)
}

/// How deep a hand means to be \[m\]: a fist as deep as three newtons of its own spring, for more the arm
/// lacks.
fn depth(operator: usize) -> f64 {
    if Operator::ALL[operator].1 == Operator::FIRM { 3e-3 } else { 10e-3 }
}

fn pressed(operator: usize, delay: usize, stiffness: f64, frames: Frames) -> Run {
    let arm = ArmSettings { delay, operator: Operator::ALL[operator].1, ..ArmSettings::default() };
    let law = Law::Spring { stiffness, yield_force: f64::INFINITY, slope: 0.0 };
    rig(arm, HandPath::new(press(depth(operator), SPEED).0), law, RIGID, frames).run(HOLD[1])
}

/// The stiffest steady wall \[N/m\], by bisection up from half of what it has to be; 0 if that is not steady.
fn greatest(operator: usize, delay: usize, frames: Frames, bisections: u32) -> f64 {
    let is_steady = |stiffness: f64| pressed(operator, delay, stiffness, frames).swing(HOLD[0]) < STEADY;
    let required = required(operator, delay);
    let (mut low, mut high) = (required, (2.0 * required).min(STIFFEST));
    if !is_steady(low) {
        return 0.0;
    }
    for _ in 0..bisections {
        let middle = (low * high).sqrt();
        if is_steady(middle) { low = middle } else { high = middle }
    }
    low
}

/// Every hand at every delay of the arm: the least K_max over all of the clay's clocks, and the most energy
/// at half of it and below.
pub fn limits(size: Size) -> Vec<Row> {
    let clocks: Vec<Frames> = clocks(size == Size::Full);
    let cells: Vec<(usize, usize)> = (0..4).flat_map(|operator| (0..3).map(move |delay| (operator, delay))).collect();
    let found: Vec<[Row; 3]> = cells
        .par_iter()
        .map(|(operator, delay)| {
            let bisections = size.pick(3, 5, 10);
            let least = |a: f64, b: f64| a.min(b);
            let stiffness: f64 =
                clocks.par_iter().map(|frames| greatest(*operator, *delay, *frames, bisections)).reduce(|| f64::INFINITY, least);
            let energy = |most: f64| {
                let half = (0.5 * stiffness).min(most);
                let made = clocks.par_iter().map(|frames| 1e3 * pressed(*operator, *delay, half, *frames).generated());
                made.reduce(|| 0.0, f64::max)
            };
            let name = format!("force, {} hand, {delay} ms late", Operator::ALL[*operator].0);
            let limit = required(*operator, *delay);
            [
                Row::at_least(format!("{name}: greatest stiffness"), stiffness, "N/m", limit),
                Row::at_most(format!("{name}: energy made, to 1000 N/m"), energy(RENDERED), "mJ", 0.05),
                Row::figure(format!("{name}: energy made at half of it"), energy(f64::INFINITY), "mJ"),
            ]
        })
        .collect();
    found.into_iter().flatten().collect()
}

/// The default settings on clay as hard as rock: hands at 2 ms delay, a device let go with the friction it
/// has.
pub fn by_default(size: Size) -> Vec<Row> {
    let clocks = clocks(size == Size::Full);
    let hard = Law::Spring { stiffness: 1e5, yield_force: f64::INFINITY, slope: 0.0 };
    let runs = clocks.par_iter().flat_map_iter(|frames| {
        Operator::ALL.iter().enumerate().map(move |(operator, (_, hand))| {
            let friction = if *hand == Operator::BARE { 0.1 } else { 0.0 };
            let arm = ArmSettings { delay: 2, operator: *hand, friction, ..ArmSettings::default() };
            let servo = ServoSettings { coupling: Coupling::default(), force: OPEN, ..ServoSettings::default() };
            let path = HandPath::new(press(depth(operator), SPEED).0);
            Rig { arm, path, servo, clay: ReferenceClay::new(hard, 0.3), frames: *frames }.run(HOLD[1])
        })
    });
    let worst = runs.map(|run| [1e6 * run.swing(HOLD[0]), 1e3 * run.generated(), run.slew()]);
    let [swing, energy, slew] = worst.reduce(|| [0.0; 3], |a, b| std::array::from_fn(|i| a[i].max(b[i])));
    vec![
        Row::at_most("force by default, hard clay: swing of a still hand", swing, "um", 1e6 * STEADY),
        Row::at_most("force by default, hard clay: energy made", energy, "mJ", 0.05),
        Row::at_most("force by default, hard clay: slew", slew, "N/ms", 0.3),
    ]
}
