//! The quadratic B-spline between particles and nodes.

/// Its value at `distance` \[cells\] from a node [-].
pub(crate) fn spline(distance: f64) -> f64 {
    let r = distance.abs();
    if r < 0.5 { 0.75 - r * r } else { 0.5 * (1.5 - r).max(0.0).powi(2) }
}
