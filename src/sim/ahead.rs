//! The clay ahead of the edges of a step's blades, and what of it is still to be parted.
//!
//! An edge bears the toughness of clay that it parts. Clay of a [class](super::cut::ClassKey) that stands on
//! one side of the blade alone was parted there before, by a cut along which the blade goes now, or ends
//! there. With the [share](super::tool::edge_share) K of a particle of rest volume V that has no side of the
//! blade's cut, z in front of its surface (cells), let r be the lesser of `sum V K |z|` over `z > 0` and over
//! `z < 0` in a class, over both: one half in whole clay, wherever between its layers of particles the blade
//! goes; what stands in the blade's surface says nothing. The class bears `clamp((r - PARTED_MAX) /
//! (WHOLE_MIN - PARTED_MAX), 0, 1)` of the toughness: what of it stands on both sides.

use super::cut::ClassKey;
use std::collections::BTreeMap;

/// Greatest r of clay that has been parted [-]: what is left of it beside an older cut a quarter of a cell
/// away, half a layer of particles.
pub(crate) const PARTED_MAX: f64 = 0.125;

/// Least r of whole clay [-]: as far from that of clay in order as disorder brings it.
pub(crate) const WHOLE_MIN: f64 = 0.375;

/// What the edges of a step's blades have ahead, by tool and class: `sum V K |z|` behind the blade and in
/// front of it, in cells.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ClayAhead(BTreeMap<(usize, ClassKey), [f64; 2]>);

impl ClayAhead {
    /// Takes in a particle of rest volume `volume` [cells^3] and share K, without a side of the cut of tool
    /// `tool`, `beside` in front of its surface \[cells\].
    pub(crate) fn see(&mut self, (tool, key): (usize, ClassKey), volume: f64, share: f64, beside: f64) {
        self.0.entry((tool, key)).or_default()[usize::from(beside > 0.0)] += volume * share * beside.abs();
    }

    /// Takes in what others have seen.
    pub(crate) fn add(&mut self, other: &Self) {
        for (class, sums) in &other.0 {
            let own = self.0.entry(*class).or_default();
            *own = [own[0] + sums[0], own[1] + sums[1]];
        }
    }

    /// How much of a class the edge of a tool has to part [-].
    pub(crate) fn wholeness(&self, tool: usize, key: ClassKey) -> f64 {
        let [behind, before] = self.0.get(&(tool, key)).copied().unwrap_or_default();
        let both = behind + before;
        if both > 0.0 { ((behind.min(before) / both - PARTED_MAX) / (WHOLE_MIN - PARTED_MAX)).clamp(0.0, 1.0) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::super::snapshot::Tag;
    use super::super::tool::edge_share;
    use super::*;

    /// How whole two bodies are of layers of particles half a cell apart about a blade, which goes `at`
    /// beside one: the second is behind `end` \[cells\].
    fn wholeness(at: f64, end: f64) -> [f64; 2] {
        let keys = [0, 1].map(|body| ClassKey::new(body, [Tag::default(); 2]));
        let mut ahead = ClayAhead::default();
        for z in (-4..4).map(|layer| 0.5 * f64::from(layer) + at) {
            ahead.see((0, keys[usize::from(z < end)]), 0.125, edge_share(0.3, z), z);
        }
        keys.map(|key| ahead.wholeness(0, key))
    }

    /// Clay is whole wherever between its layers the blade goes; none of two bodies is whose faces meet at
    /// the blade, a layer of one strayed over it or not; one that has a layer beyond is in part or all of it.
    #[test]
    fn clay_on_one_side_has_nothing_to_part() {
        for at in [0.0, 0.1, 0.2, 0.25, 0.3, 0.4] {
            assert_eq!(wholeness(at, -9.0), [1.0, 0.0], "{at}");
            assert_eq!(wholeness(at, at), [0.0; 2], "{at}");
        }
        assert_eq!(wholeness(-0.01, -0.02), [0.0; 2], "strayed");
        assert_eq!(wholeness(0.1, -0.5), [1.0, 0.0], "a layer and a half");
        let [thin, rest] = wholeness(-0.2, -0.3);
        assert!(rest == 0.0 && thin > 0.5 && thin < 1.0, "{thin}: two fifths of a layer");
        assert_eq!(ClayAhead::default().wholeness(0, ClassKey::FIRST), 0.0);
    }

    #[test]
    fn parts_add_up() {
        let seen = |tool, z| {
            let mut ahead = ClayAhead::default();
            ahead.see((tool, ClassKey::FIRST), 0.125, 2.0, z);
            ahead
        };
        let mut sum = seen(0, 0.25);
        sum.add(&seen(1, -0.25));
        assert_eq!([0, 1].map(|tool| sum.wholeness(tool, ClassKey::FIRST)), [0.0; 2]);
        sum.add(&seen(0, -0.25));
        assert_eq!([0, 1].map(|tool| sum.wholeness(tool, ClassKey::FIRST)), [1.0, 0.0]);
    }
}
