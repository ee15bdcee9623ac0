//! Particles to nodes: Eq. 2-4, MLS-MPM (Hu et al. 2018, Eq. 18) with the affine momentum of APIC (Jiang et al. 2015).
//!
//! `m_i = sum_p w m_p`, `p_i = sum_p w m_p (v_p + A_p (x_i - x_p))` with `A = C - 4 h tau / (rho_s dx^2)`: the stress impulse
//! `-h V tau 4 / dx^2` over the mass `rho_s V`; the laws as published multiply it by zeta. The sums of particles on different sides of cuts stay apart (compatibility of Eq. 2-3).

use super::grid::Grid;
use super::stencil::stencil;
use super::tools::Surroundings;
use super::{Particle, law};

/// The nodes with the mass and momentum of each class.
pub(super) fn scatter(particles: &[Particle], around: &Surroundings) -> Grid {
    let mut grid = Grid::about(particles.iter().map(|p| p.position));
    let cell_width = around.domain.cell_width;
    let density = around.plan.inertial_density();
    for particle in particles {
        let mass = density * particle.rest_volume;
        let stress = law::kirchhoff_stress(&around.plan.material, particle.elastic_strain) * around.stress_factor(particle);
        let affine = particle.affine - stress * (4.0 * around.plan.dt / (density * cell_width * cell_width));
        let touching = mass * around.touch(particle);
        let key = particle.key();
        for touch in stencil(particle.position) {
            let Some(index) = grid.index(touch.node) else { continue };
            let node = &mut grid.nodes[index];
            node.touching += touch.weight * touching;
            let sum = node.classes.of(key);
            sum.mass += touch.weight * mass;
            sum.momentum += touch.weight * mass * (particle.velocity + affine * (touch.arm * cell_width));
        }
    }
    grid
}
