//! One substep, top to bottom.
//!
//! MLS-MPM (Hu et al. 2018) with APIC transfers (Jiang et al. 2015):
//! `m_i v_i = sum_p w_ip m_p (v_p + A_p (x_i - x_p))` with `A = C - 4 h tau / (rho_s dx^2)` (Eq. 2-4) makes
//! node velocities, with the impulses of solid tools on the particles; gravity, walls, the two sides of cuts
//! and blades change them; `v_p = sum_i w_ip v_i` and
//! `C_p = 4 / dx^2 sum_i w_ip v_i (x_i - x_p)^T` bring them back, with a share of what the nodes did not see
//! of `v_p` and `C_p`, and the clay law (Eq. 5) makes the next stress.

use super::super::cutting::CuttingMethod;
use super::super::frame::{FramePlan, FrameReport};
use super::super::params::Domain;
use super::grid::Grid;
use super::particle::Particle;
use super::tools::Surroundings;
use super::{averaging, contact, faces, g2p, ghost, interactive, p2g, penalty, report, sides, tags, walls};

/// Moves `particles` over substep `step` of the frame, of `plan.dt` \[s\], and adds to `frame` what happened.
/// Returns the nodes.
pub(super) fn substep(particles: &mut [Particle], domain: &Domain, plan: &FramePlan, step: u32, frame: &mut FrameReport) -> Grid {
    let mut around = Surroundings::new(domain, plan, f64::from(step) * plan.dt);

    if plan.averages_before(step) {
        averaging::average_volumes(particles, plan.volume_averaging);
    }
    match plan.cutting {
        CuttingMethod::TwoFields => tags::take_sides(particles, &around, frame),
        CuttingMethod::Published | CuttingMethod::RigidParticles | CuttingMethod::InteractiveParticles => {
            ghost::take_sides(particles, &around, frame);
        }
    }

    around.ahead = penalty::look_ahead(particles, &around);
    let impulses = penalty::press(particles, &around, frame);
    let mut grid = p2g::scatter(particles, &impulses, &around);

    let columns = walls::fold(&mut grid, &around);
    sides::divide(&mut grid, &around);
    sides::sum_fields(&mut grid);
    faces::find_faces(&mut grid);
    if plan.cutting.has_ghosts() {
        ghost::withhold(&mut grid);
    }
    walls::set_velocities(&mut grid, &around);
    match plan.cutting {
        CuttingMethod::TwoFields => contact::between_sides(&mut grid, &around, frame),
        CuttingMethod::Published | CuttingMethod::RigidParticles => {}
        CuttingMethod::InteractiveParticles => interactive::take_along(&mut grid, &around, frame),
    }
    walls::unfold(&mut grid, &columns);
    walls::clamp(&mut grid, &around);
    walls::drive(&mut grid, &around);
    report::add_grid(frame, &grid, &around);
    if plan.cutting.has_ghosts() {
        ghost::book_withheld(frame, &grid, &around);
    }

    g2p::gather(particles, &grid, &around, frame);
    grid
}
