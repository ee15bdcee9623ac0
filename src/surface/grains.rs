//! Particles that no surface shows: drawn as balls beside the mesh, so that no clay is invisible.

use super::balls::{Ball, add_balls};
use super::extract::extract_by;
use super::field::{Field, SurfaceSettings};
use super::labels::Rules;
use super::mesh::Mesh;
use crate::sim::frame::{SurfaceParticle, SurfaceSource};
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

/// A ball that stands for one particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grain {
    /// Centre [m].
    pub position: [f32; 3],
    /// Radius of a ball [m] of the volume that the surface does not show: (3 V / 4 pi)^(1/3) with V the
    /// particle's present volume times 1 - 2 f / threshold at its place. So grains that the surface takes in
    /// shrink to nothing as it comes.
    pub radius: f32,
    /// Its number in the source.
    pub particle: u32,
}

/// All that is to be drawn of a clay.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Extraction {
    /// The surface.
    pub mesh: Mesh,
    /// The particles outside of it.
    pub grains: Vec<Grain>,
}

impl Extraction {
    /// The surface with a ball for each grain behind it, to be looked at: an icosahedron of the grain's
    /// volume, or, of more than 10,000 grains, an octahedron. Not to be exported: balls may touch each other
    /// and the surface.
    pub fn drawn(&self) -> Mesh {
        let mut mesh = self.mesh.clone();
        add_balls(&mut mesh, &self.grains);
        mesh
    }
}

/// Triangles that [`Extraction::drawn`] has for so many grains.
pub fn ball_triangles(grain_count: usize) -> usize {
    grain_count * Ball::for_count(grain_count).counts().1
}

/// The surface, and each particle that it does not show: clusters of fewer than 14 particles that stand free,
/// and particles where the field is below half the threshold. Every other one is within the surface or about
/// a particle's spacing from it, at an edge that it rounds.
pub fn extract_with_grains(source: &SurfaceSource, settings: &SurfaceSettings) -> Extraction {
    let (field, grains) = field_and_grains(source, settings);
    Extraction { mesh: extract_by(&field, settings.iso_threshold, &Rules::new(settings.method), settings.normals), grains }
}

/// The fields that the mesh of [`extract_with_grains`] is made of, and its grains.
pub(crate) fn field_and_grains(source: &SurfaceSource, settings: &SurfaceSettings) -> (Field, Vec<Grain>) {
    let (field, grains) = Field::without_grains(source, settings);
    let grain = |(particle, share): (u32, f32)| {
        let p = &source.particles[particle as usize];
        let volume = f64::from(share * p.density_weight * p.volume_ratio) * source.domain.cell_width.powi(3);
        let radius = (0.75 * volume / std::f64::consts::PI).cbrt() as f32;
        let position = source.domain.to_world(Vec3::from_array(p.position).as_dvec3()).as_vec3().to_array();
        Grain { position, radius, particle }
    };
    (field, grains.into_iter().map(grain).collect())
}

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
        for d in super::grid::neighbours() {
            if counts.contains_key(&(at + d)) && !seen.contains(&(at + d)) {
                seen.push(at + d);
            }
        }
    }
    size
}
