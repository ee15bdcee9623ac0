//! Ghost velocities, to compare with: CPIC to the letter of Eq. 1-3 ([`CuttingMethod::Published`]), and as Hu
//! et al. 2018 have it ([`CuttingMethod::RigidParticles`]). No cut is kept without its blade, and no wire is
//! known; sides of a blade stand in the tags while they last. Walls, gravity, law and solid tools are as
//! elsewhere; blades do not act on the nodes, and fields exchange nothing.
//!
//! 1. Sides of nodes: as published, as in [`sides`](super::sides) within the band of a blade. By rigid
//!    particles: the blade at its pose of `t + h` is a layer of points at most half a cell apart, its rim
//!    among them; a node that is among the 3^3 about a point has the distance of the nearest, and its sign
//!    along that point's normal.
//! 2. Sides of particles, in place of [`tags`](super::tags): as published, the sign of
//!    [`Blade::within_band`](super::super::tool::Blade::within_band) of `x` at `t + h`, none outside. By
//!    rigid particles: `sign(sum w T |d|)` over the nodes of `x` that have a side, kept from then on as long
//!    as any of them has one.
//! 3. A class that a blade divides from a node (side against side, Eq. 1) is *incompatible* with it: of its
//!    mass and momentum the node gets nothing (Eq. 2-3 with delta = 0). The other classes are one field.
//! 4. In [`g2p`](super::g2p) a particle gathers at an incompatible node its ghost velocity, the contact of
//!    the blade on `v + g h (rho / rho_s)`, with the blade's velocity at the node and its normal there
//!    towards the particle. Of several blades between them the first of the plan acts.
//! 5. Newton's third law: the blade feels what the node would have got,
//!    `w m_p (v + A (x_i - x_p) dx) + w m_p g h (rho / rho_s)`, less what the particle gathers,
//!    `w m_p v_ghost`. At folded columns an outer node's blade is its inner one's.

use super::super::cut::{self, ClassKey};
use super::super::cutting::CuttingMethod;
use super::super::frame::FrameReport;
use super::super::snapshot::Tag;
use super::contact::contact_velocity;
use super::grid::{Band, Grid, Node};
use super::particle::Particle;
use super::stencil::Touch;
use super::tools::{MovingTool, Surroundings};
use glam::DVec3;

/// Particles take the sides that they have now, and keep none of blades that they are not near.
pub(super) fn take_sides(particles: &mut [Particle], around: &Surroundings, frame: &mut FrameReport) {
    for particle in particles {
        let mut tags = [Tag::default(); 2];
        for (tool, seen) in around.tools.iter().zip(&mut frame.tools) {
            let sheet = tool.path.sheet_id();
            let had = particle.key().side(sheet);
            let side = side_of(particle.position, had, tool, around);
            if side != 0 {
                cut::take(&mut tags, sheet, side);
                seen.tagged += u64::from(side != had);
            }
        }
        particle.tags = tags;
    }
}

/// The side of a tool that a particle at `position` \[cells\] has which `had` one before; 0 for none.
fn side_of(position: DVec3, had: i8, tool: &MovingTool, around: &Surroundings) -> i8 {
    match around.plan.cutting {
        CuttingMethod::Published => {
            let near = tool.blade.and_then(|blade| blade.within_band(around.domain.to_world(position)));
            near.map_or(0, |(distance, _)| if distance < 0.0 { -1 } else { 1 })
        }
        CuttingMethod::RigidParticles => {
            let now = tool.sampled.as_ref().and_then(|sampled| sampled.colour(position));
            now.map_or(0, |now| if had == 0 { now } else { had })
        }
        CuttingMethod::TwoFields | CuttingMethod::InteractiveParticles => 0,
    }
}

/// Leaves each node to the clay that is compatible with it.
pub(super) fn withhold(grid: &mut Grid) {
    grid.nodes.iter_mut().for_each(|node| node.fields.retain(|field| field.beyond == 0));
}

/// The blade that makes the clay of `key` incompatible with a node, its normal towards that clay.
fn between(node: &Node, key: ClassKey) -> Option<Band> {
    let beyond = node.divisions.iter().filter(|d| key.side(d.sheet) == -d.owner);
    let band = beyond.filter_map(|d| d.band.map(|band| Band { normal: band.normal * f64::from(-d.owner), ..band }));
    band.min_by_key(|band| band.tool)
}

/// Gives the tools what incompatible nodes did not get.
pub(super) fn book_withheld(frame: &mut FrameReport, grid: &Grid, around: &Surroundings) {
    for (coordinate, node) in grid.coordinates().zip(&grid.nodes) {
        for (key, own) in node.classes.iter() {
            let Some(band) = between(node, key) else { continue };
            let weight = own.mass * around.gravity_step(coordinate);
            frame.grid_mass += own.mass;
            frame.gravity_impulse += weight;
            give(
                frame,
                &around.tools[band.tool],
                around.domain.to_world(coordinate.as_dvec3()),
                band.tool,
                own.momentum + weight,
            );
            frame.tools[band.tool].contacts += 1;
        }
    }
}

/// Gives tool `index` an impulse \[N s\] at `world` \[m\].
fn give(frame: &mut FrameReport, tool: &MovingTool, world: DVec3, index: usize, impulse: DVec3) {
    let felt = &mut frame.tools[index];
    felt.impulse += impulse;
    felt.angular_impulse += (world - tool.motion.end.position).cross(impulse);
    frame.impulse_scale += impulse.length();
}

/// The ghost velocity [m/s] of a particle at a node that is incompatible with it; the tool gives the
/// momentum.
pub(super) fn velocity(particle: &Particle, touch: Touch, node: &Node, around: &Surroundings, frame: &mut FrameReport) -> DVec3 {
    let Some(band) = between(node, particle.key()) else { return DVec3::ZERO };
    let tool = &around.tools[band.tool];
    let world = around.domain.to_world(touch.node.as_dvec3());
    let own = particle.velocity + around.gravity_step(touch.node);
    let ghost = contact_velocity(tool.path.tool.contact, own, tool.velocity(world), band.normal);
    let mass = around.plan.inertial_density() * particle.rest_volume;
    give(frame, tool, world, band.tool, -touch.weight * mass * ghost);
    ghost
}
