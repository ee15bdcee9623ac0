//! Where vertices at the rims of closed cuts stand.

use super::{CROSSING_MIN, CellTile};
use glam::DVec3;

/// How far beyond the sheet a closed cut's lip may go whose other end is outside, in values of
/// (P - M) / (P + M): as far as the disorder of particles makes the sheet stray, 0.06 cells. Where a layer of
/// nodes stands in the sheet, that is their whole edge.
pub(crate) const LIP_REACH: f64 = 0.06;

impl<const NODES: usize> CellTile<NODES> {
    /// Point of a vertex at `t` of an edge, from the edge's low node \[nodes\].
    ///
    /// On the edge, but for the last vertices of a closed cut's lips, which stand as high as all clay beside
    /// them: else rims end in a groove of up to an edge, whose next vertices are a node away on both sides.
    /// They stay within the cells of the edge.
    pub(crate) fn point(&self, low: usize, axis: usize, t: f64) -> DVec3 {
        let on_edge = DVec3::AXES[axis] * t;
        let high = low + Self::STEPS[axis];
        if self.is_plain() || !self.labels[low].is_parted_from(self.labels[high]) {
            return on_edge;
        }
        let closure = between(&self.closure, (low, high), t);
        if closure > 0.0 { on_edge + closure * self.to_free_surface(low, axis, t) } else { on_edge }
    }

    /// From a point of an edge, at right angles to it, to the plane through where all clay ends on the way
    /// to the edges beside that have fewer nodes inside.
    fn to_free_surface(&self, low: usize, axis: usize, t: f64) -> DVec3 {
        let along = Self::STEPS[axis];
        let inside = |low: usize| u8::from(self.is_inside(low)) + u8::from(self.is_inside(low + along));
        let excess = |low: usize| between(&self.total, (low, low + along), t) - f64::from(self.iso);
        let here = excess(low);
        if here <= 0.0 {
            return DVec3::ZERO;
        }
        let nearness = |beside: usize| {
            let there = excess(beside);
            let is_free = there <= 0.0 && inside(beside) < inside(low);
            if is_free { 1.0 / (here / (here - there)).min(1.0 - CROSSING_MIN) } else { 0.0 }
        };
        let mut slope = DVec3::ZERO;
        for across in [(axis + 1) % 3, (axis + 2) % 3] {
            let [below, above] = [low - Self::STEPS[across], low + Self::STEPS[across]].map(nearness);
            // Clay of one node ends on both sides.
            slope[across] = if below == 0.0 || above == 0.0 { above - below } else { 0.0 };
        }
        if slope == DVec3::ZERO { slope } else { slope / slope.length_squared() }
    }

    /// Where the lip of `kept`, whose values are `p`, ends at the sheet on the way to `other`, which is
    /// outside and has more of `m`.
    pub(super) fn lip_end(&self, (p, m): (&[f32], &[f32]), kept: usize, other: usize) -> f64 {
        let reach = LIP_REACH * f64::from(self.closure[kept].min(self.closure[other]));
        let q = |n: usize| f64::from(p[n] - m[n]) / f64::from(p[n] + m[n]) + reach;
        if q(other) < 0.0 { q(kept) / (q(kept) - q(other)) } else { 1.0 }
    }

    /// Whether a cut or a body's face passes a cell or one beside it, in the tile of that cell.
    pub(crate) fn is_at_lips(&self) -> bool {
        let mut nodes = Self::nodes_from(super::HOLD);
        let first = nodes.next().map(|node| self.labels[node]);
        !self.is_plain() && nodes.any(|node| first.is_some_and(|label| !label.has_owners_of(self.labels[node])))
    }
}

fn between(values: &[f32], (low, high): (usize, usize), t: f64) -> f64 {
    f64::from(values[low]) * (1.0 - t) + f64::from(values[high]) * t
}
