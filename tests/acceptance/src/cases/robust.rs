//! The same bits every time, and time steps too long that are told and survived.

use crate::lab::{
    DX, Lab, Mover, Random, Size, block, elastic, is_sound, place, room, room_with, set_velocity, snapshot, stable_step,
};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};
use std::collections::BTreeSet;
use std::hash::{DefaultHasher, Hash, Hasher};

/// A ball, a blade and walls at work on particles given in an order of `order`; the hash of the clay
/// afterwards, by id.
fn busy_scene(threads: usize, frames: u32, order: u64) -> u64 {
    let walls = Walls { low: [Wall::Slip, Wall::Stick, Wall::Separate], high: [Wall::Slip; 3] };
    let domain = room_with([20, 16, 20], walls);
    let material = ClayMaterial { softening: 0.5, ..Preset::SoftClay.material() };
    let mut particles = block(DVec3::ZERO, IVec3::new(12, 8, 12));
    if order > 0 {
        let mut random = Random::new(order);
        for i in (1..particles.len()).rev() {
            particles.swap(i, ((0.5 + 0.5 * random.uniform()) * (i + 1) as f64) as usize);
        }
    }
    let mut lab = Lab::with_threads(&snapshot(domain, material, particles), stable_step(&material), threads);
    lab.plan.gravity = DVec3::new(0.0, -9.81, 0.0);
    let unit = 0.02 * domain.cell_width / lab.plan.dt;
    let ball = ToolShape::Sphere { radius: 3.0 };
    let mut ball = Mover::new(&domain, ball, Contact::default(), DVec3::new(3.0, 10.5, 4.0), DQuat::IDENTITY);
    ball.velocity = DVec3::new(0.2, -1.0, 0.1) * unit;
    let blade = ToolShape::Blade { half_width: 4.0, half_height: 4.0 };
    let turned = DQuat::from_rotation_y(1.2);
    let mut blade = Mover::new(&domain, blade, Contact::default(), DVec3::new(8.0, 8.0, 6.0), turned);
    blade.velocity = DVec3::new(1.0, -0.5, 0.2) * unit;
    blade.id = 2;
    for _ in 0..frames {
        let duration = 20.0 * lab.plan.dt;
        let tools = [ball.path(duration), blade.path(duration)];
        lab.frame_with(20, &tools);
    }
    let mut hasher = DefaultHasher::new();
    bytemuck::cast_slice::<Particle, u8>(&lab.particles()).hash(&mut hasher);
    hasher.finish()
}

/// One and two threads, ten runs, other orders of the particles in memory.
pub fn determinism(size: Size) -> Vec<Row> {
    let frames = size.pick(5, 5, 40);
    let others = |runs: &[(usize, u64)]| {
        let hashes: BTreeSet<u64> = runs.iter().map(|(threads, order)| busy_scene(*threads, frames, *order)).collect();
        (hashes.len() - 1) as f64
    };
    let threads = others(&[(1, 0), (2, 0), (2, 0)]);
    let runs = others(&vec![(2, 0); size.pick(2, 10, 10)]);
    let orders = others(&[(2, 0), (2, 1), (2, 2), (1, 3)]);
    vec![
        Row::at_most("determinism: states that differ, 1 and 2 threads, two runs", threads, "states", 0.0),
        Row::at_most("determinism: states that differ, ten runs", runs, "states", 0.0),
        Row::at_most("determinism: states that differ, four orders of particles", orders, "states", 0.0),
    ]
}

/// Time steps too long for the clay.
pub fn health(_: Size) -> Vec<Row> {
    let mut rows = long_step();
    rows.extend(fast_body());
    rows
}

/// A time step 16 times the stability limit: redone or given up, and the clay is as good as ever.
fn long_step() -> Vec<Row> {
    let material = Preset::SoftClay.material();
    let limit = material.time_step_limit(DX, material.density);
    let particles = block(DVec3::new(4.0, 0.5, 4.0), IVec3::splat(5));
    let mut lab = Lab::new(&snapshot(room([16; 3], Wall::Separate), material, particles), 16.0 * limit);
    lab.plan.gravity = DVec3::new(0.0, -9.81, 0.0);
    let report = lab.frame(60);
    let told = report.redone > 0 || report.health.contains(Health::GIVEN_UP);
    let survived = is_sound(&lab.particles());
    lab.plan.dt = stable_step(&material);
    let next = lab.frame(200);
    let goes_on = next.health.is_ok() && is_sound(&lab.particles()) && next.energies.kinetic.is_finite();
    let yes = |b: bool| f64::from(u8::from(b));
    vec![
        Row::at_least("health: a step 16 times too long is redone or given up", yes(told), "yes", 1.0),
        Row::at_least("health: clay is sound after it", yes(survived), "yes", 1.0),
        Row::at_least("health: a good step runs after it", yes(goes_on), "yes", 1.0),
    ]
}

/// A body too fast for the step: redone with half of it, to the same bits as if half had been asked for.
fn fast_body() -> Vec<Row> {
    let material = elastic(0.3);
    let dt = stable_step(&material);
    let run = |dt: f64, steps: u32| {
        let mut particles = block(DVec3::new(2.0, 2.0, 2.0), IVec3::splat(4));
        let speed = 0.7 * DX / stable_step(&material);
        particles.iter_mut().for_each(|p| set_velocity(p, DVec3::X * speed));
        let mut lab = Lab::new(&snapshot(room([24, 8, 8], Wall::Separate), material, particles), dt);
        let report = lab.frame(steps);
        (lab.particles(), report)
    };
    let (redone, report) = run(dt, 10);
    let (halved, _) = run(0.5 * dt, 20);
    let far = redone.iter().map(|p| place(p).x).fold(0.0, f64::max);
    vec![
        Row::at_most("health: redone frames of a body at 0.7 cells per substep", f64::from(report.redone) - 1.0, "beyond 1", 0.0),
        Row::at_most("health: it differs from half the step", f64::from(u8::from(redone != halved)), "yes", 0.0),
        Row::at_most("health: place of its front", (far - 12.75).abs(), "cells", 1e-3),
    ]
}
