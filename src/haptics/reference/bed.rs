//! A bed of spheres on a jittered lattice, as clay's particles lie, and tools of spheres.

use super::super::model::{NEAR_MAX, NearParticle};
use super::super::proxy::{Sphere, ToolSpheres};
use glam::{DVec3, IVec3};

/// Random numbers that are the same everywhere.
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// A number of [0, 1), by xorshift (Marsaglia 2003).
    pub fn unit(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A tool of `side` x `side` spheres in a level square, `spacing` \[m\] apart.
pub fn square_tool(side: usize, spacing: f64, radius: f64) -> ToolSpheres {
    let middle = 0.5 * (side as f64 - 1.0);
    let centre = |i: usize| DVec3::new((i / side) as f64 - middle, 0.0, (i % side) as f64 - middle) * spacing;
    let spheres: Vec<Sphere> = (0..side * side).map(|i| Sphere { centre: centre(i), radius }).collect();
    ToolSpheres::new(&spheres)
}

/// A bed of spheres whose top layer lies about y = 0.
#[derive(Clone, Debug)]
pub struct Bed {
    /// Its particles.
    pub particles: Vec<NearParticle>,
}

impl Bed {
    /// Lattice constant \[m\].
    pub const SPACING: f64 = 1.2e-3;
    /// Radius of a tool's sphere \[m\].
    pub const RADIUS: f64 = 1.2e-3;
    /// Radius of a particle \[m\].
    pub const PARTICLE: f64 = 0.66e-3;

    /// A bed of 25 x 13 x 25 particles, each off its lattice point by up to 0.15 of the lattice constant.
    pub fn new(seed: u64) -> Self {
        let mut random = Random(seed);
        let mut particles = vec![];
        for i in 0..25 * 13 * 25 {
            let at = IVec3::new(i / (13 * 25) - 12, i / 25 % 13 - 12, i % 25 - 12).as_dvec3();
            let mut off = || 0.3 * (random.unit() - 0.5);
            let place = (at + DVec3::new(off(), off(), off())) * Self::SPACING;
            let id = i.unsigned_abs();
            particles.push(NearParticle { id, position: place.as_vec3().to_array(), radius: Self::PARTICLE as f32 });
        }
        Self { particles }
    }

    /// A place above the bed for a tool, 4 mm beside its middle.
    pub fn above(&self, tool: &ToolSpheres) -> DVec3 {
        DVec3::new(-4e-3, 1.02 * (tool.radius_min() + Self::PARTICLE), 0.0)
    }

    /// Where a hand is that goes in by `depth` \[m\] in 40 ticks and drags along x at 50 mm/s.
    pub fn drag(&self, tick: usize, depth: f64) -> DVec3 {
        let share = (tick as f64 / 40.0).min(1.0);
        DVec3::new(-4e-3 + tick as f64 * 5e-5, Self::RADIUS + Self::PARTICLE - depth * share, 0.0)
    }

    /// The particles nearest to a place, as many as a contact model holds, the nearest first.
    pub fn near(&self, place: DVec3) -> Vec<NearParticle> {
        let distance = |p: &NearParticle| {
            let [x, y, z] = p.position;
            DVec3::new(x.into(), y.into(), z.into()).distance_squared(place)
        };
        let mut near = self.particles.clone();
        near.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        near.truncate(NEAR_MAX);
        near
    }
}
