//! Nodes to particles: affine transfers (APIC, Jiang et al. 2015) with quadratic splines that lose nothing at
//! once (Fei et al. 2021, ACM TOG 40:176), advection, and the clay law.
//!
//! `v+ = sum w v_i`, `C+ = 4 / dx^2 sum w v_i (x_i - x_p)^T dx`, each from the field of the particle's own
//! class; `x += h v+ / dx`; the room's walls stop `x`. The yield stress of the [law](super::law), which
//! takes `C+`, is that of the new `x`, with the tools at `t + h`, and of the hardening and the working
//! before.
//!
//! With `v-`, `C-` gathered alike from the velocities before ([`p2g`](super::p2g)), `r = v - v-` is what
//! nodes do not see of the particle, and a share `a` of it stays
//! ([`velocity_kept`](super::super::frame::FramePlan::velocity_kept)): `v = v+ + a r`,
//! `C = C+ + a (C - C-) + W`, where `W y = w x y`, `w = -(2 h a / dx^2) v+ x r`: momentum `m r` that moves
//! with `v+` takes its spin from the particle, so that angular momentum stays.
//!
//! Why: with a = 0 each substep takes a part of what the particles have beyond the nodes, however short it
//! is, and drag grows without end as h shrinks (a ball pressed in: 2.51, 2.71, 3.06 N at h, h/3, h/9;
//! without, 2.35 N at each). Particles that moved with `v` would never come to rest relative to each other.

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
    let kept = around.plan.velocity_kept(cell_width, dt);
    for particle in particles {
        let (after, before) = seen(particle, grid, around, frame);
        particle.way = after.velocity * (dt / cell_width);
        particle.position = around.in_room(particle.position + particle.way);

        let material = &around.plan.material;
        let yield_stress = around.yield_stress(particle, Moment::End);
        let update = law::advance(material, yield_stress, dt, particle.elastic_strain, after.affine * dt);
        particle.elastic_strain = update.elastic_strain;
        particle.hardening += update.plastic_strain;
        particle.flowed += update.plastic_strain;
        particle.structure = material.structure_after(particle.structure, update.plastic_strain, dt);
        frame.clamped += u64::from(update.is_clamped);

        let unseen = kept * (particle.velocity - before.velocity);
        let spin = after.velocity.cross(unseen) * (-2.0 * dt / (cell_width * cell_width));
        let turning = DMat3::from_cols(spin.cross(DVec3::X), spin.cross(DVec3::Y), spin.cross(DVec3::Z));
        particle.velocity = after.velocity + unseen;
        particle.affine = after.affine + (particle.affine - before.affine) * kept + turning;
    }
}

/// What nodes have at a particle: velocity [m/s] and affine velocity [1/s].
#[derive(Clone, Copy, Debug)]
struct Seen {
    velocity: DVec3,
    affine: DMat3,
}

impl Seen {
    const NOTHING: Self = Self { velocity: DVec3::ZERO, affine: DMat3::ZERO };

    fn add(&mut self, arm: DVec3, v: DVec3) {
        self.velocity += v;
        self.affine += DMat3::from_cols(v * arm.x, v * arm.y, v * arm.z);
    }
}

/// What the clay of the particle's class has at its position after the nodes' update, and what it came with.
fn seen(particle: &Particle, grid: &Grid, around: &Surroundings, frame: &mut FrameReport) -> (Seen, Seen) {
    let (mut after, mut before) = (Seen::NOTHING, Seen::NOTHING);
    let key = particle.key();
    // sum w arm arm^T = I / 4 in cells^2.
    let per_arm = 4.0 / around.domain.cell_width;
    for touch in stencil(particle.position) {
        let Some(node) = grid.get(touch.node) else { continue };
        let velocity = match node.field(key) {
            Some(field) => field.velocity,
            None => ghost::velocity(particle, touch, node, around, frame),
        };
        after.add(touch.arm * per_arm, touch.weight * velocity);
        before.add(touch.arm * per_arm, touch.weight * node.classes.velocity_before(key).unwrap_or(DVec3::ZERO));
    }
    (after, before)
}
