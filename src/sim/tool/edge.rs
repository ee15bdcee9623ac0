//! The edge of a blade: what parts clay that is still whole.
//!
//! A blade's edge is the rim of its outline, a wire's the wire itself. By y ahead of it, along its outward
//! normal m in the blade's surface, and z beside that surface (cells), clay bears the [`share`] of the edge's
//! force per length there: over clay that fills the room it sums to 1, whatever the angle to the grid. It
//! reaches no further ahead than a layer of particles, since all of that is borne before it is cut: an edge
//! that stands in clay has done the work of 0.3 cells more than it has cut.

use super::blade::{BAND, Blade};
use super::outline::Outline;
use glam::{DVec2, DVec3};

/// How far ahead of an edge clay bears its force \[cells\]: half a cell, the distance of the layers of
/// particles, and a ramp.
pub const EDGE_REACH: f64 = 0.5 + EDGE_RAMP;

/// The way \[cells\] on which clay takes over its share, and hands it on.
pub const EDGE_RAMP: f64 = 0.1;

/// The share [1/cell^2] of an edge's force per length that clay bears `ahead` of it and `beside` the blade's
/// surface \[cells\]: which layers of particles half a cell apart sum to 1.
pub fn share(ahead: f64, beside: f64) -> f64 {
    let along = (ahead.min(EDGE_REACH - ahead) / EDGE_RAMP).clamp(0.0, 1.0);
    2.0 * along * (1.0 - beside.abs()).max(0.0)
}

/// The part of an edge that a point is ahead of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ahead {
    /// Unit normal m of the edge, outwards in the blade's surface, in the blade's frame.
    pub(super) outward: DVec3,
    /// How far the point is ahead, along m.
    pub(super) ahead: f64,
    /// How far beside the blade's surface.
    pub(super) beside: f64,
}

/// What an edge means to a particle for a substep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edge {
    /// m, in the blade's frame.
    outward: DVec3,
    /// m, in the caller's.
    pub(crate) direction: DVec3,
    /// The particle's [`share`].
    pub(crate) share: f64,
    /// How far it is in front of the blade's surface \[cells\], negative behind it.
    pub(crate) beside: f64,
    /// Where the particle stands before the blade as the substep begins.
    from: DVec3,
}

impl Outline {
    /// The part of the edge that a point of the blade's frame is ahead of: beside no edge's end, and not
    /// inside.
    pub(super) fn ahead(&self, q: DVec3) -> Option<Ahead> {
        match *self {
            Self::Rectangle { .. } | Self::Triangle { .. } => {
                self.corners().and_then(|(corners, count)| ahead_of_polygon(&corners[..count], q))
            }
            Self::Strip { profile, half_height } => {
                let at = DVec2::new(q.x, q.z);
                let near = profile.nearest(at);
                let above = q.y.abs() - half_height;
                match (above > 0.0, near.is_beyond) {
                    (true, false) => Some(Ahead { outward: DVec3::Y * q.y.signum(), ahead: above, beside: near.distance.abs() }),
                    (false, true) => {
                        let (end, way) = profile.end_near(at);
                        let (outward, away) = (DVec3::new(way.x, 0.0, way.y), at - end);
                        Some(Ahead { outward, ahead: away.dot(way), beside: away.perp_dot(way).abs() })
                    }
                    (true, true) | (false, false) => None,
                }
            }
            // A plate is solid; a wire that stands has no way.
            Self::Plate { .. } | Self::Wire { .. } => None,
        }
    }
}

/// The same of a convex polygon in the XY plane, anticlockwise.
fn ahead_of_polygon(corners: &[DVec2], q: DVec3) -> Option<Ahead> {
    let at = DVec2::new(q.x, q.y);
    let sides = corners.iter().zip(corners.iter().cycle().skip(1));
    sides.into_iter().find_map(|(a, b)| {
        let (length, way) = ((*b - *a).length(), (*b - *a).normalize());
        let (along, ahead) = ((at - *a).dot(way), way.perp_dot(*a - at));
        let is_ahead = ahead > 0.0 && (0.0..=length).contains(&along);
        is_ahead.then(|| Ahead { outward: DVec3::new(way.y, -way.x, 0.0), ahead, beside: q.z.abs() })
    })
}

impl Blade {
    /// The edge that a particle at `start` when the substep begins is ahead of as the blade stands at its
    /// end, if that comes near.
    pub(crate) fn edge(&self, start: DVec3) -> Option<Edge> {
        let cell = self.reach / BAND;
        let local = self.motion.end.to_local(start);
        let Ahead { outward, ahead, beside } = self.outline.ahead(local).filter(|_| self.is_edge(local))?;
        let share = share(ahead / cell, beside / cell);
        let direction = self.motion.end.rotation * outward;
        let beside = || (beside / cell).copysign(self.outline.foot(local).distance);
        (share > 0.0).then(|| Edge { outward, direction, share, beside: beside(), from: self.motion.start.to_local(start) })
    }

    /// Whether the rim is an edge where a point of the blade's frame is ahead of it: of a wire's strip only
    /// the wire is.
    fn is_edge(&self, local: DVec3) -> bool {
        self.holds || self.wire_at.is_some_and(|at| local.y * at > 0.0 && local.y.abs() > at.abs())
    }

    /// By how much the edge has come towards a particle at `at` since it was anchored, in the blade's frame,
    /// or since the substep began: negative where it has drawn back.
    pub(crate) fn advance(&self, edge: &Edge, at: DVec3, anchor: Option<DVec3>) -> f64 {
        edge.outward.dot(anchor.unwrap_or(edge.from) - self.motion.end.to_local(at))
    }

    /// Where a particle at `at` is anchored to the edge that has advanced by `advance`, in the blade's frame.
    pub(crate) fn edge_anchor(&self, edge: &Edge, at: DVec3, advance: f64) -> DVec3 {
        self.motion.end.to_local(at) + edge.outward * advance
    }
}

#[cfg(test)]
mod tests {
    use super::super::path::{Motion, Pose};
    use super::super::profile::Profile;
    use super::*;
    use glam::{DQuat, EulerRot};

    /// The clay of a lattice of 8 particles a cell that fills `size` cells about the origin.
    fn lattice(size: i32) -> impl Iterator<Item = DVec3> {
        let n = 2 * size;
        let at = move |i: i32| DVec3::new(f64::from(i % n), f64::from(i / n % n), f64::from(i / n / n));
        (0..n * n * n).map(move |i| (at(i) + 0.5) / 2.0 - f64::from(size) / 2.0)
    }

    fn still(outline: Outline, pose: Pose) -> Blade {
        Blade::new(outline, Motion { start: pose, end: pose, duration: 1.0 }, 1.0)
    }

    /// The force of each edge, of 1 per length, in whole clay: the sum over all particles, along the edges'
    /// normals.
    fn forces(blade: &Blade, size: i32) -> DVec3 {
        let along = |edge: Edge| (blade.motion.end.rotation.inverse() * edge.direction).abs();
        lattice(size).filter_map(|at| blade.edge(at)).map(|edge| along(edge) * edge.share / 8.0).sum()
    }

    /// In whole clay a rectangle's edges bear 1 per length, wherever it stands and however it is turned: in
    /// the lattice's own directions to the last bit, else as finely as particles sample it.
    #[test]
    fn edges_bear_one_per_length() {
        let outline = Outline::Rectangle { half_width: 4.0, half_height: 3.0 };
        for (turn, shift, off) in
            [(0.0, 0.0, 1e-12), (0.0, 0.13, 1e-12), (0.0, 0.4, 1e-12), (0.3, 0.0, 0.04), (0.785, 0.2, 0.04), (1.1, 0.3, 0.04)]
        {
            let rotation = DQuat::from_euler(EulerRot::XYZ, turn, 0.7 * turn, 0.4 * turn);
            let found = forces(&still(outline, Pose { position: DVec3::splat(shift), rotation }), 13);
            let expected = DVec3::new(12.0, 16.0, 0.0);
            assert!((found - expected).abs().max_element() < 16.0 * off, "{turn} {shift}: {found}");
        }
    }

    /// A point is ahead of the edge that it is before, along the normal in the blade's surface; of none where
    /// it is inside or beyond a corner.
    #[test]
    fn points_are_ahead_of_their_edge() {
        let triangle = Outline::Triangle { half_width: 3.0, half_height: 2.0 };
        let near = triangle.ahead(DVec3::new(1.5, 0.0, 0.2) + DVec3::new(0.4, -0.3, 0.0)).expect("an edge");
        assert!((near.outward - DVec3::new(0.8, -0.6, 0.0)).length() < 1e-12 && (near.ahead - 0.5).abs() < 1e-12, "{near:?}");
        assert_eq!(near.beside, 0.2);
        assert_eq!(triangle.ahead(DVec3::new(0.0, 2.3, 0.0)).map(|edge| edge.outward), Some(DVec3::Y));
        for at in [DVec3::ZERO, DVec3::new(0.0, -2.3, 0.0), DVec3::new(3.4, 2.1, 0.0)] {
            assert_eq!(triangle.ahead(at), None, "{at}");
        }
        let bend = Profile::new(&[DVec2::new(0.0, 2.0), DVec2::ZERO, DVec2::new(2.0, 0.0)]).expect("a profile");
        let strip = Outline::Strip { profile: bend, half_height: 1.5 };
        let of = |at| strip.ahead(at).map(|edge| (edge.outward, edge.ahead, edge.beside));
        assert_eq!(of(DVec3::new(1.0, -1.8, 0.1)), Some((DVec3::NEG_Y, 0.3000000000000000_4, 0.1)));
        assert_eq!(of(DVec3::new(2.4, 1.0, -0.1)), Some((DVec3::X, 0.3999999999999999, 0.1)));
        assert_eq!(of(DVec3::new(0.1, 1.0, 2.4)).map(|edge| edge.0), Some(DVec3::Z));
        assert_eq!(of(DVec3::new(2.4, 1.6, 0.0)), None);
        assert_eq!(of(DVec3::new(1.0, 1.0, 0.1)), None);
    }

    /// A wire bears ahead of the way it goes alone, and nothing where it stands.
    #[test]
    fn wire_is_an_edge_where_it_goes() {
        let wire = |way: DVec3| {
            let start = Pose { position: -way, rotation: DQuat::from_rotation_x(0.4) };
            let end = Pose { position: DVec3::ZERO, ..start };
            Blade::new(Outline::Wire { half_length: 2.0 }, Motion { start, end, duration: 1.0 }, 1.0)
        };
        for way in [DVec3::new(0.0, -0.1, 0.0), DVec3::new(0.0, 0.02, 0.03), DVec3::Z * 0.1] {
            let (blade, ahead) = (wire(way), way.normalize());
            let edge = blade.edge(0.3 * ahead).expect("an edge");
            assert!((edge.direction - ahead).length() < 1e-12 && edge.share == 2.0, "{way}: {edge:?}");
            assert!((blade.advance(&edge, 0.3 * ahead, None) - way.length()).abs() < 1e-12);
            assert_eq!((blade.edge(-0.3 * ahead), blade.edge(-1.3 * ahead)), (None, None));
        }
        assert_eq!(wire(DVec3::ZERO).edge(DVec3::new(0.0, -0.3, 0.0)), None);
    }
}
