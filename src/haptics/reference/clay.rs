//! Clays at rest at every instant whose force on a tool is known in closed form, with a level surface at y
//! = 0.

use super::super::model::{ContactModel, NearParticle};
use super::super::proxy::{Sphere, ToolSpheres};
use super::bed::Bed;
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// Depth whose stiffness is said of clay that nothing touches yet \[m\].
const TOUCH: f64 = 1e-4;

/// Stiffness across the normal over that along it, of a frictional contact at full stick: Mindlin 1949,
/// `2 (1 - nu) / (2 - nu)` at nu = 0.33.
const ACROSS: f64 = 0.8;

/// How force and depth belong together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// A spring that yields at `yield_force + slope depth`.
    Spring {
        /// \[N/m\]
        stiffness: f64,
        /// \[N\]
        yield_force: f64,
        /// \[N/m\]
        slope: f64,
    },
    /// A rigid flat punch on an elastic half space (Boussinesq 1885): `F = 2 E* a d`.
    Punch {
        /// a \[m\]
        radius: f64,
        /// E* \[Pa\]
        modulus: f64,
    },
    /// A rigid ball on an elastic half space (Hertz 1882): `F = 4/3 E* sqrt(R) d^1.5`.
    Hertz {
        /// R \[m\]
        radius: f64,
        /// E* \[Pa\]
        modulus: f64,
    },
    /// A rigid plate on one of the two sides of an elastic ball (Tatara 1991):
    /// `d = (F / (4/3 E* sqrt(R)))^(2/3) - F f(a) / (pi E)`.
    Tatara {
        /// R \[m\]
        radius: f64,
        /// E \[Pa\]
        young_modulus: f64,
        /// nu [-]
        poisson_ratio: f64,
    },
    /// A cone in rigid-plastic clay: `F = H pi tan^2(alpha) d^2`, unloading with `2 E* a`.
    Cone {
        /// H \[Pa\]
        hardness: f64,
        /// alpha, from the axis \[rad\]
        half_angle: f64,
        /// E* \[Pa\]
        modulus: f64,
    },
}

impl Law {
    /// Force at a depth that only grew \[N\].
    pub fn backbone(&self, depth: f64) -> f64 {
        let d = depth.max(0.0);
        match *self {
            Self::Spring { stiffness, .. } => (stiffness * d).min(self.yield_force(d)),
            Self::Punch { radius, modulus } => 2.0 * modulus * radius * d,
            Self::Hertz { radius, modulus } => 4.0 / 3.0 * modulus * radius.sqrt() * d.powf(1.5),
            Self::Tatara { radius, young_modulus, poisson_ratio } => tatara(radius, young_modulus, poisson_ratio, d),
            Self::Cone { .. } => self.yield_force(d),
        }
    }

    /// Force beyond which the clay gives way at a depth \[N\].
    fn yield_force(&self, depth: f64) -> f64 {
        match *self {
            Self::Spring { yield_force, slope, .. } => yield_force + slope * depth,
            Self::Cone { hardness, half_angle, .. } => hardness * PI * (half_angle.tan() * depth).powi(2),
            _ => f64::INFINITY,
        }
    }

    /// How that grows with depth \[N/m\].
    fn yield_slope(&self, depth: f64) -> f64 {
        match *self {
            Self::Spring { slope, .. } => slope,
            Self::Cone { .. } if depth > 0.0 => 2.0 * self.yield_force(depth) / depth,
            _ => 0.0,
        }
    }

    /// Stiffness at a depth, of clay that does not yield \[N/m\].
    fn stiffness(&self, depth: f64) -> f64 {
        let d = depth.max(TOUCH);
        match *self {
            Self::Spring { stiffness, .. } => stiffness,
            Self::Cone { half_angle, modulus, .. } => 2.0 * modulus * half_angle.tan() * d,
            _ => (self.backbone(1.001 * d) - self.backbone(0.999 * d)) / (0.002 * d),
        }
    }

    /// Whether clay that was let go comes back all the way.
    fn is_elastic(&self) -> bool {
        !matches!(self, Self::Spring { .. } | Self::Cone { .. })
    }
}

/// Force \[N\] of a plate pressed `d` \[m\] into a ball between two plates, by bisection.
fn tatara(radius: f64, young_modulus: f64, poisson_ratio: f64, d: f64) -> f64 {
    let plane = young_modulus / (1.0 - poisson_ratio.powi(2));
    let hertz = 4.0 / 3.0 * plane * radius.sqrt();
    let depth = |force: f64| {
        let a = (0.75 * force * radius / plane).cbrt();
        let square = a * a + 4.0 * radius * radius;
        let far = 2.0 * (1.0 + poisson_ratio) * radius * radius / square.powf(1.5);
        let f = far + (1.0 - poisson_ratio.powi(2)) / square.sqrt();
        (force / hertz).powf(2.0 / 3.0) - force * f / (PI * young_modulus)
    };
    let (mut low, mut high) = (0.0, 2.0 * hertz * d.powf(1.5));
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if depth(middle) < d { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// A tool in a clay: the state of its contact.
#[derive(Clone, Copy, Debug)]
pub struct ReferenceClay {
    /// Its law.
    pub law: Law,
    /// Coefficient of friction [-].
    pub friction: f64,
    /// Depth that stays when the tool is let go \[m\].
    dent: f64,
    /// Where the tool sticks, across the normal \[m\].
    stick: DVec3,
    tool: DVec3,
    force: DVec3,
    /// Whether its models hold particles.
    has_particles: bool,
}

/// Particles along a side of those under a tool, of two layers.
const SIDE: u32 = 11;

/// Depth over which clay under a dent gives way \[m\].
const DECAY: f64 = 5e-3;

/// A tool of 3 x 3 spheres whose lowest points are at its origin's height, for clay with particles.
pub fn flat_tool() -> ToolSpheres {
    let at = |i: i32| f64::from(i - 1) * 1.5e-3;
    let sphere = |i: i32| Sphere { centre: DVec3::new(at(i / 3), Bed::RADIUS, at(i % 3)), radius: Bed::RADIUS };
    ToolSpheres::new(&(0..9).map(sphere).collect::<Vec<_>>())
}

impl ReferenceClay {
    /// Clay that no tool has touched.
    pub fn new(law: Law, friction: f64) -> Self {
        let (tool, stick, force) = (DVec3::Y, DVec3::ZERO, DVec3::ZERO);
        Self { law, friction, dent: 0.0, stick, tool, force, has_particles: false }
    }

    /// The same with two layers of particles in its models, whose tops are the surface or the floor of the
    /// dent.
    pub fn with_particles(self) -> Self {
        Self { has_particles: true, ..self }
    }

    /// The force on a tool that has come to `place` in a straight line \[N\].
    pub fn force(&mut self, place: DVec3) -> DVec3 {
        let depth = -place.y;
        let across = place * DVec3::new(1.0, 0.0, 1.0);
        let stiffness = self.law.stiffness(depth);
        let pressed = if self.law.is_elastic() {
            self.law.backbone(depth)
        } else {
            let bound = self.law.yield_force(depth.max(0.0));
            let spring = stiffness * (depth - self.dent);
            if spring > bound {
                self.dent = depth - bound / stiffness;
            }
            spring.min(bound).max(0.0)
        };
        let rubbed = (ACROSS * stiffness * (self.stick - across)).clamp_length_max(self.friction * pressed);
        self.stick = across + rubbed / (ACROSS * stiffness);
        self.tool = place;
        self.force = DVec3::Y * pressed + rubbed;
        self.force
    }

    /// What a frame says that ended where the tool is now, of the mean of force \[N\] and place \[m\] over it.
    pub fn model(&self, force: DVec3, place: DVec3) -> ContactModel {
        let depth = -place.y;
        let stiffness = self.law.stiffness(depth);
        let across = if self.friction > 0.0 { ACROSS * stiffness } else { 0.0 };
        // Above its dent the tool touches nothing.
        let gap = if force.y > 0.0 { 0.0 } else { (self.dent - depth).max(0.0) };
        // Of a frame that touched in part the mean place may lie above the clay: the line goes on.
        let touch = depth + gap;
        let slope = self.law.yield_slope(touch);
        let mut model = ContactModel {
            rate: 1.0,
            position: place,
            force,
            normal: DVec3::Y,
            gap,
            stiffness: DMat3::from_diagonal(DVec3::new(across, stiffness, across)),
            yield_force: self.law.yield_force(touch.max(0.0)) + slope * touch.min(0.0),
            yield_slope: slope,
            friction: self.friction,
            density: 1.0,
            ..ContactModel::NONE
        };
        if self.has_particles {
            self.place_particles(&mut model);
        }
        model
    }

    /// Particles under the tool: at the floor of the dent as deep as it, below it less.
    fn place_particles(&self, model: &mut ContactModel) {
        let floor = if self.force.y > 0.0 { self.dent.max(-self.tool.y) } else { self.dent };
        let middle = 0.5 * f64::from(SIDE - 1);
        let along = |i: u32| (f64::from(i) - middle) * Bed::SPACING;
        model.near_count = 2 * SIDE * SIDE;
        for (id, particle) in (0..).zip(&mut model.near[..(2 * SIDE * SIDE) as usize]) {
            let (layer, column) = (id / (SIDE * SIDE), id % (SIDE * SIDE));
            let depth = f64::from(layer) * Bed::SPACING;
            let height = -Bed::PARTICLE - depth - floor * (-depth / DECAY).exp();
            let place = DVec3::new(along(column / SIDE), height, along(column % SIDE));
            *particle = NearParticle { id, position: place.as_vec3().to_array(), radius: Bed::PARTICLE as f32 };
        }
    }

    /// Where the tool is \[m\].
    pub fn tool(&self) -> DVec3 {
        self.tool
    }
}
