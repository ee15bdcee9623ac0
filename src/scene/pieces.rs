//! The pieces that clay is in: bodies, and what of them nothing holds together any more.
//!
//! What hangs together is as `sim::body` has it; crumbs, which are no bodies of their own, are pieces. A cut
//! that ends inside the clay leaves one piece, one that passes through it two.

use crate::sim::snapshot::Snapshot;
use glam::DVec3;
use std::collections::HashMap;

/// Which piece each particle belongs to. Pieces are numbered by falling volume, from 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pieces {
    /// Piece of each particle, in the snapshot's order.
    pub of_particle: Vec<u32>,
    /// Rest volume of each piece [m^3].
    pub volumes: Vec<f64>,
}

impl Pieces {
    /// Finds the pieces of clay; particles that are not finite are a piece each. Of equal ones the one whose
    /// particle comes first in the snapshot has the lower number.
    pub fn of(snapshot: &Snapshot) -> Self {
        let parts = snapshot.parts();
        // Of each part its volume and its first particle.
        let mut found: HashMap<u32, (f64, usize)> = HashMap::new();
        for (i, (part, particle)) in parts.iter().zip(&snapshot.particles).enumerate() {
            found.entry(*part).or_insert((0.0, i)).0 += f64::from(particle.rest_volume);
        }
        let mut order: Vec<(u32, (f64, usize))> = found.into_iter().collect();
        order.sort_by(|(_, a), (_, b)| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let number: HashMap<u32, u32> = order.iter().zip(0..).map(|((part, _), number)| (*part, number)).collect();
        Self { of_particle: parts.iter().map(|part| number[part]).collect(), volumes: order.iter().map(|o| o.1.0).collect() }
    }

    /// Number of pieces.
    pub fn count(&self) -> usize {
        self.volumes.len()
    }

    /// The clay without the pieces that `keeps` does not name.
    #[must_use]
    pub fn kept(&self, snapshot: &Snapshot, keeps: impl Fn(u32) -> bool) -> Snapshot {
        let kept = snapshot.particles.iter().zip(&self.of_particle).filter(|(_, piece)| keeps(**piece)).map(|(p, _)| *p);
        Snapshot { particles: kept.collect(), forecasts: None, ..*snapshot }
    }

    /// The piece of the particle nearest to `world` \[m\]; none where there is no clay at all.
    pub fn at(&self, snapshot: &Snapshot, world: DVec3) -> Option<u32> {
        let from = snapshot.domain.to_grid(world);
        let finite = snapshot.particles.iter().zip(&self.of_particle).filter(|(p, _)| p.is_finite());
        let nearest = finite.min_by(|a, b| a.0.grid().distance_squared(from).total_cmp(&b.0.grid().distance_squared(from)));
        nearest.map(|(_, piece)| *piece)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::cut::SheetSet;
    use crate::sim::material::ClayMaterial;
    use crate::sim::params::{Domain, WALL_NODE, Walls};
    use crate::sim::snapshot::{Particle, Tag};

    /// A cube of 8 cells, cut by planes: sheet, a point of the plane [cells from the cube's middle], normal,
    /// how deep from the top it reaches \[cells\].
    fn cube(cuts: &[(u8, DVec3, DVec3, f64)]) -> Snapshot {
        let domain = Domain::new(DVec3::ZERO, DVec3::splat(0.16), 0.01, Walls::default()).expect("domain");
        let middle = DVec3::splat(8.0 + f64::from(WALL_NODE));
        let mut particles = vec![];
        for i in 0..4096u32 {
            let at = DVec3::new(f64::from(i % 16), f64::from(i / 16 % 16), f64::from(i / 256)) * 0.5 - 3.75;
            let mut particle = Particle::at(middle + at, 1.25e-7, i);
            let mut free = particle.tags.iter_mut();
            for (sheet, point, normal, depth) in cuts {
                let distance = (at - *point).dot(normal.normalize());
                if distance.abs() < 1.5
                    && at.y > 4.0 - depth
                    && let Some(tag) = free.next()
                {
                    *tag = Tag { sheet: *sheet, side: if distance < 0.0 { -1 } else { 1 } };
                }
            }
            particles.push(particle);
        }
        Snapshot::new(domain, ClayMaterial::default(), particles)
    }

    const THROUGH: f64 = 10.0;

    #[test]
    fn cut_through_makes_two_and_half_a_cut_one() {
        let normal = DVec3::new(1.0, 0.2, -0.1);
        let whole = Pieces::of(&cube(&[]));
        assert_eq!(whole.count(), 1);
        assert!((whole.volumes[0] / 4096.0 / 1.25e-7 - 1.0).abs() < 1e-6);
        let halves = Pieces::of(&cube(&[(3, DVec3::X * 1.3, normal, THROUGH)]));
        assert_eq!(halves.count(), 2);
        // The middle plane is 1.3 of 8 cells off: 66 and 34 %.
        assert!((halves.volumes[0] / whole.volumes[0] - 0.66).abs() < 0.02, "{:?}", halves.volumes);
        assert_eq!(Pieces::of(&cube(&[(3, DVec3::X * 1.3, normal, 5.0)])).count(), 1);
    }

    #[test]
    fn crossed_cuts_make_four_and_parallel_ones_slabs() {
        let crossed = cube(&[(3, DVec3::ZERO, DVec3::X, THROUGH), (9, DVec3::Z * 0.2, DVec3::new(0.1, 0.2, 1.0), THROUGH)]);
        assert_eq!(Pieces::of(&crossed).count(), 4);
        let slabs = cube(&[(3, DVec3::X * -1.1, DVec3::X, THROUGH), (9, DVec3::X * 1.4, DVec3::X, THROUGH)]);
        assert_eq!(Pieces::of(&slabs).count(), 3);
        let tee = cube(&[(3, DVec3::ZERO, DVec3::X, THROUGH), (9, DVec3::ZERO, DVec3::Z, 4.0)]);
        assert_eq!(Pieces::of(&tee).count(), 2, "half a cut across a whole one");
    }

    /// Offcuts are the smaller pieces; a point names the piece it is in.
    #[test]
    fn pieces_are_kept_and_found() {
        let clay = cube(&[(3, DVec3::X * 1.3, DVec3::X, THROUGH)]);
        let pieces = Pieces::of(&clay);
        let largest = pieces.kept(&clay, |piece| piece == 0);
        assert!((largest.rest_volume() - pieces.volumes[0]).abs() < 1e-12);
        assert_eq!(Pieces::of(&largest).count(), 1);
        let middle = DVec3::splat(0.08);
        assert_eq!(pieces.at(&clay, middle - DVec3::X * 0.03), Some(0));
        assert_eq!(pieces.at(&clay, middle + DVec3::X * 0.03), Some(1));
        assert_eq!(Pieces::default().at(&Snapshot { particles: vec![], ..clay }, middle), None);
    }

    /// What is too little to be a body of its own is a piece all the same.
    #[test]
    fn crumbs_are_pieces() {
        let mut clay = cube(&[]);
        let far = Particle::at(DVec3::splat(3.5), 1.25e-7, 0);
        (clay.particles[3].cell, clay.particles[3].offset) = (far.cell, far.offset);
        let pieces = Pieces::of(&clay);
        assert_eq!((pieces.count(), pieces.of_particle[3]), (2, 1));
        clay.find_bodies(SheetSet::default());
        assert!(clay.particles.iter().all(|p| p.body == 0));
    }

    /// Particles that are not numbers are set aside, one piece each, the smallest.
    #[test]
    fn broken_particles_are_pieces_of_their_own() {
        let mut clay = cube(&[]);
        clay.particles[7].offset[1] = f32::NAN;
        let pieces = Pieces::of(&clay);
        assert_eq!((pieces.count(), pieces.of_particle[7]), (2, 1));
    }
}
