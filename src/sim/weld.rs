//! When the two sides of a cut grow together.

use super::cut::{self, JOINT_SHEET};
use super::frame::FramePlan;
use super::snapshot::Tag;

/// Parts of the time that growing together takes: what a tag counts.
pub(crate) const WELD_PARTS: f64 = 100.0;

/// What a tag counts whose sides were pressed when their blade left: cutting leaves clay under pressure, and
/// nobody presses. It counts from 1 once it was released.
pub(crate) const LEFT_PRESSED: u8 = i8::MAX.unsigned_abs();

/// Share [-] of the stress that welds from which on what a blade is at, or has left pressed, counts as
/// pressed: what cutting left at 1.00 of it fell below in one frame, was over it again in the next, and
/// joined two bodies.
pub(crate) const LEFT_SHARE: f64 = 0.5;

/// When the two sides of a cut grow together in a frame: [`Weld`](super::material::Weld) in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WeldRule {
    /// Compressive stress across the cut \[Pa\].
    pub(crate) stress: f64,
    /// What a frame adds to the count of a pressed tag.
    pub(crate) step: u8,
}

impl WeldRule {
    /// The rule of a plan whose frame starts at the clay's time `start` \[s\]; none if nothing grows together.
    /// The step is the number of whole parts of the time that pass in the frame, which may be none, so that
    /// growing together takes as long whatever the frames' length.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the range of a tag's count")]
    pub(crate) fn of(plan: &FramePlan, start: f64) -> Option<Self> {
        let (stress, time) = plan.material.weld.rule().filter(|_| plan.cutting.keeps_cuts())?;
        let stress = stress * plan.material.shear_strength();
        let parts = |at: f64| (at / time * WELD_PARTS).floor();
        let step = (parts(start + plan.duration()) - parts(start)).clamp(0.0, WELD_PARTS) as u8;
        stress.is_finite().then_some(Self { stress, step })
    }

    /// Whether nothing grows together at a sheet: its blade is there.
    pub(crate) fn spares(plan: &FramePlan, sheet: u8) -> bool {
        plan.tools.iter().any(|path| path.divides() && path.sheet_id() == sheet)
    }

    /// Compressive stress \[Pa\] from which on the sides of the cut at this tag count as pressed.
    pub(crate) fn stress_at(self, plan: &FramePlan, tag: Tag) -> f64 {
        if is_left_pressed(tag) || is_at_blade(plan, tag) { LEFT_SHARE * self.stress } else { self.stress }
    }

    /// The same of a particle with these tags and another body.
    pub(crate) fn joint_stress_at(self, plan: &FramePlan, tags: &[Tag]) -> f64 {
        let is_left = |tag: &Tag| tag.sheet == JOINT_SHEET && is_left_pressed(*tag) || is_at_blade(plan, *tag);
        if tags.iter().any(is_left) { LEFT_SHARE * self.stress } else { self.stress }
    }

    /// Counts a frame in which the two sides were pressed on each other at this tag, or were not; returns
    /// whether they have grown together: then the side is gone, and the sheet says where.
    pub(crate) fn count(self, tag: &mut Tag, is_pressed: bool) -> bool {
        if is_pressed && is_left_pressed(*tag) {
            return false;
        }
        let count = tag.side.unsigned_abs().saturating_add(self.step);
        let is_welded = is_pressed && f64::from(count) > WELD_PARTS;
        *tag = match is_pressed {
            true if is_welded => Tag { side: 0, ..*tag },
            true => Tag { side: tag.sign() * count.cast_signed(), ..*tag },
            false => Tag { side: tag.sign(), ..*tag },
        };
        is_welded
    }

    /// Marks a tag whose blade is there by whether the sides are pressed on each other.
    pub(crate) fn mark(tag: &mut Tag, is_pressed: bool) {
        tag.side = tag.sign() * if is_pressed { LEFT_PRESSED.cast_signed() } else { 1 };
    }

    /// Counts a particle that meets another body, or none: pressed, it gets a tag that counts, if it has room
    /// for one, and loses it where nothing presses any more. Beside a blade, whose sheet the rule `spares`,
    /// what presses is marked at its cut.
    pub(crate) fn count_joint(self, tags: &mut [Tag; 2], is_pressed: bool, spares: impl Fn(u8) -> bool) -> bool {
        if let Some(at) = tags.iter().position(|tag| tag.side != 0 && tag.sheet < JOINT_SHEET && spares(tag.sheet)) {
            if is_pressed {
                Self::mark(&mut tags[at], true);
            }
            cut::drop(tags, JOINT_SHEET);
            return false;
        }
        let at = tags.iter().position(|tag| tag.sheet == JOINT_SHEET);
        let is_welded = at.is_some_and(|at| tags[at].side == 0);
        match at {
            _ if is_welded => false,
            Some(at) if is_pressed => self.count(&mut tags[at], true),
            Some(_) => {
                cut::drop(tags, JOINT_SHEET);
                false
            }
            None if !is_pressed => false,
            None => {
                let Some(free) = tags.iter_mut().find(|tag| tag.side == 0) else { return false };
                *free = Tag { sheet: JOINT_SHEET, side: 1 };
                self.count(free, true)
            }
        }
    }
}

/// Whether the blade of the tag's cut is in the plan.
fn is_at_blade(plan: &FramePlan, tag: Tag) -> bool {
    tag.side != 0 && tag.sheet < JOINT_SHEET && WeldRule::spares(plan, tag.sheet)
}

/// Whether the sides were pressed when the tag's blade left, and have been since.
pub(crate) fn is_left_pressed(tag: Tag) -> bool {
    tag.side.unsigned_abs() == LEFT_PRESSED
}

/// Least share [-] of the clay on one side of a cut in the tagged clay about a particle for which the two
/// sides meet there.
pub(crate) const MEETING_SHARE: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use super::super::material::{ClayMaterial, Weld};
    use super::super::planner::StepLimits;
    use super::super::tool::{Contact, Pose, Tool, ToolPath, ToolShape};
    use super::*;

    fn tag(sheet: u8, side: i8) -> Tag {
        Tag { sheet, side }
    }

    /// A hundred parts of pressing, not one of them missing, make whole clay; the count starts anew where the
    /// sides part.
    #[test]
    fn sides_grow_together_while_pressed() {
        let rule = WeldRule { stress: 1.0, step: 30 };
        let mut pressed = tag(5, -1);
        assert!((0..3).all(|_| !rule.count(&mut pressed, true)));
        assert_eq!(pressed, tag(5, -91));
        let mut parted = pressed;
        assert!(!rule.count(&mut parted, false) && parted == tag(5, -1));
        assert!(rule.count(&mut pressed, true) && pressed == tag(5, 0));
        assert!(WeldRule { stress: 1.0, step: 100 }.count(&mut tag(5, 1), true), "at once");
    }

    /// A particle pressed on another body counts in a tag of its own where it has room for one, and gives up
    /// no cut for it; the tag goes with what presses, but for one that has counted to the end.
    #[test]
    fn bodies_are_counted_where_there_is_room() {
        let rule = WeldRule { stress: 1.0, step: 60 };
        let (none, cut) = (Tag::default(), tag(5, -1));
        let mut tags = [cut, none];
        assert!(!rule.count_joint(&mut tags, false, |_| false) && tags == [cut, none]);
        assert!(!rule.count_joint(&mut tags, true, |_| false) && tags == [cut, tag(JOINT_SHEET, 61)]);
        assert!(!rule.count_joint(&mut tags, false, |_| false) && tags == [cut, none]);
        rule.count_joint(&mut tags, true, |_| false);
        assert!(rule.count_joint(&mut tags, true, |_| false) && tags == [cut, tag(JOINT_SHEET, 0)]);
        assert!(!rule.count_joint(&mut tags, true, |_| false) && !rule.count_joint(&mut tags, false, |_| false));
        assert_eq!(tags, [cut, tag(JOINT_SHEET, 0)]);
        let mut full = [cut, tag(6, 1)];
        assert!(!rule.count_joint(&mut full, true, |_| false) && full == [cut, tag(6, 1)]);
    }

    /// What presses where a blade leaves is of its cutting: it counts once it was released, and no sooner.
    #[test]
    fn what_cutting_leaves_is_no_press() {
        let rule = WeldRule { stress: 1.0, step: 100 };
        let mut left = tag(5, -1);
        WeldRule::mark(&mut left, true);
        assert!((0..9).all(|_| !rule.count(&mut left, true)), "as it was left");
        assert!(!rule.count(&mut left, false) && left == tag(5, -1), "released");
        assert!(rule.count(&mut left, true), "pressed");
        let mut parted = tag(5, 60);
        WeldRule::mark(&mut parted, false);
        assert_eq!(parted, tag(5, 1), "cut anew");
    }

    /// So it is between bodies that a blade has made while it is still there: what presses is marked at the
    /// cut, and nothing is counted.
    #[test]
    fn bodies_count_nothing_beside_a_blade() {
        let rule = WeldRule { stress: 1.0, step: 60 };
        let spares = |sheet| sheet == 5;
        for joint in [Tag::default(), tag(JOINT_SHEET, 61)] {
            let mut tags = [tag(5, -1), joint];
            assert!(!rule.count_joint(&mut tags, false, spares) && tags == [tag(5, -1), Tag::default()]);
            tags[1] = joint;
            assert!(!rule.count_joint(&mut tags, true, spares) && tags == [tag(5, -127), Tag::default()]);
        }
    }

    /// What cutting left pressed stays so down to half the stress that welds, as does what its blade is at.
    #[test]
    fn what_cutting_left_is_pressed_by_half_as_much() {
        let rule = WeldRule { stress: 1.0, step: 60 };
        let blade = Tool { shape: ToolShape::Blade { half_width: 0.01, half_height: 0.01 }, contact: Contact::Slip };
        let path = ToolPath { sheet: 5, ..ToolPath::still(1, blade, Pose::default()) };
        let plan = FramePlan::new(ClayMaterial::default(), 1e-3, 1);
        let cutting = FramePlan { tools: vec![path], ..plan.clone() };
        let left = LEFT_PRESSED.cast_signed();
        for (plan, of, stress) in [
            (&plan, tag(5, 1), 1.0),
            (&plan, tag(5, -left), LEFT_SHARE),
            (&cutting, tag(5, 1), LEFT_SHARE),
            (&cutting, tag(6, 1), 1.0),
        ] {
            assert_eq!(rule.stress_at(plan, of), stress, "{of:?}");
        }
        for (plan, tags, stress) in [
            (&plan, [tag(5, 1), tag(JOINT_SHEET, left)], LEFT_SHARE),
            // A cut that was left pressed says nothing of another body.
            (&plan, [tag(5, left), tag(JOINT_SHEET, 40)], 1.0),
            (&cutting, [tag(5, 1), Tag::default()], LEFT_SHARE),
            (&cutting, [tag(6, 1), tag(JOINT_SHEET, 61)], 1.0),
        ] {
            assert_eq!(rule.joint_stress_at(plan, &tags), stress, "{tags:?}");
        }
    }

    /// Growing together takes as long in short frames as in long ones, to a part of that time, whenever it
    /// begins; and not half as long.
    #[test]
    fn frames_of_any_length_weld_in_the_same_time() {
        let weld = Weld::Pressed;
        let time = weld.rule().expect("a rule").1;
        for duration in [1e-4, 1e-3, 3.1e-3, 0.016, 0.033] {
            for began in [0.0, 0.0123, 71.99] {
                let limits = StepLimits::default();
                let plan = limits.frame(&ClayMaterial { weld, ..ClayMaterial::default() }, 0.01, duration, &[]);
                let (mut now, mut pressed) = (began, tag(5, 1));
                while !WeldRule::of(&plan, now).expect("a rule").count(&mut pressed, true) {
                    now += plan.duration();
                }
                let took = now + plan.duration() - began;
                assert!((took - time).abs() < time / WELD_PARTS + plan.duration(), "{took} s in frames of {duration} s");
            }
        }
    }
}
