//! How the two sides of a cut, or two bodies, face each other at a node: by which normal they press on each
//! other, and how far they may still come together.
//!
//! What is known at a node is how much clay of either side has come to it and to those about it, F in front
//! and B behind. From that, at each node that both have reached (`definition`):
//!
//! - The *normal*. Over a plane `ln(F / B)` grows almost evenly with the distance, and alike at any angle to
//!   the grid, since the spline's spread is that of a ball; so it is the slope of that, fitted to the 27
//!   nodes. But a node at the rim of the clay has only what stands on one side of it: it tells of a place
//!   further in, where the middle of that clay is ([`DISPLACEMENT`]), and counts as if it stood there.
//!   Without that the normals of a slope of 28 degrees through a block of 10 cells lean by 1.8 degrees, as
//!   much as friction of .03 more; with it by .02.
//! - The *gap*, from how far the middle of either side's clay stands before the node (`face_distance`).
//!
//! Of jittered clay both scatter from node to node, normals by 1 to 3 degrees and gaps by 0.09 cells. Clay
//! that bears at some nodes before it does at others is softer than whole clay, and bears before it touches.
//! Therefore a pair of fields meets by the mean of what the 27 nodes about its own have found, each by the
//! mass `F B / (F + B)` that both share there ([`Facing::mean`]): normals to half a degree, gaps to 0.03
//! cells. With it halves that were 1.3 cells apart bear 0.006 k at 0.1 cells, then as whole clay within
//! 0.3 %, and a cut that was never open bears as whole clay within 4 %; without, 0.02 k, and 4 to 24 %.

#[cfg(any(test, feature = "reference"))]
pub(crate) mod definition;

use super::cut::ClassKey;
use glam::DVec3;

/// What stands on two sides: those of a cut, or two bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Between {
    /// The sides of a cut, by its sheet.
    Sides(u8),
    /// Two bodies, one for the back and one for the front.
    Bodies { back: u16, front: u16 },
}

impl Between {
    /// Whether the clay of a class stands on it, and whether in front.
    pub(crate) fn is_front(self, key: ClassKey) -> Option<bool> {
        match self {
            Self::Sides(sheet) => Some(key.side(sheet)).filter(|side| *side != 0).map(|side| side > 0),
            Self::Bodies { back, front } => Some(key.body() == front).filter(|is_front| *is_front || key.body() == back),
        }
    }

    /// All that clay of these classes, in the order of their keys, may stand on either side of: the cuts by
    /// their sheets, then each two bodies.
    pub(crate) fn all(keys: impl Iterator<Item = ClassKey> + Clone) -> Vec<Self> {
        let mut sheets: Vec<u8> = keys.clone().flat_map(|key| key.sides()).map(|side| side.0).collect();
        sheets.sort_unstable();
        sheets.dedup();
        let mut bodies: Vec<u16> = keys.map(ClassKey::body).collect();
        bodies.dedup();
        let pairs = (1..bodies.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
        let bodies = pairs.map(|(a, b)| Self::Bodies { back: bodies[a], front: bodies[b] });
        sheets.into_iter().map(Self::Sides).chain(bodies).collect()
    }
}

/// Where the two sides of a cut, or two bodies, face each other at a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Facing {
    /// Unit normal from back to front.
    pub(crate) normal: DVec3,
    /// Gap between the two faces along it \[cells\]; negative where they overlap.
    pub(crate) gap: f64,
}

impl Facing {
    /// How far the two sides may come together before they bear \[cells\].
    pub(crate) fn room(&self) -> f64 {
        self.gap.max(0.0)
    }

    /// Where two cuts lie between two fields: across the mean of their normals, by the wider gap.
    pub(crate) fn across(facings: impl Iterator<Item = Self>) -> Option<Self> {
        let (normal, gap) =
            facings.fold((DVec3::ZERO, f64::NEG_INFINITY), |(normal, gap), m| (normal + m.normal, gap.max(m.gap)));
        Some(Self { normal: normal.try_normalize()?, gap })
    }

    /// The same seen from the other side.
    pub(crate) fn turned(self, side: i8) -> Self {
        Self { normal: f64::from(side) * self.normal, ..self }
    }

    /// The mean of what nodes have found, by its sum; none where none has, or where normals cancel.
    pub(crate) fn mean([x, y, z, gap, mass]: [f64; 5]) -> Option<Self> {
        Some(Self { normal: DVec3::new(x, y, z).try_normalize()?, gap: gap / mass })
    }
}

/// How many numbers a node tells of two sides to the fits of the nodes about it.
pub(crate) const TERMS: usize = 22;

/// How far along an axis \[cells\] the middle of the clay that has come to a node is off it: c |c| times the
/// polynomial of |c| with these coefficients, the highest power first, of
/// `c = (after - before) / (before + 2 here + after)`, the masses at the node before, here and at the one
/// after. For clay that ends in a plane across the axis at d before the node it is `integral of x S'(x) / S`
/// beyond d, S the spline's integral, to 0.03 cells.
pub(crate) const DISPLACEMENT: [f64; 4] = [7.139_792, -13.971_006, 7.726_884, 0.481_051];

/// Coefficients of `face_distance`, the highest power first.
pub(crate) const FACE_DISTANCE: [f64; 6] = [8.932_776, -20.629_426, 19.289_938, -10.516_657, 5.929_993, -1.711_848];

/// How much farther apart two faces are than their distances (`face_distance`), of a plane along the grid,
/// have it \[cells\], times `1 - n_x^4 - n_y^4 - n_z^4` of their normal: of nine directions to the grid, at
/// seven places each and gaps of 0, 0.1 and 0.3 cells, it is 0.1 times that to 0.01 cells.
pub(crate) const OBLIQUE_GAP: f64 = 0.1;

/// Least slope of `ln(F / B)` that says where a cut faces [1/cell]: across a closed cut it is over 3. What is
/// less is rounding, and turned the normals of a cut that opens into its plane: in implicit steps its sides
/// stuck to each other.
pub(crate) const SLOPE_MIN: f64 = 0.2;

/// What is added to the diagonal of the fit's matrix, of its trace.
pub(crate) const NORMAL_REGULARISATION: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use super::*;

    /// What is known of two cuts between two fields: the mean of their normals, and the wider gap; faces that
    /// overlap leave no room.
    #[test]
    fn fields_beyond_two_cuts_meet_by_the_wider_gap() {
        let [a, b] = [(DVec3::X, 0.3), (DVec3::NEG_Y, -0.2)].map(|(normal, gap)| Facing { normal, gap });
        let both = Facing::across([a, b.turned(-1)].into_iter()).expect("a normal");
        assert!((both.normal - DVec3::new(0.5, 0.5, 0.0).normalize()).length() < 1e-15);
        assert!((both.room() - 0.3).abs() < 1e-15 && b.room() == 0.0);
        assert_eq!(Facing::across([a, a.turned(-1)].into_iter()), None);
    }
}
