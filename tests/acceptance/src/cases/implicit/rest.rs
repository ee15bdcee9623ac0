//! What comes after a stroke, and before one: tools held, taken away slowly or at once, clay under its own
//! weight and in flight.

use super::free::{FLIGHT, FRAME, Free, GRAVITY, PRESS, stroke, tossed, turning};
use super::planned::Planned;
use super::stroke::{Pace, Pressed, Way, frame_travel};
use crate::lab::{Lab, Size, block, place, room_with, snapshot};
use crate::report::Row;
use bevy_clay::sim::penalty::{ARRIVAL_GAP, reach};
use bevy_clay::sim::prelude::*;
use glam::{DVec3, IVec3};
use rayon::prelude::*;

/// A ball that is held for 0.3 s keeps its force.
pub fn held(size: Size) -> Vec<Row> {
    let mut run = stroke(size).begin();
    run.go(Way::Implicit(PRESS));
    let frames = size.pick(9, 27, 27);
    let forces: Vec<f64> = (0..frames).map(|_| run.hold(PRESS)).collect();
    let kept = forces[forces.len() - 1] / forces[0];
    vec![
        Row::at_least("implicit, held ball: force kept in 0.3 s", kept, "-", 0.98),
        Row::at_most("implicit, held ball: force after 0.3 s over that before", kept, "-", 1.02),
    ]
}

/// The way back of a tool \[cells\]: twice what the clay springs back by.
const BACK: f64 = 0.3;

/// A ball that goes back at 5 mm/s: its force all the way, over the greatest.
pub fn unloading(size: Size) -> Vec<Row> {
    let stroke = stroke(size);
    let way = |way: Way| {
        let mut run = stroke.begin();
        run.go(way);
        let most = run.pressed.forces.iter().map(|s| s[2]).fold(0.0, f64::max);
        let first = run.pressed.forces.len();
        run.turn(0.005, BACK);
        run.go(way);
        (run.pressed.forces.split_off(first), most)
    };
    let ways = [Way::Explicit(1.0), Way::Implicit(Pace { travel: frame_travel(0.005), passes: 12 })];
    let found: Vec<(Vec<[f64; 3]>, f64)> = ways.par_iter().map(|w| way(*w)).collect();
    let (exact, most) = &found[0];
    let reference = Pressed { forces: exact.clone(), ..Pressed::empty() };
    let off = found[1].0.iter().map(|s| (s[2] - reference.mean(s[0], s[1])).powi(2));
    let known: Vec<f64> = off.filter(|o| o.is_finite()).collect();
    let rms = (known.iter().sum::<f64>() / known.len() as f64).sqrt();
    vec![Row::at_most("implicit, ball withdrawn at 5 mm/s: force off by", 100.0 * rms / most, "% of the greatest", 3.0)]
}

/// A ball that is taken away at once: where the clay comes to rest.
pub fn released(size: Size) -> Vec<Row> {
    let run = Free::Release.run(Way::Implicit(Pace { travel: 1.0, ..PRESS }), size);
    let [back, ways] = run.errors(&Free::Release.reference(size)).map(|e| 100.0 * e);
    vec![
        Row::at_most("implicit, ball taken away: ways off by", ways, "%", 3.0),
        Row::figure("the same: the way back off by", back, "%"),
    ]
}

/// A block that comes to bear its own weight at once.
pub fn self_weight(size: Size) -> Vec<Row> {
    let pace = Pace { travel: 1.0, passes: 10 };
    let run = Free::Weight.run(Way::Implicit(pace), size);
    let [floor, ways] = run.errors(&Free::Weight.reference(size)).map(|e| 100.0 * e);
    vec![
        Row::figure("implicit, own weight: the floor's force in the third frame off by", floor, "%"),
        Row::at_most("implicit, own weight: ways after 3 frames off by", ways, "%", 3.0),
    ]
}

/// Greatest errors in a flight of momentum, gravity's share taken off, and of angular momentum about the
/// centre of mass, over those at the start [-].
fn flight(mut frame: impl FnMut() -> (FrameReport, Vec<Particle>), clay: &Snapshot) -> [f64; 2] {
    let (mut start, mut errors, mut fallen) = (None, [0.0f64; 2], DVec3::ZERO);
    for _ in 0..FLIGHT {
        let (report, particles) = frame();
        fallen += report.gravity_impulse;
        let now = [report.momentum - fallen, turning(&report, &particles, clay)];
        let first = *start.get_or_insert(now);
        errors = [0, 1].map(|i| errors[i].max((now[i] - first[i]).length() / first[i].length()));
    }
    errors
}

/// A block that is tossed: as it is planned, and by implicit steps alone, which go by less than a cell each.
pub fn tossed_block(_: Size) -> Vec<Row> {
    let clay = tossed();
    let policy = Policy { integrator: IntegratorChoice::Auto, outputs: FrameOutputs::ALL, ..Policy::default() };
    let mut planner = Planned::new(&clay, policy, 0);
    let planned = flight(|| (planner.frame(FRAME, &[]), planner.particles()), &clay);
    let mut lab = Lab::new(&clay, 1.0);
    lab.plan.gravity = GRAVITY;
    let bare = flight(
        || {
            let steps = Pace { travel: 1.0, passes: 10 }.plan(&mut lab, 3.0, FRAME);
            (lab.frame(steps), lab.particles())
        },
        &clay,
    );
    vec![
        Row::at_most("implicit, toss as planned: momentum off by", planned[0], "relative", 1e-3),
        Row::at_most("implicit, toss as planned: angular momentum off by", planned[1], "relative", 1e-3),
        Row::figure("toss by implicit steps alone: momentum off by", bare[0], "relative"),
        Row::figure("toss by implicit steps alone: angular momentum off by", bare[1], "relative"),
    ]
}

/// From how far above the floor a block falls \[cells\], and in how long steps \[s\].
const FALLS: [(f64, f64); 4] = [(0.4, 1.0 / 30.0), (0.8, 1.0 / 60.0), (1.5, 1.0 / 120.0), (3.1, 1.0 / 240.0)];

/// How far from where it would touch the lowest clay of a block stands that has fallen on a floor \[cells\].
fn landed(floor: Wall, (fall, dt): (f64, f64)) -> f64 {
    let walls = Walls { low: [Wall::Separate, floor, Wall::Separate], high: [Wall::Separate; 3] };
    let particles = block(DVec3::new(4.0, fall, 4.0), IVec3::splat(4));
    let clay = snapshot(room_with([12; 3], walls), Preset::SoftClay.material(), particles);
    let mut lab = Lab::new(&clay, 1.0);
    lab.plan = FramePlan { dt, gravity: GRAVITY, integrator: Integrator::Implicit { passes: 15 }, ..lab.plan };
    for _ in 0..(0.3 / dt) as u32 {
        lab.frame(1);
    }
    let lowest = lab.particles().iter().map(|p| place(p).y).fold(f64::INFINITY, f64::min);
    (lowest - reach(0.125)).abs()
}

/// Blocks that fall on floors, from several heights in steps of several lengths.
pub fn landings(_: Size) -> Vec<Row> {
    let row = |(name, floor)| {
        let off = FALLS.iter().map(|fall| landed(floor, *fall)).fold(0.0, f64::max);
        // Where clay has arrived it is held, within this.
        Row::at_most(format!("implicit, block on a {name} floor: rests off it by"), off, "cells", ARRIVAL_GAP)
    };
    [("sticking", Wall::Stick), ("slipping", Wall::Slip), ("separating", Wall::Separate)].map(row).to_vec()
}
