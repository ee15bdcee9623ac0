//! Tool shapes and their exact signed distances.

use super::super::params::{LENGTH, ParamsError};
use super::super::variants::variants;
use super::outline::Outline;
use super::profile::Profile;
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// A tool's shape in its own frame, in metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(clippy::large_enum_variant, reason = "copied a few times a frame; what holds it stays `Copy`")]
#[non_exhaustive]
pub enum ToolShape {
    /// A ball about the origin.
    Sphere {
        /// Radius \[m\].
        radius: f64,
    },
    /// A rod with round ends along the local Y axis.
    Capsule {
        /// Radius \[m\].
        radius: f64,
        /// Half the length of the axis between the two centres \[m\].
        half_length: f64,
    },
    /// A block about the origin.
    Box {
        /// Half the edge lengths \[m\].
        half_size: DVec3,
    },
    /// A blade without thickness: a rectangle in the local XY plane, its front along +Z.
    Blade {
        /// Half the extent along local X \[m\].
        half_width: f64,
        /// Half the extent along local Y \[m\].
        half_height: f64,
    },
    /// A blade with a point: a triangle in the local XY plane, its tip at -`half_height`, its base of twice
    /// `half_width` at +`half_height`; its front along +Z.
    PointedBlade {
        /// Half the base along local X \[m\].
        half_width: f64,
        /// Half the way from the tip to the base along local Y \[m\].
        half_height: f64,
    },
    /// A blade bent along a profile in the local XZ plane, of constant height along local Y: gouges, loops,
    /// corrugated cutters.
    BentBlade {
        /// The bend.
        profile: Profile,
        /// Half the extent along local Y \[m\].
        half_height: f64,
    },
    /// A taut wire along local X, without thickness: it parts the clay that it passes and pushes none. The
    /// front of its cut is where local Z points.
    Wire {
        /// Half its length \[m\].
        half_length: f64,
    },
    /// A solid cone about the local Y axis, its tip at the low end.
    Cone {
        /// Radius of the flat end, at +`half_height` \[m\].
        radius: f64,
        /// Half the way from the tip, at -`half_height`, to the flat end \[m\].
        half_height: f64,
    },
}

variants! {
    /// One of every shape, about three units wide.
    ToolShape:
        Sphere { radius: 3.2 },
        Capsule { radius: 2.1, half_length: 2.5 },
        Box { half_size: DVec3::new(2.3, 1.7, 3.1) },
        Blade { half_width: 4.1, half_height: 3.4 },
        Cone { radius: 3.1, half_height: 2.4 },
        PointedBlade { half_width: 2.1, half_height: 4.3 },
        BentBlade { profile: Profile::V, half_height: 3.4 },
        Wire { half_length: 7.3 },
}

impl ToolShape {
    /// Signed distance \[m\] from `local` to a solid shape, negative inside; to a blade, the unsigned distance.
    pub fn distance(&self, local: DVec3) -> f64 {
        match *self {
            Self::Sphere { radius } => local.length() - radius,
            Self::Capsule { radius, half_length } => {
                (local - DVec3::Y * local.y.clamp(-half_length, half_length)).length() - radius
            }
            Self::Box { half_size } => {
                let q = local.abs() - half_size;
                q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
            }
            Self::Blade { half_width, half_height } => {
                let on = DVec3::new(local.x.clamp(-half_width, half_width), local.y.clamp(-half_height, half_height), 0.0);
                local.distance(on)
            }
            Self::PointedBlade { half_width, half_height } => {
                let corners = [(0.0, -half_height), (half_width, half_height), (-half_width, half_height)].map(DVec2::from);
                triangle_distance(corners, local.truncate()).hypot(local.z)
            }
            Self::BentBlade { profile, half_height } => profile.strip_distance(half_height, local),
            Self::Wire { half_length } => (local - DVec3::X * local.x.clamp(-half_length, half_length)).length(),
            Self::Cone { radius, half_height } => cone(radius, half_height, local).0,
        }
    }

    /// Outward unit normal of a solid shape at `local`: the gradient of [`Self::distance`]. Where that is not
    /// defined (the centre) it is +Y.
    pub fn normal(&self, local: DVec3) -> DVec3 {
        let gradient = match *self {
            Self::Sphere { .. } => local,
            Self::Capsule { half_length, .. } => local - DVec3::Y * local.y.clamp(-half_length, half_length),
            Self::Box { half_size } => {
                let q = local.abs() - half_size;
                let outside = q.max(DVec3::ZERO);
                let g = if outside != DVec3::ZERO {
                    outside
                } else if q.x >= q.y && q.x >= q.z {
                    DVec3::X
                } else if q.y >= q.z {
                    DVec3::Y
                } else {
                    DVec3::Z
                };
                g * DVec3::new(1f64.copysign(local.x), 1f64.copysign(local.y), 1f64.copysign(local.z))
            }
            Self::Blade { .. } | Self::PointedBlade { .. } | Self::BentBlade { .. } | Self::Wire { .. } => DVec3::Z,
            Self::Cone { radius, half_height } => cone(radius, half_height, local).1,
        };
        gradient.try_normalize().unwrap_or(DVec3::Y)
    }

    /// The shape with every length multiplied by `factor`: metres -> cells.
    pub fn scaled(&self, factor: f64) -> Self {
        match *self {
            Self::Sphere { radius } => Self::Sphere { radius: radius * factor },
            Self::Capsule { radius, half_length } => Self::Capsule { radius: radius * factor, half_length: half_length * factor },
            Self::Box { half_size } => Self::Box { half_size: half_size * factor },
            Self::Blade { half_width, half_height } => {
                Self::Blade { half_width: half_width * factor, half_height: half_height * factor }
            }
            Self::PointedBlade { half_width, half_height } => {
                Self::PointedBlade { half_width: half_width * factor, half_height: half_height * factor }
            }
            Self::BentBlade { profile, half_height } => {
                Self::BentBlade { profile: profile.scaled(factor), half_height: half_height * factor }
            }
            Self::Wire { half_length } => Self::Wire { half_length: half_length * factor },
            Self::Cone { radius, half_height } => Self::Cone { radius: radius * factor, half_height: half_height * factor },
        }
    }

    /// Whether the shape is a blade or a wire: it divides the clay instead of displacing it.
    pub fn is_blade(&self) -> bool {
        self.outline().is_some()
    }

    /// Whether the shape is a wire: it parts the clay and holds none off.
    pub fn is_wire(&self) -> bool {
        self.wire().is_some()
    }

    /// Half the length of a wire \[m\]; none for other shapes.
    pub(crate) fn wire(&self) -> Option<f64> {
        match *self {
            Self::Wire { half_length } => Some(half_length),
            Self::Sphere { .. }
            | Self::Capsule { .. }
            | Self::Box { .. }
            | Self::Blade { .. }
            | Self::PointedBlade { .. }
            | Self::BentBlade { .. }
            | Self::Cone { .. } => None,
        }
    }

    /// A ball that is larger by `growth` \[m\]; none for other shapes.
    pub(crate) fn grown_ball(&self, growth: f64) -> Option<Self> {
        match *self {
            Self::Sphere { radius } => Some(Self::Sphere { radius: radius + growth }),
            Self::Capsule { .. }
            | Self::Box { .. }
            | Self::Blade { .. }
            | Self::PointedBlade { .. }
            | Self::BentBlade { .. }
            | Self::Wire { .. }
            | Self::Cone { .. } => None,
        }
    }

    /// What a blade or a wire is in its own plane or bend; none for a solid shape.
    pub(crate) fn outline(&self) -> Option<Outline> {
        Some(match *self {
            Self::Blade { half_width, half_height } => Outline::Rectangle { half_width, half_height },
            Self::PointedBlade { half_width, half_height } => Outline::Triangle { half_width, half_height },
            Self::BentBlade { profile, half_height } => Outline::Strip { profile, half_height },
            Self::Wire { half_length } => Outline::Wire { half_length },
            Self::Sphere { .. } | Self::Capsule { .. } | Self::Box { .. } | Self::Cone { .. } => return None,
        })
    }

    /// Whether the shape is a plate on a grid of such cells \[m\]: a box thinner than two cells along one edge
    /// alone. Clay on its two sides shares nodes.
    pub fn is_plate(&self, cell_width: f64) -> bool {
        match *self {
            Self::Box { half_size } => half_size.to_array().iter().filter(|h| **h < cell_width).count() == 1,
            Self::Sphere { .. }
            | Self::Capsule { .. }
            | Self::Blade { .. }
            | Self::PointedBlade { .. }
            | Self::BentBlade { .. }
            | Self::Wire { .. }
            | Self::Cone { .. } => false,
        }
    }

    /// Radius \[m\] of a ball about the origin that holds the shape.
    pub fn bounding_radius(&self) -> f64 {
        match *self {
            Self::Sphere { radius } => radius,
            Self::Capsule { radius, half_length } => radius + half_length,
            Self::Box { half_size } => half_size.length(),
            Self::Blade { half_width, half_height } | Self::PointedBlade { half_width, half_height } => {
                half_width.hypot(half_height)
            }
            Self::BentBlade { profile, half_height } => profile.radius().hypot(half_height),
            Self::Wire { half_length } => half_length,
            Self::Cone { radius, half_height } => radius.hypot(half_height),
        }
    }

    /// Checks the shape's lengths.
    ///
    /// # Errors
    /// The first length out of [`LENGTH`], by name.
    pub fn validate(&self) -> Result<(), ParamsError> {
        let check = |name, value: f64| LENGTH.check(name, value);
        match *self {
            Self::Sphere { radius } => check("radius", radius),
            Self::Capsule { radius, half_length } => check("radius", radius).and(check("half_length", half_length)),
            Self::Box { half_size } => half_size.to_array().into_iter().try_for_each(|h| check("half_size", h)),
            Self::Blade { half_width, half_height } | Self::PointedBlade { half_width, half_height } => {
                check("half_width", half_width).and(check("half_height", half_height))
            }
            Self::BentBlade { half_height, .. } => check("half_height", half_height),
            Self::Wire { half_length } => check("half_length", half_length),
            Self::Cone { radius, half_height } => check("radius", radius).and(check("half_height", half_height)),
        }
    }
}

/// Distance from `q` to a triangle in its plane, 0 inside; corners counter-clockwise.
fn triangle_distance(corners: [DVec2; 3], q: DVec2) -> f64 {
    let edges = || (0..3).map(|i| (corners[i], corners[(i + 1) % 3]));
    if edges().all(|(a, b)| (b - a).perp_dot(q - a) >= 0.0) {
        return 0.0;
    }
    let to_edge = |(a, b): (DVec2, DVec2)| {
        let t = ((q - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        q.distance(a.lerp(b, t))
    };
    edges().map(to_edge).fold(f64::INFINITY, f64::min)
}

/// Signed distance from `local` to a cone, and the direction of its gradient. In the half plane of `local`
/// and the axis the cone is a triangle: the slant from the tip to the rim, and the flat end.
fn cone(radius: f64, half_height: f64, local: DVec3) -> (f64, DVec3) {
    let q = DVec2::new(local.x.hypot(local.z), local.y);
    // On the axis the slant's normal has no direction of its own.
    let outward = if q.x > 0.0 { DVec3::new(local.x, 0.0, local.z) / q.x } else { DVec3::X };
    let space = |n: DVec2| outward * n.x + DVec3::Y * n.y;
    let (tip, rim) = (DVec2::new(0.0, -half_height), DVec2::new(radius, half_height));
    let slant = (rim - tip).length();
    let along = (rim - tip) / slant;
    let normal = DVec2::new(along.y, -along.x);
    let (s, beyond) = ((q - tip).dot(along), (q - tip).dot(normal));
    let above = q.y - half_height;
    if above < 0.0 && beyond < 0.0 {
        return if above > beyond { (above, DVec3::Y) } else { (beyond, space(normal)) };
    }
    if above >= 0.0 && q.x <= radius {
        return (above, DVec3::Y);
    }
    if above < 0.0 && s > 0.0 && s < slant {
        return (beyond, space(normal));
    }
    let edge = if above < 0.0 && s <= 0.0 { tip } else { rim };
    ((q - edge).length(), space(q - edge))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stepping back along the normal by the distance reaches the surface, from outside and inside.
    #[test]
    fn normal_times_distance_leads_to_surface() {
        for shape in ToolShape::ALL.into_iter().filter(|shape| !shape.is_blade()).map(|shape| shape.scaled(0.2)) {
            for i in 0..1000 {
                let r = |k: i32| f64::from((i * 7919 + k * 104_729) % 2000) / 1000.0 - 1.0;
                let x = DVec3::new(r(1), r(2), r(3));
                let on = x - shape.normal(x) * shape.distance(x);
                assert!(shape.distance(on).abs() < 1e-9, "{shape:?} at {x}: {}", shape.distance(on));
            }
        }
    }

    /// A blade's distance is to the rectangle, not to its plane.
    #[test]
    fn blade_distance_beyond_edge_is_to_the_edge() {
        let blade = ToolShape::Blade { half_width: 1.0, half_height: 2.0 };
        assert_eq!(blade.distance(DVec3::new(0.5, -1.0, -0.25)), 0.25);
        assert_eq!(blade.distance(DVec3::new(4.0, 0.0, 4.0)), 5.0);
    }

    #[test]
    fn pointed_blade_distance_is_to_the_triangle() {
        let blade = ToolShape::PointedBlade { half_width: 3.0, half_height: 2.0 };
        assert_eq!(blade.distance(DVec3::new(0.5, 1.0, -0.25)), 0.25);
        assert_eq!(blade.distance(DVec3::new(0.0, -5.0, 4.0)), 5.0);
        // Beside the flank from (0, -2) to (3, 2), along its normal (4, -3) / 5 from the middle.
        assert!((blade.distance(DVec3::new(1.5 + 0.8, -0.6, 0.0)) - 1.0).abs() < 1e-12);
    }

    /// Off its tip, its slant, its rim and its flat end.
    #[test]
    fn cone_distance_is_to_its_nearest_part() {
        let cone = ToolShape::Cone { radius: 3.0, half_height: 2.0 };
        let is =
            |local, distance: f64| assert!((cone.distance(local) - distance).abs() < 1e-12, "{local}: {}", cone.distance(local));
        is(DVec3::new(0.0, -3.0, 0.0), 1.0);
        // Half way up the slant of 3 by 4, along its normal (4, -3) / 5.
        is(DVec3::new(0.0, 0.0, 1.5) + DVec3::new(0.0, -0.6, 0.8) * 0.5, 0.5);
        is(DVec3::new(6.0, 6.0, 0.0), 5.0);
        is(DVec3::new(1.0, 2.5, 1.0), 0.5);
        is(DVec3::new(0.1, 1.9, 0.0), -0.1);
    }

    #[test]
    fn zero_and_nan_lengths_are_refused_by_name() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let error = ToolShape::Sphere { radius: bad }.validate().expect_err("bad radius");
            assert_eq!(error.name, "radius");
        }
    }
}
