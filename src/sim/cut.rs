//! Cuts as particles carry them: the side of each cut that a particle stands at, and what follows from it.
//!
//! A particle has room for two cuts. Particles with the same sides of the same cuts, a [`CutKey`], move together everywhere; two particles are
//! *compatible* (delta of Eq. 2-3) unless they are on opposite sides of the same cut.

use super::engine::FramePlan;
use super::snapshot::Tag;
use serde::{Deserialize, Serialize};

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

/// Parts of the time that growing together takes: what a tag counts.
pub(crate) const WELD_PARTS: f64 = 100.0;

/// When the two sides of a cut grow together in a frame: [`Weld`](super::material::Weld) in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WeldRule {
    /// Compressive stress across the cut [Pa].
    pub(crate) stress: f64,
    /// What a frame adds to the count of a pressed tag.
    pub(crate) step: u8,
}

impl WeldRule {
    /// The rule of a plan; none if nothing grows together.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the range of a tag's count")]
    pub(crate) fn of(plan: &FramePlan) -> Option<Self> {
        let (stress, time) = plan.material.weld.rule()?;
        let stress = stress * plan.material.shear_strength();
        let step = (plan.duration() / time * WELD_PARTS).ceil().clamp(1.0, WELD_PARTS) as u8;
        stress.is_finite().then_some(Self { stress, step })
    }

    /// Whether the rule leaves a sheet alone: its blade is there.
    pub(crate) fn spares(plan: &FramePlan, sheet: u8) -> bool {
        plan.tools.iter().any(|path| path.tool.shape.is_blade() && path.sheet_id() == sheet)
    }

    /// Counts a frame in which the two sides were pressed on each other at this tag, or were not; returns whether they have grown together: then the tag
    /// is gone.
    pub(crate) fn count(self, tag: &mut Tag, is_pressed: bool) -> bool {
        let count = tag.side.unsigned_abs().saturating_add(self.step);
        let is_welded = is_pressed && f64::from(count) > WELD_PARTS;
        *tag = match is_pressed {
            true if is_welded => Tag::default(),
            true => Tag { side: tag.sign() * count.cast_signed(), ..*tag },
            false => Tag { side: tag.sign(), ..*tag },
        };
        is_welded
    }
}

/// Least share [-] of the clay on one side of a cut in the tagged clay about a particle for which the two sides meet there.
pub(crate) const MEETING_SHARE: f64 = 1e-3;

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

    /// A hundred parts of pressing, not one of them missing, make whole clay; the count starts anew where the sides part.
    #[test]
    fn sides_grow_together_while_pressed() {
        let rule = WeldRule { stress: 1.0, step: 30 };
        let mut pressed = tag(5, -1);
        assert!((0..3).all(|_| !rule.count(&mut pressed, true)));
        assert_eq!(pressed, tag(5, -91));
        let mut parted = pressed;
        assert!(!rule.count(&mut parted, false) && parted == tag(5, -1));
        assert!(rule.count(&mut pressed, true) && pressed == Tag::default());
        assert!(WeldRule { stress: 1.0, step: 100 }.count(&mut tag(5, 1), true), "at once");
    }

    #[test]
    fn sheet_set_holds_what_was_put_in() {
        let set: SheetSet = [0, 1, 64, 255, 64].into_iter().collect();
        assert_eq!(set.iter().collect::<Vec<_>>(), [1, 64, 255]);
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
