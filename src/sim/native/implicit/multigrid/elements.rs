//! The product of a level's operator with a vector, element by element.
//!
//! Along each axis the corners of a cell are taken as their sum and their difference. There a unit cell's
//! matrices are diagonal: `k = [1 -1; -1 1]` has 0 and 1, `m = [2 1; 1 2] / 6` has 1/4 and 1/12. Of the eight
//! products of sums and differences each component has one number, of a cell its fill is a factor. Rows of
//! nodes along z are lanes; sums and differences of a row serve all four cells about it.

use super::super::super::nodes::local;
use super::super::super::simd::has_fma;
use super::super::super::simd::{F8, Lanes};
use super::super::super::state::NEIGHBOURS;
use super::super::vectors::Block3;
use std::mem::MaybeUninit;

/// Nodes -1 ..= 4 about a block along an axis, and cells -1 ..= 3.
const NODES: usize = 6;
const CELLS: usize = 5;

/// A tile's numbers of one component: rows of 8 along z, and what a shifted row reads beyond the last.
const TILE: usize = NODES * NODES * 8 + 8;

/// The nodes about a block, z fastest and padded.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
struct Tile([[f32; TILE]; 3]);

/// How full the cells -1 ..= 3 about a block are, z fastest and padded by 0.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(super) struct Cells {
    rows: [[f32; 8]; CELLS * CELLS],
    /// Which rows have any fill, a bit each.
    some: u32,
}

/// The number of each product of sums and differences (x slowest; 1 is a difference), by component.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Modes {
    of: [[f32; 8]; 3],
    has_fma: bool,
}

impl Modes {
    /// Of cells of this width, in cells of the finest level.
    pub(super) fn new(mu: f32, lambda: f32, width: f32) -> Self {
        let (k, m) = ([0.0, 1.0], [1.0 / 4.0, 1.0 / 12.0]);
        let of = |a: usize| {
            let moduli: [f32; 3] = std::array::from_fn(|axis| width * if axis == a { lambda + 2.0 * mu } else { mu });
            std::array::from_fn(|mode| {
                let [x, y, z] = [mode >> 2 & 1, mode >> 1 & 1, mode & 1];
                moduli[0] * k[x] * m[y] * m[z] + moduli[1] * m[x] * k[y] * m[z] + moduli[2] * m[x] * m[y] * k[z]
            })
        };
        Self { of: [0, 1, 2].map(of), has_fma: has_fma() }
    }
}

impl Cells {
    pub(super) const EMPTY: Self = Self { rows: [[0.0; 8]; CELLS * CELLS], some: 0 };

    /// The cells about a slot, from the fill of slots of its class.
    pub(super) fn new<'a>(fill_of: impl Fn(usize) -> Option<&'a [f32; 64]>) -> Self {
        let mut cells = Self::EMPTY;
        for (i, offset) in NEIGHBOURS.iter().enumerate() {
            let Some(fill) = (offset.max_element() < 1).then(|| fill_of(i)).flatten() else { continue };
            // Along each axis: the last cell of the block before, or those of the block itself.
            let [x, y, z] = offset.to_array().map(|o| if o < 0 { (3..4, 4) } else { (0..4, 0) });
            for a in x.0 {
                for b in y.0.clone() {
                    for c in z.0.clone() {
                        let row = (a + 1 - x.1) * CELLS as i32 + b + 1 - y.1;
                        cells.rows[row as usize][(c + 1 - z.1) as usize] = fill[local(a, b, c)];
                    }
                }
            }
        }
        for (i, row) in cells.rows.iter().enumerate() {
            cells.some |= u32::from(row.iter().any(|fill| *fill != 0.0)) << i;
        }
        cells
    }

    /// The fill of the eight cells about each node of the block.
    pub(super) fn about_nodes(&self) -> [f32; 64] {
        std::array::from_fn(|node| {
            let (x, y, z) = (node / 16, node / 4 % 4, node % 4);
            let row = |i: usize| self.rows[(x + i / 2) * CELLS + y + i % 2];
            (0..4).map(|i| row(i)[z] + row(i)[z + 1]).sum()
        })
    }

    /// Whether there is no clay about.
    pub(super) fn is_empty(&self) -> bool {
        self.some == 0
    }
}

/// Adds to `product` that of the elements with the vector: of a slot from the blocks about it.
pub(super) fn add_product(modes: &Modes, cells: &Cells, vector: &[Block3], neighbours: &[u32; 27], product: &mut Block3) {
    #[cfg(target_arch = "x86_64")]
    if modes.has_fma {
        // SAFETY: `has_fma` is set only after AVX2 and FMA were detected.
        return unsafe { add_product_avx2(modes, cells, vector, neighbours, product) };
    }
    add_product_with::<F8>(modes, cells, vector, neighbours, product);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn add_product_avx2(modes: &Modes, cells: &Cells, vector: &[Block3], neighbours: &[u32; 27], product: &mut Block3) {
    add_product_with::<super::super::super::simd::Wide>(modes, cells, vector, neighbours, product);
}

#[inline(always)]
fn add_product_with<L: Lanes>(modes: &Modes, cells: &Cells, vector: &[Block3], neighbours: &[u32; 27], product: &mut Block3) {
    let mut tile = MaybeUninit::uninit();
    let tile = gather(vector, neighbours, &mut tile);
    for a in 0..3 {
        add_component::<L>(&modes.of[a], cells, &tile.0[a], &mut product.0[a]);
    }
}

/// Brings the nodes about a slot to `tile`.
#[inline(always)]
fn gather<'a>(vector: &[Block3], neighbours: &[u32; 27], tile: &'a mut MaybeUninit<Tile>) -> &'a Tile {
    static NOTHING: Block3 = Block3::ZERO;
    let block = |x: usize, y: usize, z: usize| match neighbours[x + 3 * y + 9 * z] {
        0 => &NOTHING,
        slot => &vector[slot as usize - 1],
    };
    // Which block along an axis, and which of its nodes; the first is the last of the block before.
    let place = |i: usize| {
        let at = i + 3;
        (at / 4, at % 4)
    };
    let numbers = tile.as_mut_ptr().cast::<f32>();
    // SAFETY: `to` and the eight numbers after it are in a component's part of the tile: rows of eight end
    // where the last eight begin.
    let set = |a: usize, to: usize, row: [f32; 8]| unsafe { numbers.add(a * TILE + to).cast::<[f32; 8]>().write(row) };
    for x in 0..NODES {
        for y in 0..NODES {
            let ((bx, i), (by, j)) = (place(x), place(y));
            let (from, to) = ((i * 4 + j) * 4, (x * NODES + y) * 8);
            let (low, own, high) = (block(bx, by, 0), block(bx, by, 1), block(bx, by, 2));
            for a in 0..3 {
                let [p, q, r, s] = [0, 1, 2, 3].map(|k| own.0[a][from + k]);
                set(a, to, [low.0[a][from + 3], p, q, r, s, high.0[a][from], 0.0, 0.0]);
            }
        }
    }
    (0..3).for_each(|a| set(a, TILE - 8, [0.0; 8]));
    // SAFETY: all its numbers are set.
    unsafe { tile.assume_init_ref() }
}

/// Sums and differences along y and z of a cell's corners in one plane of nodes: the difference along z is
/// the last bit.
type Corners<L> = [L; 4];

#[inline(always)]
fn row(values: &[f32; TILE], at: usize) -> &[f32; 8] {
    // SAFETY: rows start at 0 ..= 288 - 8, a shifted one is one further, and the tile has 296 numbers.
    unsafe { &*values.as_ptr().add(at).cast::<[f32; 8]>() }
}

/// The cells' corners in plane `x` of the nodes.
#[inline(always)]
fn plane<L: Lanes>(tile: &[f32; TILE], x: usize) -> [Corners<L>; CELLS] {
    let along_z = |y: usize| {
        let at = (x * NODES + y) * 8;
        let (low, high) = (L::load_row(row(tile, at)), L::load_row(row(tile, at + 1)));
        [low.plus(high), low.minus(high)]
    };
    let mut low = along_z(0);
    let mut corners = [[low[0]; 4]; CELLS];
    for y in 0..CELLS {
        let high = along_z(y + 1);
        corners[y] = [low[0].plus(high[0]), low[1].plus(high[1]), low[0].minus(high[0]), low[1].minus(high[1])];
        low = high;
    }
    corners
}

#[inline(always)]
fn add_component<L: Lanes>(modes: &[f32; 8], cells: &Cells, tile: &[f32; TILE], product: &mut [f32; 64]) {
    let zero = L::splat(0.0);
    let modes = modes.map(L::splat);
    let mut low = plane::<L>(tile, 0);
    let mut from_before = [[zero; 4]; CELLS];
    for x in 0..CELLS {
        let high = plane::<L>(tile, x + 1);
        let mut to_next = [[zero; 4]; CELLS];
        for y in 0..CELLS {
            let at = x * CELLS + y;
            if cells.some >> at & 1 == 0 {
                continue;
            }
            let fill = L::load_row(&cells.rows[at]);
            for m in 0..4 {
                let sum = low[y][m].plus(high[y][m]).times(modes[m]);
                let difference = low[y][m].minus(high[y][m]).times(modes[4 + m]);
                from_before[y][m] = sum.plus(difference).times_plus(fill, from_before[y][m]);
                to_next[y][m] = sum.minus(difference).times(fill);
            }
        }
        if x > 0 {
            add_plane(&from_before, product, (x - 1) * 16);
        }
        (low, from_before) = (high, to_next);
    }
}

/// Brings what the cells' sums and differences got to the nodes of a plane, which stand in the block from
/// `first` on.
#[inline(always)]
fn add_plane<L: Lanes>(got: &[Corners<L>; CELLS], product: &mut [f32; 64], first: usize) {
    for y in 0..4 {
        let (before, after) = (&got[y], &got[y + 1]);
        // The node is the high corner of the cell before and the low one of that after.
        let along_z = |z: usize| before[z].minus(before[2 + z]).plus(after[z].plus(after[2 + z]));
        let (sum, difference) = (along_z(0), along_z(1));
        let (mut low, mut high) = ([0.0; 8], [0.0; 8]);
        sum.plus(difference).store_row(&mut low);
        sum.minus(difference).store_row(&mut high);
        let to = &mut product[first + y * 4..first + y * 4 + 4];
        for z in 0..4 {
            to[z] += low[z + 1] + high[z];
        }
    }
}

#[cfg(all(test, feature = "reference"))]
mod tests {
    use super::*;
    use crate::sim::oracle::implicit::multigrid::element;
    use glam::DVec3;

    /// The product with a cell is that of the oracle's matrix, wherever it stands about the block, in lanes
    /// and in registers.
    #[test]
    fn product_with_a_cell_is_that_of_its_matrix() {
        let (mu, lambda, width) = (1.5, 4.0, 2.0);
        let value = |n: [usize; 3], a: usize| ((n[0] * 37 + n[1] * 17 + n[2] * 5 + a * 11) % 23) as f32 / 7.0 - 1.0;
        let mut vector = vec![Block3::ZERO; 27];
        for n in 0..12 * 12 * 12 {
            let n = [n / 144, n / 12 % 12, n % 12];
            let (b, l) = (n.map(|n| n / 4), n.map(|n| (n % 4) as i32));
            for a in 0..3 {
                vector[b[0] + 3 * b[1] + 9 * b[2]].0[a][local(l[0], l[1], l[2])] = value(n, a);
            }
        }
        let neighbours = std::array::from_fn(|i| i as u32 + 1);
        for cell in 0..125 {
            let cell = [cell / 25, cell / 5 % 5, cell % 5];
            let mut cells = Cells::EMPTY;
            cells.rows[cell[0] * CELLS + cell[1]][cell[2]] = 0.7;
            cells.some = 1 << (cell[0] * CELLS + cell[1]);
            let corner = |c: usize, axis: usize| cell[axis] + (c >> axis & 1);
            let mut expected = [[0.0; 64]; 3];
            for (a, expected) in expected.iter_mut().enumerate() {
                let moduli = f64::from(width) * (DVec3::splat(mu) + DVec3::AXES[a] * (lambda + mu));
                for (i, k) in (0..64).map(|ik| (ik / 8, ik % 8)) {
                    let node: [usize; 3] = std::array::from_fn(|axis| corner(i, axis));
                    if node.iter().all(|n| (1..5).contains(n)) {
                        let other = std::array::from_fn(|axis| corner(k, axis) + 3);
                        let at = ((node[0] - 1) * 4 + node[1] - 1) * 4 + node[2] - 1;
                        expected[at] += 0.7 * element(moduli, i, k) * f64::from(value(other, a));
                    }
                }
            }
            let modes = Modes::new(mu as f32, lambda as f32, width);
            for modes in [modes, Modes { has_fma: false, ..modes }] {
                let mut product = Block3::ZERO;
                add_product(&modes, &cells, &vector, &neighbours, &mut product);
                for (got, expected) in product.flat().iter().zip(expected.as_flattened()) {
                    assert!((f64::from(*got) - expected).abs() < 1e-5, "cell {cell:?}: {got}, {expected}");
                }
            }
        }
    }
}
