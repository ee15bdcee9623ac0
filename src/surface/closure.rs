//! How closed cuts and meeting bodies are, near each node.
//!
//! What the parts on both sides of a closed cut show outside is the surface of all clay, whoever is within:
//! drawn from its own clay alone each part's rim would round over a cell, 2 to 3 % of a block 12 cells
//! across. So a part sees `own + k other` at a node, with `k` its *closure*: 1 where the cut is closed, 0
//! where it is open by half a cell or more.
//!
//! Nodes where two parts have clay, and neither much more than the other, stand at their faces: all clay
//! there is 1 if the faces meet, less the wider they gape. That is true inside of the clay alone, so a node
//! goes by the greatest of the nodes about it. They are taken by cells of 2^3 nodes, of each its greatest,
//! then that of the cells within [`CLOSURE_REACH`], then from cell to cell linearly.
//!
//! Where three parts or more meet, and on the coarse grid, edges stay blunt: sharp ones come apart into
//! crumbs there (`labels`, rule 3).

use super::bodies::BodyField;
use super::grid::{BLOCK, BlockGrid, NodeValues, neighbours};
use super::labels::{CutMethod, Rules};
use super::sheets::SheetField;
use glam::IVec3;
use rayon::prelude::*;

/// Cells of 2^3 nodes of a block.
pub(crate) const CLOSURE_CELLS: usize = 64;
/// Cells on each side of a node's that it goes by: clay 2 cells of the fine grid within a free surface has
/// .98 of what is inside.
const CLOSURE_REACH: i32 = 2;
/// All clay at the faces \[of the inside\] where they are as good as open, half a cell apart, and where they
/// are closed: .72 and 1 for flat faces on the fine grid, and the greatest of the many is .05 more.
pub(crate) const CLAY_OPEN: f32 = 0.8;
pub(crate) const CLAY_CLOSED: f32 = 0.92;
/// Share of a node's clay above which there is a part, and below which the greatest leaves room for another.
pub(crate) const PART_SHARE: f32 = 0.05;
pub(crate) const FACE_SHARE: f32 = 0.75;
/// What a node says where three parts or more meet: more than any clay.
pub(crate) const SEVERAL: f32 = 16.0;

/// What stands at the faces of a field, by cells.
#[derive(Clone, Debug, Default)]
pub(crate) struct Closure {
    /// Of each slot that two parts or more are near: the greatest of its cells' nodes, x fastest.
    blocks: Vec<Option<Box<[f32; CLOSURE_CELLS]>>>,
}

impl Closure {
    pub(crate) fn new(grid: &BlockGrid, total: &NodeValues, bodies: &[BodyField], sheets: &[SheetField]) -> Self {
        if bodies.is_empty() && sheets.is_empty() {
            return Self::default();
        }
        let block = |slot: usize| Some(Box::new(Parts::of(slot, total, bodies, sheets)?.cells()));
        Self { blocks: (0..grid.blocks().len()).into_par_iter().map(block).collect() }
    }

    /// k of the nodes `first..first + size` about `block`'s low corner, x fastest. The nodes must be within 3
    /// of the block.
    pub(crate) fn load(&self, grid: &BlockGrid, block: IVec3, first: IVec3, size: i32, out: &mut [f32]) {
        out.fill(0.0);
        let low = first.map(|n| n.div_euclid(2)) - CLOSURE_REACH - 1;
        let edge = size / 2 + 3 + 2 * CLOSURE_REACH;
        let mut cells = vec![0.0f32; (edge * edge * edge) as usize];
        if !self.load_cells(grid, block, low, edge, &mut cells) {
            return;
        }
        for step in [1, edge, edge * edge] {
            cells = greatest(&cells, edge, step);
        }
        cells.iter_mut().for_each(|clay| *clay = closure(*clay));
        for (i, out) in (0..).zip(out) {
            let node = first + IVec3::new(i % size, i / size % size, i / (size * size));
            *out = between(node, low, edge, &cells);
        }
    }

    /// Copies cells of the block and its neighbours; whether there are any.
    fn load_cells(&self, grid: &BlockGrid, block: IVec3, low: IVec3, edge: i32, out: &mut [f32]) -> bool {
        const CELLS: i32 = BLOCK / 2;
        let cells_of = |d: IVec3| grid.slot(block + d).and_then(|slot| self.blocks.get(slot)?.as_deref());
        let near: Vec<_> = neighbours().map(cells_of).collect();
        if near.iter().all(Option::is_none) {
            return false;
        }
        for (i, out) in (0..).zip(out) {
            let cell = low + IVec3::new(i % edge, i / edge % edge, i / (edge * edge));
            let (away, at) = (cell.map(|c| c.div_euclid(CELLS)) + 1, cell & (CELLS - 1));
            // Cells at a tile's sides that no node that counts goes by may be beyond.
            let is_near = away.cmpge(IVec3::ZERO).all() && away.cmple(IVec3::splat(2)).all();
            let cells = if is_near { near[(away.x + 3 * (away.y + 3 * away.z)) as usize] } else { None };
            *out = cells.map_or(0.0, |cells| cells[(at.x + CELLS * (at.y + CELLS * at.z)) as usize]);
        }
        true
    }
}

/// What a part sees at a node: its own clay, and of the others', `total - own`, as much as `closure` says.
pub(crate) fn with_others(own: f32, total: f32, closure: f32) -> f32 {
    own + closure * (total - own)
}

/// The greatest of the cells within [`CLOSURE_REACH`] along one axis.
fn greatest(cells: &[f32], edge: i32, step: i32) -> Vec<f32> {
    let of = |i: i32| {
        let at = i / step % edge;
        let (first, last) = ((at - CLOSURE_REACH).max(0), (at + CLOSURE_REACH).min(edge - 1));
        (first..=last).map(|c| cells[(i + (c - at) * step) as usize]).fold(0.0, f32::max)
    };
    (0..cells.len() as i32).map(of).collect()
}

/// k, from the greatest of all clay at the faces.
fn closure(clay: f32) -> f32 {
    if clay == SEVERAL {
        return 0.0;
    }
    let x = ((clay - CLAY_OPEN) / (CLAY_CLOSED - CLAY_OPEN)).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// Linear between the middles of cells: a node stands a quarter of a cell from its own's.
fn between(node: IVec3, low: IVec3, edge: i32, cells: &[f32]) -> f32 {
    let own = node.map(|n| n.div_euclid(2)) - low;
    let beside = (node & 1) * 2 - 1;
    (0..8).fold(0.0, |sum, i| {
        let d = IVec3::new(i & 1, i >> 1 & 1, i >> 2);
        let at = own + d * beside;
        let share = (0..3).fold(1.0, |share, axis| share * if d[axis] == 1 { 0.25 } else { 0.75 });
        sum + share * cells[(at.x + edge * (at.y + edge * at.z)) as usize]
    })
}

/// The parts near a slot.
struct Parts<'a> {
    total: &'a [f32],
    bodies: Vec<(u32, &'a [f32])>,
    /// Body, P, M.
    sheets: Vec<(u32, &'a [f32], &'a [f32])>,
}

impl<'a> Parts<'a> {
    /// `None` unless there are two or more.
    fn of(slot: usize, total: &'a NodeValues, bodies: &'a [BodyField], sheets: &'a [SheetField]) -> Option<Self> {
        let body = |b: &'a BodyField| Some((b.body, b.block(total, slot)?));
        let sheet = |s: &'a SheetField| Some((s.body, s.front.block(slot)?, s.back.block(slot)?));
        let bodies: Vec<_> = bodies.iter().filter_map(body).collect();
        let sheets: Vec<_> = sheets.iter().filter_map(sheet).collect();
        let total = total.block(slot)?;
        (bodies.len() > 1 || !sheets.is_empty()).then_some(Self { total, bodies, sheets })
    }

    fn cells(&self) -> [f32; CLOSURE_CELLS] {
        std::array::from_fn(|cell| {
            let low = (cell % 4 + cell / 4 % 4 * 8 + cell / 16 * 64) * 2;
            (0..8).map(|i| self.at(low + (i & 1) + (i >> 1 & 1) * 8 + (i >> 2) * 64)).fold(0.0, f32::max)
        })
    }

    /// All clay at a node if two parts stand there face to face, [`SEVERAL`] if more do, else 0.
    fn at(&self, node: usize) -> f32 {
        let total = self.total[node];
        if total < CLAY_OPEN {
            return 0.0;
        }
        let (mut body, mut whole, mut faces) = (0, total, 0);
        if !self.bodies.is_empty() {
            whole = 0.0;
            for (number, values) in &self.bodies {
                faces += i32::from(values[node] > PART_SHARE * total);
                if values[node] > whole {
                    (body, whole) = (*number, values[node]);
                }
            }
            faces -= 1;
        }
        let mut share = whole / total;
        let rules = Rules::new(CutMethod::TwoSided);
        for (_, front, back) in self.sheets.iter().filter(|s| self.bodies.is_empty() || s.0 == body) {
            let (front, back) = (front[node], back[node]);
            if rules.owner(whole, front, back) != 0 && front.min(back) > PART_SHARE * (front + back) {
                // Clay beyond the cut's end is one more.
                faces += if front + back < FACE_SHARE * whole { 2 } else { 1 };
                share *= front.max(back) / (front + back);
            }
        }
        match faces {
            ..1 => 0.0,
            1 if share <= FACE_SHARE => total,
            1 => 0.0,
            _ => SEVERAL,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::field::Field;

    const EDGE: usize = 24;

    /// Clay in front of and behind a plane \[of the inside\], at a node that is `at` nodes past it, where the
    /// faces are `gap` nodes apart: flat faces, smoothed over a cell of 2 nodes.
    fn sides(at: f32, gap: f32) -> [f32; 2] {
        let side = |s: f32| 1.0 / (1.0 + (-1.1 * s).exp());
        [side(at - 0.5 * gap), side(-at - 0.5 * gap)]
    }

    /// k of the nodes of a block of clay in the middle of which `cuts` along x and y stand, `gap` apart.
    fn closures(gap: f32, cuts: usize) -> impl Fn([usize; 3]) -> f32 {
        let node = |i: usize| [i % EDGE, i / EDGE % EDGE, i / (EDGE * EDGE)];
        let of =
            |axis: usize| (0..EDGE.pow(3)).map(move |i| sides(node(i)[axis] as f32 - 11.3, if axis == 0 { gap } else { 0.0 }));
        let [along_x, along_y] = [0, 1].map(|axis| of(axis).collect::<Vec<_>>());
        // Free surfaces two nodes within the first and the last along z.
        let free = |i: usize| sides(node(i)[2] as f32 - 2.0, 0.0)[0] * sides(22.0 - node(i)[2] as f32, 0.0)[0];
        let total: Vec<f32> = (0..EDGE.pow(3)).map(|i| free(i) * (along_x[i][0] + along_x[i][1]).min(1.0)).collect();
        let split = |along: &[[f32; 2]], side: usize| -> Vec<f32> {
            along.iter().zip(&total).map(|(s, all)| all * s[side] / (s[0] + s[1])).collect()
        };
        let parts: Vec<[Vec<f32>; 2]> =
            [&along_x, &along_y][..cuts].iter().map(|along| [0, 1].map(|side| split(along, side))).collect();
        let field = Field::from_nodes([EDGE; 3], &total, parts.iter().map(|[p, m]| (&p[..], &m[..])));
        move |[x, y, z]: [usize; 3]| {
            let at = IVec3::new(x as i32, y as i32, z as i32);
            let (block, mut k) = (at.map(|n| n.div_euclid(BLOCK)), [0.0; 64]);
            field.closure.load(&field.grid, block, at - block * BLOCK, 4, &mut k);
            k[0]
        }
    }

    /// Closed at the faces and at the rims, nearly so up to a node outside; not far from the cut.
    #[test]
    fn closed_cuts_are_closed_to_their_rims() {
        let k = closures(0.0, 1);
        for z in [1, 2, 3, 12, 21, 22, 23] {
            let least = if (2..=22).contains(&z) { 0.99 } else { 0.9 };
            let at_cut = (9..14).map(|x| k([x, 11, z])).fold(1.0, f32::min);
            assert!(at_cut > least, "{z}: {at_cut}");
            assert_eq!([k([1, 11, z]), k([22, 11, z])], [0.0; 2], "{z}");
        }
    }

    /// A cell is two nodes: closed within a fifth of one, open from half of one on.
    #[test]
    fn cuts_that_gape_open() {
        let at = [11, 11, 12];
        let open: Vec<f32> = [0.0, 0.2, 0.4, 0.6, 0.8, 1.0].iter().map(|gap| closures(*gap, 1)(at)).collect();
        assert!(open.windows(2).all(|k| k[1] <= k[0]), "{open:?}");
        assert!(open[1] > 0.99 && open[5] < 0.3, "{open:?}");
        assert_eq!(closures(1.6, 1)(at), 0.0);
    }

    /// Where cuts cross, nothing is closed; away from there each of them is.
    #[test]
    fn crossings_stay_open() {
        let k = closures(0.0, 2);
        assert_eq!([k([11, 11, 12]), k([12, 12, 3]), k([10, 13, 12])], [0.0; 3]);
        assert_eq!([k([11, 21, 12]), k([2, 11, 12])], [1.0; 2]);
        assert_eq!(k([20, 20, 12]), 0.0);
    }
}
