//! Clay against solid tools and separating walls: the [law of contact](super::super::penalty), particle by
//! particle.
//!
//! For each particle at its place of `t`, and each solid tool of the plan in order at its pose of `t + h`:
//! `g = s(x) - r` with the shape's signed distance and [`reach`] of the rest volume in cells^3, n the
//! shape's outward normal at x. [`Springs`] have `M = lambda + 2 mu` of the plan's material: per cell `A
//! kappa M / dx`, `A k_t M / dx`, and `k A` of the fresh clay's shear strength k, `A` = [`area`] in m^2.
//! The anchor is a place in the tool's frame, kept from substep to substep for as long as they touch; a
//! particle keeps at most [`ANCHORS_MAX`] of them, those of the first tools in the plan's order, and a tool
//! beyond these presses without friction or bond. What is found in several comes out of them in their
//! order. The impulse `h F` goes to the nodes with the particle's own momentum ([`p2g`](super::p2g)),
//! before walls fold; the tool feels `-h F` at x, about its origin at `t + h`. [Walls](super::walls::touch)
//! come after the tools. A growing ball of validation cases has its radius of `t + h`.

use super::super::cutting::CuttingMethod;
use super::super::frame::FrameReport;
use super::super::penalty::{NORMAL_STIFFNESS, STICK_FRICTION, Springs, Surface, TANGENTIAL_STIFFNESS, area, reach};
use super::super::snapshot::ANCHORS_MAX;
use super::particle::Particle;
use super::tools::{Moment, Surroundings};
use super::walls;
use glam::DVec3;

/// The impulse \[N s\] of solid tools and walls on each particle in the substep; moves the anchors and gives
/// the tools the opposite.
pub(super) fn press(particles: &mut [Particle], around: &Surroundings, frame: &mut FrameReport) -> Vec<DVec3> {
    let presses = match around.plan.cutting {
        CuttingMethod::TwoFields | CuttingMethod::Published | CuttingMethod::RigidParticles => true,
        CuttingMethod::InteractiveParticles => false,
    };
    let press = |p: &mut Particle| {
        let springs = springs(p.rest_volume, around);
        let impulse = if presses { press_on(p, &springs, around, frame) } else { DVec3::ZERO };
        impulse + walls::touch(p, &springs, impulse, around, frame)
    };
    particles.iter_mut().map(press).collect()
}

fn press_on(particle: &mut Particle, springs: &Springs, around: &Surroundings, frame: &mut FrameReport) -> DVec3 {
    let cell_width = around.domain.cell_width;
    let world = around.domain.to_world(particle.position);
    let volume = particle.rest_volume / cell_width.powi(3);
    let mass = around.plan.inertial_density() * particle.rest_volume;
    let (mut impulse, mut anchors) = (DVec3::ZERO, vec![]);
    for (tool, felt) in around.tools.iter().zip(&mut frame.tools).filter(|(tool, _)| tool.is_solid()) {
        let (pose, id) = (tool.motion.end, tool.path.id);
        let gap = tool.distance(world, Moment::End) - reach(volume) * cell_width;
        let normal = tool.normal(world);
        let leaving = normal.dot(particle.velocity + impulse / mass - tool.velocity(world));
        let surface = Surface { contact: tool.path.tool.contact, gap, normal, leaving };
        let before = particle.anchors.iter().flatten().find(|anchor| anchor.0 == id);
        let Some(touch) = springs.touch(&surface, world, before.map(|anchor| pose.to_world(anchor.1 * cell_width))) else {
            continue;
        };
        anchors.extend(touch.anchor.map(|at| (id, pose.to_local(at) / cell_width)));
        let given = touch.force * around.plan.dt;
        impulse += given;
        felt.impulse -= given;
        felt.angular_impulse -= (world - pose.position).cross(given);
        felt.contacts += 1;
        frame.impulse_scale += given.length();
    }
    particle.anchors = std::array::from_fn::<_, ANCHORS_MAX, _>(|i| anchors.get(i).copied());
    impulse
}

/// The springs of a particle of rest volume `volume` [m^3], in SI units.
pub(super) fn springs(volume: f64, around: &Surroundings) -> Springs {
    let (material, cell_width) = (&around.plan.material, around.domain.cell_width);
    let modulus = material.lame_lambda() + 2.0 * material.lame_mu();
    let area = area(volume / cell_width.powi(3)) * cell_width * cell_width;
    Springs {
        normal: NORMAL_STIFFNESS * modulus * area / cell_width,
        tangential: TANGENTIAL_STIFFNESS * modulus * area / cell_width,
        strength: material.shear_strength() * area,
        grip: STICK_FRICTION,
        inertia: around.plan.inertial_density() * volume / around.plan.dt,
        cell: cell_width,
        speed: cell_width / around.plan.dt,
    }
}
