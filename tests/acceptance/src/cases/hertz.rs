//! Hertz's contact: an elastic ball between two flat rigid plates, as an octant between slip walls.
//!
//! Hertz's half space has no end; of a ball between two plates each contact feels the other, which Tatara
//! added (1991, "On compression of rubber elastic sphere over a large range of displacements", J. Eng. Mater.
//! Technol. 113): at depths of 1 to 5 % of the radius the force is 6 to 12 % above Hertz's.

use crate::lab::{DX, Lab, Mover, Size, carved, elastic, room_with, snapshot, wave_step};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3};
use std::f64::consts::PI;

/// Radius of the ball [cells].
const RADIUS: f64 = 32.0;
/// How far a plate is pressed in, of the radius.
const DEPTHS: [f64; 7] = [0.0125, 0.01875, 0.025, 0.03125, 0.0375, 0.04375, 0.05];

/// Depth \[cells\], force of a plate at rest \[N\] and Tatara's, at each depth, of an elastic ball of `radius`
/// \[cells\]; none if it did not stay sound.
pub fn octant(radius: f64) -> Vec<[f64; 3]> {
    let material = elastic(0.3);
    let found = forces(&material, radius).unwrap_or_default();
    DEPTHS.iter().zip(found).map(|(d, force)| [d * radius, force, tatara(&material, radius, d * radius)]).collect()
}

/// Force of a plate [N] at each depth, at rest.
fn forces(material: &ClayMaterial, radius: f64) -> Option<Vec<f64>> {
    let walls = Walls { low: [Wall::Slip; 3], high: [Wall::Separate; 3] };
    let cells = (radius.ceil() as i32 + 7) / 4 * 4;
    let domain = room_with([cells; 3], walls);
    let particles = carved(glam::IVec3::splat(cells), &|x| x.length() < radius);
    let mut lab = Lab::new(&snapshot(domain, *material, particles), wave_step(material, 0.35));
    // Slowest wave: to the far plate and back, twice. Damped to 0.7 of critical.
    let period = 4.0 * radius * DX / material.wave_speed(material.density);
    lab.plan.validation.damping = 1.4 * 2.0 * PI / period;
    let steps = |periods: f64| (periods * period / lab.plan.dt) as u32;
    let (move_steps, rest_steps, mean_steps) = (steps(0.5), steps(1.0), steps(0.25));
    let plate = ToolShape::Box { half_size: DVec3::new(radius, 2.0, radius) };
    let contact = Contact::Separate { friction: 0.0 };
    let mut mover = Mover::new(&domain, plate, contact, DVec3::Y * (radius + 2.5), DQuat::IDENTITY);
    let mut found = vec![];
    let mut at = -0.5;
    for depth in DEPTHS {
        let way = (depth * radius - at) * DX;
        at = depth * radius;
        mover.velocity = DVec3::NEG_Y * way / (f64::from(move_steps) * lab.plan.dt);
        let mut health = lab.frame_moving(move_steps, &mut mover).health;
        mover.velocity = DVec3::ZERO;
        health.insert(lab.frame_moving(rest_steps, &mut mover).health);
        let report = lab.frame_moving(mean_steps, &mut mover);
        health.insert(report.health);
        if !health.is_ok() {
            return None;
        }
        // A quarter of each plate's contact lies in the octant.
        found.push(4.0 * report.tools[0].force.y);
    }
    Some(found)
}

/// Force [N] of a plate pressed `depth` [cells] into the ball: Hertz's `d = (F / (4/3 E* sqrt(R)))^(2/3)`,
/// less what the far plate's force lifts the contact, `F f(a) / (pi E)` with
/// `f(a) = 2 (1 + nu) R^2 / (a^2 + 4 R^2)^1.5 + (1 - nu^2) / (a^2 + 4 R^2)^0.5` and
/// `a^3 = 3 (1 - nu^2) F R / (4 E)`.
fn tatara(material: &ClayMaterial, radius: f64, depth: f64) -> f64 {
    let (e, nu, r) = (material.young_modulus, material.poisson_ratio, radius * DX);
    let compliance = 1.0 - nu * nu;
    let depth_under = |force: f64| {
        let a = (0.75 * compliance * force * r / e).cbrt();
        let far = a * a + 4.0 * r * r;
        a * a / r - force / (PI * e) * (2.0 * (1.0 + nu) * r * r / far.powf(1.5) + compliance / far.sqrt())
    };
    // By bisection, up to a ball pressed flat.
    let (mut low, mut high) = (0.0, 4.0 * e * r * r);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if depth_under(middle) < depth * DX { low = middle } else { high = middle }
    }
    low
}

/// Greatest difference of the forces to `exact(d + offset)`, of that.
fn worst(forces: &[f64], exact: &dyn Fn(f64) -> f64, offset: f64) -> f64 {
    DEPTHS.iter().zip(forces).map(|(d, f)| (f / exact(d * RADIUS + offset) - 1.0).abs()).fold(0.0, f64::max)
}

/// Offset [cells] at which that is least.
fn fit_offset(forces: &[f64], exact: &dyn Fn(f64) -> f64) -> f64 {
    let offsets = (-399..=1000).map(|i| f64::from(i) * 1e-3);
    let misfit = |offset: &f64| worst(forces, exact, *offset);
    offsets.min_by(|a, b| misfit(a).total_cmp(&misfit(b))).unwrap_or(f64::NAN)
}

/// Slope of the line through the logarithms of depth and force: no offset is fitted.
fn exponent(forces: &[f64]) -> f64 {
    let points: Vec<(f64, f64)> = DEPTHS.iter().zip(forces).map(|(d, f)| (d.ln(), f.ln())).collect();
    let n = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 / n, s.1 + p.1 / n));
    let (xy, xx) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + (p.0 - x) * (p.1 - y), s.1 + (p.0 - x).powi(2)));
    xy / xx
}

/// Exponent, offset and force: against Hertz's half space, as it stands in the books, and against the ball
/// between two plates.
pub fn contact(size: Size) -> Vec<Row> {
    if size != Size::Full {
        return vec![];
    }
    let material = elastic(0.3);
    let found = forces(&material, RADIUS).unwrap_or_else(|| vec![f64::NAN; DEPTHS.len()]);
    let modulus = material.young_modulus / (1.0 - material.poisson_ratio.powi(2));
    let hertz = |depth: f64| 4.0 / 3.0 * modulus * (RADIUS * DX).sqrt() * (depth * DX).powf(1.5);
    let ball = |depth: f64| tatara(&material, RADIUS, depth);
    let [to_hertz, to_ball] = [&hertz as &dyn Fn(f64) -> f64, &ball].map(|exact| (exact, fit_offset(&found, exact)));
    vec![
        Row::at_most("Hertz: exponent of the force, off 1.5 by", (exponent(&found) - 1.5).abs(), "-", 0.05),
        Row::at_most("Hertz: contact offset", to_hertz.1.abs(), "cells", 0.5),
        Row::at_most("Hertz: force", worst(&found, to_hertz.0, to_hertz.1), "relative", 0.05),
        Row::at_most("ball between plates: contact offset", to_ball.1.abs(), "cells", 0.5),
        Row::at_most("ball between plates: force", worst(&found, to_ball.0, to_ball.1), "relative", 0.05),
    ]
}
