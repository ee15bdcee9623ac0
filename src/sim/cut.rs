//! Cuts as particles carry them: the side of each cut that a particle stands at, and what follows from it.
//!
//! A particle has room for two cuts. Particles with the same sides of the same cuts, a [`CutKey`], move together everywhere; two particles are
//! *compatible* (delta of Eq. 2-3) unless they are on opposite sides of the same cut.

use super::snapshot::Tag;

/// Which sides of which cuts a particle is on, and nothing else: by sheet, the higher first, so that equal sides make equal keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CutKey([(u8, i8); 2]);

impl CutKey {
    /// The key of clay that is near no cut.
    pub const UNTAGGED: Self = Self([(0, 0); 2]);

    /// The key of a particle's tags; of two tags of one sheet the first counts.
    pub fn of(tags: [Tag; 2]) -> Self {
        let side = |tag: Tag| if tag.side == 0 || tag.sheet == 0 { (0, 0) } else { (tag.sheet, tag.sign()) };
        let [a, b] = tags.map(side);
        let b = if a.0 == b.0 { (0, 0) } else { b };
        Self(if a.0 >= b.0 { [a, b] } else { [b, a] })
    }

    /// Whether the clay is near no cut.
    pub fn is_untagged(self) -> bool {
        self == Self::UNTAGGED
    }

    /// The side (+1, -1) of `sheet`; 0 for clay that is not near it.
    pub fn side(self, sheet: u8) -> i8 {
        self.sides().find(|s| s.0 == sheet).map_or(0, |s| s.1)
    }

    /// The sheets with the side of each.
    pub fn sides(self) -> impl Iterator<Item = (u8, i8)> {
        self.0.into_iter().filter(|s| s.0 != 0)
    }
}

/// The place of `sheet` among the tags, if it has one.
pub(crate) fn place(tags: &[Tag; 2], sheet: u8) -> Option<usize> {
    tags.iter().position(|t| t.sheet == sheet && t.side != 0)
}

/// Gives the tags a side of `sheet`. A new sheet comes first and moves the others back; returns whether an older one is given up for it.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn tag(sheet: u8, side: i8) -> Tag {
        Tag { sheet, side }
    }

    #[test]
    fn equal_sides_make_equal_keys() {
        let key = CutKey::of([tag(3, 1), tag(7, -1)]);
        assert_eq!(key, CutKey::of([tag(7, -40), tag(3, 9)]));
        assert_eq!((key.side(3), key.side(7), key.side(5)), (1, -1, 0));
        assert_eq!(CutKey::of([tag(3, 0), tag(7, -1)]), CutKey::of([tag(7, -1), Tag::default()]));
        assert_eq!(CutKey::of([tag(7, 1), tag(7, -1)]), CutKey::of([tag(7, 1), Tag::default()]));
        assert!(CutKey::of([Tag::default(); 2]).is_untagged() && !key.is_untagged());
    }

    /// Two cuts find room, a third takes the place of the older one, and a sheet that is there already changes its side where it stands.
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
