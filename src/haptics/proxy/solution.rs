//! What a solver of Eq. 6 finds.

use glam::DVec3;

/// How far a place may lie within a constraint and still count as outside \[m\]: a hundredth of what the
/// solution has to be true to.
pub const FEASIBLE: f64 = 1e-11;

/// The place that a solver found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution {
    /// The place \[m\].
    pub position: DVec3,
    /// Constraints taken in, or sweeps over all of them.
    pub iterations: u32,
    /// Whether it is outside all constraints, as far as the solver is exact.
    pub is_feasible: bool,
}
