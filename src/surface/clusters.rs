//! Which particles stand free of any body: what a cluster is, and from which size on it is meshed.

use super::grid::neighbours;
use crate::sim::frame::SurfaceParticle;
use glam::{IVec3, Vec3};
use std::collections::HashMap;

/// Density around a particle, below which it may be a grain: with it every particle of a cluster of 13 is
/// one; on a flat surface the density is 0.65.
pub(super) const GRAIN_DENSITY: f32 = 0.5;
/// Particles of the smallest cluster that is meshed: 8 come out at 0.7 to 2.1 times their volume, by how they
/// lie on the grid, 12 at 0.7 to 1.6, 14 at 0.7 to 1.4.
pub(super) const CLUSTER_MIN: usize = 14;

/// Field over the threshold below which a particle is drawn. Particles at the sharp edges of bodies, which
/// the surface rounds, have 0.54 and more: balls there would be beads on every edge. Between that and the
/// threshold a particle is within about its spacing of the surface.
pub(super) const GRAIN_FIELD: f32 = 0.5;

/// Particles that stand free, in clusters of fewer than [`CLUSTER_MIN`]. A cluster is what is in neighbouring
/// cells.
pub(super) fn free_grains(particles: &[SurfaceParticle], densities: &[f32]) -> Vec<u32> {
    let is_free = |i: &u32| {
        let rho = densities[*i as usize];
        rho > 0.0 && rho < GRAIN_DENSITY
    };
    let free: Vec<u32> = (0..particles.len() as u32).filter(is_free).collect();
    if free.is_empty() {
        return free;
    }
    let cell = |i: u32| Vec3::from_array(particles[i as usize].position).floor().as_ivec3();
    let mut counts: HashMap<IVec3, usize> = HashMap::new();
    for i in (0..particles.len() as u32).filter(|i| densities[*i as usize] > 0.0) {
        *counts.entry(cell(i)).or_default() += 1;
    }
    free.into_iter().filter(|&i| cluster_size(&counts, cell(i)) < CLUSTER_MIN).collect()
}

/// Particles in the cells joined to `cell`, counted up to [`CLUSTER_MIN`].
fn cluster_size(counts: &HashMap<IVec3, usize>, cell: IVec3) -> usize {
    let mut seen = vec![cell];
    let mut size = 0;
    let mut next = 0;
    while next < seen.len() && size < CLUSTER_MIN {
        let at = seen[next];
        next += 1;
        size += counts.get(&at).copied().unwrap_or(0);
        for d in neighbours() {
            if counts.contains_key(&(at + d)) && !seen.contains(&(at + d)) {
                seen.push(at + d);
            }
        }
    }
    size
}
