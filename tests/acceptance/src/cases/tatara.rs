//! An elastic ball between two flat rigid plates, as an octant between slip walls.
//!
//! Hertz's half space has no end; of a ball between two plates each contact feels the other, which Tatara
//! added (1991, "On compression of rubber elastic sphere over a large range of displacements", J. Eng. Mater.
//! Technol. 113): at depths of 1 to 5 % of the radius the force is 6 to 12 % above Hertz's, so that Hertz's
//! own formula is no measure for it.

use crate::lab::{DX, Lab, Mover, carved, elastic, room_with, snapshot, wave_step};
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3};
use std::f64::consts::PI;

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
