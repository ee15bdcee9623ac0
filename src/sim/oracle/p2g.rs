//! Particles to nodes: Eq. 2-4, MLS-MPM (Hu et al. 2018, Eq. 18) with the affine momentum of APIC (Jiang et
//! al. 2015).
//!
//! `m_i = sum w m_p`, `p_i = sum w m_p (v + A (x_i - x_p) dx)` with `A = C - 4 h tau / (rho_s dx^2)` [1/s],
//! the stress impulse `-h V tau 4 / dx^2` over the mass `rho_s V`, of the Kirchhoff stress
//! `tau = 2 mu H + lambda tr(H) I`, `H = ln(I + E) / 2`. The laws as published multiply tau by
//! [`stress_factor_at`](super::super::material::ClayMaterial::stress_factor_at) the distance to the nearest
//! tool at its pose of `t`. The [impulse of tools and walls](super::penalty) is part of the particle's
//! momentum: `w j` goes to each node. The sums of each class stay apart (compatibility of Eq. 2-3). Nodes
//! note at which walls their clay has arrived.
//!
//! Beside these, `sum w m_p (v + C (x_i - x_p) dx)`, what the particles had before stress and tools: over
//! `m_i` the velocity *before*, of each class by itself, which no wall folds; [`g2p`](super::g2p) needs it.
//! And `sum w m_p l`, l what the particle has lost of its strength: [`contact`](super::contact) needs it.

use super::grid::Grid;
use super::law;
use super::particle::Particle;
use super::stencil::stencil;
use super::tools::Surroundings;
use glam::DVec3;

/// The nodes with the mass and momentum of each class; `impulses` \[N s\] act on the particles.
pub(super) fn scatter(particles: &[Particle], impulses: &[DVec3], around: &Surroundings) -> Grid {
    let mut grid = Grid::about(particles.iter().map(|p| p.position));
    let cell_width = around.domain.cell_width;
    let density = around.plan.inertial_density();
    for (particle, impulse) in particles.iter().zip(impulses) {
        let mass = density * particle.rest_volume;
        let stress = law::kirchhoff_stress(&around.plan.material, particle.elastic_strain) * around.stress_factor(particle);
        let affine = particle.affine - stress * (4.0 * around.plan.dt / (density * cell_width * cell_width));
        let (key, lost) = (particle.key(), around.strength_lost(particle));
        for touch in stencil(particle.position) {
            let Some(index) = grid.index(touch.node) else { continue };
            let node = &mut grid.nodes[index];
            let sum = node.classes.of(key);
            sum.mass += touch.weight * mass;
            let arm = touch.arm * cell_width;
            sum.momentum += touch.weight * (mass * (particle.velocity + affine * arm) + *impulse);
            sum.before += touch.weight * mass * (particle.velocity + particle.affine * arm);
            sum.lost += touch.weight * mass * lost;
            node.walls |= particle.walls;
        }
    }
    grid
}
