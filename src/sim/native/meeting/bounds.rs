//! What bounds the clay at the nodes of a substep.

use super::super::super::cutting::CuttingMethod;
use super::super::super::params::{BLOCK, Domain, Wall};
use super::super::contact::ToolNow;
use super::super::walls::Arrivals;
use glam::IVec3;

/// Walls and tools of one substep.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Meeting<'a> {
    pub domain: &'a Domain,
    pub tools: &'a [ToolNow],
    /// How tools act on the clay.
    pub cutting: CuttingMethod,
    /// Which nodes of walls hold clay.
    pub arrivals: &'a Arrivals,
}

impl Meeting<'_> {
    /// Solid tools press on particles; but for the method that makes them nodes' masses.
    fn acts_on_nodes(&self, tool: &ToolNow) -> bool {
        match self.cutting {
            CuttingMethod::TwoFields | CuttingMethod::Published | CuttingMethod::RigidParticles => tool.blade.is_some(),
            CuttingMethod::InteractiveParticles => true,
        }
    }

    /// Whether a wall that holds clay stands in the block or a tool that acts on nodes is near it.
    pub(in super::super) fn concerns(&self, block: IVec3) -> bool {
        let (low, high) = self.domain.wall_nodes();
        let is_at = |walls: [Wall; 3], w: IVec3| (0..3).any(|d| walls[d] != Wall::Separate && w[d] / BLOCK == block[d]);
        let walls = self.domain.walls;
        is_at(walls.low, low)
            || is_at(walls.high, high)
            || self.tools.iter().any(|t| self.acts_on_nodes(t) && t.is_near_block(block))
    }
}
