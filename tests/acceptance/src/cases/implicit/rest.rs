//! What comes after a stroke, and before one: tools held, taken away slowly or at once, clay under its own
//! weight and in flight.

use super::compare::distance;
use super::planned::Planned;
use super::stroke::{Pace, Pressed, SAMPLE, Shape, Stroke, Way, frame_travel, ways};
use crate::lab::{DX, Lab, Size, at_walls, block, place, room_with, set_velocity, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::sim::planner::VOLUME_AVERAGING;
use bevy_clay::sim::prelude::*;
use glam::{DVec3, IVec3};
use rayon::prelude::*;

/// Steps of a tool in contact, and of clay that no tool drives.
const PACE: Pace = Pace { travel: 0.5 * SAMPLE, passes: 12 };
/// Length of a frame \[s\] where no similarity is called for.
const FRAME: f64 = 1.0 / 90.0;
/// Gravity [m/s^2].
const GRAVITY: DVec3 = DVec3::new(0.0, -9.81, 0.0);

/// A ball of 2 or 4 cells in soft clay, at half its radius of depth.
fn stroke(size: Size) -> Stroke {
    let radius = size.pick(2.0, 2.0, 4.0);
    let material = Preset::SoftClay.material();
    Stroke { shape: Shape::Ball(radius), contact: Contact::default(), material, speed: 0.02, depth: 0.5 * radius }
}

/// A ball that is held for 0.3 s keeps its force.
pub fn held(size: Size) -> Vec<Row> {
    let mut run = stroke(size).begin();
    run.go(Way::Implicit(PACE));
    let frames = size.pick(9, 27, 27);
    let forces: Vec<f64> = (0..frames).map(|_| run.hold(PACE)).collect();
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

/// Frames in which clay comes to rest.
const RESTING: u32 = 9;

/// Where explicit clay without a tool comes to rest, damped critically for waves through it.
fn settled(lab: &mut Lab, material: &ClayMaterial, height: f64, time: f64) {
    let wave = (material.lame_mu() / material.density).sqrt();
    lab.plan.validation.damping = std::f64::consts::PI * wave / (height * DX);
    lab.plan.integrator = Integrator::default();
    lab.plan.dt = stable_step(material);
    lab.frame((time / lab.plan.dt).ceil() as u32);
}

/// A ball that is taken away at once: where the clay comes to rest.
pub fn released(size: Size) -> Vec<Row> {
    let stroke = stroke(size);
    let run = |way: Way| {
        let mut run = stroke.begin();
        run.go(way);
        let pressed = ways(&run.clay, &run.lab);
        if let Way::Implicit(pace) = way {
            for _ in 0..RESTING {
                let steps = pace.plan(&mut run.lab, 0.0, FRAME * 4.0);
                run.lab.frame(steps);
            }
        } else {
            settled(&mut run.lab, &stroke.material, 2.5 * stroke.depth * 2.0, 0.1);
        }
        (pressed, ways(&run.clay, &run.lab))
    };
    let found: Vec<(Vec<DVec3>, Vec<DVec3>)> = [Way::Explicit(1.0), Way::Implicit(PACE)].par_iter().map(|w| run(*w)).collect();
    let back =
        |(before, after): &(Vec<DVec3>, Vec<DVec3>)| -> Vec<DVec3> { before.iter().zip(after).map(|(b, a)| *a - *b).collect() };
    vec![
        Row::at_most("implicit, ball taken away: ways off by", 100.0 * distance(&found[1].1, &found[0].1), "%", 3.0),
        Row::figure("the same: the way back off by", 100.0 * distance(&back(&found[1]), &back(&found[0])), "%"),
    ]
}

/// A block that comes to bear its own weight at once.
pub fn self_weight(size: Size) -> Vec<Row> {
    let high = size.pick(6, 8, 16);
    let walls = Walls { low: [Wall::Slip, Wall::Stick, Wall::Slip], ..Walls::default() };
    let domain = room_with([16, high + 4, 16], walls);
    let mut particles = block(DVec3::ZERO, IVec3::new(6, high, 6));
    at_walls(&domain, &mut particles);
    let material = Preset::SoftClay.material();
    let clay = snapshot(domain, material, particles);
    let lab = || {
        let mut lab = Lab::new(&clay, 1.0);
        (lab.plan.volume_averaging, lab.plan.gravity) = (VOLUME_AVERAGING, GRAVITY);
        lab
    };
    let mut exact = lab();
    settled(&mut exact, &material, f64::from(high), 0.2);
    let exact = ways(&clay, &exact);
    let mut lab = lab();
    let errors: Vec<f64> = (0..3)
        .map(|_| {
            let steps = Pace { travel: 1.0, passes: 10 }.plan(&mut lab, 0.0, FRAME);
            lab.frame(steps);
            100.0 * distance(&ways(&clay, &lab), &exact)
        })
        .collect();
    vec![
        Row::figure("implicit, own weight: ways after 1 frame off by", errors[0], "%"),
        Row::at_most("implicit, own weight: ways after 3 frames off by", errors[2], "%", 3.0),
    ]
}

/// Frames of a flight.
const FLIGHT: u32 = 8;

/// A block in the air that turns.
fn tossed() -> Snapshot {
    let domain = room_with([40, 32, 16], Walls::default());
    let spin = DVec3::new(2.0, 4.0, 9.0);
    let mut particles = block(DVec3::new(4.0, 10.0, 4.0), IVec3::splat(8));
    for p in &mut particles {
        set_velocity(p, DVec3::new(0.8, 0.3, 0.0) + spin.cross((place(p) - DVec3::new(8.0, 14.0, 8.0)) * DX));
        p.affine = DVec3::AXES.map(|axis| spin.cross(axis).as_vec3().to_array());
    }
    snapshot(domain, Preset::SoftClay.material(), particles)
}

/// Greatest errors in a flight of momentum, gravity's share taken off, and of angular momentum about the
/// centre of mass, over those at the start [-].
fn flight(mut frame: impl FnMut() -> (FrameReport, Vec<Particle>), clay: &Snapshot) -> [f64; 2] {
    let centre = |particles: &[Particle]| {
        let at = particles.iter().map(|p| clay.domain.to_world(p.grid()));
        at.sum::<DVec3>() / particles.len() as f64
    };
    let (mut start, mut errors, mut fallen) = (None, [0.0f64; 2], DVec3::ZERO);
    for _ in 0..FLIGHT {
        let (report, particles) = frame();
        fallen += report.gravity_impulse;
        let turning = report.angular_momentum - centre(&particles).cross(report.momentum);
        let (momentum, turning_at_first) = *start.get_or_insert((report.momentum - fallen, turning));
        let off = [
            (report.momentum - fallen - momentum).length() / momentum.length(),
            (turning - turning_at_first).length() / turning_at_first.length(),
        ];
        errors = [errors[0].max(off[0]), errors[1].max(off[1])];
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
