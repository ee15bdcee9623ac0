//! What cuts make of nodes, cells and edges, in one place. Whoever extracts, on whatever processor, follows
//! this text line by line.
//!
//! With f the clay around a node, and P and M that of it in front of and behind a sheet (each particle counts
//! at both of its cuts):
//!
//! 0. **Body of a node**: the one with most clay around it, the lowest number of equal ones; none without
//!    clay. Its clay alone is what f means below, and its cuts are the only ones: a body ends at another as
//!    at the other side of a cut right through, and knows nothing of what is beyond. To clay of one body its
//!    number means nothing.
//! 1. **Owner of a node at a sheet**: none if P + M <= f / 2; else the front if P >= M, else the back. More
//!    than half, and not any trace: with a small share clay far from the cut counts as one of its sides.
//!    Where other sheets own the node, f / 2 is half of the least of their owners' values (2): a cut may end
//!    at another one, and the clay beyond that is none of its business. A node keeps the first three sheets
//!    (`CUTS_MAX`), by number, that own it.
//! 2. **A side's value at a node**: f - b(c) X, with X the clay of the other side, c = (P + M) / f the share
//!    of the clay that stands at the cut, and b(c) the smoothstep from c = 1/2 to 1. Where the tags end the
//!    sides share all clay, one cell behind the crack front each has its own alone: so the lips close
//!    smoothly.
//! 3. **Own value**: f times v / f for each of the node's sides' values v. A product, and not the least of
//!    them: where cuts cross, the edges of the pieces are blunt then. Sharp ones come apart into crumbs on
//!    the grid (in 41 of 400 crossings; none with the product). In f and in v count what others have there,
//!    as far as they are closed (`closure`), so that rims keep their volume. **Inside**: own value above the
//!    threshold; if it is so by the others' clay alone, only beside a node (of six) of the same body and
//!    sides that is so by its own, or beside one that stands beside such a node: what is looser at the end of
//!    an overhang comes apart into crumbs and handles.
//! 4. **Two nodes are parted** if they are of different bodies, or if a sheet owns them from opposite sides.
//!    In a cell, inside nodes that are not parted are of one body of the cell (`Bodies`, not to be taken
//!    for those of the clay), and so are those that they join: where untouched clay stands beside both
//!    sides, the crack front passes, and the cut parts nothing there. Empty nodes join nothing: if they did,
//!    they would bridge the cut along the free surface.
//! 5. **Emission**: each cell once per body of it, with that body's nodes inside.
//! 6. **Vertices**: an edge is *split* if its ends are inside and of different bodies of each of its four
//!    cells. A split edge has one vertex per end that is kept, all others have one that bodies share. So lips
//!    are welded at the crack front.
//! 7. **Place of a vertex**: see `CellTile::crossing` and `CellTile::point`. **Caps**: see `caps.rs`.
//!
//! Rules 0 to 2 look at one node, 3 at those about it, 4 and 5 at one cell, 6 at the cells of one edge:
//! blocks that have these in common see them alike, whatever else they hold, and so their meshes agree on
//! their faces.

use serde::{Deserialize, Serialize};

/// Most cuts that own a node. Particles stand at two cuts at most, so no four can each hold more than half of
/// a node's clay.
pub(crate) const CUTS_MAX: usize = 3;
/// Share of the clay around a node that stands at a cut, above which the cut owns it. Any trace instead
/// (0.05) gave the wrong bodies in 29 of 60 cuts.
const OWNER_SHARE: f32 = 0.5;

/// How cuts show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum CutMethod {
    /// Two lips: cells at a cut are emitted once per side.
    #[default]
    TwoSided,
    /// Equation 9 as published, for comparison: each node sees the clay of its own side only, then ordinary
    /// marching cubes.
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
        if other == 0.0 {
            return total;
        }
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

/// The body of nodes without clay.
pub(crate) const NOBODY: u32 = u32::MAX;

/// Who owns a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Label {
    /// Bit 0 inside; then for each cut, by sheet number, 9 bits: side (front 1), sheet.
    word: u32,
    /// Number of its body, or [`NOBODY`]; 0 throughout where no two bodies are near.
    pub(crate) body: u32,
}

impl Label {
    /// That of a node of a body that no cut owns.
    pub(crate) fn of_body(body: u32) -> Self {
        Self { word: 0, body }
    }

    /// Adds a sheet that owns the node; false if there is no room for it.
    pub(crate) fn push(&mut self, sheet: u8, owner: i8) -> bool {
        let Some(k) = (0..CUTS_MAX).find(|&k| self.word(k) == 0) else { return false };
        self.word |= (u32::from(sheet) << 1 | u32::from(owner > 0)) << (1 + 9 * k);
        true
    }

    pub(crate) fn set_inside(&mut self) {
        self.word |= 1;
    }

    pub(crate) fn set_outside(&mut self) {
        self.word &= !1;
    }

    pub(crate) fn is_inside(self) -> bool {
        self.word & 1 == 1
    }

    /// Whether both nodes are of one body and the same sides of the same cuts own them.
    pub(crate) fn has_owners_of(self, other: Self) -> bool {
        self.body == other.body && self.word >> 1 == other.word >> 1
    }

    fn word(self, k: usize) -> u32 {
        self.word >> (1 + 9 * k) & 0x1ff
    }

    /// The sheets that own the node, and from which side.
    pub(crate) fn owners(self) -> impl Iterator<Item = (u8, i8)> {
        let owner = |w: u32| ((w >> 1) as u8, if w & 1 == 1 { 1 } else { -1 });
        (0..CUTS_MAX).map(move |k| self.word(k)).take_while(|&w| w != 0).map(owner)
    }

    /// Whether two nodes are of different bodies.
    pub(crate) fn is_of_other_body(self, other: Self) -> bool {
        self.body != other.body && self.body != NOBODY && other.body != NOBODY
    }

    /// Whether two nodes are parted.
    pub(crate) fn is_parted_from(self, other: Self) -> bool {
        self.is_of_other_body(other) || self.parting(other).next().is_some()
    }

    /// The sheets that part two nodes of one body.
    pub(crate) fn parting(self, other: Self) -> impl Iterator<Item = u8> {
        // Words differ in the side alone.
        let is_parting = move |w: &u32| (0..CUTS_MAX).any(|k| other.word(k) == w ^ 1);
        (0..CUTS_MAX).map(move |k| self.word(k)).filter(|&w| w != 0).filter(is_parting).map(|w| (w >> 1) as u8)
    }
}

/// The bodies of a cell: 3 bits per corner, the first corner of its body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Bodies(u32);

impl Bodies {
    /// One body.
    pub(crate) const WHOLE: Self = Self(0);

    /// The bodies that the corners of `mask` make.
    pub(crate) fn new(corners: &[Label; 8], mask: u8) -> Self {
        let mut first: [u8; 8] = std::array::from_fn(|i| i as u8);
        let mut is_grown = true;
        while is_grown {
            is_grown = false;
            for i in 0..8 {
                for j in 0..i {
                    let are_in = mask >> i & 1 == 1 && mask >> j & 1 == 1;
                    if are_in && first[i] != first[j] && !corners[i].is_parted_from(corners[j]) {
                        let least = first[i].min(first[j]);
                        (first[i], first[j], is_grown) = (least, least, true);
                    }
                }
            }
        }
        Self((0..8).fold(0, |bits, i| bits | u32::from(first[i]) << (3 * i)))
    }

    /// The first corner of a corner's body.
    fn first(self, corner: u8) -> u8 {
        (self.0 >> (3 * corner) & 7) as u8
    }

    /// Whether two inside corners are of different bodies.
    pub(crate) fn part(self, a: u8, b: u8) -> bool {
        self.first(a) != self.first(b)
    }

    /// The corners of `mask`, body by body.
    pub(crate) fn masks(self, mask: u8) -> impl Iterator<Item = u8> {
        let of = move |first: u8| (0..8).filter(|&i| self.first(i) == first).fold(0, |bits, i| bits | 1 << i) & mask;
        (0..8).map(of).filter(|&body| body != 0)
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

    fn cell(corners: [&[(u8, i8)]; 8]) -> ([Label; 8], Vec<u8>) {
        let labels = corners.map(label);
        (labels, Bodies::new(&labels, 0xff).masks(0xff).collect())
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
    fn untouched_clay_joins_both_sides() {
        let (p, m): (&[_], &[_]) = (&[(1, 1)], &[(1, -1)]);
        assert_eq!(cell([p, m, p, m, p, m, p, m]).1, [0b0101_0101, 0b1010_1010]);
        let (mut labels, one) = cell([p, m, p, m, p, m, p, &[]]);
        assert_eq!(one, [0xff]);
        labels[7] = Label::default();
        assert_eq!(Bodies::new(&labels, 0x7f).masks(0x7f).count(), 2);
        assert_eq!(Bodies::new(&labels, 0xff).masks(0x7f).count(), 1, "the variant in which empty nodes join");
    }

    /// Bodies part a cell with and without cuts; empty nodes are of none.
    #[test]
    fn bodies_part_a_cell() {
        let of = |body: u32, owners: &[(u8, i8)]| Label { body, ..label(owners) };
        let cell = |labels: [Label; 8], mask: u8| Bodies::new(&labels, mask).masks(mask).collect::<Vec<_>>();
        let labels = std::array::from_fn(|i| of(if i & 1 == 1 { 5 } else { 0 }, &[]));
        assert_eq!(cell(labels, 0xff), [0x55, 0xaa]);
        assert!(labels[0].is_parted_from(labels[1]) && !labels[0].is_parted_from(Label::of_body(NOBODY)));
        // A cut in one of them, which is the other's by number only.
        let labels =
            std::array::from_fn(|i| if i & 1 == 1 { of(5, &[(3, 1)]) } else { of(0, &[(3, if i & 2 == 2 { 1 } else { -1 })]) });
        assert_eq!(cell(labels, 0xff), [0x11, 0xaa, 0x44]);
    }

    /// Two crossing sheets make four bodies; where one meets the other from above, three; where it ends just
    /// below the other, three too.
    #[test]
    fn crossing_sheets_part_a_cell_in_four() {
        let corner = |i: u8| [(4u8, if i & 1 == 1 { 1i8 } else { -1 }), (9, if i & 2 == 2 { 1 } else { -1 })];
        let all: [[(u8, i8); 2]; 8] = std::array::from_fn(|i| corner(i as u8));
        assert_eq!(cell(std::array::from_fn(|i| &all[i][..])).1, [0x11, 0x22, 0x44, 0x88]);
        let above = |i: usize| i & 2 == 2;
        let three = [0x33, 0x44, 0x88];
        assert_eq!(cell(std::array::from_fn(|i| if above(i) { &all[i][..] } else { &all[i][1..] })).1, three);
        assert_eq!(cell(std::array::from_fn(|i| if above(i) || i < 5 { &all[i][..] } else { &all[i][1..] })).1, three);
        // Without sheet 9 on one side they are joined there.
        assert_eq!(cell(std::array::from_fn(|i| if above(i) { &all[i][..1] } else { &[][..] })).1, [0xff]);
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
