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
use super::super::vectors::Block1;

/// Cells -1 ..= 3 about a block along an axis; nodes are -1 ..= 4.
const CELLS: usize = 5;

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

    /// Whether any cell of plane `x` has some.
    #[inline(always)]
    fn has_some(&self, x: usize) -> bool {
        self.some >> (x * CELLS) & ((1 << CELLS) - 1) != 0
    }

    /// Whether there is no clay about.
    pub(super) fn is_empty(&self) -> bool {
        self.some == 0
    }
}

/// Adds to `product` that of the elements with component `a` of a vector: of a slot from the blocks about it.
pub(super) fn add_product(
    (modes, a): (&Modes, usize),
    cells: &Cells,
    field: &[Block1],
    neighbours: &[u32; 27],
    product: &mut [f32; 64],
) {
    #[cfg(target_arch = "x86_64")]
    if modes.has_fma {
        // SAFETY: `has_fma` is set only after AVX2 and FMA were detected.
        return unsafe { add_product_avx2(&modes.of[a], cells, field, neighbours, product) };
    }
    add_product_with::<F8>(&modes.of[a], cells, field, neighbours, product);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn add_product_avx2(modes: &[f32; 8], cells: &Cells, field: &[Block1], neighbours: &[u32; 27], product: &mut [f32; 64]) {
    add_product_with::<super::super::super::simd::Wide>(modes, cells, field, neighbours, product);
}

#[inline(always)]
fn add_product_with<L: Lanes>(
    modes: &[f32; 8],
    cells: &Cells,
    field: &[Block1],
    neighbours: &[u32; 27],
    product: &mut [f32; 64],
) {
    static NOTHING: Block1 = Block1::ZERO;
    let blocks = neighbours.map(|slot| if slot == 0 { &NOTHING } else { &field[slot as usize - 1] });
    let zero = L::splat(0.0);
    let modes = modes.map(L::splat);
    // Of this plane and the next, by turns.
    let (mut planes, mut got) = ([[[zero; 4]; CELLS]; 2], [[[zero; 4]; CELLS]; 2]);
    let (mut some_before, mut some) = (false, cells.has_some(0));
    if some {
        set_plane(&mut planes[0], &blocks, 0);
    }
    for x in 0..CELLS {
        let some_next = x + 1 < CELLS && cells.has_some(x + 1);
        let [even, odd] = &mut planes;
        let (low, high) = if x % 2 == 0 { (even, odd) } else { (odd, even) };
        if some || some_next {
            set_plane(high, &blocks, x + 1);
        }
        let [even, odd] = &mut got;
        let (from_before, to_next) = if x % 2 == 0 { (even, odd) } else { (odd, even) };
        add_cells(&modes, cells, x, (low, high), (from_before, to_next));
        if x > 0 && (some_before || some) {
            add_plane(from_before, product, (x - 1) * 16);
        }
        (some_before, some) = (some, some_next);
    }
}

/// Sums and differences along y and z of a cell's corners in one plane of nodes: the difference along z is
/// the last bit.
type Corners<L> = [L; 4];

/// A row of nodes of a block about, or of the block itself.
#[inline(always)]
fn row(block: &Block1, first: usize) -> &[f32; 4] {
    &block.0.as_chunks::<4>().0[first]
}

/// Sum and difference along z of a row of nodes, of those about a block.
#[inline(always)]
fn along_z<L: Lanes>(blocks: &[&Block1; 27], x: usize, y: usize) -> [L; 2] {
    // Which block along an axis, and which of its nodes; the first is the last of the block before.
    let (about, at) = (x.div_ceil(4) + 3 * y.div_ceil(4), (x + 3) % 4 * 4 + (y + 3) % 4);
    let [before, own, after] = [blocks[about], blocks[about + 9], blocks[about + 18]];
    let [low, high] = L::load_between(row(before, at)[3], row(own, at), row(after, at)[0]);
    [low.plus(high), low.minus(high)]
}

/// Finds the cells' corners in plane `x` of the nodes.
#[inline(always)]
fn set_plane<L: Lanes>(corners: &mut [Corners<L>; CELLS], blocks: &[&Block1; 27], x: usize) {
    let mut low = along_z::<L>(blocks, x, 0);
    for y in 0..CELLS {
        let high = along_z::<L>(blocks, x, y + 1);
        corners[y] = [low[0].plus(high[0]), low[1].plus(high[1]), low[0].minus(high[0]), low[1].minus(high[1])];
        low = high;
    }
}

/// What the cells between two planes of nodes bring to either.
#[inline(always)]
fn add_cells<L: Lanes>(
    modes: &[L; 8],
    cells: &Cells,
    x: usize,
    (low, high): (&[Corners<L>; CELLS], &[Corners<L>; CELLS]),
    (from_before, to_next): (&mut [Corners<L>; CELLS], &mut [Corners<L>; CELLS]),
) {
    for y in 0..CELLS {
        let at = x * CELLS + y;
        if cells.some >> at & 1 == 0 {
            to_next[y] = [L::splat(0.0); 4];
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
}

/// Brings what the cells' sums and differences got to the nodes of a plane, which stand in the block from
/// `first` on.
#[inline(always)]
fn add_plane<L: Lanes>(got: &[Corners<L>; CELLS], product: &mut [f32; 64], first: usize) {
    let rows = &mut product.as_chunks_mut::<4>().0[first / 4..first / 4 + 4];
    for (y, row) in rows.iter_mut().enumerate() {
        // The node is the high corner of the cell before and the low one of that after, along z too.
        let (before, after) = (&got[y], &got[y + 1]);
        let sum = before[0].minus(before[2]).plus(after[0].plus(after[2]));
        let difference = before[1].minus(before[3]).plus(after[1].plus(after[3]));
        sum.plus(difference).rotated_down().plus(sum.minus(difference)).add_low_to(row);
    }
}

#[cfg(all(test, feature = "reference"))]
mod tests {
    use super::*;
    use crate::sim::native::simd::Node;
    use crate::sim::oracle::implicit::multigrid::element;
    use glam::DVec3;

    /// The product with a cell is that of the oracle's matrix, wherever it stands about the block, in lanes
    /// and in registers.
    #[test]
    fn product_with_a_cell_is_that_of_its_matrix() {
        let (mu, lambda, width) = (1.5, 4.0, 2.0);
        let value = |n: [usize; 3], a: usize| ((n[0] * 37 + n[1] * 17 + n[2] * 5 + a * 11) % 23) as f32 / 7.0 - 1.0;
        let field = |a: usize| {
            let mut field = vec![Block1::ZERO; 27];
            for n in 0..12 * 12 * 12 {
                let n = [n / 144, n / 12 % 12, n % 12];
                let (b, l) = (n.map(|n| n / 4), n.map(|n| (n % 4) as i32));
                field[b[0] + 3 * b[1] + 9 * b[2]].0[local(l[0], l[1], l[2])] = value(n, a);
            }
            field
        };
        let fields = [0, 1, 2].map(field);
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
                for (a, (field, expected)) in fields.iter().zip(&expected).enumerate() {
                    let mut product = [0.0; 64];
                    add_product((&modes, a), &cells, field, &neighbours, &mut product);
                    for (got, expected) in product.iter().zip(expected) {
                        assert!((f64::from(*got) - expected).abs() < 1e-5, "cell {cell:?}: {got}, {expected}");
                    }
                }
            }
        }
    }

    /// Cells add up, whichever planes of them have some and whichever have none between.
    #[test]
    fn products_of_cells_add_up() {
        let mut value = 0u32;
        let field: Vec<Block1> = (0..27)
            .map(|_| {
                Block1(std::array::from_fn(|_| {
                    value = (value * 37 + 11) % 101;
                    value as f32 / 50.0 - 1.0
                }))
            })
            .collect();
        let neighbours = std::array::from_fn(|i| i as u32 + 1);
        let modes = Modes::new(1.5, 4.0, 1.0);
        let product = |planes: u32| {
            let mut cells = Cells::EMPTY;
            for row in (0..CELLS * CELLS).filter(|row| planes >> (row / CELLS) & 1 == 1 && row % 3 > 0) {
                cells.rows[row][..CELLS].fill(0.25 + row as f32 / 50.0);
                cells.some |= 1 << row;
            }
            let mut product = [0.0; 64];
            add_product((&modes, 1), &cells, &field, &neighbours, &mut product);
            product
        };
        let single: Vec<_> = (0..CELLS).map(|x| product(1 << x)).collect();
        for planes in 0..1 << CELLS {
            for (n, got) in product(planes).into_iter().enumerate() {
                let sum: f32 = (0..CELLS).filter(|x| planes >> x & 1 == 1).map(|x| single[x][n]).sum();
                assert!((got - sum).abs() < 1e-5, "planes {planes:b}, node {n}: {got}, {sum}");
            }
        }
    }

    #[inline(always)]
    fn rows<L: Lanes>(out: &mut [Node; 3]) {
        let [before, first] = L::load_between(1.0, &[2.0, 3.0, 4.0, 5.0], 6.0);
        before.store(&mut out[0]);
        first.rotated_down().store(&mut out[1]);
        out[2].0 = [10.0; 8];
        first.add_low_to(out[2].0.first_chunk_mut().expect("four lanes"));
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn rows_avx2(out: &mut [Node; 3]) {
        rows::<crate::sim::native::simd::Wide>(out);
    }

    /// Rows between their neighbours, moved down by a lane, and added to four numbers, in either form.
    #[test]
    fn rows_are_moved_and_added() {
        let expected = [
            [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0.0, 0.0],
            [3.0, 4.0, 5.0, 6.0, 0.0, 0.0, 0.0, 2.0],
            [12.0, 13.0, 14.0, 15.0, 10.0, 10.0, 10.0, 10.0],
        ];
        let mut out = [Node::default(); 3];
        rows::<F8>(&mut out);
        assert_eq!(out.map(|row| row.0), expected);
        #[cfg(target_arch = "x86_64")]
        if has_fma() {
            // SAFETY: AVX2 and FMA were detected.
            unsafe { rows_avx2(&mut out) };
            assert_eq!(out.map(|row| row.0), expected);
        }
    }
}
