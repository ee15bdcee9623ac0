//! Where the sides of a cut are carried on: what both engines and the oracle hold to.

use super::cut::{self, JOINT_SHEET};
use super::frame::FramePlan;
use super::snapshot::Tag;
use super::weld::{MEETING_SHARE, WeldRule};
use glam::DVec3;

/// Least share [-] of one side in a cut's tagged clay about a particle that takes it. Clay ahead of the front
/// of a cut that ends in the clay sees as much of either side.
pub(crate) const CARRY_SHARE: f64 = 0.75;

/// Least cosine [-] between the cut's normal and the way to the particle from the tagged clay of its side:
/// that clay lies between it and the cut. Beside the front of a cut that ends in the clay it lies beside it.
pub(crate) const CARRY_COSINE: f64 = 0.8;

/// Whether sides of this sheet are carried on in a frame: those of cuts that stay, away from their blades.
pub(crate) fn is_carried(plan: &FramePlan, sheet: u8) -> bool {
    (1..JOINT_SHEET).contains(&sheet) && plan.cutting.keeps_cuts() && !WeldRule::spares(plan, sheet)
}

/// Whether a particle takes sides of `sheet` from the clay about it: it has room for one, and neither a side
/// of the sheet nor grown together there.
pub(crate) fn is_open(tags: &[Tag; 2], sheet: u8) -> bool {
    tags.iter().all(|tag| tag.sheet != sheet) && tags.iter().any(|tag| tag.side == 0)
}

/// Gives the tags the side that `about` carries on; returns whether there is one.
pub(crate) fn take(tags: &mut [Tag; 2], sheet: u8, about: &SidesAbout) -> bool {
    let side = about.carried();
    if let Some(side) = side {
        cut::take(tags, sheet, side);
    }
    side.is_some()
}

/// The clay on either side of a sheet about a particle, the front first: mass, and that times the way to it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SidesAbout {
    pub(crate) masses: [f64; 2],
    pub(crate) moments: [DVec3; 2],
}

impl SidesAbout {
    /// Unit normal of the cut there, from back to front; none where the two sides do not meet.
    pub(crate) fn normal(&self) -> Option<DVec3> {
        let shares = self.shares();
        let meet = shares[0].min(shares[1]) > MEETING_SHARE;
        if meet { (shares[1] * self.moments[0] - shares[0] * self.moments[1]).try_normalize() } else { None }
    }

    /// Each side's part of the tagged mass [-].
    fn shares(&self) -> [f64; 2] {
        let total = self.masses[0] + self.masses[1];
        self.masses.map(|mass| mass / total)
    }

    /// The side (+1, -1) that a particle takes which has none.
    fn carried(&self) -> Option<i8> {
        let (normal, shares) = (self.normal()?, self.shares());
        let (i, side) = if shares[0] > shares[1] { (0, 1) } else { (1, -1) };
        let away = -self.moments[i].try_normalize()?;
        (shares[i] > CARRY_SHARE && away.dot(normal) * f64::from(side) > CARRY_COSINE).then_some(side)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a particle takes with front clay of mass `front` at `front_at` from it, back clay at `back_at`.
    fn side([front, back]: [f64; 2], front_at: DVec3, back_at: DVec3) -> Option<i8> {
        let about = SidesAbout { masses: [front, back], moments: [front * front_at, back * back_at] };
        let mut tags = [Tag::default(); 2];
        let is_taken = take(&mut tags, 4, &about);
        assert_eq!(is_taken, tags[0].side != 0);
        is_taken.then_some(tags[0].side)
    }

    /// Clay over a thinned side takes that side; clay that sees hardly any of the other side, and clay ahead
    /// of the front, which sees as much of both or has its side beside it, take none.
    #[test]
    fn sides_are_carried_away_from_the_cut_alone() {
        let (under, deep) = (DVec3::NEG_Y * 0.4, DVec3::NEG_Y);
        assert_eq!(side([0.5, 0.05], under, deep), Some(1));
        assert_eq!(side([0.05, 0.5], deep, under), Some(-1));
        assert_eq!(side([0.5, 0.0004], under, deep), None, "as thick as splines reach");
        assert_eq!(side([0.3, 0.0], under, deep), None);
        assert_eq!(side([0.2, 0.1], under, deep), None, "in the cut's way");
        let (beside, below) = (DVec3::NEG_X * 0.8, DVec3::new(-0.8, -0.9, 0.0));
        assert_eq!(side([0.4, 0.1], beside, below), None, "ahead of the front");
    }

    /// A side is taken where there is room for one, the cut is not known yet, and has not grown together.
    #[test]
    fn tags_are_open_to_cuts_they_do_not_know() {
        let (none, other, own) = (Tag::default(), Tag { sheet: 9, side: -3 }, Tag { sheet: 4, side: 2 });
        let grown = Tag { sheet: 4, side: 0 };
        let is_open = |tags| is_open(&tags, 4);
        assert_eq!([[none; 2], [other, none], [other, Tag { side: 0, ..other }]].map(is_open), [true; 3]);
        assert_eq!([[own, none], [other, grown], [grown, none], [other; 2]].map(is_open), [false; 4]);
    }
}
