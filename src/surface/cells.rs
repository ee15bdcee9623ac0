//! The cells of one block with their surroundings: owners of nodes, classes of cells, vertices on edges.

use super::field::Field;
use super::grid::{BLOCK, neighbours};
use glam::{DVec3, IVec3};

/// Nodes along an edge of a tile: the block's cells need 9 nodes; whether a node or edge touches the crack front needs one more cell
/// on every side.
const NODES: i32 = BLOCK + 3;
const NODE_COUNT: usize = (NODES * NODES * NODES) as usize;
/// First node of a tile, relative to the block.
const FIRST: i32 = -1;
/// Crossings stay this far from the nodes, in parts of the edge: no triangle degenerates where a node's value is the threshold.
const CROSSING_MIN: f64 = 1e-3;
/// Steps between tile nodes along x, y, z.
pub(crate) const STEPS: [usize; 3] = [1, NODES as usize, (NODES * NODES) as usize];
/// Vertices that an edge can carry: shared, of the front copy, of the back copy.
pub(crate) const VARIANTS: usize = 3;
/// Vertex places of a tile.
pub(crate) const PLACES: usize = NODE_COUNT * 3 * VARIANTS;

/// What a cell is to a cut.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum CellClass {
    /// Not at a cut: one copy.
    #[default]
    Whole,
    /// Crossed by a cut from end to end: one copy per side.
    Cut,
    /// At the crack front, where the two lips meet: one copy.
    Rim,
}

/// Which copy of a cell is emitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Copy {
    /// The only one.
    Single,
    /// The clay in front of the cut.
    Front,
    /// The clay behind it.
    Back,
}

/// Node values around a block and what follows from them.
pub(crate) struct CellTile {
    iso: f32,
    total: Vec<f32>,
    front: Vec<f32>,
    back: Vec<f32>,
    /// Value of the node's own side: f without the other side's part; plain f at the crack front.
    own: Vec<f32>,
    /// +1, -1 or 0: the side that holds more than half of the clay around the node.
    owners: Vec<i8>,
    /// Class of the cell with this low node.
    classes: Vec<CellClass>,
    has_sides: bool,
}

impl CellTile {
    pub(crate) fn new(iso: f32) -> Self {
        let values = || vec![0.0; NODE_COUNT];
        Self {
            iso,
            total: values(),
            front: values(),
            back: values(),
            own: values(),
            owners: vec![0; NODE_COUNT],
            classes: vec![CellClass::Whole; NODE_COUNT],
            has_sides: false,
        }
    }

    /// Fills the tile for one block; `false` if no surface can pass through its cells.
    pub(crate) fn load(&mut self, field: &Field, block: IVec3) -> bool {
        field.grid.load(&field.total, block, FIRST, NODES, &mut self.total);
        if self.total.iter().all(|&f| f <= self.iso) {
            return false;
        }
        let slots = || neighbours().filter_map(|d| field.grid.slot(block + d));
        self.has_sides = slots().any(|s| field.front.block(s).is_some()) && slots().any(|s| field.back.block(s).is_some());
        if !self.has_sides {
            return self.total.iter().any(|&f| f <= self.iso);
        }
        field.grid.load(&field.front, block, FIRST, NODES, &mut self.front);
        field.grid.load(&field.back, block, FIRST, NODES, &mut self.back);
        self.find_owners();
        self.classify();
        true
    }

    fn find_owners(&mut self) {
        for i in 0..NODE_COUNT {
            let (f, p, m) = (self.total[i], self.front[i], self.back[i]);
            // More than half, and not any trace: with a small threshold clay far from the cut counts as one of its sides.
            self.owners[i] = if p + m <= 0.5 * f {
                0
            } else if p >= m {
                1
            } else {
                -1
            };
            self.own[i] = self.side_value(i, self.owners[i]);
        }
    }

    /// Clay around a node that belongs with side `side`; all of it for 0.
    fn side_value(&self, node: usize, side: i8) -> f32 {
        match side {
            1 => self.total[node] - self.back[node],
            -1 => self.total[node] - self.front[node],
            _ => self.total[node],
        }
    }

    fn classify(&mut self) {
        self.classes.fill(CellClass::Whole);
        let cells = NODES - 1;
        let mut rim = Vec::new();
        for z in 0..cells {
            for y in 0..cells {
                for x in 0..cells {
                    let low = node_index(IVec3::new(x, y, z));
                    let owns = |side: i8| corners(low).any(|n| self.owners[n] == side);
                    if !owns(1) || !owns(-1) {
                        continue;
                    }
                    // Empty nodes own nothing: counting them would bridge the cut along the free surface.
                    let is_rim = corners(low).any(|n| self.owners[n] == 0 && self.own[n] > self.iso);
                    self.classes[low] = if is_rim { CellClass::Rim } else { CellClass::Cut };
                    if is_rim {
                        rim.push(low);
                    }
                }
            }
        }
        // Plain f where the lips meet: a side's own value would leave pits along the front.
        rim.into_iter().flat_map(corners).for_each(|n| self.own[n] = self.total[n]);
    }

    /// The low nodes of the block's cells, x fastest.
    pub(crate) fn cells() -> impl Iterator<Item = usize> {
        let range = || -FIRST..BLOCK - FIRST;
        range().flat_map(move |z| range().flat_map(move |y| range().map(move |x| node_index(IVec3::new(x, y, z)))))
    }

    pub(crate) fn class(&self, cell: usize) -> CellClass {
        if self.has_sides { self.classes[cell] } else { CellClass::Whole }
    }

    /// The inside bits of one copy of a cell.
    pub(crate) fn case(&self, cell: usize, copy: Copy) -> u8 {
        let owner = match copy {
            Copy::Single => None,
            Copy::Front => Some(1),
            Copy::Back => Some(-1),
        };
        let is_in = |n: usize| self.is_inside(n) && owner.is_none_or(|o| self.owners[n] == o);
        corners(cell).enumerate().fold(0, |bits, (i, n)| bits | u8::from(is_in(n)) << i)
    }

    fn is_inside(&self, node: usize) -> bool {
        self.own_value(node) > self.iso
    }

    fn own_value(&self, node: usize) -> f32 {
        if self.has_sides { self.own[node] } else { self.total[node] }
    }

    /// Whether the two nodes of an edge are on different sides of a cut.
    fn is_split(&self, low: usize, axis: usize) -> bool {
        self.has_sides && self.owners[low] * self.owners[low + STEPS[axis]] < 0
    }

    /// Whether one of the four cells at an edge is a rim cell.
    fn touches_rim(&self, low: usize, axis: usize) -> bool {
        let (u, v) = (STEPS[(axis + 1) % 3], STEPS[(axis + 2) % 3]);
        [0, u, v, u + v].iter().any(|back| self.classes[low - back] == CellClass::Rim)
    }

    /// Which of an edge's vertices a copy of a cell uses: split edges have one per side, welded where the crack front touches them.
    pub(crate) fn variant(&self, low: usize, axis: usize, copy: Copy) -> usize {
        match copy {
            Copy::Front if self.is_split(low, axis) && !self.touches_rim(low, axis) => 1,
            Copy::Back if self.is_split(low, axis) && !self.touches_rim(low, axis) => 2,
            _ => 0,
        }
    }

    /// Position of a vertex on an edge, in parts of the edge from its low node.
    pub(crate) fn crossing(&self, low: usize, axis: usize, variant: usize) -> f64 {
        let high = low + STEPS[axis];
        let both_inside = self.is_inside(low) == self.is_inside(high);
        let t = if !self.is_split(low, axis) || (variant == 0 && !both_inside) {
            self.crossing_of(self.own_value(low), self.own_value(high))
        } else if both_inside {
            // Both lips are pinned to the sheet: they coincide, until the clay itself opens by more than a cell.
            self.sheet_crossing(low, high)
        } else {
            self.lip_crossing(low, high, if variant == 1 { 1 } else { -1 })
        };
        t.clamp(CROSSING_MIN, 1.0 - CROSSING_MIN)
    }

    fn crossing_of(&self, a: f32, b: f32) -> f64 {
        f64::from(self.iso - a) / f64::from(b - a)
    }

    /// Zero of (P - M) / (P + M) between two nodes of different owners.
    fn sheet_crossing(&self, low: usize, high: usize) -> f64 {
        let q = |n: usize| f64::from(self.front[n] - self.back[n]) / f64::from(self.front[n] + self.back[n]);
        q(low) / (q(low) - q(high))
    }

    /// Free surface of one side, where the other side has none.
    fn lip_crossing(&self, low: usize, high: usize, side: i8) -> f64 {
        let (a, b) = (self.side_value(low, side), self.side_value(high, side));
        if (a > self.iso) == (b > self.iso) { self.sheet_crossing(low, high) } else { self.crossing_of(a, b) }
    }

    /// Position of a tile node relative to the block [nodes].
    pub(crate) fn node_offset(node: usize) -> IVec3 {
        let (n, i) = (NODES, node as i32);
        IVec3::new(i % n, i / n % n, i / (n * n)) + FIRST
    }

    /// World position of a point of an edge [m].
    pub(crate) fn position(field: &Field, node: IVec3, axis: usize, t: f64) -> [f32; 3] {
        let mut at = node.as_dvec3();
        at[axis] += t;
        let world: DVec3 = field.origin + field.spacing * at;
        world.as_vec3().to_array()
    }
}

fn node_index(node: IVec3) -> usize {
    (node.x + NODES * (node.y + NODES * node.z)) as usize
}

/// Tile nodes of the corners of a cell, in the table's order.
fn corners(cell: usize) -> impl Iterator<Item = usize> {
    (0..8).map(move |i| corner(cell, i))
}

/// Tile node of corner `i` of a cell.
pub(crate) fn corner(cell: usize, i: u8) -> usize {
    let i = usize::from(i);
    cell + (i & 1) * STEPS[0] + (i >> 1 & 1) * STEPS[1] + (i >> 2 & 1) * STEPS[2]
}
