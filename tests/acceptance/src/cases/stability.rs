//! Stability: the longest stable step of a particle, a block and a sheet, energy over many steps, stress
//! noise of clay that crosses cells, clay pressed to a sheet.

use crate::cases::work::cut;
use crate::lab::{
    DX, Lab, Mover, Random, Size, block, elastic, jitter, place, room, room_with, set_velocity, snapshot, stable_step, wave_step,
};
use crate::report::Row;
use bevy_clay::sim::oracle::law::Spectrum;
use bevy_clay::sim::planner::VOLUME_AVERAGING;
use bevy_clay::sim::prelude::*;
use glam::{DMat3, DQuat, DVec3, IVec3};
use std::collections::{HashMap, HashSet};

/// Where the bisection of the step limit ends, over `time_step_limit`. The limit of the rows is 1 less this.
const WIDTH: f64 = 2e-3;

/// The stability limits, bisected, over `time_step_limit`: one particle, a block and a sheet two particles
/// thick, all free.
pub fn step_limit(size: Size) -> Vec<Row> {
    let ratios: &[f64] = size.pick(&[0.45], &[0.1, 0.45], &[0.1, 0.3, 0.45, 0.49]);
    let steps = size.pick(300, 300, 2000);
    let edge = size.pick(4, 4, 8);
    let sheet = IVec3::new(2 * edge, 1, 2 * edge);
    let row = |body: &str, poisson_ratio: f64, is_stable: &dyn Fn(&ClayMaterial, f64) -> bool| {
        let material = elastic(poisson_ratio);
        let formula = material.time_step_limit(DX, material.density);
        let limit = bisect(|fraction| is_stable(&material, fraction * formula));
        Row::at_least(format!("step limit: {body}, nu {poisson_ratio}"), limit, "x formula", 1.0 - WIDTH)
    };
    let rows_of = |&nu: &f64| {
        [
            row("one particle", nu, &is_particle_stable),
            row("block", nu, &|m, dt| is_body_stable(m, dt, IVec3::splat(edge), steps)),
            row("sheet of one cell", nu, &|m, dt| is_body_stable(m, dt, sheet, steps)),
        ]
    };
    ratios.iter().flat_map(rows_of).collect()
}

/// The greatest stable fraction of the formula, to [`WIDTH`]; NaN if half of it is unstable, or nothing up to
/// three times it: then nothing was tested.
fn bisect(is_stable: impl Fn(f64) -> bool) -> f64 {
    let (mut stable, mut unstable) = (0.5, 3.0);
    if !is_stable(stable) || is_stable(unstable) {
        return f64::NAN;
    }
    while unstable - stable > WIDTH {
        let middle = 0.5 * (stable + unstable);
        *(if is_stable(middle) { &mut stable } else { &mut unstable }) = middle;
    }
    stable
}

/// Whether one particle that swells at a small rate stays as lively as it was for 1000 steps.
fn is_particle_stable(material: &ClayMaterial, dt: f64) -> bool {
    let mut particle = Particle::at(DVec3::new(9.3, 9.6, 9.4), (DX.powi(3) / 8.0) as f32, 0);
    let rate = 1e-3 / dt;
    for (c, column) in particle.affine.iter_mut().enumerate() {
        column[c] = rate as f32;
    }
    let mut lab = Lab::with_threads(&snapshot(room([8; 3], Wall::Separate), *material, vec![particle]), dt, 1);
    let report = lab.frame(1000);
    // An oscillator near its limit has a large amplitude but a bounded one: the ratio is (1 - (dt /
    // limit)^2)^(-1/2) < 16 up to 0.998.
    let grown = f64::from(lab.particles()[0].affine[0][0]).abs() / rate;
    report.health.is_ok() && report.redone == 0 && grown < 30.0
}

/// Whether a free body of `cells` that starts with random velocities of 1e-4 c keeps below 20 times its
/// energy.
fn is_body_stable(material: &ClayMaterial, dt: f64, cells: IVec3, steps: u32) -> bool {
    // Half the least room that leaves 3 cells free, and a place between the nodes.
    let low = DVec3::new(4.13, 4.41, 4.77);
    let mut particles = block(low, cells);
    let mut random = Random::new(11);
    let speed = 1e-4 * material.wave_speed(material.density);
    particles.iter_mut().for_each(|p| set_velocity(p, DVec3::new(random.uniform(), random.uniform(), random.uniform()) * speed));
    let kinetic = |p: &Particle| {
        0.5 * material.density * f64::from(p.rest_volume) * p.velocity.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>()
    };
    let start: f64 = particles.iter().map(kinetic).sum();
    let domain = room((cells + 8).to_array(), Wall::Separate);
    let mut lab = Lab::new(&snapshot(domain, *material, particles), dt);
    // Short frames: one that blows up is redone with smaller steps, up to 30 times as many.
    (0..steps / 20).all(|_| {
        let report = lab.frame(20);
        report.health.is_ok() && report.redone == 0 && report.energies.kinetic + report.energies.elastic < 20.0 * start
    })
}

/// Total energy at the end of each frame of `steps` substeps; NaN for a frame that went wrong. `weight` is
/// the body's, `floor` the wall's height [m].
fn energies(lab: &mut Lab, frames: u32, steps: u32, weight: f64) -> Vec<f64> {
    let low = lab.engine.save().expect("clay is loaded").domain.corners().0.y;
    let mut run = || {
        let report = lab.frame(steps);
        let height = if weight > 0.0 {
            let domain = lab.engine.save().expect("clay is loaded").domain;
            let particles = lab.particles();
            particles.iter().map(|p| domain.to_world(p.grid()).y).sum::<f64>() / particles.len() as f64 - low
        } else {
            0.0
        };
        let total = report.energies.kinetic + report.energies.elastic + weight * height;
        if report.health.is_ok() && report.redone == 0 { total } else { f64::NAN }
    };
    (0..frames).map(|_| run()).collect()
}

/// Greatest growth [%] from the mean over one part of the run to that over any later part, of 20: kinetic and
/// elastic energy stand half a substep apart, so that their sum swings by omega dt / 2 of itself.
fn growth(energies: &[f64]) -> f64 {
    let means: Vec<f64> = energies.chunks(energies.len().div_ceil(20)).map(|c| c.iter().sum::<f64>() / c.len() as f64).collect();
    if !means.iter().all(|m| m.is_finite()) {
        return f64::NAN;
    }
    let mut least = f64::INFINITY;
    means.iter().fold(f64::NEG_INFINITY, |worst: f64, &m| {
        least = least.min(m);
        worst.max(100.0 * (m / least - 1.0))
    })
}

/// Bodies at the default step for 1e5 substeps: a block and a sheet that turn and ring, clay that settles on
/// a floor, a block in two that bounces there. With tools: the case `work of tools`.
pub fn energy(size: Size) -> Vec<Row> {
    let steps = size.pick(2000, 5000, 100_000);
    let per_frame = 97;
    let frames = steps / per_frame + 1;
    let row = |body: &str, value: f64| Row::at_most(format!("energy: growth of {body} in {steps} substeps"), value, "%", 1.0);
    let edge = size.pick(4, 4, 8);
    let mut rows = vec![];
    let bodies = [
        ("a free block, nu 0.1", 0.1, IVec3::splat(edge)),
        ("a free block, nu 0.49", 0.49, IVec3::splat(edge)),
        ("a free sheet of one cell, nu 0.45", 0.45, IVec3::new(2 * edge, 1, 2 * edge)),
    ];
    for (name, poisson_ratio, cells) in bodies {
        let material = elastic(poisson_ratio);
        let mut lab = Lab::new(&ringing(&material, cells), stable_step(&material));
        rows.push(row(name, growth(&energies(&mut lab, frames, per_frame, 0.0))));
    }
    let material = Preset::SoftClay.material();
    let walls = Walls { low: [Wall::Separate; 3], high: [Wall::Separate; 3] };
    let particles = block(DVec3::new(4.0, 0.5, 4.0), IVec3::splat(edge));
    let mass = material.density * particles.iter().map(|p| f64::from(p.rest_volume)).sum::<f64>();
    let domain = room_with([edge + 8, edge + 4, edge + 8], walls);
    let mut lab = Lab::new(&snapshot(domain, material, particles), stable_step(&material));
    lab.plan.gravity = DVec3::new(0.0, -9.81, 0.0);
    rows.push(row("clay dropped on a floor", growth(&energies(&mut lab, frames, per_frame, mass * 9.81))));
    // Elastic, so that it bounces and rings: only friction at the cut takes energy, and a cut gives none.
    let material = ClayMaterial { weld: Weld::Off, ..elastic(0.45) };
    let mut particles = block(DVec3::new(4.0, 0.5, 4.0), IVec3::splat(edge));
    let middle = DVec3::new(4.0, 0.5, 4.0) + 0.5 * f64::from(edge);
    cut(&mut particles, DVec3::new(0.3, 1.0, 0.2).normalize(), middle);
    let mut lab = Lab::new(&snapshot(domain, material, particles), stable_step(&material));
    lab.plan.gravity = DVec3::new(0.0, -9.81, 0.0);
    rows.push(row("a cut elastic block dropped on a floor", growth(&energies(&mut lab, frames, per_frame, mass * 9.81))));
    rows
}

/// A free body whose parts move with a velocity gradient of 1e-3 c / dx along all axes: it turns, and rings
/// at strains of a percent.
fn ringing(material: &ClayMaterial, cells: IVec3) -> Snapshot {
    let unit = 1e-3 * material.wave_speed(material.density) / DX;
    let gradient = DMat3::from_cols(DVec3::new(0.5, 0.9, -0.4), DVec3::new(-1.1, -0.7, 0.8), DVec3::new(0.6, -0.9, 0.4)) * unit;
    // Room to turn about any axis.
    let extent = cells.as_dvec3().length().ceil() as i32 + 6;
    let centre = DVec3::splat(f64::from(extent) / 2.0) + DVec3::new(0.13, 0.41, 0.27);
    let mut particles = block(centre - cells.as_dvec3() / 2.0, cells);
    for p in &mut particles {
        set_velocity(p, gradient * (place(p) - centre) * DX);
        p.affine = gradient.to_cols_array_2d().map(|c| c.map(|x| x as f32));
    }
    snapshot(room([extent; 3], Wall::Separate), *material, particles)
}

/// What became of clay pressed to a sheet.
struct Sheet {
    /// Greatest share of cells inside the clay that held no particle, on the way [%].
    holes: f64,
    /// Least principal elastic stretch of any particle, on the way [-].
    stretch: f64,
}

/// A square bar of 2 `half` cells an edge, pressed by a plate on a slip floor in plane strain until it is 20
/// times as long as thick, by volume. The half at x > 0 is computed, of clay as scenes fill it: a lattice
/// moved by up to a quarter of its spacing. The plate thins it at a constant rate, at which `inertia` is rho
/// V^2 / k at the ends at last.
fn press(half: i32, contact: Contact, inertia: f64) -> Sheet {
    const THICKNESS: i32 = 4;
    const ASPECT: f64 = 20.0;
    const FRAME: u32 = 32;
    let material = Preset::SoftClay.material();
    let area = f64::from(4 * half * half);
    // The half length L / 2 at L^2 / area = ASPECT.
    let end = (ASPECT * area).sqrt() / 2.0;
    let walls = Walls { low: [Wall::Slip; 3], high: [Wall::Slip; 3] };
    let room = [(end / 4.0).ceil() as i32 * 4 + 4, 2 * half + 8, THICKNESS];
    let domain = room_with(room, walls);
    let mut particles = block(DVec3::ZERO, IVec3::new(half, 2 * half, THICKNESS));
    jitter(&mut particles, 0.25 * 0.5, 7);
    let mut lab = Lab::new(&snapshot(domain, material, particles), stable_step(&material));
    lab.plan.volume_averaging = VOLUME_AVERAGING;
    let seconds = f64::from(FRAME) * lab.plan.dt;
    let rate = (inertia * material.shear_strength() / material.density).sqrt() / (end * DX);
    let mut height = f64::from(2 * half);
    // The plate covers the room; its face acts where the clay's surface is.
    let plate = DVec3::new(f64::from(room[0]) + 4.0, 4.0, f64::from(THICKNESS));
    let at = DVec3::new(0.0, height + plate.y, 0.5 * f64::from(THICKNESS));
    let mut mover = Mover::new(&domain, ToolShape::Box { half_size: plate }, contact, at, DQuat::IDENTITY);
    let mut found = Sheet { holes: 0.0, stretch: 1.0 };
    loop {
        let drop = -height * (-rate * seconds).exp_m1();
        mover.velocity = DVec3::NEG_Y * drop * DX / seconds;
        let mut is_sound = true;
        for _ in 0..5 {
            let report = lab.frame_moving(FRAME, &mut mover);
            is_sound &= report.health.is_ok() && report.clamped == 0;
            height -= drop;
        }
        let particles = lab.particles();
        if !is_sound || height < 1.0 {
            return Sheet { holes: f64::NAN, stretch: f64::NAN };
        }
        found.holes = found.holes.max(holes(&particles, height));
        found.stretch = particles.iter().map(least_stretch).fold(found.stretch, f64::min);
        let reach = particles.iter().map(|p| place(p).x).fold(0.0, f64::max);
        if reach > end {
            return found;
        }
    }
}

/// Share [%] of the cells below `height` [cells] that hold no particle though one lies further out in their
/// row along x.
fn holes(particles: &[Particle], height: f64) -> f64 {
    let filled: HashSet<[i32; 3]> = particles.iter().map(|p| place(p).floor().as_ivec3().to_array()).collect();
    let mut rows: HashMap<[i32; 2], (i32, i32)> = HashMap::new();
    for &[x, y, z] in filled.iter().filter(|cell| cell[1] < height.floor() as i32) {
        let (last, count) = rows.entry([y, z]).or_default();
        *last = x.max(*last);
        *count += 1;
    }
    let (inside, full) = rows.values().fold((0, 0), |s, (last, count)| (s.0 + last + 1, s.1 + count));
    100.0 * (1.0 - f64::from(full) / f64::from(inside))
}

/// Least singular value of a particle's elastic deformation gradient [-].
fn least_stretch(particle: &Particle) -> f64 {
    let [xx, yy, zz, xy, xz, yz] = particle.elastic_strain.map(f64::from);
    let strain = DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz));
    (1.0 + Spectrum::of(strain).values.min_element()).sqrt()
}

/// Rows of clay pressed to 20 : 1. At yield the least stretch is `exp(-sY / (3 mu)) = 0.983`, times that of
/// the pressure: under friction J is down to 0.945 in the middle of the sheet, 0.981. No figure was asked
/// for; at 0.9 a particle would hold six times the strain of yield.
pub fn pressed(size: Size) -> Vec<Row> {
    let rows = |name: &str, contact: Contact| {
        let (half, inertia) = size.pick((6, 0.5), (6, 0.5), (9, 0.05));
        let sheet = press(half, contact, inertia);
        [
            Row::at_most(format!("pressed to 20:1, {name}: cells inside without a particle"), sheet.holes, "%", 1.0),
            Row::at_least(format!("pressed to 20:1, {name}: least elastic stretch"), sheet.stretch, "-", 0.9),
        ]
    };
    let mut found = rows("friction 0.3", Contact::default()).to_vec();
    if size == Size::Full {
        found.extend(rows("no friction", Contact::Slip));
    }
    found
}

/// A bar, pressed between slip walls along y and z and free along x, moves 20 cells along x: its stress stays
/// what it is.
pub fn crossing(size: Size) -> Vec<Row> {
    let material = elastic(0.3);
    let (mu, lambda) = (material.lame_mu(), material.lame_lambda());
    // Hencky strains with no stress along x: (2 mu + lambda) h_x + 2 lambda h = 0.
    let h = -0.02;
    let along = -2.0 * lambda * h / (2.0 * mu + lambda);
    let strain = [along, h, h].map(|h: f64| (2.0 * h).exp_m1() as f32);
    let stress = 2.0 * mu * h + lambda * (along + 2.0 * h);
    let length = 12;
    let mut particles = block(DVec3::new(2.0, 0.0, 0.0), IVec3::new(length, 4, 4));
    let speed = 0.02;
    let dt = wave_step(&material, 0.4);
    for p in &mut particles {
        p.elastic_strain[..3].copy_from_slice(&strain);
        p.rest_volume /= (along + 2.0 * h).exp() as f32;
        set_velocity(p, DVec3::X * speed * DX / dt);
    }
    // The middle third: the ends' own waves are not the subject.
    let is_seen: Vec<bool> = particles.iter().map(|p| (place(p).x - 8.0).abs() < 2.0).collect();
    let walls = Walls { low: [Wall::Separate, Wall::Slip, Wall::Slip], high: [Wall::Separate, Wall::Slip, Wall::Slip] };
    let mut lab = Lab::new(&snapshot(room_with([length + 24, 4, 4], walls), material, particles), dt);
    let (mut sum, mut square, mut count, mut moved) = (0.0, 0.0, 0.0, 0.0);
    let frames = size.pick(50, 143, 143);
    for _ in 0..frames {
        lab.frame(7);
        for (p, _) in lab.particles().iter().zip(&is_seen).filter(|(_, seen)| **seen) {
            let hencky = [0, 1, 2].map(|i| 0.5 * f64::from(p.elastic_strain[i]).ln_1p());
            let found = 2.0 * mu * hencky[1] + lambda * hencky.iter().sum::<f64>();
            sum += found;
            square += (found - stress).powi(2);
            count += 1.0;
        }
        moved += 7.0 * speed;
    }
    let noise = (square / count).sqrt() / stress.abs();
    vec![
        Row::at_most(format!("cell crossing: stress noise over {moved:.0} cells"), 100.0 * noise, "% rms", 1.0),
        Row::at_most("cell crossing: mean stress", 100.0 * (sum / count / stress - 1.0).abs(), "%", 1.0),
    ]
}

/// Clay that fell on a floor from several heights and came to rest lies on it.
pub fn rest(size: Size) -> Vec<Row> {
    let heights: &[f64] = size.pick(&[2.0], &[2.0], &[0.1, 0.4, 0.7, 1.0, 2.0]);
    let rows_of = |(wall, name): (Wall, &str)| {
        let rests: Vec<(f64, f64)> = heights.iter().map(|&h| lie(wall, h)).collect();
        let greatest = |f: fn(&(f64, f64)) -> f64| rests.iter().map(f).fold(f64::NEG_INFINITY, f64::max);
        [
            Row::at_most(format!("rest: gap above a {name} floor"), greatest(|r| r.0), "cells", 0.1),
            Row::at_most(format!("rest: speed on a {name} floor"), greatest(|r| r.1), "m/s", 1e-3),
        ]
    };
    [(Wall::Separate, "separating"), (Wall::Slip, "slip"), (Wall::Stick, "stick")].into_iter().flat_map(rows_of).collect()
}

/// Gap [cells] below a block that fell from `height` [cells], and its speed [m/s], at rest.
fn lie(wall: Wall, height: f64) -> (f64, f64) {
    let material = Preset::SoftClay.material();
    let walls = Walls { low: [Wall::Separate, wall, Wall::Separate], high: [Wall::Separate; 3] };
    let particles = block(DVec3::new(3.0, height, 3.0), IVec3::splat(6));
    let is_bottom: Vec<bool> = particles.iter().map(|p| place(p).y < height + 0.5).collect();
    let mut lab = Lab::new(&snapshot(room_with([12, 12, 12], walls), material, particles), stable_step(&material));
    lab.plan.gravity = DVec3::new(0.0, -9.81, 0.0);
    // Falls at most at 0.05 m/s, 8 mm within the time.
    lab.plan.validation.damping = 200.0;
    let report = (0..40).map(|_| lab.frame(100)).last().unwrap_or_default();
    // A quarter of a cell of clay lies below the particles of the lowest layer.
    let gaps = lab
        .particles()
        .iter()
        .zip(&is_bottom)
        .filter(|(_, b)| **b)
        .map(|(p, _)| place(p).y - 0.25)
        .fold(f64::NEG_INFINITY, f64::max);
    (gaps, report.momentum.length() / report.particle_mass)
}
