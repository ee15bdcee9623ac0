//! What a clay frame says to the hand: its contact, of first order about the pose at which it was read.

use crate::sim::touch::EdgeTouch;
use glam::{DMat3, DQuat, DVec3};

/// Particles near the tool that a model holds, at most.
pub const NEAR_MAX: usize = 256;

/// A particle near the tool.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NearParticle {
    /// Which it is: the same from frame to frame.
    pub id: u32,
    /// Where it is \[m\], in the world's frame.
    pub position: [f32; 3],
    /// Radius of a ball of its volume \[m\].
    pub radius: f32,
}

/// Edges that a flat blade has, at most.
pub const EDGES_MAX: usize = 4;

/// What clay bears of a flat blade, whose plane is the XY plane of the tool's own frame, where the tool is as
/// the frame ends. All of it yields by direction: `f = -sum_e t_e m_e + s + b n`, m_e the edges' outward
/// normals, n the front's,
///
/// | part | bound |
/// |---|---|
/// | edge | `0 <= t_e <= R L_e`, against its advance alone, and where it has come to whole clay |
/// | flanks | `abs s <= 2 k A + friction abs b` in the plane, against sliding either way |
/// | across | `-bearing[0] <= b <= bearing[1]`: held on both sides |
///
/// Forces that grow with the tool's place are of first order in it, and count as none below 0: so before
/// touch they are negative by the way that is left.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BladeContact {
    /// Traction of the flanks `2 k A` \[N\].
    pub flank: f64,
    /// Its growth with the tool's place, in the tool's own frame \[N/m\].
    pub flank_growth: DVec3,
    /// Force beyond which the clay in front gives way to the blade, and the clay behind it \[N\].
    pub bearing: [f64; 2],
    /// Their growth, as the flanks' \[N/m\].
    pub bearing_growth: [DVec3; 2],
    /// Its edges; what is over has no direction and no force.
    pub edges: [EdgeTouch; EDGES_MAX],
}

impl BladeContact {
    /// The same in a frame whose lengths are `scale` times as great; directions are the tool's own.
    pub fn scaled(&self, scale: f64) -> Self {
        Self {
            flank_growth: self.flank_growth / scale,
            bearing_growth: self.bearing_growth.map(|growth| growth / scale),
            edges: self.edges.map(|edge| EdgeTouch { gap: edge.gap * scale, ..edge }),
            ..*self
        }
    }
}

/// Contact of a tool with clay in one clay frame. Of fixed size and free of pointers: it is handed to the
/// servo without waiting.
#[derive(Clone, Copy, Debug)]
pub struct ContactModel {
    /// Clay frame.
    pub frame: u64,
    /// When it was published, by the host's clock \[s\].
    pub stamp: f64,
    /// Clay time that a second of wall time takes \[-\]; 0 while the clay is paused.
    pub rate: f64,
    /// Whether the clay is known to rest: its model stays true however old it is, as long as it is renewed.
    pub is_resting: bool,
    /// Place of the tool at which the rest was read \[m\].
    pub position: DVec3,
    /// The tool's rotation there.
    pub rotation: DQuat,
    /// Force of the clay on the tool, averaged over the frame \[N\].
    pub force: DVec3,
    /// Whether the frame's steps were too few for what happened in it: its impulse is what the clay was
    /// given, and says little of the force that is next.
    pub is_poor: bool,
    /// Hand time that the frame took in \[s\]: the first and the last of the samples that the clay's tool has
    /// followed in it, by the clock of [`DeviceState`](super::device::DeviceState). Equal where no clay was
    /// run.
    pub span: [f64; 2],
    /// Equal parts of the span at whose ends the force was read, as implicit steps have it; 0 where it is the
    /// mean over all of it.
    pub parts: u32,
    /// Out of the clay, of unit length; zero where there is no clay near. Of a flat blade its front's.
    pub normal: DVec3,
    /// Way against the normal that is left before the tool touches \[m\]; 0 where it does.
    pub gap: f64,
    /// How the force falls with the tool's place: `force(x) = force - stiffness (x - position)` \[N/m\].
    /// Symmetric, no eigenvalue negative. Where nothing touches yet, what it will be at the first touch.
    pub stiffness: DMat3,
    /// Force along the normal beyond which the clay gives way, at `position`, or where the tool will touch
    /// if it does not yet \[N\]; infinite where it does not.
    pub yield_force: f64,
    /// How that force grows with depth, against the normal \[N/m\].
    pub yield_slope: f64,
    /// Coefficient of friction of the tool on the clay \[-\].
    pub friction: f64,
    /// What a flat blade yields at, by direction, in place of `gap` and the yield force; none of other tools.
    pub blade: Option<BladeContact>,
    /// Fill of the clay about the tool, 1 in the midst of it \[-\].
    pub density: f64,
    /// Its gradient \[1/m\].
    pub density_gradient: DVec3,
    /// How many of `near` there are.
    pub near_count: u32,
    /// Particles near the tool, the nearest first.
    pub near: [NearParticle; NEAR_MAX],
}

impl ContactModel {
    /// A tool that touches nothing.
    pub const NONE: Self = Self {
        frame: 0,
        stamp: f64::NEG_INFINITY,
        rate: 0.0,
        is_resting: false,
        position: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        force: DVec3::ZERO,
        is_poor: false,
        span: [0.0; 2],
        parts: 0,
        normal: DVec3::ZERO,
        gap: 0.0,
        stiffness: DMat3::ZERO,
        yield_force: f64::INFINITY,
        yield_slope: 0.0,
        friction: 0.0,
        blade: None,
        density: 0.0,
        density_gradient: DVec3::ZERO,
        near_count: 0,
        near: [NearParticle { id: 0, position: [0.0; 3], radius: 0.0 }; NEAR_MAX],
    };

    /// Force along the normal beyond which the clay gives way with the tool at `place` \[N\].
    pub fn yield_at(&self, place: DVec3) -> f64 {
        (self.yield_force + self.yield_slope * (self.position - place).dot(self.normal)).max(0.0)
    }

    /// Particles near the tool, the nearest first.
    pub fn near(&self) -> &[NearParticle] {
        &self.near[..(self.near_count as usize).min(NEAR_MAX)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In a frame of lengths three times as great a blade bears what it bore at the same place.
    #[test]
    fn scaled_blade_bears_the_same_at_the_same_place() {
        let edge = EdgeTouch { outward: DVec3::NEG_Y, gap: 2e-3, force: 0.1 };
        let blade = BladeContact {
            flank: 0.2,
            flank_growth: DVec3::NEG_Y * 40.0,
            bearing: [0.3, 0.4],
            bearing_growth: [DVec3::NEG_Y * 60.0, DVec3::X * 90.0],
            edges: [edge; EDGES_MAX],
        };
        let (scaled, way) = (blade.scaled(3.0), DVec3::new(1e-3, -2e-3, 0.0));
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-15, "{a} is not {b}");
        near(scaled.flank + scaled.flank_growth.dot(3.0 * way), blade.flank + blade.flank_growth.dot(way));
        for side in 0..2 {
            let [a, b] = [(scaled, 3.0 * way), (blade, way)].map(|(of, way)| of.bearing[side] + of.bearing_growth[side].dot(way));
            near(a, b);
        }
        near(scaled.edges[0].gap, 6e-3);
        assert_eq!((scaled.edges[0].outward, scaled.edges[0].force), (edge.outward, edge.force));
    }
}
