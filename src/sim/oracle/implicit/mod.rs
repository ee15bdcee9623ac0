//! One implicit step, top to bottom: backward Euler, as the least of one potential.
//!
//! The nodes' displacements u over the step make
//! `sum m_i |u_i - h v_i*|^2 / (2 h^2) + sum V_p W_p(u) + sum contact_p(u)` least: inertia with
//! `v* = p / m + g h`, clay with its flow, the springs of tools and walls. No term of it bounds h: what
//! bounds it is how far clay and tools go in a step, not how fast sound is.
//!
//! | file         | does                                                                    |
//! |--------------|-------------------------------------------------------------------------|
//! | `unknowns`   | which displacement each field of each node has, walls folded            |
//! | `residual`   | the potential's slope, particle by particle; the step's end             |
//! | `contact`    | tools and walls on particles, at the step's end                         |
//! | `multigrid`  | a V-cycle of three scalar operators, which know how full cells are      |
//! | `pairs`      | the sides of kept cuts, which do not go through each other              |
//! | `minimise`   | L-BFGS about it, guarded                                                |
//!
//! Particles take their [sides](super::tags) as the explicit step has it; cuts weld and volumes are
//! averaged at the frame's end.

mod contact;
mod minimise;
pub(in crate::sim) mod multigrid;
mod pairs;
mod residual;
#[cfg(test)]
mod tests;
mod unknowns;

use super::super::cut::ClassKey;
use super::super::frame::{FramePlan, FrameReport};
use super::super::params::Domain;
use super::grid::Grid;
use super::particle::Particle;
use super::stencil::stencil;
use super::tools::Surroundings;
use super::{penalty, sides, tags, walls};
use glam::DVec3;
use multigrid::Multigrid;
use residual::System;
use unknowns::Unknowns;

/// Moves `particles` over step `step` of the frame, of `plan.dt` \[s\], with `passes` evaluations of the
/// slope, and adds to `frame` what happened. Returns the nodes.
pub(super) fn step(
    particles: &mut Vec<Particle>,
    domain: &Domain,
    plan: &FramePlan,
    step: u32,
    passes: u32,
    frame: &mut FrameReport,
) -> Grid {
    let mut around = Surroundings::new(domain, plan, f64::from(step) * plan.dt);
    take_sides(particles, &mut around, frame);
    let fields = scatter_fields(particles, &around);
    let mut moved = vec![];
    with_system(particles, &fields, &around, |system, guess| {
        let cycle_at = |u: &[DVec3]| Multigrid::new(system.finest(&fields.0, u));
        let least = minimise::minimise(system, &cycle_at, guess.to_vec(), passes);
        moved = system.end(&least.u, &least.slope, frame);
        frame.passes += least.passes;
        frame.rejected += least.rejected;
        frame.residual = frame.residual.max(least.slope.quality());
    });
    *particles = moved;
    fields.0
}

/// Tags the particles as the explicit step does, and looks at what edges have ahead; what a blade has cut
/// clings to it.
fn take_sides(particles: &mut [Particle], around: &mut Surroundings, frame: &mut FrameReport) {
    let before: Vec<ClassKey> = particles.iter().map(Particle::key).collect();
    tags::take_sides(particles, around, frame);
    for (particle, before) in particles.iter_mut().zip(before) {
        contact::cling(particle, before, around);
    }
    around.ahead = penalty::look_ahead(particles, around);
}

/// The nodes of a step, walls folded, with the fields that move and their velocities without stress and
/// contact.
fn scatter_fields(particles: &mut [Particle], around: &Surroundings) -> (Grid, Vec<walls::Column>) {
    let mut grid = scatter(particles, around);
    let columns = walls::fold(&mut grid, around);
    sides::divide(&mut grid, around);
    sides::sum_fields(&mut grid);
    super::faces::find_faces(&mut grid);
    walls::set_velocities(&mut grid, around);
    (grid, columns)
}

/// Calls `each` with the potential of a step and where its iterations start.
fn with_system(
    particles: &[Particle],
    (grid, columns): &(Grid, Vec<walls::Column>),
    around: &Surroundings,
    each: impl FnOnce(&System<'_>, &[DVec3]),
) {
    let mut system = System::new(particles, grid, Unknowns::new(grid, columns, around), around);
    let mut guess = system.guess();
    system.pairs.begin(&mut guess);
    system.share_volumes(&guess);
    each(&system, &guess);
}

/// The nodes with the mass and momentum of each class, without stress, at the places of the step's stencils.
fn scatter(particles: &mut [Particle], around: &Surroundings) -> Grid {
    let mut grid = Grid::about(particles.iter().map(|p| residual::middle(p, around)).collect::<Vec<_>>().into_iter());
    let (cell_width, density) = (around.domain.cell_width, around.plan.inertial_density());
    for particle in particles {
        let middle = residual::middle(particle, around);
        // What comes to a wall within the step meets it as one that clay can leave, and arrives as it ends.
        particle.walls |= walls::is_arrived(particle, particle.position, around);
        let (mass, key) = (density * particle.rest_volume, particle.key());
        for touch in stencil(middle) {
            let Some(index) = grid.index(touch.node) else { continue };
            let node = &mut grid.nodes[index];
            let sum = node.classes.of(key);
            sum.mass += touch.weight * mass;
            sum.momentum += touch.weight * mass * (particle.velocity + particle.affine * (touch.arm * cell_width));
            node.walls |= particle.walls;
        }
    }
    grid
}
