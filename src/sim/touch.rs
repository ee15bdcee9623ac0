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

/// What a tool meets.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ToolTouch {
    /// The tool's id.
    pub id: u32,
    /// Its pose at the frame's end.
    pub pose: Pose,
    /// Mean of its position over the frame \[m\]: where the mean force belongs.
    pub mean_position: DVec3,
    /// Mean force on it over the frame \[N\].
    pub force: DVec3,
    /// Out of the clay, of unit length; zero where no clay is near, and of blades.
    pub normal: DVec3,
    /// Way against the normal before it touches \[m\]; 0 where it does.
    pub gap: f64,
    /// Area of what touches across the normal, or will \[m^2\].
    pub area: f64,
    /// Fall of the force with the tool's place \[N/m\].
    pub stiffness: DMat3,
    /// Whether the clay that it touches flows.
    pub is_yielding: bool,
    /// Force along the normal beyond which clay gives way \[N\]; none of clay that does not yield.
    pub yield_force: Option<f64>,
    /// Growth of that with depth \[N/m\].
    pub yield_slope: f64,
    /// Coefficient of friction [-].
    pub friction: f64,
    /// Fill about the patch, 1 within the clay [-].
    pub fill: f64,
    /// Its gradient \[1/m\].
    pub fill_gradient: DVec3,
    /// The particles nearest to it, the nearest first.
    pub near: Vec<TouchParticle>,
}
