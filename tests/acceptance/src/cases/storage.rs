//! What f32 keeps: slow creep, the same bits anywhere in a large room, sums of crowded cells.

use crate::lab::{DX, Lab, Random, Size, block, elastic, jitter, place, room, set_velocity, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::sim::params::WALL_NODE;
use bevy_clay::sim::prelude::*;
use glam::{DVec3, IVec3};

/// Cells by which scenes are shifted: a multiple of a block's 4.
const SHIFT: i32 = 200;

/// A body creeps at 20 um/s, 200 cells from the grid's origin, at 0.39 mm a cell and 67 us a substep: with
/// absolute f32 grid coordinates (ulp 1.5e-5 cells) it would stand still.
pub fn creep(size: Size) -> Vec<Row> {
    let (cell_width, dt, speed) = (3.9e-4, 67e-6, 20e-6);
    // The modulus for which this is the default step: E = (1 - 2 nu) rho (0.7 dx / dt)^2.
    let nu = 0.45;
    let density = 1700.0;
    let young_modulus = (1.0 - 2.0 * nu) * density * (bevy_clay::sim::planner::STEP_FRACTION * cell_width / dt).powi(2);
    let material = ClayMaterial { density, young_modulus, ..elastic(nu) };
    let low = DVec3::new(0.1, -0.05, 0.2);
    let extent = IVec3::new(SHIFT + 12, 12, 12).as_dvec3() * cell_width;
    let domain = Domain::new(low, low + extent, cell_width, Walls::default()).expect("a sound room");
    let mut particles = block(DVec3::new(f64::from(SHIFT) + 4.0, 4.0, 4.0), IVec3::splat(4));
    // Unlike places in the cell, so that one lucky rounding is not all there is.
    jitter(&mut particles, 0.1, 3);
    for p in &mut particles {
        p.rest_volume *= (cell_width / DX).powi(3) as f32;
        set_velocity(p, DVec3::X * speed);
    }
    let mut lab = Lab::new(&snapshot(domain, material, particles), dt);
    let before = lab.particles();
    let steps = size.pick(1500, 15_000, 15_000);
    for _ in 0..10 {
        lab.frame(steps / 10);
    }
    let way = speed * dt * f64::from(steps);
    let error = |(a, b): (&Particle, &Particle)| ((b.grid() - a.grid()) * cell_width - DVec3::X * way).length() / way;
    let after = lab.particles();
    let worst = before.iter().zip(&after).map(error).fold(0.0, f64::max);
    let mean =
        before.iter().zip(&after).map(|(a, b)| (b.grid() - a.grid()).x * cell_width / way).sum::<f64>() / after.len() as f64;
    let seconds = dt * f64::from(steps);
    vec![
        Row::at_most(format!("creep: displacement at 20 um/s for {seconds:.1} s, worst particle"), 100.0 * worst, "%", 1.0),
        Row::at_most(format!("creep: displacement at 20 um/s for {seconds:.1} s, mean"), 100.0 * (mean - 1.0).abs(), "%", 1.0),
    ]
}

/// A cut body that turns, flows and falls, here and `SHIFT` cells away along each axis in the same room, and
/// in a room moved by as much.
pub fn shift(size: Size) -> Vec<Row> {
    let material = Preset::SoftClay.material();
    let dt = stable_step(&material);
    let mut particles = block(DVec3::splat(16.0), IVec3::splat(6));
    jitter(&mut particles, 0.2, 9);
    let mut random = Random::new(9);
    let speed = 0.05 * DX / dt;
    for p in &mut particles {
        let r = place(p) - 19.0;
        set_velocity(
            p,
            (DVec3::new(r.y, -r.x, 0.4 * r.z) + 0.5 * DVec3::new(random.uniform(), random.uniform(), random.uniform()))
                * 0.2
                * speed,
        );
        if r.x.abs() < 1.5 && r.y > -1.0 {
            p.tags[0] = Tag { sheet: 1, side: if r.x < 0.0 { -1 } else { 1 } };
        }
    }
    let room = room([SHIFT + 40; 3], Wall::Separate);
    let run = |domain: Domain, cells: i32| {
        let mut clay = particles.clone();
        clay.iter_mut().for_each(|p| p.cell = p.cell.map(|c| c + cells));
        let mut lab = Lab::new(&snapshot(domain, material, clay), dt);
        lab.plan.gravity = DVec3::new(0.3, -9.81, -0.2);
        (0..size.pick(2, 5, 20)).for_each(|_| {
            lab.frame(50);
        });
        let mut after = lab.particles();
        after.iter_mut().for_each(|p| p.cell = p.cell.map(|c| c - cells));
        after
    };
    let here = run(room, 0);
    let moved = Domain { origin: room.origin + f64::from(SHIFT) * room.cell_width, ..room };
    let differ = |other: &[Particle]| here.iter().zip(other).filter(|(a, b)| a != b).count() as f64;
    let worked = here.iter().filter(|p| p.hardening > 0.0).count();
    vec![
        Row::at_most(format!("shift: particles that differ {SHIFT} cells away"), differ(&run(room, SHIFT)), "particles", 0.0),
        Row::at_most(
            format!("shift: particles that differ in a room {SHIFT} cells away"),
            differ(&run(moved, 0)),
            "particles",
            0.0,
        ),
        // Rigid flight proves little.
        Row::at_least("shift: particles that flowed", worked as f64, "particles", 100.0),
    ]
}

/// A lattice of 64 particles per cell, each with the mass of an eighth of a cell of clay at J = 1 and the
/// strain of J = 0.5.
fn crowd(low: DVec3, cells: IVec3) -> Vec<Particle> {
    let n = cells * 4;
    let squeezed = (0.5f64.powf(2.0 / 3.0) - 1.0) as f32;
    let volume = (DX.powi(3) / 8.0) as f32;
    let at = |i: i32| IVec3::new(i / (n.y * n.z), i / n.z % n.y, i % n.z).as_dvec3();
    let particle = |i: i32| {
        let mut p = Particle::at(low + (at(i) + 0.5) / 4.0 + f64::from(WALL_NODE), volume, i.cast_unsigned());
        p.elastic_strain[..3].fill(squeezed);
        p
    };
    (0..n.x * n.y * n.z).map(particle).collect()
}

/// Crowded cells, held by walls, and bursting in flight near the greatest speed that a substep takes: no sum
/// of a node overflows.
pub fn crowded(size: Size) -> Vec<Row> {
    let material = elastic(0.45);
    let limit = material.time_step_limit(DX, material.density);
    let steps = size.pick(5, 10, 40);
    let held = snapshot(room([8; 3], Wall::Slip), material, crowd(DVec3::ZERO, IVec3::splat(8)));
    let mut lab = Lab::new(&held, stable_step(&material));
    let mut rows = crowd_rows("held", &mut lab, steps);
    let ratio = lab.particles().iter().map(|p| (p.volume_ratio() - 0.5).abs()).fold(0.0, f64::max);
    rows.push(Row::at_most("crowded cells, held: change of J", ratio, "-", 1e-3));
    // A tenth of the limit: the burst adds up to 0.15 cells per substep to the flight's 0.3, and a node may
    // go 0.49.
    let dt = 0.1 * limit;
    let mut flying = snapshot(room([24, 12, 12], Wall::Separate), material, crowd(DVec3::splat(3.0), IVec3::splat(6)));
    flying.particles.iter_mut().for_each(|p| set_velocity(p, DVec3::X * 0.3 * DX / dt));
    let mut lab = Lab::new(&flying, dt);
    rows.extend(crowd_rows("in flight", &mut lab, steps.min(20)));
    rows
}

fn crowd_rows(name: &str, lab: &mut Lab, steps: u32) -> Vec<Row> {
    let report = lab.frame(steps);
    let is_ok = report.health.is_ok() && report.redone == 0;
    vec![
        Row::at_least(format!("crowded cells, {name}: healthy"), f64::from(u8::from(is_ok)), "yes", 1.0),
        Row::at_most(
            format!("crowded cells, {name}: mass"),
            (report.grid_mass / report.particle_mass - 1.0).abs(),
            "relative",
            1e-5,
        ),
        Row::at_most(format!("crowded cells, {name}: momentum balance"), report.balance_error(), "relative", 1e-5),
    ]
}
