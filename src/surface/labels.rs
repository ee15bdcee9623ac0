//! What cuts make of nodes, cells and edges, in one place. Whoever extracts, on whatever processor, follows this text line by line.
//!
//! With f the clay around a node, and P and M that of it in front of and behind a sheet (each particle counts at both of its cuts):
//!
//! 1. **Owner of a node at a sheet**: none if P + M <= f / 2; else the front if P >= M, else the back. A node keeps the first
//!    [`CUTS_MAX`] sheets, by number, that own it. More than half, and not any trace: with a small share clay far from the cut counts
//!    as one of its sides.
//! 2. **A side's value at a node**: f - b(c) X, with X the clay of the other side, c = (P + M) / f the share of the clay that stands at
//!    the cut, and b(c) the smoothstep from c = 1/2 to 1. Where the tags end the sides share all clay, one cell behind the crack
//!    front each has its own alone: so the lips close smoothly.
//! 3. **Own value**: the least of the node's sides' values, f without owners. **Inside**: own value above the threshold. Least, and
//!    not the clay that is on the right side of every cut: where two shut cuts cross, that is a quarter, and a channel would open.
//! 4. **A sheet parts two nodes** if it owns them from opposite sides. In a cell, nodes that no sheet parts are of one body. A sheet
//!    that parts nodes which are of one body by way of others *ends* in that cell: the crack front passes there, and it parts
//!    nothing in that cell. A cell where more than [`CUTS_MAX`] sheets end has only one body.
//! 5. **Emission**: each cell once per body, with that body's inside nodes inside. Empty nodes join nothing: if they did, they would
//!    bridge the cut along the free surface.
//! 6. **Vertices**: the two ends of an edge are *split* if a sheet parts them that ends in none of the edge's four cells. A split edge
//!    has one vertex per kept end, all others share one. So lips are welded at the crack front.
//! 7. **Place of a vertex**: see [`super::cells::CellTile::crossing`]. **Caps**: see [`super::caps`].
//!
//! Every rule but 4 and 6 looks at one node or the two nodes of an edge, and those two at cells and edges that all blocks around see
//! alike: so blocks agree on their common faces, whatever else they hold.

use serde::{Deserialize, Serialize};

/// Most cuts that own a node. Particles stand at two cuts at most, so no four can each hold more than half of a node's clay.
pub(crate) const CUTS_MAX: usize = 3;
/// Share of the clay around a node that stands at a cut, above which the cut owns it. Any trace instead (0.05) gave the wrong bodies in
/// 29 of 60 cuts.
const OWNER_SHARE: f32 = 0.5;

/// How cuts show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum CutMethod {
    /// Two lips: cells at a cut are emitted once per side.
    #[default]
    TwoSided,
    /// Equation 9 as published, for comparison: each node sees the clay of its own side only, then ordinary marching cubes.
    Equation9,
}

/// The rules by their numbers. Other ones are for tests, which show what they break.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rules {
    /// How cuts show.
    pub method: CutMethod,
    /// Share above which a cut owns a node.
    pub owner_share: f32,
    /// Whether empty nodes join bodies.
    pub empty_nodes_join: bool,
}

impl Rules {
    /// The rules of a method.
    pub fn new(method: CutMethod) -> Self {
        Self { method, owner_share: OWNER_SHARE, empty_nodes_join: false }
    }

    /// The side that owns a node at a sheet: 1 front, -1 back, 0 none.
    pub(crate) fn owner(&self, total: f32, front: f32, back: f32) -> i8 {
        if front + back <= self.owner_share * total {
            0
        } else if front >= back {
            1
        } else {
            -1
        }
    }

    /// Value of a side at a node from which `other` is kept apart; `at_cut` = P + M.
    pub(crate) fn side_value(&self, total: f32, at_cut: f32, other: f32) -> f32 {
        let share = match self.method {
            CutMethod::TwoSided => blend(at_cut / total),
            CutMethod::Equation9 => 1.0,
        };
        total - share * other
    }
}

/// Smoothstep of the share of clay at a cut, from 1/2 to 1.
fn blend(share: f32) -> f32 {
    // A node without clay: 0 / 0.
    let x = (2.0 * share - 1.0).clamp(0.0, 1.0);
    if x.is_nan() { 0.0 } else { x * x * (3.0 - 2.0 * x) }
}

/// Who owns a node: bit 0 inside; then for each cut, by sheet number, 9 bits: side (front 1), sheet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Label(u32);

impl Label {
    /// Adds a sheet that owns the node; false if there is no room for it.
    pub(crate) fn push(&mut self, sheet: u8, owner: i8) -> bool {
        let Some(k) = (0..CUTS_MAX).find(|&k| self.word(k) == 0) else { return false };
        self.0 |= (u32::from(sheet) << 1 | u32::from(owner > 0)) << (1 + 9 * k);
        true
    }

    pub(crate) fn set_inside(&mut self) {
        self.0 |= 1;
    }

    pub(crate) fn is_inside(self) -> bool {
        self.0 & 1 == 1
    }

    /// Whether the same sides of the same cuts own both nodes.
    pub(crate) fn has_owners_of(self, other: Self) -> bool {
        self.0 >> 1 == other.0 >> 1
    }

    fn word(self, k: usize) -> u32 {
        self.0 >> (1 + 9 * k) & 0x1ff
    }

    /// The sheets that own the node, and from which side.
    pub(crate) fn owners(self) -> impl Iterator<Item = (u8, i8)> {
        let owner = |w: u32| ((w >> 1) as u8, if w & 1 == 1 { 1 } else { -1 });
        (0..CUTS_MAX).map(move |k| self.word(k)).take_while(|&w| w != 0).map(owner)
    }

    /// The sheets that part two nodes.
    pub(crate) fn parting(self, other: Self) -> impl Iterator<Item = u8> {
        // Words differ in the side alone.
        let is_parting = move |w: &u32| (0..CUTS_MAX).any(|k| other.word(k) == w ^ 1);
        (0..CUTS_MAX).map(move |k| self.word(k)).filter(|&w| w != 0).filter(is_parting).map(|w| (w >> 1) as u8)
    }
}

/// The sheets that end in a cell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Ends(u32);

impl Ends {
    /// Every sheet.
    const ALL: Self = Self(u32::MAX);

    pub(crate) fn is_none(self) -> bool {
        self.0 == 0
    }

    pub(crate) fn has(self, sheet: u8) -> bool {
        self == Self::ALL || (0..CUTS_MAX).any(|k| self.0 >> (8 * k) & 0xff == u32::from(sheet))
    }

    fn push(&mut self, sheet: u8) {
        if !self.has(sheet) {
            match (0..CUTS_MAX).find(|&k| self.0 >> (8 * k) & 0xff == 0) {
                Some(k) => self.0 |= u32::from(sheet) << (8 * k),
                None => *self = Self::ALL,
            }
        }
    }

    /// Whether a sheet that does not end here parts two nodes.
    pub(crate) fn leaves_parted(self, a: Label, b: Label) -> bool {
        a.parting(b).any(|sheet| !self.has(sheet))
    }
}

/// Bodies of a cell, given what its corners are and which sheets end in it: the corners of `mask` that no sheet parts from the first one,
/// then the others.
pub(crate) fn bodies(corners: [Label; 8], mask: u8, ends: Ends) -> impl Iterator<Item = u8> {
    let mut left = mask;
    std::iter::from_fn(move || {
        let mut body = left & left.wrapping_neg();
        if body == 0 {
            return None;
        }
        // Until no corner is added: a body reaches as far as its nodes reach.
        loop {
            let is_joined = |i: &usize| {
                left >> i & 1 == 1 && (0..8).any(|j| body >> j & 1 == 1 && !ends.leaves_parted(corners[*i], corners[j]))
            };
            let grown = (0..8usize).filter(is_joined).fold(body, |b, i| b | 1 << i);
            if grown == body {
                break;
            }
            body = grown;
        }
        left &= !body;
        Some(body)
    })
}

/// The sheets that end in a cell: they part nodes of one body.
pub(crate) fn ends_of_cell(corners: &[Label; 8], mask: u8) -> Ends {
    let mut ends = Ends::default();
    loop {
        let mut more = ends;
        for body in bodies(*corners, mask, ends) {
            for i in 0..8usize {
                for j in i + 1..8 {
                    if body >> i & 1 == 1 && body >> j & 1 == 1 {
                        // Those that end here already are in the set.
                        corners[i].parting(corners[j]).for_each(|sheet| more.push(sheet));
                    }
                }
            }
        }
        if more == ends {
            return ends;
        }
        ends = more;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn label(owners: &[(u8, i8)]) -> Label {
        let mut label = Label::default();
        owners.iter().for_each(|&(sheet, side)| assert!(label.push(sheet, side)));
        label.set_inside();
        label
    }

    fn cell(corners: [&[(u8, i8)]; 8]) -> ([Label; 8], Ends, Vec<u8>) {
        let labels = corners.map(label);
        let ends = ends_of_cell(&labels, 0xff);
        (labels, ends, bodies(labels, 0xff, ends).collect())
    }

    #[test]
    fn labels_keep_three_owners() {
        let mut l = label(&[(3, 1), (200, -1), (255, 1)]);
        assert!(!l.push(7, 1) && l.is_inside());
        assert_eq!(l.owners().collect::<Vec<_>>(), [(3, 1), (200, -1), (255, 1)]);
        assert_eq!(l.parting(label(&[(3, -1), (200, -1), (255, -1)])).collect::<Vec<_>>(), [3, 255]);
        assert_eq!(label(&[]).parting(l).count(), 0);
        assert!(l.has_owners_of(l) && !l.has_owners_of(label(&[])));
    }

    /// A cut through; its front; the front with an empty node where the untouched clay was.
    #[test]
    fn sheet_ends_where_untouched_clay_joins_its_sides() {
        let (p, m): (&[_], &[_]) = (&[(1, 1)], &[(1, -1)]);
        let (_, ends, bodies) = cell([p, m, p, m, p, m, p, m]);
        assert_eq!((ends, bodies), (Ends::default(), vec![0b0101_0101, 0b1010_1010]));
        let (mut labels, ends, one) = cell([p, m, p, m, p, m, p, &[]]);
        assert!(ends.has(1) && !ends.has(2) && one == [0xff]);
        labels[7] = Label::default();
        assert_eq!(ends_of_cell(&labels, 0x7f), Ends::default());
        assert!(ends_of_cell(&labels, 0xff).has(1), "the variant in which empty nodes join");
    }

    /// Two crossing sheets make four bodies; where one meets the other from above, three.
    #[test]
    fn crossing_sheets_part_a_cell_in_four() {
        let corner = |i: u8| [(4u8, if i & 1 == 1 { 1i8 } else { -1 }), (9, if i & 2 == 2 { 1 } else { -1 })];
        let all: [[(u8, i8); 2]; 8] = std::array::from_fn(|i| corner(i as u8));
        let (_, ends, four) = cell(std::array::from_fn(|i| &all[i][..]));
        assert_eq!((ends, four), (Ends::default(), vec![0x11, 0x22, 0x44, 0x88]));
        // Below sheet 9 nothing knows of sheet 4.
        let (_, ends, three) = cell(std::array::from_fn(|i| if i & 2 == 2 { &all[i][..] } else { &all[i][1..] }));
        assert_eq!((ends, three), (Ends::default(), vec![0x33, 0x44, 0x88]));
        // Without sheet 9 on one side they are joined there.
        let (_, ends, one) = cell(std::array::from_fn(|i| if i & 2 == 2 { &all[i][..1] } else { &[][..] }));
        assert!(ends.has(4) && one == [0xff]);
    }

    #[test]
    fn cell_of_many_ending_sheets_is_one_body() {
        let pairs: [[(u8, i8); 1]; 8] = std::array::from_fn(|i| [(i as u8 / 2 + 1, if i & 1 == 1 { 1 } else { -1 })]);
        let (_, ends, one) = cell(std::array::from_fn(|i| &pairs[i][..]));
        assert_eq!((ends, one), (Ends::ALL, vec![0xff]));
    }

    #[test]
    fn side_values_part_where_the_cut_is_whole() {
        let rules = Rules::new(CutMethod::TwoSided);
        assert_eq!([rules.owner(1.0, 0.3, 0.2), rules.owner(1.0, 0.3, 0.3), rules.owner(1.0, 0.2, 0.4)], [0, 1, -1]);
        assert_eq!(rules.owner(0.0, 0.0, 0.0), 0);
        assert_eq!(rules.side_value(1.0, 0.5, 0.25), 1.0);
        assert_eq!(rules.side_value(1.0, 1.0, 0.25), 0.75);
        assert_eq!(rules.side_value(0.0, 0.0, 0.0), 0.0);
        assert_eq!(Rules::new(CutMethod::Equation9).side_value(1.0, 0.5, 0.25), 0.75);
    }
}
