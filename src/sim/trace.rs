//! What stands at the nodes after one substep: how tests compare an engine with the oracle pass by pass.

use super::cut::ClassKey;
use glam::{DVec3, IVec3};

/// One class of clay at one node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TracedNode {
    /// Grid coordinate.
    pub node: IVec3,
    /// On which sides of which cuts.
    pub key: ClassKey,
    /// Mass \[kg\] that `p2g` brought.
    pub mass: f64,
    /// Momentum [kg m/s] that `p2g` brought.
    pub momentum: DVec3,
    /// Velocity [m/s] after `grid`.
    pub velocity: DVec3,
}
