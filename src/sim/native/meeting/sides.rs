//! Which cuts divide the clay at a node, and how it moves then: compatibility of Eq. 2-3 as fields.
//!
//! Each sheet divides a node apart from the others: in the band of its blade by the sign of the node's
//! distance, elsewhere where most of the node's mass is tagged by it, but for bodies that it has not tagged
//! there. Clay that it has not tagged moves with the owner's side. A field is the clay of one body that is
//! beyond the same divisions.

use super::super::super::cut::ClassKey;
use super::super::super::facing::{Between, Facing};
use super::super::super::limits;
use super::super::super::params::BLOCK;
use super::super::contact::ToolNow;
use super::super::nodes::{Ghosts, Incompatible, offset};
use super::bounds::Meeting;
use glam::IVec3;

const DIVISIONS_MAX: usize = limits::DIVISIONS_MAX as usize;
/// Most fields of a node, of all bodies.
const FIELDS_MAX: usize = 2 << DIVISIONS_MAX;

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
    pub(super) fn new(node: IVec3, keys: &[ClassKey], sheets: &[u8], mass: impl Fn(usize) -> f64, meeting: &Meeting<'_>) -> Self {
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

    /// Where the clay of `key` is.
    pub(super) fn place(&self, key: ClassKey) -> Place {
        let beyond = self.iter().enumerate().map(|(i, d)| u8::from(key.side(d.sheet) == -d.owner) << i).sum();
        Place { body: key.body(), beyond }
    }

    /// The blade, the first of the plan, that makes the node incompatible with the clay of `key`, and the
    /// side of it on which that is.
    pub(super) fn incompatible(&self, key: ClassKey) -> Option<(u8, i8)> {
        let beyond = self.iter().filter(|d| key.side(d.sheet) == -d.owner);
        beyond.filter_map(|d| Some((d.blade?, -d.owner))).min_by_key(|b| b.0)
    }

    /// The side of division `i` on which a field is.
    pub(super) fn side(&self, beyond: u8, i: usize) -> i8 {
        if beyond >> i & 1 == 1 { -self.items[i].owner } else { self.items[i].owner }
    }

    /// How field `b` faces field `a`, the normal from a to b: across the one cut between them, or both of
    /// two, or from body to body. None where a blade stands between them, which acts on both, or where there
    /// is no normal.
    pub(super) fn pair_facing(&self, a: Place, b: Place, mut facing: impl FnMut(Between) -> Option<Facing>) -> Option<Facing> {
        let differs = |i: usize| (a.beyond ^ b.beyond) >> i & 1 == 1;
        let between = || self.iter().enumerate().filter(|(i, _)| differs(*i));
        if between().any(|(_, division)| division.blade.is_some()) {
            return None;
        }
        if a.body != b.body {
            return facing(Between::Bodies { back: a.body, front: b.body });
        }
        let mut facings = [None; DIVISIONS_MAX];
        for (i, division) in between() {
            facings[i] = Some(facing(Between::Sides(division.sheet))?.turned(self.side(b.beyond, i)));
        }
        Facing::across(facings.into_iter().flatten())
    }
}

/// The owner of a node where a kept cut divides it: more than half of the mass of the bodies that it has
/// tagged there is.
fn owner_by_mass(keys: &[ClassKey], sheet: u8, mass: impl Fn(usize) -> f64) -> Option<i8> {
    let (mut front, mut back, mut all) = (0.0, 0.0, 0.0);
    let is_its = |(class, key): (usize, &ClassKey), body: u16| key.is_front(body, sheet).is_some() && mass(class) > 0.0;
    let is_tagged = |body: u16| keys.iter().enumerate().any(|class| is_its(class, body));
    for (class, key) in keys.iter().enumerate().filter(|(_, key)| is_tagged(key.body())) {
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
pub(super) fn ghosts_of(keys: &[ClassKey], divisions: &[Divisions; 64], block: IVec3, meeting: &Meeting<'_>) -> Vec<Ghosts> {
    let at = |key: ClassKey, k: usize| {
        let (tool, side) = divisions[k].incompatible(key)?;
        let (_, front) = meeting.tools[usize::from(tool)].side(block * BLOCK + offset(k))?;
        Some(Incompatible { tool, normal: front * f64::from(side) })
    };
    let of_class = |key: &ClassKey| std::array::from_fn(|k| at(*key, k));
    if meeting.cutting.has_ghosts() { keys.iter().map(of_class).collect() } else { vec![] }
}

/// Whether node `k` is incompatible with a class.
pub(super) fn is_incompatible(ghosts: &[Ghosts], class: usize, k: usize) -> bool {
    ghosts.get(class).is_some_and(|ghosts| ghosts[k].is_some())
}

/// By what the fields of a node are told apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Place {
    pub(super) body: u16,
    /// Which divisions the clay is beyond, from their owners' sides: a bit each.
    pub(super) beyond: u8,
}

/// The fields of a node in order, each with the first of its classes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Fields {
    items: [(Place, u8); FIELDS_MAX],
    count: usize,
}

impl Fields {
    pub(super) fn as_slice(&self) -> &[(Place, u8)] {
        &self.items[..self.count]
    }

    /// The first class of the field in this place; `class` becomes it if there is no such field yet. Where
    /// more meet than there is room for, the last ones move together.
    pub(super) fn leader(&mut self, place: Place, class: u8) -> u8 {
        let at = self.as_slice().partition_point(|f| f.0 < place);
        match self.as_slice().get(at) {
            Some(field) if field.0 == place => field.1,
            _ if self.count == FIELDS_MAX => self.items[FIELDS_MAX - 1].1,
            _ => {
                self.items.copy_within(at..self.count, at + 1);
                self.items[at] = (place, class);
                self.count += 1;
                class
            }
        }
    }
}
