//! A particle in f64, and its f32 twin in the snapshot.

use super::super::cut::ClassKey;
use super::super::snapshot::{self, ANCHORS_MAX, Anchor, Tag};
use glam::{DMat3, DVec3};

/// What a particle carries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Particle {
    /// Grid coordinate \[cells\].
    pub position: DVec3,
    /// Velocity [m/s].
    pub velocity: DVec3,
    /// Affine velocity C [1/s]: column `c` is the derivative of the velocity along axis `c`.
    pub affine: DMat3,
    /// Elastic strain `E = b_e - I` [-], symmetric.
    pub elastic_strain: DMat3,
    /// Accumulated plastic strain [-].
    pub hardening: f64,
    /// By how much it moved in the last substep \[cells\]; where a frame starts, as its velocity has it.
    pub way: DVec3,
    /// Plastic strain [-] since volumes were last averaged: not in a snapshot, since they are at each frame's
    /// end.
    pub flowed: f64,
    /// Working D of thixotropic clay [-]; 0 is fresh.
    pub structure: f64,
    /// Rest volume [m^3].
    pub rest_volume: f64,
    /// Stable identity.
    pub id: u32,
    /// Cuts the particle stands at.
    pub tags: [Tag; 2],
    /// Where it clings to tools: a tool's id and a place in its frame \[cells\].
    pub anchors: [Option<(u32, DVec3)>; ANCHORS_MAX],
    /// The walls that it touches or has arrived at, a bit each.
    pub walls: u32,
    /// The body that it is of, by number.
    pub body: u32,
}

impl Particle {
    /// A particle at rest at grid coordinate `position` \[cells\].
    pub fn at(position: DVec3, rest_volume: f64, id: u32) -> Self {
        Self {
            position,
            velocity: DVec3::ZERO,
            affine: DMat3::ZERO,
            elastic_strain: DMat3::ZERO,
            hardening: 0.0,
            way: DVec3::ZERO,
            flowed: 0.0,
            structure: 0.0,
            rest_volume,
            id,
            tags: [Tag::default(); 2],
            anchors: [None; ANCHORS_MAX],
            walls: 0,
            body: 0,
        }
    }

    /// The particle of a snapshot.
    pub fn from_snapshot(particle: &snapshot::Particle) -> Self {
        let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
        let [xx, yy, zz, xy, xz, yz] = particle.elastic_strain.map(f64::from);
        Self {
            position: particle.grid(),
            velocity: vector(particle.velocity),
            affine: DMat3::from_cols(vector(particle.affine[0]), vector(particle.affine[1]), vector(particle.affine[2])),
            elastic_strain: DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz)),
            hardening: f64::from(particle.hardening),
            way: DVec3::ZERO,
            flowed: 0.0,
            structure: f64::from(particle.structure),
            rest_volume: f64::from(particle.rest_volume),
            id: particle.id,
            tags: particle.tags,
            anchors: particle.anchors.map(|anchor| anchor.get()),
            walls: particle.walls,
            body: particle.body,
        }
    }

    /// The particle rounded to f32.
    #[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is what a snapshot is")]
    pub fn to_snapshot(&self) -> snapshot::Particle {
        let e = self.elastic_strain;
        let strain = [e.x_axis.x, e.y_axis.y, e.z_axis.z, e.x_axis.y, e.x_axis.z, e.y_axis.z];
        let mut particle = snapshot::Particle {
            velocity: self.velocity.as_vec3().to_array(),
            affine: self.affine.as_mat3().to_cols_array_2d(),
            elastic_strain: strain.map(|s| s as f32),
            hardening: self.hardening as f32,
            structure: self.structure as f32,
            rest_volume: self.rest_volume as f32,
            id: self.id,
            tags: self.tags,
            anchors: self.anchors.map(|anchor| anchor.map_or_else(Anchor::default, |(id, at)| Anchor::on(id, at))),
            walls: self.walls,
            body: self.body,
            ..snapshot::Particle::default()
        };
        particle.set_grid(self.position);
        particle
    }

    /// The class of particles it moves with: those of the same body on the same sides of the same cuts.
    pub fn key(&self) -> ClassKey {
        ClassKey::new(self.body, self.tags)
    }
}
