//! Cuts as particles carry them: the side of each cut that a particle stands at, the body that it is of, and
//! what follows from both.
//!
//! A particle has room for two cuts. Particles of one body with the same sides of the same cuts, a
//! [`ClassKey`], move together everywhere; two particles are *compatible* (delta of Eq. 2-3) unless they are
//! of two [bodies](super::body), or on opposite sides of the same cut.

use super::snapshot::Tag;
use serde::{Deserialize, Serialize};

/// The first of the sheets, up to 255, that plates part the clay by: solid tools thinner than two cells. A
/// side of one lasts while its plate is near; those below are cuts that stay.
pub const PLATE_SHEET: u8 = 240;

/// The sheet of no cut, by whose tags particles count how far they have grown together with another
/// [body](super::body); cuts that stay have those below.
pub const JOINT_SHEET: u8 = PLATE_SHEET - 1;

/// Which body a particle is of and which sides of which cuts it is on, and nothing else: the sides by sheet,
/// the higher first, so that equal sides make equal keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ClassKey {
    body: u16,
    sides: [(u8, i8); 2],
}

impl ClassKey {
    /// The key of clay of the first body that is near no cut.
    pub const FIRST: Self = Self { body: 0, sides: [(0, 0); 2] };

    /// The key of clay of a body, as a particle has it, with these tags; of two tags of one sheet the first
    /// counts, and those that count how bodies grow together do not.
    #[expect(clippy::cast_possible_truncation, reason = "bodies are numbered up to BODY_MAX, which `admit` sees to")]
    pub fn new(body: u32, tags: [Tag; 2]) -> Self {
        let is_side = |tag: Tag| tag.side != 0 && tag.sheet != 0 && tag.sheet != JOINT_SHEET;
        let side = |tag: Tag| if is_side(tag) { (tag.sheet, tag.sign()) } else { (0, 0) };
        let [a, b] = tags.map(side);
        let b = if a.0 == b.0 { (0, 0) } else { b };
        Self { body: body as u16, sides: if a.0 >= b.0 { [a, b] } else { [b, a] } }
    }

    /// The number of the body.
    pub fn body(self) -> u16 {
        self.body
    }

    /// Whether the clay is of the first body and near no cut.
    pub fn is_first(self) -> bool {
        self == Self::FIRST
    }

    /// The key of clay of the same body that is near no cut.
    pub fn without_sides(self) -> Self {
        Self { body: self.body, ..Self::FIRST }
    }

    /// Whether clay of both keys is of one body and on opposite sides of no cut (delta of Eq. 2-3).
    pub fn is_compatible(self, other: Self) -> bool {
        self.body == other.body && self.sides().all(|(sheet, side)| other.side(sheet) != -side)
    }

    /// The side (+1, -1) of `sheet`; 0 for clay that is not near it.
    pub fn side(self, sheet: u8) -> i8 {
        self.sides().find(|s| s.0 == sheet).map_or(0, |s| s.1)
    }

    /// Whether clay of a body is in front of a sheet, or behind it; none for other clay.
    pub(crate) fn is_front(self, body: u16, sheet: u8) -> Option<bool> {
        let side = if self.body == body { self.side(sheet) } else { 0 };
        (side != 0).then_some(side > 0)
    }

    /// The sheets with the side of each.
    pub fn sides(self) -> impl Iterator<Item = (u8, i8)> {
        self.sides.into_iter().filter(|s| s.0 != 0)
    }
}

/// A set of sheets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SheetSet([u64; 4]);

impl SheetSet {
    /// Adds a sheet.
    pub fn insert(&mut self, sheet: u8) {
        self.0[usize::from(sheet / 64)] |= 1 << (sheet % 64);
    }

    /// Whether the sheet is in it.
    pub fn contains(&self, sheet: u8) -> bool {
        self.0[usize::from(sheet / 64)] >> (sheet % 64) & 1 == 1
    }

    /// Its sheets, in order.
    pub fn iter(&self) -> impl Iterator<Item = u8> {
        (1..=u8::MAX).filter(|sheet| self.contains(*sheet))
    }
}

impl FromIterator<u8> for SheetSet {
    fn from_iter<I: IntoIterator<Item = u8>>(sheets: I) -> Self {
        let mut set = Self::default();
        sheets.into_iter().filter(|sheet| *sheet != 0).for_each(|sheet| set.insert(sheet));
        set
    }
}

/// The place of `sheet` among the tags, if it has one.
pub(crate) fn place(tags: &[Tag; 2], sheet: u8) -> Option<usize> {
    tags.iter().position(|t| t.sheet == sheet && t.side != 0)
}

/// Gives the tags a side of `sheet`. A new sheet comes first and moves the others back; returns whether an
/// older one is given up for it.
pub(crate) fn take(tags: &mut [Tag; 2], sheet: u8, side: i8) -> bool {
    if let Some(at) = place(tags, sheet) {
        tags[at].side = side;
        return false;
    }
    let gives_up = tags.iter().all(|t| t.side != 0);
    if tags[0].side != 0 {
        tags[1] = tags[0];
    }
    tags[0] = Tag { sheet, side };
    gives_up
}

/// Gives the tags the side of a plate's `sheet` that clay which the plate holds off takes there, unless sides
/// of other sheets leave no room for it; takes it from clay that is not beside the plate any more. Returns
/// whether a side was taken.
pub(crate) fn beside_plate(tags: &mut [Tag; 2], sheet: u8, is_held: bool, takes: Option<i8>) -> bool {
    let has_room = place(tags, sheet).is_some() || tags.iter().any(|t| t.side == 0);
    match takes.filter(|_| is_held && has_room) {
        Some(side) => {
            take(tags, sheet, side);
            true
        }
        None if is_held => false,
        None => {
            drop(tags, sheet);
            false
        }
    }
}

/// Takes the side of `sheet` from the tags.
pub(crate) fn drop(tags: &mut [Tag; 2], sheet: u8) {
    match place(tags, sheet) {
        Some(0) => *tags = [tags[1], Tag::default()],
        Some(_) => tags[1] = Tag::default(),
        None => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tag(sheet: u8, side: i8) -> Tag {
        Tag { sheet, side }
    }

    #[test]
    fn equal_sides_make_equal_keys() {
        let of = |tags| ClassKey::new(2, tags);
        let key = of([tag(3, 1), tag(7, -1)]);
        assert_eq!(key, of([tag(7, -40), tag(3, 9)]));
        assert_eq!((key.side(3), key.side(7), key.side(5), key.body()), (1, -1, 0, 2));
        assert_eq!(of([tag(3, 0), tag(7, -1)]), of([tag(7, -1), Tag::default()]));
        assert_eq!(of([tag(7, 1), tag(7, -1)]), of([tag(7, 1), Tag::default()]));
        assert!(key != ClassKey::new(1, [tag(3, 1), tag(7, -1)]));
        assert_eq!(of([tag(3, 1), tag(JOINT_SHEET, 50)]), of([tag(3, 1), Tag::default()]));
        assert!(key.is_compatible(of([tag(7, -1), tag(9, 1)])) && !key.is_compatible(of([tag(7, 1), tag(3, 1)])));
        assert!(key.is_compatible(key.without_sides()) && !key.is_compatible(ClassKey::new(1, [tag(3, 1); 2])));
        let none = [Tag::default(); 2];
        assert!(ClassKey::new(0, none).is_first() && !ClassKey::new(1, none).is_first() && !key.is_first());
    }

    /// Clay takes the side of a plate where it has room for one, leaves it when it is away, and gives up no
    /// cut for it.
    #[test]
    fn side_of_a_plate_lasts_while_it_is_near() {
        let after = |mut tags: [Tag; 2], is_held, takes| (beside_plate(&mut tags, 240, is_held, takes), tags);
        let (none, plate) = (Tag::default(), tag(240, 1));
        assert_eq!(after([none; 2], true, Some(1)), (true, [plate, none]));
        assert_eq!(after([tag(3, -1), none], true, Some(1)), (true, [plate, tag(3, -1)]));
        assert_eq!(after([tag(3, -1), plate], true, Some(-1)), (true, [tag(3, -1), tag(240, -1)]));
        assert_eq!(after([tag(3, -1), tag(4, 1)], true, Some(1)), (false, [tag(3, -1), tag(4, 1)]));
        assert_eq!(after([plate, tag(3, -1)], true, None), (false, [plate, tag(3, -1)]));
        assert_eq!(after([plate, tag(3, -1)], false, Some(1)), (false, [tag(3, -1), none]));
        assert_eq!(after([tag(3, -1), plate], false, None), (false, [tag(3, -1), none]));
        assert_eq!(after([tag(3, -1), tag(4, 1)], false, None), (false, [tag(3, -1), tag(4, 1)]));
    }

    #[test]
    fn sheet_set_holds_what_was_put_in() {
        let set: SheetSet = [0, 1, 64, 255, 64].into_iter().collect();
        assert_eq!(set.iter().collect::<Vec<_>>(), [1, 64, 255]);
    }

    /// Two cuts find room, a third takes the place of the older one, and a sheet that is there already
    /// changes its side where it stands.
    #[test]
    fn newest_sheets_are_kept() {
        let mut tags = [Tag::default(); 2];
        assert!(!take(&mut tags, 3, 1) && !take(&mut tags, 7, -1));
        assert_eq!(tags, [tag(7, -1), tag(3, 1)]);
        assert!(!take(&mut tags, 3, -1));
        assert_eq!(tags, [tag(7, -1), tag(3, -1)]);
        assert!(take(&mut tags, 9, 1));
        assert_eq!(tags, [tag(9, 1), tag(7, -1)]);
    }
}
