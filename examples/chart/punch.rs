//! Prandtl's punch: a rough strip pressed into weightless clay, in plane strain, half of it by symmetry.

use super::knobs::Setting;
use super::lab::{DX, Lab, Mover, lattice, room_with, snapshot};
use bevy_clay::sim::prelude::*;
use bevy_clay::sim::tool::CONTACT_OFFSET;
use glam::{DQuat, DVec3, IVec3};
use std::f64::consts::PI;

/// Bearing factor of a strip on a half-space: `q = (2 + pi) k` (Prandtl 1920).
const FACTOR: f64 = 2.0 + PI;
/// Shear strength k [Pa]. Only ratios to it matter.
const STRENGTH: f64 = 5e3;
/// Rigidity index G / k [-]: the factor is that of rigid clay to a few per cent, and the step is that of stiff clay.
const RIGIDITY: f64 = 100.0;
/// Poisson's ratio [-]: where plain MPM begins to lock.
const POISSON: f64 = 0.45;
/// Speed over the shear wave's speed [-]: `rho V^2 / k = 4e-4`.
const SPEED: f64 = 0.002;
/// How deep the strip goes, and from where on its force counts, over its width B.
const DEPTHS: [f64; 2] = [0.1, 0.06];
/// Substeps of a frame.
const STEPS: u32 = 32;

/// What a run gave.
pub(crate) struct Bearing {
    /// Mean of F / (B k) over the counted way, less 2 + pi, over 2 + pi [-]. B is as drawn.
    pub(crate) error: f64,
    /// Particles.
    pub(crate) particles: usize,
    /// What the frames reported, in order.
    pub(crate) reports: Vec<FrameReport>,
}

fn material() -> ClayMaterial {
    let young_modulus = 2.0 * RIGIDITY * STRENGTH * (1.0 + POISSON);
    ClayMaterial { young_modulus, poisson_ratio: POISSON, yield_stress: 3f64.sqrt() * STRENGTH, ..Preset::SoftClay.material() }
}

/// Half of the clay about a strip of `width` cells: six times as wide as the strip, twice as deep, and as thick as it is wide.
pub(crate) fn size(width: i32) -> IVec3 {
    IVec3::new(3 * width, 2 * width, width)
}

/// Presses a strip of `setting.cells` cells in.
pub(crate) fn press(setting: &Setting) -> Bearing {
    let material = material();
    let (size, b) = (size(setting.cells), f64::from(setting.cells));
    let walls = Walls { low: [Wall::Slip, Wall::Stick, Wall::Slip], high: [Wall::Slip; 3] };
    let domain = room_with([size.x, size.y + 4, size.z], walls);
    let particles = lattice(DVec3::ZERO, size, setting.per_axis);
    let count = particles.len();
    let dt = setting.fraction * material.time_step_limit(DX, material.density);
    let mut lab = Lab::new(&snapshot(domain, material, particles), dt);
    lab.plan.volume_averaging = setting.volume_averaging;
    lab.plan.validation.clamped_walls = setting.clamped_walls;
    // The strip starts where it first touches the nodes of the clay's surface: the way counts from the first contact.
    let shape = ToolShape::Box { half_size: DVec3::new(b / 2.0, 2.0, b) };
    let start = DVec3::new(0.0, f64::from(size.y) + 2.0 + CONTACT_OFFSET - 1e-6, f64::from(size.z) / 2.0);
    let mut strip = Mover::new(&domain, shape, Contact::Stick, start, DQuat::IDENTITY);
    let speed = SPEED * (material.lame_mu() / material.density).sqrt();
    let (mut way, mut forces, mut reports) = (0.0, vec![], vec![]);
    while way < DEPTHS[0] * b * DX {
        // From rest to full speed over the first fifth.
        let frame_way = speed * dt * f64::from(STEPS);
        let ramp = (f64::from(reports.len() as u32 + 1) * frame_way / (0.2 * DEPTHS[0] * b * DX)).min(1.0);
        strip.velocity = DVec3::NEG_Y * ramp * speed;
        let report = lab.frame_moving(STEPS, &mut strip);
        way += ramp * frame_way;
        if way > DEPTHS[1] * b * DX {
            forces.push(report.tools[0].force.y);
        }
        reports.push(report);
    }
    let area = b / 2.0 * f64::from(size.z) * DX * DX;
    let factor = forces.iter().sum::<f64>() / forces.len() as f64 / (area * STRENGTH);
    Bearing { error: factor / FACTOR - 1.0, particles: count, reports }
}
