//! The outline of a blade: where its surface is, in its own frame.

use super::profile::{Nearest, Profile};
use glam::{DVec2, DVec3};

/// A blade's shape in its own frame. Lengths in metres or cells.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "one for each blade and substep")]
pub(crate) enum Outline {
    /// In the XY plane, about the origin.
    Rectangle {
        /// Half the extent along X.
        half_width: f64,
        /// Half the extent along Y.
        half_height: f64,
    },
    /// In the XY plane, its tip at -`half_height`, its base at +`half_height`.
    Triangle {
        /// Half the base along X.
        half_width: f64,
        /// Half the way from tip to base along Y.
        half_height: f64,
    },
    /// Bent along a profile in the XZ plane.
    Strip {
        /// The bend.
        profile: Profile,
        /// Half the extent along Y.
        half_height: f64,
    },
    /// The middle of a plate of these half edges: across the shortest, the first of equal ones.
    Plate {
        /// Half the edge lengths.
        half_size: DVec3,
    },
    /// A line along X.
    Wire {
        /// Half its length.
        half_length: f64,
    },
}

/// The point of a blade nearest to another, in the blade's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    /// Signed distance, positive in front.
    pub(super) distance: f64,
    /// Unit normal of the front there.
    pub(super) normal: DVec3,
    /// Whether the foot is inside the blade's outline.
    pub(super) is_inside: bool,
}

impl Outline {
    /// Corners of a flat blade in its XY plane, anticlockwise, and how many there are; none of what is bent,
    /// a plate or a wire.
    pub(crate) fn corners(&self) -> Option<([DVec2; 4], usize)> {
        match *self {
            Self::Rectangle { half_width: w, half_height: h } => {
                Some(([DVec2::new(-w, -h), DVec2::new(w, -h), DVec2::new(w, h), DVec2::new(-w, h)], 4))
            }
            Self::Triangle { half_width: w, half_height: h } => {
                Some(([DVec2::new(0.0, -h), DVec2::new(w, h), DVec2::new(-w, h), DVec2::ZERO], 3))
            }
            Self::Strip { .. } | Self::Plate { .. } | Self::Wire { .. } => None,
        }
    }

    /// The foot of a point of the blade's frame.
    pub(super) fn foot(&self, q: DVec3) -> Foot {
        let flat = |is_inside| Foot { distance: q.z, normal: DVec3::Z, is_inside };
        match *self {
            Self::Rectangle { half_width, half_height } => flat(q.x.abs() <= half_width && q.y.abs() <= half_height),
            Self::Triangle { half_width, half_height } => {
                flat(q.y.abs() <= half_height && q.x.abs() <= half_width * (q.y + half_height) / (2.0 * half_height))
            }
            Self::Strip { profile, half_height } => {
                let Nearest { distance, normal, is_beyond } = profile.nearest(DVec2::new(q.x, q.z));
                Foot { distance, normal: DVec3::new(normal.x, 0.0, normal.y), is_inside: q.y.abs() <= half_height && !is_beyond }
            }
            Self::Plate { half_size } => {
                let normal = across(half_size);
                let is_beside = (q.abs() - half_size).cmple(DVec3::ZERO) | normal.cmpne(DVec3::ZERO);
                Foot { distance: q.dot(normal), normal, is_inside: is_beside.all() }
            }
            Self::Wire { .. } => flat(false),
        }
    }

    /// Whether the straight way from `a` to `b`, in the blade's frame, passes through it.
    pub(super) fn is_crossed(&self, a: DVec3, b: DVec3) -> bool {
        match *self {
            Self::Strip { profile, half_height } => {
                let at = |q: DVec3| DVec2::new(q.x, q.z);
                profile.crossings(at(a), at(b)).any(|t| a.lerp(b, t).y.abs() <= half_height)
            }
            Self::Rectangle { .. } | Self::Triangle { .. } | Self::Plate { .. } | Self::Wire { .. } => {
                let [from, to] = [a, b].map(|q| self.foot(q).distance);
                (from < 0.0) != (to < 0.0) && self.foot(a.lerp(b, from / (from - to))).is_inside
            }
        }
    }
}

/// Unit vector along the shortest edge, the first of equal ones.
fn across(half_size: DVec3) -> DVec3 {
    if half_size.x <= half_size.y && half_size.x <= half_size.z {
        DVec3::X
    } else if half_size.y <= half_size.z {
        DVec3::Y
    } else {
        DVec3::Z
    }
}
