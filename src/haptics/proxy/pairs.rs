//! Pairs of spheres that may touch, as planes that the tool must stay outside of.

use super::super::model::NearParticle;
use glam::{DQuat, DVec3};

/// Spheres of a tool, at most.
pub const SPHERE_MAX: usize = 32;
/// Pairs, at most: 25 spheres 6 mm deep in clay have 71.
pub const PAIR_MAX: usize = 256;

/// A sphere of a tool, in the tool's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sphere {
    /// Its centre \[m\].
    pub centre: DVec3,
    /// Its radius \[m\].
    pub radius: f64,
}

/// A tool as spheres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToolSpheres {
    spheres: [Sphere; SPHERE_MAX],
    count: usize,
}

impl ToolSpheres {
    /// The first [`SPHERE_MAX`] of `spheres`.
    pub fn new(spheres: &[Sphere]) -> Self {
        let mut tool = Self { spheres: [Sphere::default(); SPHERE_MAX], count: spheres.len().min(SPHERE_MAX) };
        for (to, from) in tool.spheres.iter_mut().zip(spheres) {
            *to = *from;
        }
        tool
    }

    /// They.
    pub fn spheres(&self) -> &[Sphere] {
        &self.spheres[..self.count]
    }

    /// Least radius of a sphere \[m\].
    pub fn radius_min(&self) -> f64 {
        self.spheres().iter().fold(f64::INFINITY, |least, sphere| least.min(sphere.radius))
    }
}

/// A plane that bounds where the tool's origin may be: `normal . x >= offset`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Constraint {
    /// Out of the clay, of unit length.
    pub normal: DVec3,
    /// Along it, from the world's origin \[m\].
    pub offset: f64,
}

impl Constraint {
    /// How far outside of it a place is \[m\].
    pub fn gap(&self, x: DVec3) -> f64 {
        self.normal.dot(x) - self.offset
    }
}

/// The pairs about one place of the tool, each with a name that lasts from frame to frame.
#[derive(Clone, Debug)]
pub struct Pairs {
    constraints: [Constraint; PAIR_MAX],
    ids: [u64; PAIR_MAX],
    /// From the one centre to the other, and the sum of radii \[m\].
    spheres: [[DVec3; 2]; PAIR_MAX],
    count: usize,
    /// Whether there were more than [`PAIR_MAX`].
    pub is_full: bool,
    /// Least gap of a pair at the place they were made at \[m\]; infinite if there is none.
    pub gap_min: f64,
}

impl Default for Pairs {
    fn default() -> Self {
        let none = Constraint { normal: DVec3::ZERO, offset: 0.0 };
        Self {
            constraints: [none; PAIR_MAX],
            ids: [0; PAIR_MAX],
            spheres: [[DVec3::ZERO; 2]; PAIR_MAX],
            count: 0,
            is_full: false,
            gap_min: f64::INFINITY,
        }
    }
}

impl Pairs {
    /// The planes.
    pub fn constraints(&self) -> &[Constraint] {
        &self.constraints[..self.count]
    }

    /// Their names.
    pub fn ids(&self) -> &[u64] {
        &self.ids[..self.count]
    }

    /// Where the pair of this name is; `near` is where it may be.
    pub(super) fn find(&self, id: u64, near: usize) -> Option<usize> {
        let (before, after) = self.ids().split_at(near.min(self.count));
        let found = after.iter().position(|other| *other == id).map(|at| before.len() + at);
        found.or_else(|| before.iter().position(|other| *other == id))
    }

    /// No pair is left.
    pub fn clear(&mut self) {
        self.count = 0;
        self.is_full = false;
        self.gap_min = f64::INFINITY;
    }

    /// Takes in a plane; false, and nothing done, if there is no room.
    pub fn push(&mut self, id: u64, constraint: Constraint) -> bool {
        let has_room = self.count < PAIR_MAX;
        if has_room {
            self.constraints[self.count] = constraint;
            self.ids[self.count] = id;
            self.count += 1;
        }
        self.is_full |= !has_room;
        has_room
    }

    /// The pairs of a tool at `x` with gaps below `margin` \[m\], Eq. 7 in its tangent planes there.
    pub fn collect(&mut self, tool: &ToolSpheres, x: DVec3, rotation: DQuat, near: &[NearParticle], margin: f64) {
        self.clear();
        let count = tool.spheres().len();
        let mut centres = [[0.0; SPHERE_MAX]; 4];
        for (i, sphere) in tool.spheres().iter().enumerate() {
            let centre = x + rotation * sphere.centre;
            (centres[0][i], centres[1][i], centres[2][i]) = (centre.x, centre.y, centre.z);
            centres[3][i] = sphere.radius + margin;
        }
        let [xs, ys, zs, reaches] = &centres;
        for particle in near {
            let (at, radius) = (place(particle), f64::from(particle.radius));
            // Without a branch, for the compiler to take several spheres at once.
            let mut excess = [0.0; SPHERE_MAX];
            for i in 0..SPHERE_MAX {
                let square = (xs[i] - at.x).powi(2) + (ys[i] - at.y).powi(2) + (zs[i] - at.z).powi(2);
                excess[i] = square - (reaches[i] + radius).powi(2);
            }
            for (i, _) in excess[..count].iter().enumerate().filter(|(_, excess)| **excess < 0.0) {
                let away = DVec3::new(xs[i], ys[i], zs[i]) - at;
                let distance = away.length();
                // Two centres in one place: any way out is as good as another.
                let normal = if distance > 0.0 { away / distance } else { DVec3::Y };
                let gap = distance - (reaches[i] - margin) - radius;
                self.gap_min = self.gap_min.min(gap);
                let plane = Constraint { normal, offset: normal.dot(x) - gap };
                let spheres = [away, DVec3::splat(distance - gap)];
                if self.push((i as u64) << 32 | u64::from(particle.id), plane) {
                    self.spheres[self.count - 1] = spheres;
                }
            }
        }
    }

    /// Least gap of the pairs, Eq. 7 itself, of a tool that went `way` \[m\] from where they were made;
    /// infinite if there is none.
    pub(super) fn gap_after(&self, way: DVec3) -> f64 {
        let gap = |[away, radii]: &[DVec3; 2]| (*away + way).length() - radii.x;
        self.spheres[..self.count].iter().map(gap).fold(f64::INFINITY, f64::min)
    }
}

/// Where a particle is.
fn place(particle: &NearParticle) -> DVec3 {
    let [x, y, z] = particle.position;
    DVec3::new(x.into(), y.into(), z.into())
}
