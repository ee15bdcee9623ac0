//! What a tool meets at a frame's end, as reports have it: `patch` makes it.

use super::tool::Pose;
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

/// Particles that a touch holds, at most: as many as a loop of a thousand times a second can look at.
pub const NEAR_MAX: usize = 256;

/// A particle near a tool.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TouchParticle {
    /// Stable identity.
    pub id: u32,
    /// Place \[m\].
    pub position: DVec3,
    /// Radius of a ball of its rest volume \[m\].
    pub radius: f64,
}

/// The clay ahead of an edge of a flat blade.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EdgeTouch {
    /// The edge's unit normal, outwards in the blade's plane, in the tool's own frame.
    pub outward: DVec3,
    /// Way along that before it comes to clay that it has not cut \[m\]; 0 where it stands before such.
    pub gap: f64,
    /// Force against its advance there: the clay's toughness times the length that meets whole clay \[N\]
    /// (Atkins 2009).
    pub force: f64,
}

/// What clay bears of a flat blade, whose plane is the XY plane of the tool's own frame: each force at the
/// frame's end, negative by the way that is left where the blade does not touch, and its growth with the
/// blade's place \[N/m\] in that frame.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BladeTouch {
    /// Traction of both flanks against sliding, in any direction of the plane \[N\].
    pub flank: f64,
    /// Its growth \[N/m\].
    pub flank_growth: DVec3,
    /// What the clay in front, towards +Z, bears of a blade that presses on it, and what that behind \[N\].
    pub bearing: [f64; 2],
    /// Their growth \[N/m\].
    pub bearing_growth: [DVec3; 2],
    /// Its edges: of a rectangle those at -Y, +X, +Y and -X, of a triangle that at +X, +Y and -X.
    pub edges: Vec<EdgeTouch>,
}

/// What a tool meets.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ToolTouch {
    /// The tool's id.
    pub id: u32,
    /// Its pose at the frame's end.
    pub pose: Pose,
    /// Mean of its position over the frame \[m\], of implicit steps at their ends: where the mean force
    /// belongs.
    pub mean_position: DVec3,
    /// Its way in the latter half of the frame \[m\].
    #[serde(default)]
    pub latter_way: DVec3,
    /// Mean force on it over the frame \[N\].
    pub force: DVec3,
    /// Out of the clay, of unit length; zero where no clay is near, and of wires and bent blades. Of a flat
    /// blade its front's.
    pub normal: DVec3,
    /// Way against the normal before it touches \[m\]; 0 where it does, and of blades.
    pub gap: f64,
    /// Area of what touches across the normal, or will \[m^2\]; of a blade on both flanks.
    pub area: f64,
    /// Fall of the force with the tool's place \[N/m\].
    pub stiffness: DMat3,
    /// Whether the clay that it touches flows.
    pub is_yielding: bool,
    /// Force along the normal beyond which clay gives way \[N\]; none of clay that does not yield.
    pub yield_force: Option<f64>,
    /// Growth of that with depth \[N/m\].
    pub yield_slope: f64,
    /// Coefficient of friction [-]; of blades beside what clings to them.
    pub friction: f64,
    /// What clay bears of a flat blade; none of other tools, and where none is near.
    #[serde(default)]
    pub blade: Option<BladeTouch>,
    /// Fill about the patch, 1 within the clay [-].
    pub fill: f64,
    /// Its gradient \[1/m\].
    pub fill_gradient: DVec3,
    /// The particles nearest to it, the nearest first.
    pub near: Vec<TouchParticle>,
}
