//! What goes into a mode, and what comes out.

use glam::{DQuat, DVec3};

/// What a mode makes of a pose.
#[derive(Clone, Copy, Debug)]
pub(super) struct Felt {
    /// On the tool \[N\].
    pub(super) force: DVec3,
    /// Where the clay's tool is to be \[m\].
    pub(super) tool: DVec3,
    pub(super) is_touching: bool,
    pub(super) is_caught: bool,
    pub(super) gap: f64,
    pub(super) iterations: u32,
}

impl Felt {
    pub(super) fn new(force: DVec3, tool: DVec3) -> Self {
        Self { force, tool, is_touching: force != DVec3::ZERO, is_caught: false, gap: f64::INFINITY, iterations: 0 }
    }
}

/// The hand as the modes see it, in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hand {
    pub(super) time: f64,
    pub(super) dt: f64,
    pub(super) position: DVec3,
    pub(super) rotation: DQuat,
    pub(super) velocity: DVec3,
}
