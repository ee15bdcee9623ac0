//! Which cuts divide the clay at a node, and how it moves then: compatibility of Eq. 2-3 as fields.
//!
//! Each sheet divides a node apart from the others: in the band of its blade by the sign of the node's distance, elsewhere where most of the node's mass is
//! tagged by it. Clay that it has not tagged moves with the owner's side. A field is the clay that is beyond the same divisions.

use super::super::cut::CutKey;
use super::ghost::Incompatible;
use super::special::Meeting;
use glam::{DVec3, IVec3};

/// Most sheets that divide one node: particles know two, and a node sees those within 1.5 cells. The sheets of the lowest numbers count.
const DIVISIONS_MAX: usize = 4;
/// Most fields of a node.
const FIELDS_MAX: usize = 1 << DIVISIONS_MAX;

/// A sheet that divides a node.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Division {
    pub sheet: u8,
    /// The side with which clay moves that has none.
    pub owner: i8,
    /// The blade in whose band the node stands: its index, the signed distance [cells] and the unit normal of its front; none at a kept cut.
    pub blade: Option<(usize, f64, DVec3)>,
}

/// The sheets that divide a node, in their order; none at a whole node.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Divisions {
    items: [Division; DIVISIONS_MAX],
    count: usize,
}

impl Divisions {
    /// The divisions of the node at `node` with these classes of these masses; `sheets` are those of the classes and of the blades, in order.
    pub(super) fn new(node: IVec3, keys: &[CutKey], sheets: &[u8], mass: impl Fn(usize) -> f64, meeting: &Meeting<'_>) -> Self {
        let mut divisions = Self::default();
        for &sheet in sheets {
            let blade = meeting.tools.iter().enumerate().find(|(_, t)| t.blade.is_some() && t.sheet == sheet);
            let blade = blade.and_then(|(i, t)| {
                let (distance, normal) = t.side(node)?;
                Some((i, distance, normal))
            });
            let owner = match blade {
                Some((_, distance, _)) => Some(if distance < 0.0 { -1 } else { 1 }),
                // No other method knows cuts without their blades.
                None if !meeting.cutting.keeps_cuts() => None,
                None => owner_by_mass(keys, sheet, &mass),
            };
            if let Some(owner) = owner
                && divisions.count < DIVISIONS_MAX
            {
                divisions.items[divisions.count] = Division { sheet, owner, blade };
                divisions.count += 1;
            }
        }
        divisions
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Division> {
        self.items[..self.count].iter()
    }

    /// The division that the blade of this index makes, the node's signed distance from it [cells] and its normal.
    pub(super) fn of_blade(&self, index: usize) -> Option<(usize, f64, DVec3)> {
        self.iter().enumerate().find_map(|(i, d)| d.blade.filter(|b| b.0 == index).map(|b| (i, b.1, b.2)))
    }

    /// Which divisions the clay of `key` is beyond, from their owners' sides: a bit each.
    pub(super) fn beyond(&self, key: CutKey) -> u8 {
        self.iter().enumerate().map(|(i, d)| u8::from(key.side(d.sheet) == -d.owner) << i).sum()
    }

    /// The blade, the first of the plan, that makes this node incompatible with the clay of `key`.
    pub(super) fn incompatible(&self, key: CutKey) -> Option<Incompatible> {
        let beyond = self.iter().filter(|d| key.side(d.sheet) == -d.owner);
        let (tool, normal) = beyond.filter_map(|d| d.blade.map(|b| (b.0, b.2 * f64::from(-d.owner)))).min_by_key(|b| b.0)?;
        Some(Incompatible { tool: tool as u8, normal })
    }

    /// The side of division `i` on which a field is.
    pub(super) fn side(&self, beyond: u8, i: usize) -> i8 {
        if beyond >> i & 1 == 1 { -self.items[i].owner } else { self.items[i].owner }
    }

    /// Unit normal from field `a` to field `b`: across the one cut between them, or the mean of two. None where a blade stands between them, which acts
    /// on both, or where a cut has no normal.
    pub(super) fn pair_normal(&self, a: u8, b: u8, normal: impl Fn(u8) -> Option<DVec3>) -> Option<DVec3> {
        let mut sum = DVec3::ZERO;
        for (i, division) in self.iter().enumerate().filter(|(i, _)| (a ^ b) >> i & 1 == 1) {
            if division.blade.is_some() {
                return None;
            }
            sum += f64::from(self.side(b, i)) * normal(division.sheet)?;
        }
        sum.try_normalize()
    }
}

/// The owner of a node where a kept cut divides it: more than half of its mass is tagged.
fn owner_by_mass(keys: &[CutKey], sheet: u8, mass: impl Fn(usize) -> f64) -> Option<i8> {
    let on = |side: i8| (0..keys.len()).filter(|c| keys[*c].side(sheet) == side).map(&mass).sum::<f64>();
    let (front, back) = (on(1), on(-1));
    let all: f64 = (0..keys.len()).map(&mass).sum();
    (front + back > 0.5 * all).then_some(if front >= back { 1 } else { -1 })
}

/// The fields of a node in the order of what they are beyond, each with the first of its classes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Fields {
    items: [(u8, u8); FIELDS_MAX],
    count: usize,
}

impl Fields {
    pub(super) fn as_slice(&self) -> &[(u8, u8)] {
        &self.items[..self.count]
    }

    /// The first class of the field beyond these divisions; `class` becomes it if there is no such field yet.
    pub(super) fn leader(&mut self, beyond: u8, class: u8) -> u8 {
        let at = self.as_slice().partition_point(|f| f.0 < beyond);
        match self.as_slice().get(at) {
            Some(field) if field.0 == beyond => field.1,
            _ => {
                self.items.copy_within(at..self.count, at + 1);
                self.items[at] = (beyond, class);
                self.count += 1;
                class
            }
        }
    }
}
