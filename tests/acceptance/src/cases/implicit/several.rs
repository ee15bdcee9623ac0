//! Walls that mirror, several tools, thin sheets and debris; the same bits every time.

use super::compare::distance;
use super::stroke::{Pace, SAMPLE, frame_travel, ways};
use crate::lab::{DX, Lab, Mover, Random, Size, at_walls, block, place, room_with, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::sim::planner::VOLUME_AVERAGING;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};

/// How fine the steps are.
const PACE: Pace = Pace { travel: 0.5 * SAMPLE, passes: 12 };
/// Speed of the tools [m/s].
const SPEED: f64 = 0.1;

/// Tools in clay.
struct Scene {
    clay: Snapshot,
    movers: Vec<Mover>,
    gravity: DVec3,
}

impl Scene {
    /// Moves the tools by `depth` \[cells\]: mean force on each over the second half, and the ways.
    fn run(&self, depth: f64, is_implicit: bool) -> (Vec<DVec3>, Vec<DVec3>) {
        let mut lab = Lab::with_threads(&self.clay, stable_step(&self.clay.material), 1);
        (lab.plan.volume_averaging, lab.plan.gravity) = (VOLUME_AVERAGING, self.gravity);
        // What two implicit steps bear they bear at their ends, a quarter of their way later than the middle
        // of it: the explicit step's parts are such quarters, and one more of them is looked at.
        let parts = if is_implicit { 1 } else { 4 };
        let travel = SAMPLE / f64::from(parts);
        let duration = travel * DX / SPEED;
        let explicit = (duration / lab.plan.dt).ceil() as u32;
        let frames = (depth / SAMPLE).ceil() as u32;
        let (all, late) = (frames * parts, if is_implicit { 0 } else { 1 });
        let seen = frames / 2 * parts + late..all + late;
        let (mut movers, mut after) = (self.movers.clone(), vec![]);
        let mut forces = vec![DVec3::ZERO; movers.len()];
        for i in 0..all + late {
            let steps = if is_implicit { PACE.plan(&mut lab, travel, duration) } else { explicit };
            lab.plan.dt = duration / f64::from(steps);
            let paths: Vec<ToolPath> = movers.iter_mut().map(|m| m.path(duration)).collect();
            let report = lab.frame_with(steps, &paths);
            if seen.contains(&i) {
                forces.iter_mut().zip(&report.tools).for_each(|(sum, felt)| *sum += felt.force / f64::from(seen.len() as u32));
            }
            if i + 1 == all {
                after = ways(&self.clay, &lab);
            }
        }
        (forces, after)
    }

    /// Both steps: forces of each tool off the explicit step's, and ways [%].
    fn compared(&self, depth: f64) -> [f64; 2] {
        let (exact, found) = rayon::join(|| self.run(depth, false), || self.run(depth, true));
        let off = exact.0.iter().zip(&found.0).map(|(e, f)| (*f - *e).length() / e.length());
        [100.0 * off.fold(0.0, |a: f64, b| if b.is_nan() { b } else { a.max(b) }), 100.0 * distance(&found.1, &exact.1)]
    }
}

fn ball(domain: &Domain, id: u32, radius: f64, at: DVec3, direction: DVec3) -> Mover {
    let shape = ToolShape::Sphere { radius };
    Mover { id, velocity: SPEED * direction, ..Mover::new(domain, shape, Contact::default(), at, DQuat::IDENTITY) }
}

/// Half of a strip in plane strain before a mirror, or all of it.
fn strip(is_whole: bool) -> Scene {
    let walls = Walls { low: [Wall::Slip, Wall::Stick, Wall::Slip], high: [Wall::Slip; 3] };
    let (width, middle) = if is_whole { (24, 12.0) } else { (12, 0.0) };
    let domain = room_with([width, 16, 4], walls);
    let mut particles = block(DVec3::ZERO, IVec3::new(width, 12, 4));
    at_walls(&domain, &mut particles);
    let shape = ToolShape::Box { half_size: DVec3::new(3.0, 2.0, 4.0) };
    let at = DVec3::new(middle, 14.05, 2.0);
    let mover = Mover { velocity: DVec3::NEG_Y * SPEED, ..Mover::new(&domain, shape, Contact::default(), at, DQuat::IDENTITY) };
    Scene { clay: snapshot(domain, Preset::SoftClay.material(), particles), movers: vec![mover], gravity: DVec3::ZERO }
}

/// A wall that mirrors is worth the other half.
pub fn mirrored(size: Size) -> Vec<Row> {
    let depth = size.pick(0.6, 1.0, 3.0);
    let (whole, half) = rayon::join(|| strip(true).run(depth, true), || strip(false).run(depth, true));
    let (clay, other) = (strip(true).clay, strip(false).clay);
    // Each particle of the half and its own of the whole, which stands 12 cells further on.
    let is_right = |p: &&Particle| place(p).x > 12.0;
    let right: Vec<DVec3> = clay.particles.iter().zip(&whole.1).filter(|(p, _)| is_right(p)).map(|(_, w)| *w).collect();
    assert_eq!(right.len(), other.particles.len());
    vec![
        Row::at_most(
            "implicit, strip before a mirror: force off half of the whole's",
            100.0 * (2.0 * half.0[0].y / whole.0[0].y - 1.0).abs(),
            "%",
            3.0,
        ),
        Row::at_most("the same: ways off by", 100.0 * distance(&half.1, &right), "%", 3.0),
    ]
}

/// Two balls on the two sides of a block, at once.
fn two_balls() -> Scene {
    let domain = room_with(
        [24, 12, 12],
        Walls { low: [Wall::Separate, Wall::Stick, Wall::Slip], high: [Wall::Separate, Wall::Separate, Wall::Slip] },
    );
    let mut particles = block(DVec3::new(6.0, 0.0, 0.0), IVec3::new(12, 8, 12));
    at_walls(&domain, &mut particles);
    let at = |x: f64| DVec3::new(x, 4.0, 6.0);
    let movers = vec![ball(&domain, 1, 2.5, at(3.4), DVec3::X), ball(&domain, 2, 2.5, at(20.6), DVec3::NEG_X)];
    Scene { clay: snapshot(domain, Preset::SoftClay.material(), particles), movers, gravity: DVec3::ZERO }
}

/// A sheet one cell thick under a ball.
fn sheet() -> Scene {
    let domain = room_with([16, 12, 16], Walls { low: [Wall::Separate, Wall::Stick, Wall::Separate], ..Walls::default() });
    let mut particles = block(DVec3::new(1.0, 0.0, 1.0), IVec3::new(14, 1, 14));
    at_walls(&domain, &mut particles);
    let movers = vec![ball(&domain, 1, 3.0, DVec3::new(8.0, 4.05, 8.0), DVec3::NEG_Y)];
    Scene { clay: snapshot(domain, Preset::SoftClay.material(), particles), movers, gravity: DVec3::ZERO }
}

/// Clay in crumbs on a floor, and a ball that comes down on them.
fn debris() -> Scene {
    let domain = room_with([16, 12, 16], Walls::default());
    let mut random = Random::new(7);
    let mut particles: Vec<Particle> =
        block(DVec3::new(2.0, 0.0, 2.0), IVec3::new(12, 2, 12)).into_iter().filter(|_| random.uniform() < -0.5).collect();
    (0..).zip(&mut particles).for_each(|(id, p)| p.id = id);
    let movers = vec![ball(&domain, 1, 3.0, DVec3::new(8.0, 5.0, 8.0), DVec3::NEG_Y)];
    Scene { clay: snapshot(domain, Preset::SoftClay.material(), particles), movers, gravity: DVec3::NEG_Y * 9.81 }
}

/// Two tools at once, and clay on sparse nodes.
pub fn sparse(size: Size) -> Vec<Row> {
    let scenes = [("two balls", two_balls(), size.pick(0.4, 0.6, 1.5)), ("sheet of 1 cell", sheet(), 0.4)];
    let errors: Vec<[f64; 2]> = scenes.par_iter().map(|(_, scene, depth)| scene.compared(*depth)).collect();
    let mut rows = vec![];
    for ((name, ..), [force, way]) in scenes.iter().zip(errors) {
        rows.push(Row::at_most(format!("implicit, {name}: force off by"), force, "%", 3.0));
        rows.push(Row::at_most(format!("implicit, {name}: ways off by"), way, "%", 3.0));
    }
    let [force, way] = debris().compared(1.0);
    rows.push(Row::figure("implicit, debris under a ball: force off by", force, "%"));
    rows.push(Row::figure("implicit, debris under a ball: ways off by", way, "%"));
    rows
}

/// A ball and a box at work between three kinds of walls on softening clay: the hash of the clay afterwards.
fn busy(threads: usize, frames: u32) -> u64 {
    let walls = Walls { low: [Wall::Slip, Wall::Stick, Wall::Separate], high: [Wall::Slip; 3] };
    let domain = room_with([20, 16, 20], walls);
    let material = ClayMaterial { softening: 0.5, ..Preset::Plasticine.material() };
    let mut lab = Lab::with_threads(&snapshot(domain, material, block(DVec3::ZERO, IVec3::new(12, 8, 12))), 1.0, threads);
    (lab.plan.gravity, lab.plan.volume_averaging) = (DVec3::NEG_Y * 9.81, VOLUME_AVERAGING);
    let mut round = ball(&domain, 1, 3.0, DVec3::new(3.0, 10.5, 4.0), DVec3::new(0.2, -1.0, 0.1));
    let shape = ToolShape::Box { half_size: DVec3::splat(1.5) };
    let mut edged = Mover::new(&domain, shape, Contact::Stick, DVec3::new(9.0, 9.8, 8.0), DQuat::from_rotation_y(1.2));
    (edged.velocity, edged.id) = (DVec3::new(0.5, -1.0, 0.2) * SPEED, 2);
    for _ in 0..frames {
        let duration = frame_travel(0.02) * DX / SPEED;
        let steps = PACE.plan(&mut lab, SAMPLE, duration);
        lab.frame_with(steps, &[round.path(duration), edged.path(duration)]);
    }
    let mut hasher = DefaultHasher::new();
    bytemuck::cast_slice::<Particle, u8>(&lab.particles()).hash(&mut hasher);
    hasher.finish()
}

/// One and two threads, and two runs.
pub fn determinism(size: Size) -> Vec<Row> {
    let frames = size.pick(2, 3, 20);
    let hashes: BTreeSet<u64> = [1, 2, 2].iter().map(|threads| busy(*threads, frames)).collect();
    let others = (hashes.len() - 1) as f64;
    vec![Row::at_most("implicit: states that differ, 1 and 2 threads, two runs", others, "states", 0.0)]
}
