//! What an evaluation gathers from and scatters to: four numbers a node, of which three are used. Particles
//! go in [`Pairs`].

use super::super::kernel::Tile;
use super::super::simd::{F8, Node4, Pairs, in_lanes};
use super::vectors::Block3;

/// A slot's 64 nodes.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Rows([Node4; 64]);

/// The nodes -1 .. 5 about a block, in the order of [`Tile`].
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Tile4([Node4; Tile::LEN]);

/// Nodes along an axis, and along z with the padding.
const SIDE: usize = 7;
const PADDED: usize = 8;

/// The last index at which a stencil's first node can stand.
const FIRST_MAX: usize = Tile::at(3, 3, 3);

impl Rows {
    pub(super) const ZERO: Self = Self([Node4([0.0; 4]); 64]);

    /// The block's nodes one after the other.
    pub(super) fn set(&mut self, from: &Block3) {
        set_rows(self, from);
    }

    /// The same back.
    pub(super) fn copy_to(&self, block: &mut Block3) {
        copy_rows(self, block);
    }

    /// Adds what a tile has of this block's nodes, that of the block at `about` (an index of
    /// [`NEIGHBOURS`](super::super::state::NEIGHBOURS)).
    #[inline]
    pub(super) fn add(&mut self, about: usize, tile: &Tile4) {
        match about / 9 {
            0 => self.add_rows::<2>(about, tile, (0, 5)),
            1 => self.add_rows::<4>(about, tile, (0, 1)),
            _ => self.add_rows::<1>(about, tile, (3, 0)),
        }
    }

    /// The same with rows of `N` nodes along z: the first of the block's, and where it stands in the tile.
    #[inline(always)]
    fn add_rows<const N: usize>(&mut self, about: usize, tile: &Tile4, z: (usize, usize)) {
        // The block's nodes that the tile has, from `low` to `high`, and where they stand in it.
        let range = |o: usize| [(0, 2, 5), (0, 4, 1), (3, 4, 0)][o];
        let (x, y) = (range(about % 3), range(about / 3 % 3));
        for i in x.0..x.1 {
            for j in y.0..y.1 {
                let to = self.0[(i * 4 + j) * 4 + z.0..].first_chunk_mut::<N>();
                let from = tile.0[((i - x.0 + x.2) * SIDE + j - y.0 + y.2) * PADDED + z.1..].first_chunk::<N>();
                let (Some(to), Some(from)) = (to, from) else { continue };
                for k in 0..N {
                    for d in 0..4 {
                        to[k].0[d] += from[k].0[d];
                    }
                }
            }
        }
    }
}

in_lanes! {
    fn set_rows(rows: &mut Rows, from: &Block3) {
        for (k, node) in rows.0.iter_mut().enumerate() {
            *node = Node4([from.0[0][k], from.0[1][k], from.0[2][k], 0.0]);
        }
    }
}

in_lanes! {
    fn copy_rows(rows: &Rows, block: &mut Block3) {
        for (k, node) in rows.0.iter().enumerate() {
            for d in 0..3 {
                block.0[d][k] = node.0[d];
            }
        }
    }
}

impl Default for Tile4 {
    fn default() -> Self {
        Self::ZERO
    }
}

impl Tile4 {
    pub(super) const ZERO: Self = Self([Node4([0.0; 4]); Tile::LEN]);

    /// Takes the nodes of the blocks about one: slot + 1 of each, 0 if there is none.
    pub(super) fn fill(&mut self, neighbours: &[u32; 27], of: &[Rows]) {
        static NOTHING: Rows = Rows::ZERO;
        let block = |x: usize, y: usize, z: usize| match neighbours[x + 3 * y + 9 * z] {
            0 => &NOTHING.0,
            slot => &of[slot as usize - 1].0,
        };
        // Which block along an axis, and which of its nodes; the first is the last of the block before.
        let place = |node: usize| {
            let at = node + 3;
            (at / 4, at % 4)
        };
        for x in 0..SIDE {
            for y in 0..SIDE {
                let ((bx, i), (by, j)) = (place(x), place(y));
                let from = (i * 4 + j) * 4;
                let row = &mut self.0[(x * SIDE + y) * PADDED..][..PADDED];
                row[0] = block(bx, by, 0)[from + 3];
                row[1..5].copy_from_slice(&block(bx, by, 1)[from..from + 4]);
                row[5..7].copy_from_slice(&block(bx, by, 2)[from..from + 2]);
            }
        }
    }

    /// The greatest length at a node.
    pub(super) fn length_max(&self) -> f32 {
        self.0.iter().map(|n| n.0[0] * n.0[0] + n.0[1] * n.0[1] + n.0[2] * n.0[2]).fold(0.0, f32::max).sqrt()
    }

    #[inline(always)]
    fn node(&self, index: usize) -> &Node4 {
        // SAFETY: `Stencils` holds first nodes up to `FIRST_MAX`, and the last of its 27 is 130 further.
        unsafe { self.0.get_unchecked(index) }
    }

    #[inline(always)]
    fn node_mut(&mut self, index: usize) -> &mut Node4 {
        // SAFETY: as in `node`.
        unsafe { self.0.get_unchecked_mut(index) }
    }

    /// Two nodes.
    ///
    /// # Safety
    /// They are not the same, and in the tile.
    #[inline(always)]
    unsafe fn two_mut(&mut self, a: usize, b: usize) -> (&mut Node4, &mut Node4) {
        debug_assert!(a != b && a.max(b) < Tile::LEN);
        let nodes = self.0.as_mut_ptr();
        // SAFETY: the caller's.
        unsafe { (&mut *nodes.add(a), &mut *nodes.add(b)) }
    }
}

/// Where eight particles stand on their nodes.
pub(super) struct Stencils {
    /// Along each axis.
    weights: [[F8; 3]; 3],
    /// From the middle one of the 3 nodes along each axis \[cells\].
    from_middle: [F8; 3],
    /// Tile index of the first node.
    first: [usize; 8],
}

impl Stencils {
    /// Of particles at these positions relative to their first nodes, which have these indices in a tile.
    #[inline(always)]
    pub(super) fn of(positions: &[F8; 3], first: &[u32; 8]) -> Self {
        let mut out = Self { weights: [[F8::ZERO; 3]; 3], from_middle: *positions, first: [0; 8] };
        for d in 0..3 {
            let f = positions[d];
            let (a, b, c) = (F8::splat(1.5) - f, f + -1.0, f + -0.5);
            out.weights[d] = [0.5 * (a * a), F8::splat(0.75) - b * b, 0.5 * (c * c)];
            out.from_middle[d] = b;
        }
        for k in 0..8 {
            out.first[k] = (first[k] as usize).min(FIRST_MAX);
        }
        out
    }

    /// At particles `K` and `K + 4`: the nodes' columns of moments about the middle node, and their mean.
    #[inline(always)]
    fn gather_pair<L: Pairs, const K: usize>(&self, nodes: &Tile4) -> [L; 4] {
        let w = |d: usize, i: usize| L::twins::<K>(&self.weights[d][i]);
        let (low, high) = (self.first[K], self.first[K + 4]);
        let zero = L::splat(0.0);
        let mut sums = [zero; 4];
        for z in 0..3 {
            let mut plane = [zero; 3];
            for j in 0..3 {
                let at = |i: usize| (i * SIDE + j) * PADDED + z;
                let q = |i: usize| L::load_nodes(nodes.node(low + at(i)), nodes.node(high + at(i)));
                let (before, after) = (w(0, 0).times(q(0)), w(0, 2).times(q(2)));
                let row = w(0, 1).times_plus(q(1), before).plus(after);
                plane[0] = w(1, j).times_plus(after.minus(before), plane[0]);
                let share = w(1, j).times(row);
                plane[2] = plane[2].plus(share);
                plane[1] = match j {
                    0 => zero.minus(share),
                    1 => plane[1],
                    _ => plane[1].plus(share),
                };
            }
            let share = w(2, z).times(plane[2]);
            sums[0] = w(2, z).times_plus(plane[0], sums[0]);
            sums[1] = w(2, z).times_plus(plane[1], sums[1]);
            sums[2] = match z {
                0 => zero.minus(share),
                1 => sums[2],
                _ => sums[2].plus(share),
            };
            sums[3] = sums[3].plus(share);
        }
        sums
    }

    /// The nodes' moments, column by column, and their mean.
    #[inline(always)]
    pub(super) fn gather<L: Pairs>(&self, nodes: &Tile4) -> [[F8; 3]; 4] {
        let p = self.gather_pair::<L, 0>(nodes);
        let q = self.gather_pair::<L, 1>(nodes);
        let r = self.gather_pair::<L, 2>(nodes);
        let s = self.gather_pair::<L, 3>(nodes);
        let mut out = [[F8::ZERO; 3]; 4];
        for c in 0..4 {
            out[c] = L::to_eight([p[c], q[c], r[c], s[c]]);
        }
        for c in 0..3 {
            for d in 0..3 {
                out[c][d] = out[c][d] - self.from_middle[c] * out[3][d];
            }
        }
        out
    }

    #[inline(always)]
    fn scatter_pair<L: Pairs, const K: usize>(&self, brought: [L; 4], out: &mut Tile4) {
        if self.first[K] == self.first[K + 4] {
            self.scatter_pair_to::<L, K, true>(brought, out);
        } else {
            self.scatter_pair_to::<L, K, false>(brought, out);
        }
    }

    /// Columns and the vector at the middle node. `SAME`: both stand on the same nodes.
    #[inline(always)]
    fn scatter_pair_to<L: Pairs, const K: usize, const SAME: bool>(&self, [kx, ky, kz, middle]: [L; 4], out: &mut Tile4) {
        let w = |d: usize, i: usize| L::twins::<K>(&self.weights[d][i]);
        let (low, high) = (self.first[K], self.first[K + 4]);
        let beside = |at: L, step: L, i: usize| match i {
            0 => at.minus(step),
            1 => at,
            _ => at.plus(step),
        };
        for i in 0..3 {
            let at_x = beside(middle, kx, i);
            for j in 0..3 {
                let weight = w(0, i).times(w(1, j));
                let (at_y, step) = (beside(at_x, ky, j).times(weight), kz.times(weight));
                for z in 0..3 {
                    let (at, vector) = ((i * SIDE + j) * PADDED + z, beside(at_y, step, z));
                    if SAME {
                        vector.times(w(2, z)).add_both(out.node_mut(low + at));
                    } else {
                        // SAFETY: as in `node`; their first nodes are not the same.
                        let (to, other) = unsafe { out.two_mut(low + at, high + at) };
                        vector.times_plus(w(2, z), L::load_nodes(to, other)).store_nodes(to, other);
                    }
                }
            }
        }
    }

    /// Adds what the particles bring: of each node the columns times the way to it and a vector, by its
    /// weight.
    #[inline(always)]
    pub(super) fn scatter<L: Pairs>(&self, columns: &[[F8; 3]; 3], vector: &[F8; 3], out: &mut Tile4) {
        let mut middle = *vector;
        for c in 0..3 {
            for d in 0..3 {
                middle[d] = middle[d] - columns[c][d] * self.from_middle[c];
            }
        }
        let (x, y, z) = (L::from_eight(&columns[0]), L::from_eight(&columns[1]), L::from_eight(&columns[2]));
        let v = L::from_eight(&middle);
        self.scatter_pair::<L, 0>([x[0], y[0], z[0], v[0]], out);
        self.scatter_pair::<L, 1>([x[1], y[1], z[1], v[1]], out);
        self.scatter_pair::<L, 2>([x[2], y[2], z[2], v[2]], out);
        self.scatter_pair::<L, 3>([x[3], y[3], z[3], v[3]], out);
    }

    /// Calls `each` with particle `k`'s weight at a node and the node's index.
    #[inline(always)]
    fn of_one(&self, k: usize, mut each: impl FnMut(f32, usize)) {
        for n in 0..27 {
            let (x, y, z) = (n / 9, n / 3 % 3, n % 3);
            let weight = self.weights[0][x].0[k] * self.weights[1][y].0[k] * self.weights[2][z].0[k];
            each(weight, self.first[k] + (x * SIDE + y) * PADDED + z);
        }
    }

    /// Adds what particle `k` brings, as its weight.
    pub(super) fn add_one(&self, k: usize, brought: [f32; 3], out: &mut Tile4) {
        self.of_one(k, |weight, at| (0..3).for_each(|d| out.node_mut(at).0[d] += weight * brought[d]));
    }
}
