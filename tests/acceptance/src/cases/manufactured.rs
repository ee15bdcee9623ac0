//! A manufactured solution: clay that fills a box and moves as a closed form says, under the body force that
//! this takes.

use crate::lab::{DX, Lab, Size, at_walls, elastic, lattice, place, room, set_velocity, snapshot, wave_step};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use bevy_clay::sim::validation::Manufactured;
use glam::{DVec3, IVec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// The axes that move: each axis of the solution depends on its own coordinate only, so that a slice 4 cells
/// thick shows what a cube does.
#[derive(Clone, Copy)]
enum Axes {
    Two,
    Three,
}

/// Relative L2 error of the displacement after half a period, in a box of `cells` cells an edge.
fn error(axes: Axes, cells: i32, amplitude: f64, per_axis: i32) -> f64 {
    let material = elastic(0.3);
    let (size, moves) = match axes {
        Axes::Two => ([cells, cells, 4], DVec3::new(1.0, 1.0, 0.0)),
        Axes::Three => ([cells; 3], DVec3::ONE),
    };
    let domain = room(size, Wall::Slip);
    let length = f64::from(cells) * DX;
    // Phases of no symmetry: at no time do the axes rest or peak together.
    let phases = DVec3::new(0.0, 1.0, 2.2);
    let case = Manufactured { amplitudes: amplitude * moves, length, low: domain.corners().0, phases, time: 0.0 };
    let omega = case.frequency(&material);
    let steps = (PI / omega / wave_step(&material, 0.3)).ceil();
    let dt = PI / omega / steps;
    let mut particles = lattice(DVec3::ZERO, IVec3::from_array(size), per_axis);
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
    at_walls(&domain, &mut particles);
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
fn order(axes: Axes, cells: &[i32], amplitude: f64, per_axis: i32) -> f64 {
    let errors = cells.iter().map(|&n| (f64::from(n).ln(), error(axes, n, amplitude, per_axis).ln()));
    let points: Vec<(f64, f64)> = errors.collect();
    let count = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 / count, s.1 + p.1 / count));
    let (xy, xx) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + (p.0 - x) * (p.1 - y), s.1 + (p.0 - x).powi(2)));
    -xy / xx
}

/// Small and large deformation.
///
/// Large with 8 per cell does not converge. The particles' sum in place of the integral lets their distances
/// and their strains drift apart while they cross cells, where stretches are 0.7 to 1.3 by a strain of 1.3e-4
/// a cell, whatever dx (one dimension, f64, 64 to 256 cells). The cells crossed grow as 1 / dx, and so does
/// the error beyond 32 cells. A start at rest (u = 0) or a third of the time step change little; spline
/// gradients in place of C, in force, strain or both, are worse. 27 per cell drift a thirtieth as far: order
/// 1.9 to 64 cells.
pub fn solution(size: Size) -> Vec<Row> {
    let cells = size.pick(&[8, 16][..], &[16, 32], &[16, 32, 64]);
    let mut rows = vec![
        Row::at_least("manufactured solution: order, amplitude 0.01", order(Axes::Two, cells, 0.01, 2), "-", 1.8),
        Row::at_least("manufactured solution: order, amplitude 0.1, 27 per cell", order(Axes::Two, cells, 0.1, 3), "-", 1.5),
    ];
    let coarse = |cells| order(Axes::Two, cells, 0.1, 2);
    if size == Size::Full {
        let cube = order(Axes::Three, &[16, 32], 0.01, 2);
        rows.push(Row::at_least("manufactured solution: order to 32 cells, three axes, amplitude 0.01", cube, "-", 1.8));
        let case = "manufactured solution: order to 64 cells, amplitude 0.1, 8 per cell";
        rows.push(Row::at_least(case, coarse(cells), "-", 1.5));
    } else {
        let case = "manufactured solution: order to 32 cells, amplitude 0.1, 8 per cell";
        rows.push(Row::at_least(case, coarse(&[16, 32]), "-", 1.5));
    }
    rows
}
