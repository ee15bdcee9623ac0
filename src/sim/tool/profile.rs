//! The profile of a bent blade: a polyline in the blade's XZ plane, along which a strip of constant height is
//! bent.

use super::super::params::{LENGTH, ParamsError};
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// Most points of a profile: 32 rectangles, 64 triangles.
pub const PROFILE_POINTS: usize = 33;

/// Points (x, z) \[m\] in order; the front is to the left of the way along them, so that a straight profile
/// along +X has it at +Z. A profile whose last point is its first is a ring.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<DVec2>", into = "Vec<DVec2>")]
pub struct Profile {
    points: [DVec2; PROFILE_POINTS],
    count: usize,
}

/// The point of a profile nearest to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearest {
    /// Signed distance, positive in front.
    pub distance: f64,
    /// Direction of the front there, of length 1.
    pub normal: DVec2,
    /// Whether the nearest point is an open end, and the point looked from beyond it.
    pub is_beyond: bool,
}

impl Profile {
    /// A veiner's: 60 degrees between two flanks of 3 units.
    pub(super) const V: Self = {
        let mut points = [DVec2::ZERO; PROFILE_POINTS];
        (points[0], points[2]) = (DVec2::new(-1.5, 2.6), DVec2::new(1.5, 2.6));
        Self { points, count: 3 }
    };

    /// A profile of these points \[m\].
    ///
    /// # Errors
    /// Fewer than 2 or more than [`PROFILE_POINTS`] points, points that are not finite or out of [`LENGTH`],
    /// or two in a row at one place.
    pub fn new(points: &[DVec2]) -> Result<Self, ParamsError> {
        let error = |value: String, reason: String| Err(ParamsError::new("profile", value, reason));
        if !(2..=PROFILE_POINTS).contains(&points.len()) {
            return error(format!("{} points", points.len()), format!("must have 2 to {PROFILE_POINTS} points"));
        }
        points.iter().try_for_each(|p| LENGTH.check_vector("profile", p.extend(0.0)))?;
        if let Some(pair) = points.windows(2).find(|pair| pair[0] == pair[1]) {
            return error(pair[0].to_string(), "must not hold a point twice in a row".into());
        }
        let mut all = [DVec2::ZERO; PROFILE_POINTS];
        all[..points.len()].copy_from_slice(points);
        Ok(Self { points: all, count: points.len() })
    }

    /// The points in order.
    pub fn points(&self) -> &[DVec2] {
        &self.points[..self.count]
    }

    /// The profile with every length multiplied by `factor`.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        Self { points: self.points.map(|p| p * factor), ..*self }
    }

    /// Whether it is a ring.
    pub fn is_closed(&self) -> bool {
        self.points[0] == self.points[self.count - 1]
    }

    /// Unit normal of segment `i` towards the front.
    fn normal(&self, i: usize) -> DVec2 {
        (self.points[i + 1] - self.points[i]).normalize().perp()
    }

    /// The profile as seen from `q`. At a corner the front is that of both its segments.
    pub fn nearest(&self, q: DVec2) -> Nearest {
        let segments = self.count - 1;
        let along = |i: usize| {
            let (a, b) = (self.points[i], self.points[i + 1]);
            (q - a).dot(b - a) / (b - a).length_squared()
        };
        let foot = |i: usize| self.points[i].lerp(self.points[i + 1], along(i).clamp(0.0, 1.0));
        let mut best = 0;
        for i in 1..segments {
            if q.distance_squared(foot(i)) < q.distance_squared(foot(best)) {
                best = i;
            }
        }
        let (t, away) = (along(best), q - foot(best));
        if (0.0..=1.0).contains(&t) {
            let normal = self.normal(best);
            return Nearest { distance: away.dot(normal), normal, is_beyond: false };
        }
        // A corner or an end.
        let other = match (t < 0.0, best) {
            (true, 0) => self.is_closed().then_some(segments - 1),
            (true, i) => Some(i - 1),
            (false, i) if i + 1 == segments => self.is_closed().then_some(0),
            (false, i) => Some(i + 1),
        };
        let both = self.normal(best) + other.map_or(DVec2::ZERO, |i| self.normal(i));
        let sign = if away.dot(both) < 0.0 { -1.0 } else { 1.0 };
        let normal = (away * sign).try_normalize().unwrap_or_else(|| both.normalize_or(DVec2::Y));
        Nearest { distance: sign * away.length(), normal, is_beyond: other.is_none() }
    }

    /// The end nearer to `q`, and the direction in which the profile ends there, of length 1.
    pub(super) fn end_near(&self, q: DVec2) -> (DVec2, DVec2) {
        let points = self.points();
        let way = |from: DVec2, to: DVec2| (to, (to - from).normalize());
        let ends = [way(points[1], points[0]), way(points[self.count - 2], points[self.count - 1])];
        if q.distance_squared(ends[0].0) <= q.distance_squared(ends[1].0) { ends[0] } else { ends[1] }
    }

    /// Where the straight way from `a` to `b` crosses the profile: parts of the way.
    pub fn crossings(&self, a: DVec2, b: DVec2) -> impl Iterator<Item = f64> {
        self.points().windows(2).filter_map(move |pair| {
            let (way, segment, to) = (b - a, pair[1] - pair[0], pair[0] - a);
            let area = way.perp_dot(segment);
            let (t, s) = (to.perp_dot(segment) / area, to.perp_dot(way) / area);
            ((0.0..=1.0).contains(&t) && (0.0..=1.0).contains(&s)).then_some(t)
        })
    }

    /// Distance from `local` to the strip of `half_height` bent along the profile.
    pub(super) fn strip_distance(&self, half_height: f64, local: DVec3) -> f64 {
        let beyond = (local.y.abs() - half_height).max(0.0);
        self.nearest(DVec2::new(local.x, local.z)).distance.hypot(beyond)
    }

    /// Greatest distance \[m\] of a point from the origin.
    pub(super) fn radius(&self) -> f64 {
        self.points().iter().map(|p| p.length()).fold(0.0, f64::max)
    }
}

impl TryFrom<Vec<DVec2>> for Profile {
    type Error = ParamsError;

    fn try_from(points: Vec<DVec2>) -> Result<Self, ParamsError> {
        Self::new(&points)
    }
}

impl From<Profile> for Vec<DVec2> {
    fn from(profile: Profile) -> Self {
        profile.points().to_vec()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn profile(points: &[(f64, f64)]) -> Profile {
        Profile::new(&points.iter().map(|p| DVec2::new(p.0, p.1)).collect::<Vec<_>>()).expect("a profile")
    }

    /// A gutter: floor along +X, wall up at its end.
    #[test]
    fn distance_has_the_sign_of_its_side() {
        let gutter = profile(&[(-1.0, 0.0), (1.0, 0.0), (1.0, 1.0)]);
        let from = |x, z| gutter.nearest(DVec2::new(x, z));
        assert_eq!(from(0.0, 0.25), Nearest { distance: 0.25, normal: DVec2::Y, is_beyond: false });
        assert_eq!(from(0.0, -0.25).distance, -0.25);
        assert_eq!(from(0.8, 0.5), Nearest { distance: 1.0 - 0.8, normal: DVec2::NEG_X, is_beyond: false });
        // Outside the corner: behind both, seen from the corner.
        let outside = from(1.3, -0.4);
        assert!((outside.distance + 0.5).abs() < 1e-12 && !outside.is_beyond, "{outside:?}");
        assert!((outside.normal - DVec2::new(-0.6, 0.8)).length() < 1e-12, "{outside:?}");
        // Beyond the open ends.
        assert!(from(-1.2, 0.1).is_beyond && from(0.9, 1.4).is_beyond && !from(0.9, 0.9).is_beyond);
    }

    #[test]
    fn ring_has_no_ends() {
        let ring = profile(&[(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0), (1.0, 0.0)]);
        for i in 0..360 {
            let at = DVec2::from_angle(f64::from(i).to_radians());
            assert!(!ring.nearest(at * 1.5).is_beyond);
            assert!(ring.nearest(at * 1.5).distance < 0.0 && ring.nearest(at * 0.5).distance > 0.0, "{i}");
        }
    }

    #[test]
    fn way_through_is_seen_and_way_around_is_not() {
        let gutter = profile(&[(-1.0, 0.0), (1.0, 0.0), (1.0, 1.0)]);
        let count = |a: (f64, f64), b: (f64, f64)| gutter.crossings(DVec2::new(a.0, a.1), DVec2::new(b.0, b.1)).count();
        assert_eq!(count((0.0, 0.3), (0.1, -0.3)), 1);
        assert_eq!(count((0.5, 0.5), (1.5, 0.5)), 1);
        assert_eq!(count((-1.5, 0.3), (-1.4, -0.3)), 0);
        assert_eq!(count((0.5, -0.5), (1.5, 0.6)), 2, "in by the floor, out by the wall");
    }

    #[test]
    fn bad_profiles_are_named() {
        for points in [
            vec![DVec2::ZERO],
            vec![DVec2::ZERO; 2],
            vec![DVec2::NAN, DVec2::X],
            (0..40).map(|i| DVec2::X * f64::from(i)).collect(),
        ] {
            assert_eq!(Profile::new(&points).expect_err("bad").name, "profile");
        }
    }
}
