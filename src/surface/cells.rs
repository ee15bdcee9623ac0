//! Some cells with their surroundings, a block's or one alone: who owns the nodes, which sheets end where,
//! what is on the edges.

use super::field::{Field, SheetField};
use super::grid::{BLOCK, BlockGrid, NodeValues, neighbours};
use super::labels::{Bodies, CutMethod, Label, Rules};
use glam::{DVec3, IVec3};

/// First node of a tile, relative to its first cell.
const FIRST: i32 = -1;
/// Crossings stay this far from the nodes, in parts of the edge: no triangle degenerates where a node's value
/// is the threshold.
pub(crate) const CROSSING_MIN: f64 = 1e-3;
/// Vertices that an edge can carry: shared, keeping its low end, keeping its high end.
pub(crate) const VARIANTS: usize = 3;

/// A sheet with clay on both sides near the block.
struct SheetTile {
    sheet: u8,
    /// P.
    front: Vec<f32>,
    /// M.
    back: Vec<f32>,
}

/// The tile of a block of 8^3 cells.
pub(crate) type BlockTile = CellTile<{ BLOCK as usize + 3 }>;
/// The tile of one cell.
pub(crate) type OneCellTile = CellTile<4>;

/// Node values around cells and what follows from them, `NODES` along each edge: a block's cells need 9
/// nodes; what ends at an edge, and slopes, need one more on every side.
pub(crate) struct CellTile<const NODES: usize> {
    rules: Rules,
    iso: f32,
    total: Vec<f32>,
    /// Own values; meant only where there are sheets.
    own: Vec<f32>,
    labels: Vec<Label>,
    /// Bodies of the cell with this low node.
    bodies: Vec<Bodies>,
    /// Tiles of the sheets near these cells, by number, then unused ones.
    sheets: Vec<SheetTile>,
    sheet_count: usize,
}

/// The sheets with clay on both sides near a block.
pub(crate) fn sheets_near(field: &Field, block: IVec3) -> impl Iterator<Item = &SheetField> {
    field.sheets.iter().filter(move |s| is_near(&field.grid, &s.front, block) && is_near(&field.grid, &s.back, block))
}

impl<const NODES: usize> CellTile<NODES> {
    /// Steps between tile nodes along x, y, z.
    pub(crate) const STEPS: [usize; 3] = [1, NODES, NODES * NODES];
    const NODE_COUNT: usize = NODES * NODES * NODES;
    /// Vertex places of a tile.
    pub(crate) const PLACES: usize = Self::NODE_COUNT * 3 * VARIANTS;

    pub(crate) fn new(rules: Rules, iso: f32) -> Self {
        Self {
            rules,
            iso,
            total: vec![0.0; Self::NODE_COUNT],
            own: vec![0.0; Self::NODE_COUNT],
            labels: vec![Label::default(); Self::NODE_COUNT],
            bodies: vec![Bodies::WHOLE; Self::NODE_COUNT],
            sheets: Vec::new(),
            sheet_count: 0,
        }
    }

    /// Fills the tile for the cells from `low` of a block, and those of the sheets that are near it; `false`
    /// if no surface can pass through its cells.
    pub(crate) fn load<'a>(
        &mut self,
        field: &Field,
        (block, low): (IVec3, IVec3),
        sheets: impl IntoIterator<Item = &'a SheetField>,
    ) -> bool {
        let read = |values: &NodeValues, tile: &mut [f32]| field.grid.load(values, block, low + FIRST, NODES as i32, tile);
        read(&field.total, &mut self.total);
        if self.total.iter().all(|&f| f <= self.iso) {
            return false;
        }
        self.sheet_count = 0;
        for near in sheets {
            if self.sheet_count == self.sheets.len() {
                let values = || vec![0.0; Self::NODE_COUNT];
                self.sheets.push(SheetTile { sheet: near.sheet, front: values(), back: values() });
            }
            let tile = &mut self.sheets[self.sheet_count];
            tile.sheet = near.sheet;
            read(&near.front, &mut tile.front);
            read(&near.back, &mut tile.back);
            self.sheet_count += 1;
        }
        if self.is_plain() {
            return self.total.iter().any(|&f| f <= self.iso);
        }
        for node in 0..Self::NODE_COUNT {
            self.label_node(node);
        }
        self.find_bodies();
        true
    }

    /// Whether there is no cut near: cells have one body then, and edges one vertex.
    pub(crate) fn is_plain(&self) -> bool {
        self.sheet_count == 0
    }

    fn label_node(&mut self, node: usize) {
        let total = self.total[node];
        let sheets = &self.sheets[..self.sheet_count];
        let owner = |whole: f32, sheet: &SheetTile| self.rules.owner(whole, sheet.front[node], sheet.back[node]);
        let (mut least, mut is_near) = (total, false);
        for sheet in sheets {
            is_near |= sheet.front[node] + sheet.back[node] > 0.0;
            match owner(total, sheet) {
                0 => {}
                side => least = least.min(self.value_on(sheet, node, side)),
            }
        }
        let (mut label, mut own) = (Label::default(), total);
        for sheet in sheets.iter().filter(|_| is_near) {
            let side = owner(least, sheet);
            if side != 0 && label.push(sheet.sheet, side) {
                let value = self.value_on(sheet, node, side);
                // The product alone, but without its rounding where the other side has no clay.
                own *= if value == total { 1.0 } else { value / total };
            }
        }
        // To Equation 9 a cut makes values, and parts nothing.
        if self.rules.method == CutMethod::Equation9 {
            label = Label::default();
        }
        if own > self.iso {
            label.set_inside();
        }
        self.labels[node] = label;
        self.own[node] = own;
    }

    fn value_on(&self, sheet: &SheetTile, node: usize, side: i8) -> f32 {
        let (front, back) = (sheet.front[node], sheet.back[node]);
        self.rules.side_value(self.total[node], front + back, if side > 0 { back } else { front })
    }

    /// Value of a side of a sheet at a node, whoever owns the node.
    fn side_value(&self, node: usize, sheet: u8, side: i8) -> f32 {
        self.sheet(sheet).map_or(self.total[node], |tile| self.value_on(tile, node, side))
    }

    /// Least value at a node of the sides that `label` names, but for sheets that part it from `across`.
    fn value_beside(&self, node: usize, label: Label, across: Label) -> f32 {
        let is_parting = |sheet: u8| label.parting(across).any(|s| s == sheet);
        let sides = label.owners().filter(|o| !is_parting(o.0));
        sides.fold(self.total[node], |least, (sheet, side)| least.min(self.side_value(node, sheet, side)))
    }

    fn sheet(&self, sheet: u8) -> Option<&SheetTile> {
        self.sheets[..self.sheet_count].iter().find(|tile| tile.sheet == sheet)
    }

    fn find_bodies(&mut self) {
        let cells = NODES - 1;
        for z in 0..cells {
            for y in 0..cells {
                for x in 0..cells {
                    let low = Self::node_index([x, y, z]);
                    let corners = self.corner_labels(low);
                    let mask = if self.rules.empty_nodes_join { 0xff } else { inside_of(&corners) };
                    // Most cells of a block with a cut are not at the cut.
                    let is_whole = corners.iter().all(|l| l.has_owners_of(corners[0]));
                    self.bodies[low] = if is_whole { Bodies::WHOLE } else { Bodies::new(&corners, mask) };
                }
            }
        }
    }

    fn corner_labels(&self, low: usize) -> [Label; 8] {
        std::array::from_fn(|i| self.labels[Self::corner(low, i as u8)])
    }

    /// The low nodes of the cells, x fastest.
    pub(crate) fn cells() -> impl Iterator<Item = usize> {
        let range = || 1..NODES - 2;
        range().flat_map(move |z| range().flat_map(move |y| range().map(move |x| Self::node_index([x, y, z]))))
    }

    /// The inside bits of a cell without cuts.
    pub(crate) fn case(&self, cell: usize) -> u8 {
        (0..8).fold(0, |bits, i| bits | u8::from(self.total[Self::corner(cell, i)] > self.iso) << i)
    }

    /// The inside bits of each body of a cell.
    pub(crate) fn bodies(&self, cell: usize) -> impl Iterator<Item = u8> {
        let mask = inside_of(&self.corner_labels(cell));
        let bodies = self.bodies[cell];
        let is_whole = bodies == Bodies::WHOLE;
        (is_whole && mask != 0).then_some(mask).into_iter().chain((!is_whole).then(|| bodies.masks(mask)).into_iter().flatten())
    }

    /// Whether two corners of a cell are inside and of different bodies of it.
    pub(crate) fn are_parted(&self, cell: usize, a: u8, b: u8) -> bool {
        self.is_inside(Self::corner(cell, a)) && self.is_inside(Self::corner(cell, b)) && self.bodies[cell].part(a, b)
    }

    /// Whether a cell has one body.
    pub(crate) fn is_whole(&self, cell: usize) -> bool {
        self.bodies[cell] == Bodies::WHOLE
    }

    /// Whether a node is inside, in a tile with cuts.
    pub(crate) fn is_inside(&self, node: usize) -> bool {
        self.labels[node].is_inside()
    }

    /// Whether the ends of an edge are inside and of different bodies in each of its four cells.
    pub(crate) fn is_split(&self, low: usize, axis: usize) -> bool {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        (0..4u8).all(|i| {
            // The edge's low node is this corner of the cell.
            let place = (i & 1) << u | (i >> 1) << v;
            let cell = low - usize::from(i & 1) * Self::STEPS[u] - usize::from(i >> 1) * Self::STEPS[v];
            self.are_parted(cell, place, place | 1 << axis)
        })
    }

    /// Which of an edge's vertices a body uses that keeps one end of it.
    pub(crate) fn variant(&self, low: usize, axis: usize, keeps_low: bool) -> usize {
        match () {
            () if self.is_plain() || !self.is_split(low, axis) => 0,
            () if keeps_low => 1,
            () => 2,
        }
    }

    /// Position of a vertex on an edge, in parts of the edge from its low node.
    ///
    /// - Ends of one side, or no lip there: where the own value is the threshold.
    /// - Both ends inside: both lips are pinned to the sheet, the zero of (P - M) / (P + M), or to the mean
    ///   of several. They coincide, until the clay opens by more than the edge.
    /// - A lip whose other end is outside: where a value of the kept side is the threshold, of all the
    ///   nearest to the kept end.
    pub(crate) fn crossing(&self, low: usize, axis: usize) -> f64 {
        let high = low + Self::STEPS[axis];
        let t = if self.is_plain() {
            self.crossing_of(self.total[low], self.total[high])
        } else {
            match (self.is_inside(low), self.is_inside(high)) {
                (true, false) => self.lip_crossing(low, high),
                (false, true) => 1.0 - self.lip_crossing(high, low),
                _ => self.pinned_crossing(low, high),
            }
        };
        t.clamp(CROSSING_MIN, 1.0 - CROSSING_MIN)
    }

    fn crossing_of(&self, a: f32, b: f32) -> f64 {
        f64::from(self.iso - a) / f64::from(b - a)
    }

    /// Zero of (P - M) / (P + M) from `a` on towards `b`, nodes that a sheet owns from opposite sides.
    fn sheet_crossing(&self, sheet: u8, a: usize, b: usize) -> f64 {
        let Some(tile) = self.sheet(sheet) else { return 0.5 };
        let q = |n: usize| f64::from(tile.front[n] - tile.back[n]) / f64::from(tile.front[n] + tile.back[n]);
        let t = q(a) / (q(a) - q(b));
        // Owned from opposite sides with P = M at both: 0 / 0.
        if t.is_finite() { t } else { 0.5 }
    }

    /// Where both lips stand between two inside nodes: the mean over the sheets that part them.
    fn pinned_crossing(&self, low: usize, high: usize) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for sheet in self.labels[low].parting(self.labels[high]) {
            sum += self.sheet_crossing(sheet, low, high);
            count += 1.0;
        }
        if count > 0.0 { sum / count } else { 0.5 }
    }

    /// From `kept`, which is inside, on towards `other`, which is not.
    fn lip_crossing(&self, kept: usize, other: usize) -> f64 {
        let (label, across) = (self.labels[kept], self.labels[other]);
        if !label.is_parted_from(across) {
            return self.crossing_of(self.own[kept], self.own[other]);
        }
        let mut nearest = 1.0f64;
        for sheet in label.parting(across) {
            let side = label.owners().find(|o| o.0 == sheet).map_or(0, |o| o.1);
            let (a, b) = (self.side_value(kept, sheet, side), self.side_value(other, sheet, side));
            let is_free = a > self.iso && b <= self.iso;
            nearest = nearest.min(if is_free { self.crossing_of(a, b) } else { self.sheet_crossing(sheet, kept, other) });
        }
        let (a, b) = (self.value_beside(kept, label, across), self.value_beside(other, across, label));
        if a > self.iso && b <= self.iso { nearest.min(self.crossing_of(a, b)) } else { nearest }
    }

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
        let mut owners = label.owners().filter_map(|(sheet, side)| Some((self.sheet(sheet)?, side)));
        let Some((first, side)) = owners.next() else { return Self::slope_of(node, |n| self.total[n]) };
        let rest: Vec<_> = owners.collect();
        let value =
            |n: usize| rest.iter().fold(self.value_on(first, n, side), |least, (s, side)| least.min(self.value_on(s, n, *side)));
        Self::slope_of(node, value)
    }

    /// Position of a tile node relative to the first cell \[nodes\].
    pub(crate) fn node_offset(node: usize) -> IVec3 {
        IVec3::new((node % NODES) as i32, (node / NODES % NODES) as i32, (node / (NODES * NODES)) as i32) + FIRST
    }

    fn node_index([x, y, z]: [usize; 3]) -> usize {
        x + NODES * (y + NODES * z)
    }

    /// Tile node of corner `i` of a cell.
    pub(crate) fn corner(cell: usize, i: u8) -> usize {
        let i = usize::from(i);
        cell + (i & 1) * Self::STEPS[0] + (i >> 1 & 1) * Self::STEPS[1] + (i >> 2 & 1) * Self::STEPS[2]
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

/// World position of a point of an edge \[m\].
pub(crate) fn position(field: &Field, node: IVec3, axis: usize, t: f64) -> [f32; 3] {
    let mut at = node.as_dvec3();
    at[axis] += t;
    let world: DVec3 = field.origin + field.spacing * at;
    world.as_vec3().to_array()
}

fn is_near(grid: &BlockGrid, values: &NodeValues, block: IVec3) -> bool {
    neighbours().filter_map(|d| grid.slot(block + d)).any(|slot| values.block(slot).is_some())
}

fn inside_of(corners: &[Label; 8]) -> u8 {
    corners.iter().enumerate().fold(0, |bits, (i, l)| bits | u8::from(l.is_inside()) << i)
}
