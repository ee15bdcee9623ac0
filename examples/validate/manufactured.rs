//! A manufactured solution: clay that fills a box and moves as a closed form says, under the body force that this takes.

use crate::lab::{DX, Lab, Size, elastic, lattice, place, room, set_velocity, snapshot, wave_step};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use bevy_clay::sim::validation::Manufactured;
use glam::{DVec3, IVec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Relative L2 error of the displacement after half a period, in a box of `cells` cells an edge.
fn error(cells: i32, amplitude: f64, per_axis: i32) -> f64 {
    let material = elastic(0.3);
    let domain = room([cells; 3], Wall::Slip);
    let length = f64::from(cells) * DX;
    // Phases of no symmetry: at no time do the axes rest or peak together.
    let case = Manufactured { amplitude, length, low: domain.corners().0, phases: DVec3::new(0.0, 1.0, 2.2), time: 0.0 };
    let omega = case.frequency(&material);
    let steps = (PI / omega / wave_step(&material, 0.3)).ceil();
    let dt = PI / omega / steps;
    let mut particles = lattice(DVec3::ZERO, IVec3::splat(cells), per_axis);
    let rest: Vec<DVec3> = particles.iter().map(|p| place(p) * DX).collect();
    // The motion a quarter of a period on: stretches turn into their rates.
    let ahead = Manufactured { phases: case.phases + FRAC_PI_2, ..case };
    for (p, &x) in particles.iter_mut().zip(&rest) {
        p.set_grid(p.grid() + case.motion(&material, x, 0.0).0 / DX);
        // Symplectic steps hold velocities of half a step before the places.
        set_velocity(p, case.motion(&material, x, -0.5 * dt).1);
        let rate = (ahead.stretches(&material, x, -0.5 * dt) - 1.0) * omega / case.stretches(&material, x, -0.5 * dt);
        let strain = case.stretches(&material, x, 0.0).powf(2.0) - 1.0;
        for axis in 0..3 {
            p.affine[axis][axis] = rate[axis] as f32;
            p.elastic_strain[axis] = strain[axis] as f32;
        }
    }
    let mut lab = Lab::new(&snapshot(domain, material, particles), dt);
    lab.plan.validation.manufactured = Some(case);
    let report = lab.frame(steps as u32);
    if !report.health.is_ok() {
        return f64::NAN;
    }
    let (mut wrong, mut all) = (0.0, 0.0);
    for (p, &x) in lab.particles().iter().zip(&rest) {
        let exact = case.motion(&material, x, f64::from(report.steps) * dt).0;
        wrong += (place(p) * DX - x - exact).length_squared();
        all += exact.length_squared();
    }
    (wrong / all).sqrt()
}

/// Order of accuracy: the slope of the line through the errors' logarithms.
fn order(cells: &[i32], amplitude: f64, per_axis: i32) -> f64 {
    let points: Vec<(f64, f64)> = cells.iter().map(|&n| (f64::from(n).ln(), error(n, amplitude, per_axis).ln())).collect();
    let count = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 / count, s.1 + p.1 / count));
    let (xy, xx) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + (p.0 - x) * (p.1 - y), s.1 + (p.0 - x).powi(2)));
    -xy / xx
}

/// Small and large deformation. Large: stretches of 0.69 to 1.31 take 8 particles per cell so far apart that their sum in place of the integral makes a force
/// on each node that only falls with dx; with 27 it is an eighth of that.
pub(crate) fn solution(size: Size) -> Vec<Row> {
    let cells = |quick| size.pick(&[8, 16][..], quick, &[16, 32, 64]);
    vec![
        Row::at_least("manufactured solution: order, amplitude 0.01", order(cells(&[16, 32]), 0.01, 2), "-", 1.8),
        Row::at_least("manufactured solution: order, amplitude 0.1, 27 per cell", order(cells(&[16, 24]), 0.1, 3), "-", 1.5),
        Row::at_least("manufactured solution: order to 32 cells, amplitude 0.1, 8 per cell", order(&[16, 32], 0.1, 2), "-", 1.5),
    ]
}
