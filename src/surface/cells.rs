//! Some cells with their surroundings, a block's or one alone: who owns the nodes, which sheets end where,
//! what is on the edges.

mod normals;
pub(crate) mod rims;

use super::bodies::BodyField;
use super::closure::with_others;
use super::field::Field;
use super::grid::{BLOCK, BlockGrid, NodeValues, neighbours};
use super::labels::{Bodies, CutMethod, Label, NOBODY, Rules};
use super::sheets::SheetField;
use glam::{DVec3, IVec3};

/// First node of a tile, relative to its first cell.
const FIRST: i32 = -1 - HOLD as i32;
/// How far a node that is inside by others' clay may be from one that is so by its part's own \[nodes, along
/// axes\].
pub(crate) const HOLD: usize = 2;
/// Crossings stay this far from the nodes, in parts of the edge: no triangle degenerates where a node's value
/// is the threshold.
pub(crate) const CROSSING_MIN: f64 = 1e-3;
/// Vertices that an edge can carry: shared, keeping its low end, keeping its high end.
pub(crate) const VARIANTS: usize = 3;

/// The clay of a body near the cells.
struct BodyTile {
    body: u32,
    values: Vec<f32>,
}

/// A sheet with clay on both sides near the block.
struct SheetTile {
    body: u32,
    sheet: u8,
    /// P.
    front: Vec<f32>,
    /// M.
    back: Vec<f32>,
}

/// The tile of a block of 8^3 cells.
pub(crate) type BlockTile = CellTile<{ BLOCK as usize + 3 + 2 * HOLD }>;
/// The tile of one cell.
pub(crate) type OneCellTile = CellTile<{ 4 + 2 * HOLD }>;
/// The tile of a cell and those about it.
pub(crate) type AboutCellTile = CellTile<{ 6 + 2 * HOLD }>;

/// Node values around cells and what follows from them, `NODES` along each edge: a block's cells need 9
/// nodes; what ends at an edge, and slopes, need one more on every side, and what holds these [`HOLD`] more.
pub(crate) struct CellTile<const NODES: usize> {
    rules: Rules,
    iso: f32,
    total: Vec<f32>,
    /// k of each node; meant, as what follows, only where there are sheets or several bodies.
    closure: Vec<f32>,
    /// Own values, and what they are of a side's clay alone.
    own: Vec<f32>,
    alone: Vec<f32>,
    labels: Vec<Label>,
    /// Bodies of the cell with this low node.
    bodies: Vec<Bodies>,
    /// Tiles of the bodies with clay at these nodes, by number, if there are several; then unused ones.
    near_bodies: Vec<BodyTile>,
    body_count: usize,
    /// Tiles of the sheets near these cells, by number, then unused ones.
    sheets: Vec<SheetTile>,
    sheet_count: usize,
}

/// What may part clay near a block.
pub(crate) struct Near<'a> {
    /// The bodies, if there are several.
    bodies: Vec<&'a BodyField>,
    /// The sheets with clay on both sides.
    sheets: Vec<&'a SheetField>,
}

impl<'a> Near<'a> {
    pub(crate) fn new(field: &'a Field, block: IVec3) -> Self {
        let (grid, total) = (&field.grid, &field.total);
        let is_near = |values: &NodeValues| is_near(grid, block, |slot| values.block(slot).is_some());
        let sheets = field.sheets.iter().filter(|s| is_near(&s.front) && is_near(&s.back)).collect();
        let is_body_near = |b: &&BodyField| self::is_near(grid, block, |slot| b.block(total, slot).is_some());
        let mut bodies: Vec<_> = field.bodies.iter().filter(is_body_near).collect();
        if bodies.len() < 2 {
            bodies.clear();
        }
        Self { bodies, sheets }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.bodies.is_empty() && self.sheets.is_empty()
    }
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
            closure: vec![0.0; Self::NODE_COUNT],
            own: vec![0.0; Self::NODE_COUNT],
            alone: vec![0.0; Self::NODE_COUNT],
            labels: vec![Label::default(); Self::NODE_COUNT],
            bodies: vec![Bodies::WHOLE; Self::NODE_COUNT],
            near_bodies: Vec::new(),
            body_count: 0,
            sheets: Vec::new(),
            sheet_count: 0,
        }
    }

    /// Fills the tile for the cells from `low` of a block, and those of what is near it; `false` if no
    /// surface can pass through its cells.
    pub(crate) fn load(&mut self, field: &Field, (block, low): (IVec3, IVec3), near: &Near<'_>) -> bool {
        let at = (block, low + FIRST);
        field.grid.load(&field.total, block, at.1, NODES as i32, &mut self.total);
        if self.total.iter().all(|&f| f <= self.iso) {
            return false;
        }
        self.load_bodies(field, at, near);
        self.load_sheets(field, at, near);
        if self.is_plain() {
            return self.total.iter().any(|&f| f <= self.iso);
        }
        // To Equation 9 a side is its own clay alone.
        if self.rules.method == CutMethod::TwoSided {
            field.closure.load(&field.grid, block, at.1, NODES as i32, &mut self.closure);
        }
        for node in 0..Self::NODE_COUNT {
            self.label_node(node);
        }
        self.open_loose_nodes();
        self.find_bodies();
        true
    }

    fn load_bodies(&mut self, field: &Field, (block, first): (IVec3, IVec3), near: &Near<'_>) {
        self.body_count = 0;
        for body in &near.bodies {
            if self.body_count == self.near_bodies.len() {
                self.near_bodies.push(BodyTile { body: body.body, values: vec![0.0; Self::NODE_COUNT] });
            }
            let tile = &mut self.near_bodies[self.body_count];
            tile.body = body.body;
            field.grid.load_from(|slot| body.block(&field.total, slot), block, first, NODES as i32, &mut tile.values);
            self.body_count += usize::from(tile.values.iter().any(|&v| v > 0.0));
        }
        // One alone has all clay.
        if self.body_count == 1 {
            self.body_count = 0;
        }
    }

    fn load_sheets(&mut self, field: &Field, (block, first): (IVec3, IVec3), near: &Near<'_>) {
        self.sheet_count = 0;
        for sheet in &near.sheets {
            if self.body_count > 0 && self.body(sheet.body).is_none() {
                continue;
            }
            if self.sheet_count == self.sheets.len() {
                let values = || vec![0.0; Self::NODE_COUNT];
                self.sheets.push(SheetTile { body: 0, sheet: 0, front: values(), back: values() });
            }
            let tile = &mut self.sheets[self.sheet_count];
            (tile.body, tile.sheet) = (if self.body_count > 0 { sheet.body } else { 0 }, sheet.sheet);
            field.grid.load(&sheet.front, block, first, NODES as i32, &mut tile.front);
            field.grid.load(&sheet.back, block, first, NODES as i32, &mut tile.back);
            self.sheet_count += 1;
        }
    }

    /// Whether neither a cut nor another body is near: cells have one body then, and edges one vertex.
    pub(crate) fn is_plain(&self) -> bool {
        self.sheet_count == 0 && self.body_count == 0
    }

    fn body(&self, body: u32) -> Option<&BodyTile> {
        self.near_bodies[..self.body_count].iter().find(|tile| tile.body == body)
    }

    /// The clay of a body, which is all there is to it.
    fn whole(&self, body: u32) -> &[f32] {
        self.body(body).map_or(&self.total, |tile| &tile.values)
    }

    /// A body's clay at a node, and what counts of the others'.
    fn whole_closed(&self, node: usize, body: u32) -> f32 {
        with_others(self.whole(body)[node], self.total[node], self.closure[node])
    }

    /// Rule 0.
    fn body_at(&self, node: usize) -> u32 {
        let tiles = &self.near_bodies[..self.body_count];
        let none = (if tiles.is_empty() { 0 } else { NOBODY }, 0.0);
        let greater =
            |best: (u32, f32), tile: &BodyTile| if tile.values[node] > best.1 { (tile.body, tile.values[node]) } else { best };
        tiles.iter().fold(none, greater).0
    }

    fn label_node(&mut self, node: usize) {
        let body = self.body_at(node);
        let total = self.whole(body)[node];
        let sheets = self.sheets[..self.sheet_count].iter().filter(|sheet| sheet.body == body);
        let owner = |whole: f32, sheet: &SheetTile| self.rules.owner(whole, sheet.front[node], sheet.back[node]);
        let (mut least, mut is_near) = (total, false);
        for sheet in sheets.clone() {
            is_near |= sheet.front[node] + sheet.back[node] > 0.0;
            match owner(total, sheet) {
                0 => {}
                side => least = least.min(self.value_on(sheet, node, side)),
            }
        }
        let (mut label, mut own, mut alone) = (Label::of_body(body), self.whole_closed(node, body), total);
        for sheet in sheets.filter(|_| is_near) {
            let side = owner(least, sheet);
            if side != 0 && label.push(sheet.sheet, side) {
                // The product alone, but without its rounding where the other side has no clay.
                let share = |value: f32| if value == total { 1.0 } else { value / total };
                own *= share(self.value_closed(sheet, node, side));
                alone *= share(self.value_on(sheet, node, side));
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
        (self.own[node], self.alone[node]) = (own, alone);
    }

    /// The last of rule 3: nodes inside by others' clay, farther than [`HOLD`] from such by their own.
    fn open_loose_nodes(&mut self) {
        let inside = |n: usize| self.alone[n] > self.iso;
        let mut held: Vec<bool> = (0..Self::NODE_COUNT).map(inside).collect();
        for _ in 0..HOLD {
            let is_beside = |node: usize| {
                let beside = Self::STEPS.into_iter().flat_map(|step| [node - step, node + step]);
                self.labels[node].is_inside()
                    && beside.into_iter().any(|n| held[n] && self.labels[n].has_owners_of(self.labels[node]))
            };
            let more: Vec<usize> = Self::nodes_from(1).filter(|node| !held[*node] && is_beside(*node)).collect();
            more.into_iter().for_each(|node| held[node] = true);
        }
        for node in Self::nodes_from(HOLD) {
            if held[node] || !self.labels[node].is_inside() {
                continue;
            }
            self.labels[node].set_outside();
            // As much as there may be without being inside: the surface stays where all clay ends.
            self.own[node] = self.iso;
        }
    }

    /// The tile's nodes, but for so many at its sides.
    fn nodes_from(first: usize) -> impl Iterator<Item = usize> {
        let range = move || first..NODES - first;
        range().flat_map(move |z| range().flat_map(move |y| range().map(move |x| Self::node_index([x, y, z]))))
    }

    /// Of a side's clay alone.
    fn value_on(&self, sheet: &SheetTile, node: usize, side: i8) -> f32 {
        let (front, back) = (sheet.front[node], sheet.back[node]);
        self.rules.side_value(self.whole(sheet.body)[node], front + back, if side > 0 { back } else { front })
    }

    /// And of what counts of the other's.
    fn value_closed(&self, sheet: &SheetTile, node: usize, side: i8) -> f32 {
        with_others(self.value_on(sheet, node, side), self.whole(sheet.body)[node], self.closure[node])
    }

    /// Value of a side of a body's sheet at a node, whoever owns the node.
    fn side_value(&self, node: usize, (body, sheet): (u32, u8), side: i8) -> f32 {
        self.sheet(body, sheet).map_or_else(|| self.whole(body)[node], |tile| self.value_closed(tile, node, side))
    }

    /// Least value at a node of the sides that `label` names, and of its body.
    fn value_seen(&self, node: usize, label: Label) -> f32 {
        let value = |(sheet, side)| self.side_value(node, (label.body, sheet), side);
        label.owners().map(value).fold(self.whole_closed(node, label.body), f32::min)
    }

    /// [`Self::value_seen`], but for sheets that part the label from `across`, which is of the same body.
    fn value_beside(&self, node: usize, label: Label, across: Label) -> f32 {
        let is_parting = |sheet: u8| label.parting(across).any(|s| s == sheet);
        let sides = label.owners().filter(|o| !is_parting(o.0));
        let value = |(sheet, side)| self.side_value(node, (label.body, sheet), side);
        sides.map(value).fold(self.whole_closed(node, label.body), f32::min)
    }

    fn sheet(&self, body: u32, sheet: u8) -> Option<&SheetTile> {
        self.sheets[..self.sheet_count].iter().find(|tile| (tile.body, tile.sheet) == (body, sheet))
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
        let range = || 1 + HOLD..NODES - 2 - HOLD;
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
    ///   of several, or to where two bodies have as much clay. They coincide, until the clay opens by more
    ///   than the edge.
    /// - A lip whose other end is outside: where a value of the kept side is the threshold, or the sheet, a
    ///   little beyond it if closed, of all the nearest to the kept end.
    ///
    /// At rims vertices stand beside their edges: see [`Self::point`].
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
    fn sheet_crossing(&self, (body, sheet): (u32, u8), a: usize, b: usize) -> f64 {
        let Some(tile) = self.sheet(body, sheet) else { return 0.5 };
        zero_between((&tile.front, &tile.back), a, b)
    }

    /// [`Self::sheet_crossing`] of two bodies, the one that has `a` and the one that has `b`.
    fn body_crossing(&self, a: usize, b: usize) -> f64 {
        zero_between((self.whole(self.labels[a].body), self.whole(self.labels[b].body)), a, b)
    }

    /// Where both lips stand between two inside nodes: the mean over the sheets that part them, if it is not
    /// two bodies that meet there.
    fn pinned_crossing(&self, low: usize, high: usize) -> f64 {
        let (label, across) = (self.labels[low], self.labels[high]);
        if label.is_of_other_body(across) {
            return self.body_crossing(low, high);
        }
        let (mut sum, mut count) = (0.0, 0.0);
        for sheet in label.parting(across) {
            sum += self.sheet_crossing((label.body, sheet), low, high);
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
        if label.is_of_other_body(across) {
            let (a, b) = (self.value_seen(kept, label), self.value_seen(other, label));
            let face = self.lip_end((self.whole(label.body), self.whole(across.body)), kept, other);
            return if b <= self.iso { face.min(self.crossing_of(a, b)) } else { face };
        }
        let mut nearest = 1.0f64;
        for sheet in label.parting(across) {
            let side = label.owners().find(|o| o.0 == sheet).map_or(0, |o| o.1);
            let Some(tile) = self.sheet(label.body, sheet) else { continue };
            let (a, b) = (self.value_closed(tile, kept, side), self.value_closed(tile, other, side));
            let sides = if side > 0 { (&tile.front[..], &tile.back[..]) } else { (&tile.back[..], &tile.front[..]) };
            nearest = nearest.min(self.lip_end(sides, kept, other));
            if a > self.iso && b <= self.iso {
                nearest = nearest.min(self.crossing_of(a, b));
            }
        }
        let (a, b) = (self.value_beside(kept, label, across), self.value_beside(other, across, label));
        if a > self.iso && b <= self.iso { nearest.min(self.crossing_of(a, b)) } else { nearest }
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
}

/// World position \[m\] of a point that is so far from a node \[nodes\].
pub(crate) fn position(field: &Field, node: IVec3, point: DVec3) -> [f32; 3] {
    (field.origin + field.spacing * (node.as_dvec3() + point)).as_vec3().to_array()
}

/// Whether what is at some slots is at a block or one beside it.
fn is_near(grid: &BlockGrid, block: IVec3, is_at: impl Fn(usize) -> bool) -> bool {
    neighbours().filter_map(|d| grid.slot(block + d)).any(is_at)
}

/// Zero of (p - m) / (p + m) between two nodes.
fn zero_between((p, m): (&[f32], &[f32]), a: usize, b: usize) -> f64 {
    let q = |n: usize| f64::from(p[n] - m[n]) / f64::from(p[n] + m[n]);
    let t = q(a) / (q(a) - q(b));
    // p = m at both: 0 / 0.
    if t.is_finite() { t } else { 0.5 }
}

fn inside_of(corners: &[Label; 8]) -> u8 {
    corners.iter().enumerate().fold(0, |bits, (i, l)| bits | u8::from(l.is_inside()) << i)
}
