//! Particles that no surface shows: drawn as balls beside the mesh, so that no clay is invisible.

pub use super::balls::Grain;

use super::balls::{Ball, add_balls};
use super::extract::extract_by;
use super::field::{Field, SurfaceSettings};
use super::labels::Rules;
use super::mesh::Mesh;
use crate::sim::frame::SurfaceSource;
use glam::Vec3;

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
