//! The pieces that clay is in: bodies that nothing holds together any more.
//!
//! Particles hold together where they move in one field of a node, as in the substep: at nodes that no cut
//! divides all clay of a body in the cells about them, at others the clay on one side. A cut that ends inside
//! the clay leaves one piece, one that passes through it two.

use crate::sim::cut::ClassKey;
use crate::sim::disjoint::DisjointSets;
use crate::sim::snapshot::{Particle, Snapshot};
use glam::{DVec3, IVec3};
use std::collections::HashMap;

/// Which piece each particle belongs to. Pieces are numbered by falling volume, from 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pieces {
    /// Piece of each particle, in the snapshot's order.
    pub of_particle: Vec<u32>,
    /// Rest volume of each piece [m^3].
    pub volumes: Vec<f64>,
}

/// Masses of the classes at a node that a tagged particle reaches.
type ClassMasses = Vec<(ClassKey, f64)>;

impl Pieces {
    /// Finds the pieces of clay; particles that are not finite are a piece each.
    pub fn of(snapshot: &Snapshot) -> Self {
        let particles = &snapshot.particles;
        let masses = masses_at_cuts(particles);
        let mut sets = DisjointSets::new(particles.len());
        let mut first_of: HashMap<(IVec3, u16, u64), u32> = HashMap::new();
        for (i, particle) in (0..).zip(particles).filter(|(_, p)| p.is_finite()) {
            let (key, cell) = (ClassKey::new(particle.body, particle.tags), particle.grid().floor().as_ivec3());
            for corner in 0..8 {
                let node = cell + (IVec3::new(corner, corner >> 1, corner >> 2) & 1);
                let field = masses.get(&node).map_or(0, |classes| field_of(key, classes));
                let first = *first_of.entry((node, key.body(), field)).or_insert(i);
                sets.join(first, i);
            }
        }
        Self::numbered(particles, |i| sets.root(i))
    }

    /// Numbers the sets by falling volume; equal ones by their first particle.
    fn numbered(particles: &[Particle], mut root: impl FnMut(u32) -> u32) -> Self {
        let roots: Vec<u32> = (0..).zip(particles).map(|(i, _)| root(i)).collect();
        let mut sums: HashMap<u32, f64> = HashMap::new();
        for (root, particle) in roots.iter().zip(particles) {
            *sums.entry(*root).or_default() += f64::from(particle.rest_volume);
        }
        let mut order: Vec<(u32, f64)> = sums.into_iter().collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let number: HashMap<u32, u32> = order.iter().zip(0..).map(|((root, _), number)| (*root, number)).collect();
        Self { of_particle: roots.iter().map(|root| number[root]).collect(), volumes: order.iter().map(|o| o.1).collect() }
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

/// Class masses at the nodes that tagged particles reach, by the quadratic splines of the substep.
fn masses_at_cuts(particles: &[Particle]) -> HashMap<IVec3, ClassMasses> {
    let stencil = |p: &Particle| {
        let at = p.grid();
        let base = (at - 0.5).floor().as_ivec3();
        (0..27).map(move |i| {
            let node = base + IVec3::new(i / 9, i / 3 % 3, i % 3);
            let d = (node.as_dvec3() - at).abs();
            let spline = |x: f64| if x < 0.5 { 0.75 - x * x } else { 0.5 * (1.5 - x).max(0.0).powi(2) };
            (node, spline(d.x) * spline(d.y) * spline(d.z))
        })
    };
    let mut masses: HashMap<IVec3, ClassMasses> = HashMap::new();
    let finite = || particles.iter().filter(|p| p.is_finite()).map(|p| (p, ClassKey::new(p.body, p.tags)));
    for (p, key) in finite().filter(|(_, key)| !key.is_first()) {
        for (node, weight) in stencil(p) {
            add(masses.entry(node).or_default(), key, weight * f64::from(p.rest_volume));
        }
    }
    for (p, key) in finite().filter(|(_, key)| key.is_first()) {
        for (node, weight) in stencil(p) {
            if let Some(classes) = masses.get_mut(&node) {
                add(classes, key, weight * f64::from(p.rest_volume));
            }
        }
    }
    masses
}

fn add(classes: &mut ClassMasses, key: ClassKey, mass: f64) {
    match classes.iter_mut().find(|class| class.0 == key) {
        Some(class) => class.1 += mass,
        None => classes.push((key, mass)),
    }
}

/// Names the field in which the clay of `key` moves at a node: the divisions that it is beyond, as in the
/// substep (`m_F + m_B > m / 2`, m that of the bodies with a side of the sheet), a bit for each sheet.
fn field_of(key: ClassKey, classes: &ClassMasses) -> u64 {
    let is_tagged = |body: u16, sheet: u8| classes.iter().any(|(key, _)| key.body() == body && key.side(sheet) != 0);
    let all = |sheet: u8| classes.iter().filter(|(key, _)| is_tagged(key.body(), sheet)).map(|class| class.1).sum::<f64>();
    let mut sheets: Vec<u8> = classes.iter().flat_map(|class| class.0.sides()).map(|side| side.0).collect();
    sheets.sort_unstable();
    sheets.dedup();
    let is_beyond = |sheet: u8| {
        let on = |side: i8| classes.iter().filter(|class| class.0.side(sheet) == side).map(|class| class.1).sum::<f64>();
        let (front, back) = (on(1), on(-1));
        let owner = if front >= back { 1 } else { -1 };
        front + back > 0.5 * all(sheet) && key.side(sheet) == -owner
    };
    sheets.into_iter().take(64).enumerate().map(|(i, sheet)| u64::from(is_beyond(sheet)) << i).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::material::ClayMaterial;
    use crate::sim::params::{Domain, WALL_NODE, Walls};
    use crate::sim::snapshot::Tag;

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

    /// Particles that are not numbers are set aside, one piece each, the smallest.
    #[test]
    fn broken_particles_are_pieces_of_their_own() {
        let mut clay = cube(&[]);
        clay.particles[7].offset[1] = f32::NAN;
        let pieces = Pieces::of(&clay);
        assert_eq!((pieces.count(), pieces.of_particle[7]), (2, 1));
    }
}
