//! Nodes to particles: APIC (Jiang et al. 2015) with quadratic splines, advection, and the clay law.
//!
//! `v = sum w v_i`, `C = 4 / dx^2 sum w v_i (x_i - x_p)^T dx`, each from the field of the particle's own
//! class; `x += h v / dx`; the room's walls stop `x`. The yield stress of the [law](super::law) is that of
//! the new `x`, with the tools at `t + h`, and of the hardening and the working before.

use super::super::frame::FrameReport;
use super::grid::Grid;
use super::particle::Particle;
use super::stencil::stencil;
use super::tools::{Moment, Surroundings};
use super::{ghost, law};
use glam::{DMat3, DVec3};

/// Moves the particles with the nodes.
pub(super) fn gather(particles: &mut [Particle], grid: &Grid, around: &Surroundings, frame: &mut FrameReport) {
    let dt = around.plan.dt;
    let cell_width = around.domain.cell_width;
    for particle in particles {
        (particle.velocity, particle.affine) = velocity_and_affine(particle, grid, around, frame);
        particle.position = around.in_room(particle.position + particle.velocity * (dt / cell_width));

        let material = &around.plan.material;
        let yield_stress = around.yield_stress(particle, Moment::End);
        let update = law::advance(material, yield_stress, dt, particle.elastic_strain, particle.affine * dt);
        particle.elastic_strain = update.elastic_strain;
        particle.hardening += update.plastic_strain;
        particle.structure = material.structure_after(particle.structure, update.plastic_strain, dt);
        frame.clamped += u64::from(update.is_clamped);
    }
}

/// Velocity [m/s] and affine velocity [1/s] of the clay of the particle's class at its position.
fn velocity_and_affine(particle: &Particle, grid: &Grid, around: &Surroundings, frame: &mut FrameReport) -> (DVec3, DMat3) {
    let (mut velocity, mut affine) = (DVec3::ZERO, DMat3::ZERO);
    let key = particle.key();
    for touch in stencil(particle.position) {
        let Some(node) = grid.get(touch.node) else { continue };
        let v = touch.weight
            * match node.field(key) {
                Some(field) => field.velocity,
                None => ghost::velocity(particle, touch, node, around, frame),
            };
        velocity += v;
        affine += DMat3::from_cols(v * touch.arm.x, v * touch.arm.y, v * touch.arm.z);
    }
    (velocity, affine * (4.0 / around.domain.cell_width))
}
