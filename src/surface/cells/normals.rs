//! Normals of vertices.

use super::CellTile;
use crate::surface::labels::{CutMethod, Label};

impl<const NODES: usize> CellTile<NODES> {
    /// Outward normal of a vertex, not normalised: minus the slope of the field that the kept end sees, at
    /// the vertex.
    ///
    /// The slope at a node is the central difference, with (1 2 1)/4 across: wider than the field itself
    /// needs, for the sake of shading, which shows the particles' disorder long before the surface's place
    /// does.
    pub(crate) fn normal(&self, low: usize, axis: usize, variant: usize, t: f64) -> glam::Vec3 {
        let high = low + Self::STEPS[axis];
        let label = if self.is_plain() {
            Label::default()
        } else if variant == 1 || (variant == 0 && self.is_inside(low)) {
            self.labels[low]
        } else {
            self.labels[high]
        };
        let t = t as f32;
        -(self.slope(low, label) * (1.0 - t) + self.slope(high, label) * t)
    }

    fn slope(&self, node: usize, label: Label) -> glam::Vec3 {
        if self.is_plain() {
            return Self::slope_of(node, |n| self.total[n]);
        }
        if self.rules.method == CutMethod::Equation9 {
            return Self::slope_of(node, |n| self.own[n]);
        }
        let mut owners = label.owners().filter_map(|(sheet, side)| Some((self.sheet(label.body, sheet)?, side)));
        let whole = self.whole(label.body);
        let Some((first, side)) = owners.next() else { return Self::slope_of(node, |n| whole[n]) };
        let rest: Vec<_> = owners.collect();
        let value =
            |n: usize| rest.iter().fold(self.value_on(first, n, side), |least, (s, side)| least.min(self.value_on(s, n, *side)));
        Self::slope_of(node, value)
    }

    /// Slope of node values per node spacing: central differences, smoothed across.
    fn slope_of(node: usize, value: impl Fn(usize) -> f32) -> glam::Vec3 {
        const ACROSS: [f32; 3] = [0.25, 0.5, 0.25];
        let [_, along_y, along_z] = Self::STEPS;
        let first = node - 1 - along_y - along_z;
        let mut sum = [0.0f32; 3];
        for (z, wz) in ACROSS.iter().enumerate() {
            for (y, wy) in ACROSS.iter().enumerate() {
                for (x, wx) in ACROSS.iter().enumerate() {
                    let v = value(first + x + y * along_y + z * along_z);
                    let ahead = |i: usize| i as f32 - 1.0;
                    sum[0] += ahead(x) * wy * wz * v;
                    sum[1] += ahead(y) * wx * wz * v;
                    sum[2] += ahead(z) * wx * wy * v;
                }
            }
        }
        glam::Vec3::from_array(sum) * 0.5
    }
}
