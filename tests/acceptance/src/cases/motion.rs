//! Bodies that nothing touches: free fall, a turning block.

use crate::lab::{DX, Lab, Size, block, elastic, place, room, set_velocity, snapshot, velocity, wave_step, world};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};

/// A block falls: explicit symplectic steps give `y = g t (t + dt) / 2`, to rounding.
pub fn free_fall(_: Size) -> Vec<Row> {
    let domain = room([8, 20, 8], Wall::Separate);
    let material = elastic(0.3);
    let particles = block(DVec3::new(2.0, 14.0, 2.0), IVec3::splat(4));
    let mut lab = Lab::new(&snapshot(domain, material, particles), wave_step(&material, 0.4));
    let gravity = DVec3::new(0.7, -9.81, -1.3);
    lab.plan.gravity = gravity;
    let before = lab.particles();
    let (frames, steps) = (10, 80);
    let mut report = FrameReport::default();
    for _ in 0..frames {
        report = lab.frame(steps);
    }
    let dt = lab.plan.dt;
    let time = dt * f64::from(frames * steps);
    let fall = gravity * time * (time + dt) / 2.0;
    let after = lab.particles();
    let moved = |(a, b): (&Particle, &Particle)| ((b.grid() - a.grid()) * DX - fall).length() / fall.length();
    let error = before.iter().zip(&after).map(moved).fold(0.0, f64::max);
    let momentum = material.density * block_volume(&before) * gravity * time;
    vec![
        Row::at_most("free fall: displacement error", error, "relative", 1e-5),
        Row::at_most("free fall: momentum error", (report.momentum - momentum).length() / momentum.length(), "relative", 1e-5),
        Row::at_most("free fall: momentum balance of a frame", report.balance_error(), "relative", 1e-5),
    ]
}

fn block_volume(particles: &[Particle]) -> f64 {
    particles.iter().map(|p| f64::from(p.rest_volume)).sum()
}

/// Angular momentum [kg m^2/s] about `centre` [m] and kinetic energy [J], with the affine parts of quadratic
/// splines.
fn spin(domain: &Domain, centre: DVec3, density: f64, particles: &[Particle]) -> (DVec3, f64) {
    let inertia = DX * DX / 4.0;
    particles.iter().fold((DVec3::ZERO, 0.0), |(l, k), p| {
        let mass = density * f64::from(p.rest_volume);
        let [cx, cy, cz] = p.affine.map(|c| DVec3::from_array(c.map(f64::from)));
        let curl = DVec3::new(cy.z - cz.y, cz.x - cx.z, cx.y - cy.x);
        let v = velocity(p);
        let square = v.length_squared() + inertia * (cx.length_squared() + cy.length_squared() + cz.length_squared());
        (l + mass * ((world(domain, place(p)) - centre).cross(v) + inertia * curl), k + 0.5 * mass * square)
    })
}

/// A cube turns once about a tilted axis at 0.005 c / dx.
pub fn rotation(_: Size) -> Vec<Row> {
    let domain = room([20; 3], Wall::Separate);
    let material = elastic(0.3);
    let dt = wave_step(&material, 0.4);
    let omega = DVec3::new(1.0, 2.0, -3.0).normalize() * 0.005 * material.wave_speed(material.density) / DX;
    let mut particles = block(DVec3::splat(6.0), IVec3::splat(8));
    for p in &mut particles {
        set_velocity(p, omega.cross((place(p) - 10.0) * DX));
        // Column c is the velocity's derivative along axis c: omega x e_c.
        p.affine = DVec3::AXES.map(|axis| omega.cross(axis).as_vec3().to_array());
    }
    let centre = world(&domain, DVec3::splat(10.0));
    let (l0, k0) = spin(&domain, centre, material.density, &particles);
    let start = particles.clone();
    let mut lab = Lab::new(&snapshot(domain, material, particles), dt);
    let steps = (std::f64::consts::TAU / (omega.length() * dt)).round() as u32;
    let mut report = FrameReport::default();
    for _ in 0..10 {
        report = lab.frame(steps / 10);
    }
    let after = lab.particles();
    let (l, k) = spin(&domain, centre, material.density, &after);
    let (about_origin, _) = spin(&domain, DVec3::ZERO, material.density, &after);
    let angle = omega.length() * dt * f64::from(steps / 10 * 10);
    let turn = DQuat::from_axis_angle(omega.normalize(), angle);
    let at = |p: &Particle| place(p) - 10.0;
    let miss = start.iter().zip(&after).map(|(a, b)| (at(b) - turn * at(a)).length()).fold(0.0, f64::max);
    vec![
        Row::at_most("rotation: angular momentum over one turn", (l - l0).length() / l0.length(), "relative", 1e-5),
        Row::at_most("rotation: kinetic energy over one turn", (k / k0 - 1.0).abs(), "relative", 5e-4),
        // A turn of 1 % less than it should be would be 0.4 cells.
        Row::at_most("rotation: place after one turn", miss, "cells", 0.1),
        Row::at_most(
            "rotation: angular momentum as reported",
            (report.angular_momentum - about_origin).length() / about_origin.length(),
            "relative",
            1e-6,
        ),
        Row::at_most("rotation: momentum", report.momentum.length() / report.momentum_scale, "relative", 1e-5),
    ]
}
