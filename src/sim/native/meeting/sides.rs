//! Which cuts divide the clay at a node, and how it moves then: compatibility of Eq. 2-3 as fields.
//!
//! Each sheet divides a node apart from the others: in the band of its blade by the sign of the node's
//! distance, elsewhere where most of the node's mass is tagged by it. Clay that it has not tagged moves with
//! the owner's side. A field is the clay that is beyond the same divisions.

use super::super::super::cut::{CutKey, Facing};
use super::super::super::limits;
use super::super::super::params::BLOCK;
use super::super::contact::ToolNow;
use super::super::nodes::{Ghosts, Incompatible, offset};
use super::bounds::Meeting;
use glam::IVec3;

const DIVISIONS_MAX: usize = limits::DIVISIONS_MAX as usize;
/// Most fields of a node.
const FIELDS_MAX: usize = 1 << DIVISIONS_MAX;

/// A sheet that divides a node.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Division {
    pub sheet: u8,
    /// The side with which clay moves that has none.
    pub owner: i8,
    /// Index of the blade in whose band the node stands; none at a kept cut.
    pub blade: Option<u8>,
}

/// The sheets that divide a node, in their order; none at a whole node.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Divisions {
    items: [Division; DIVISIONS_MAX],
    count: usize,
}

impl Divisions {
    /// The divisions of the node at `node` with these classes of these masses; `sheets` are those of the
    /// classes and of the blades, in order.
    pub(super) fn new(node: IVec3, keys: &[CutKey], sheets: &[u8], mass: impl Fn(usize) -> f64, meeting: &Meeting<'_>) -> Self {
        let mut divisions = Self::default();
        for &sheet in sheets {
            let is_its = |t: &ToolNow| t.blade.is_some() && t.sheet == sheet;
            let blade =
                meeting.tools.iter().enumerate().find(|(_, t)| is_its(t)).and_then(|(i, t)| Some((i as u8, t.side(node)?.0)));
            let owner = match blade {
                Some((_, distance)) => Some(if distance < 0.0 { -1 } else { 1 }),
                // No other method knows cuts without their blades.
                None if !meeting.cutting.keeps_cuts() => None,
                None => owner_by_mass(keys, sheet, &mass),
            };
            let blade = blade.map(|b| b.0);
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

    /// The division that the blade of this index makes.
    pub(super) fn of_blade(&self, index: usize) -> Option<usize> {
        self.iter().position(|d| d.blade.is_some_and(|b| usize::from(b) == index))
    }

    /// Which divisions the clay of `key` is beyond, from their owners' sides: a bit each.
    pub(super) fn beyond(&self, key: CutKey) -> u8 {
        self.iter().enumerate().map(|(i, d)| u8::from(key.side(d.sheet) == -d.owner) << i).sum()
    }

    /// The blade, the first of the plan, that makes the node incompatible with the clay of `key`, and the
    /// side of it on which that is.
    pub(super) fn incompatible(&self, key: CutKey) -> Option<(u8, i8)> {
        let beyond = self.iter().filter(|d| key.side(d.sheet) == -d.owner);
        beyond.filter_map(|d| Some((d.blade?, -d.owner))).min_by_key(|b| b.0)
    }

    /// The side of division `i` on which a field is.
    pub(super) fn side(&self, beyond: u8, i: usize) -> i8 {
        if beyond >> i & 1 == 1 { -self.items[i].owner } else { self.items[i].owner }
    }

    /// How field `b` faces field `a`, the normal from a to b: across the one cut between them, or both of
    /// two. None where a blade stands between them, which acts on both, or where a cut has no normal.
    pub(super) fn pair_facing(&self, a: u8, b: u8, mut facing: impl FnMut(u8) -> Option<Facing>) -> Option<Facing> {
        let mut between = [None; DIVISIONS_MAX];
        for (i, division) in self.iter().enumerate().filter(|(i, _)| (a ^ b) >> i & 1 == 1) {
            if division.blade.is_some() {
                return None;
            }
            between[i] = Some(facing(division.sheet)?.turned(self.side(b, i)));
        }
        Facing::across(between.into_iter().flatten())
    }
}

/// The owner of a node where a kept cut divides it: more than half of its mass is tagged.
fn owner_by_mass(keys: &[CutKey], sheet: u8, mass: impl Fn(usize) -> f64) -> Option<i8> {
    let (mut front, mut back, mut all) = (0.0, 0.0, 0.0);
    for (class, key) in keys.iter().enumerate() {
        let mass = mass(class);
        all += mass;
        match key.side(sheet) {
            0 => {}
            1 => front += mass,
            _ => back += mass,
        }
    }
    (front + back > 0.5 * all).then_some(if front >= back { 1 } else { -1 })
}

/// Where the nodes of a block are incompatible with each class; nothing under methods without ghosts.
pub(super) fn ghosts_of(keys: &[CutKey], divisions: &[Divisions; 64], block: IVec3, meeting: &Meeting<'_>) -> Vec<Ghosts> {
    let at = |key: CutKey, k: usize| {
        let (tool, side) = divisions[k].incompatible(key)?;
        let (_, front) = meeting.tools[usize::from(tool)].side(block * BLOCK + offset(k))?;
        Some(Incompatible { tool, normal: front * f64::from(side) })
    };
    let of_class = |key: &CutKey| std::array::from_fn(|k| at(*key, k));
    if meeting.cutting.has_ghosts() { keys.iter().map(of_class).collect() } else { vec![] }
}

/// Whether node `k` is incompatible with a class.
pub(super) fn is_incompatible(ghosts: &[Ghosts], class: usize, k: usize) -> bool {
    ghosts.get(class).is_some_and(|ghosts| ghosts[k].is_some())
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
