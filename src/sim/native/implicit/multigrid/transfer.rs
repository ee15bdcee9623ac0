//! From level to level: trilinear interpolation and its transpose, slot by slot, of one component.
//!
//! A slot's nodes are interpolated from 3^3 coarse ones, from node 0 or 2 of its parent's along each axis on;
//! the third of a slot in the upper half stands in the parent's neighbour.

use super::super::super::super::implicit::COARSE_SCALE;
use super::super::super::simd::in_lanes;
use super::super::vectors::Block1;
use glam::IVec3;

/// Sums of a component of a slot's nodes for the 3^3 coarse nodes that these are interpolated from: rows of 3
/// along z, padded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Partial([[f32; 4]; 9]);

impl Partial {
    pub(super) const ZERO: Self = Self([[0.0; 4]; 9]);
}

/// Which half of its parent a block is, along an axis.
fn half(block: i32) -> usize {
    usize::from(block & 1 == 1)
}

/// The transpose of interpolation of four nodes.
#[inline(always)]
fn gathered<const N: usize>(v: [[f32; N]; 4]) -> [[f32; N]; 3] {
    std::array::from_fn(|i| {
        std::array::from_fn(|k| match i {
            0 => v[0][k] + 0.5 * v[1][k],
            1 => 0.5 * (v[1][k] + v[3][k]) + v[2][k],
            _ => 0.5 * v[3][k],
        })
    })
}

/// Interpolation of four nodes.
#[inline(always)]
fn spread<const N: usize>(c: [[f32; N]; 3]) -> [[f32; N]; 4] {
    std::array::from_fn(|i| std::array::from_fn(|k| if i % 2 == 0 { c[i / 2][k] } else { 0.5 * (c[i / 2][k] + c[i / 2 + 1][k]) }))
}

in_lanes! {
    /// What a slot gives to coarse nodes: of `values`, where `inverse` is not 0.
    pub(super) fn restrict(values: &[f32; 64], inverse: &[f32; 64], partial: &mut Partial) {
        let mut free = [0.0; 64];
        for n in 0..64 {
            free[n] = if inverse[n] > 0.0 { values[n] } else { 0.0 };
        }
        let planes: [[f32; 16]; 4] = std::array::from_fn(|x| std::array::from_fn(|k| free[x * 16 + k]));
        for (x, plane) in gathered(planes).iter().enumerate() {
            let rows: [[f32; 4]; 4] = std::array::from_fn(|y| std::array::from_fn(|z| plane[y * 4 + z]));
            for (y, row) in gathered(rows).iter().enumerate() {
                let [p, q, r] = gathered(row.map(|v| [v]));
                partial.0[x * 3 + y] = [p[0], q[0], r[0], 0.0];
            }
        }
    }
}

in_lanes! {
    /// What the nodes of a coarse slot got, of the slots at `children`: slot + 1 at each of the blocks
    /// -1 ..= 1 about its own first one, z fastest; 0 if there is none.
    pub(super) fn collect(children: &[u32; 27], partials: &[Partial], sum: &mut [f32; 64]) {
        *sum = [0.0; 64];
        // Which of a child's three coarse nodes are this slot's, and where they stand in it.
        let ranges = [(2, 1, 0), (0, 3, 0), (0, 2, 2)];
        for (o, child) in children.iter().enumerate() {
            let Some(partial) = child.checked_sub(1).map(|child| &partials[child as usize]) else { continue };
            let (x, y, z) = (ranges[o / 9], ranges[o / 3 % 3], ranges[o % 3]);
            for i in 0..x.1 {
                for j in 0..y.1 {
                    let (row, to) = (&partial.0[(x.0 + i) * 3 + y.0 + j], ((x.2 + i) * 4 + y.2 + j) * 4 + z.2);
                    for k in 0..z.1 {
                        sum[to + k] += row[z.0 + k];
                    }
                }
            }
        }
    }
}

in_lanes! {
    /// Adds to `values`, where `inverse` is not 0, what the coarse nodes about a block give: of the slots at
    /// `parents`, slot + 1 of the parent and its upper neighbours, z fastest; 0 if there is none.
    pub(super) fn interpolate(block: IVec3, parents: &[u32; 8], coarse: &[Block1], inverse: &[f32; 64], values: &mut [f32; 64]) {
        let first = block.to_array().map(half);
        let place = |axis: usize, i: usize| ((2 * first[axis] + i) / 4, (2 * first[axis] + i) % 4);
        let mut about = Partial::ZERO;
        for x in 0..3 {
            for y in 0..3 {
                for z in 0..3 {
                    let [(ex, x4), (ey, y4), (ez, z4)] = [place(0, x), place(1, y), place(2, z)];
                    let Some(parent) = parents[ex * 4 + ey * 2 + ez].checked_sub(1) else { continue };
                    about.0[x * 3 + y][z] = coarse[parent as usize].0[(x4 * 4 + y4) * 4 + z4];
                }
            }
        }
        let rows = about.0.map(|[p, q, r, _]| {
            let [a, b, c, d] = spread([[p], [q], [r]]);
            [a[0], b[0], c[0], d[0]]
        });
        let planes: [[f32; 16]; 3] = std::array::from_fn(|x| {
            let plane = spread([rows[x * 3], rows[x * 3 + 1], rows[x * 3 + 2]]);
            std::array::from_fn(|k| plane[k / 4][k % 4])
        });
        for (x, plane) in spread(planes).iter().enumerate() {
            for (k, correction) in plane.iter().enumerate() {
                let n = x * 16 + k;
                values[n] += if inverse[n] > 0.0 { COARSE_SCALE as f32 * *correction } else { 0.0 };
            }
        }
    }
}

/// The blocks of the next level that a block's nodes are interpolated from, and which of their children it is
/// (each -1 ..= 1); which of the eight about its parent they are.
pub(super) fn parents_of(block: IVec3) -> impl Iterator<Item = (usize, IVec3, IVec3)> {
    let low = block.div_euclid(IVec3::splat(2));
    let steps = (0..8).map(|e| (e, IVec3::new(e as i32 >> 2, e as i32 >> 1 & 1, e as i32 & 1)));
    steps.filter_map(move |(e, step)| {
        let child = block - 2 * (low + step);
        (child.min_element() >= -1).then_some((e, low + step, child))
    })
}
