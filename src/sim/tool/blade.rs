//! The blade's side test: which side of a moving rectangle a point is on, and whether the rectangle swept over it.
//!
//! A point takes its side when it comes near the blade anew (within the band, with its foot inside the rectangle) or when the blade swept over it
//! within the substep; the side is the one it was on before. It keeps the side while it is near and after the blade has left. Sides
//! found from the present distance alone leak 4-97 % of the particles, these 0 % (a test sweeps the blade at up to 3 cells per substep).

use super::path::{Motion, Pose};
use super::shape::CONTACT_OFFSET;
use glam::DVec3;

/// Half the width of the band about a blade in which nodes are two-sided and particles take a side [cells]: a quadratic spline reaches 1.5.
pub const BAND: f64 = 1.5;

/// Acceleration of a node at `distance` [cells] before a plane, positive in the clay, by a traction t of the plane on the clay, over `t / (rho_s dx)`.
///
/// The traction is shared by the nodes as clay of one stress shares its own: `N(d) / S(d)`, N the quadratic spline at the plane (it sums to 1), S the part of
/// the spline, and so of the node's full mass, that is on the clay's side. 0 from [`BAND`] on.
pub fn traction_share(distance: f64) -> f64 {
    // Where hardly any clay reaches the node the share grows beyond all bounds [cells].
    const LEAST: f64 = 1e-3;
    let (d, reach) = (distance, BAND - distance.abs());
    let (at_plane, in_clay) = match d {
        _ if reach <= 0.0 => (0.0, 1.0),
        _ if d > 0.5 => (0.5 * reach * reach, 1.0 - reach.powi(3) / 6.0),
        _ if d < -0.5 => (3.0, reach.max(LEAST)),
        _ => (0.75 - d * d, 0.5 + 0.75 * d - d.powi(3) / 3.0),
    };
    at_plane / in_clay
}

/// Velocity that a sticking blade leaves of `velocity` at a node `distance` [cells] before it, whose surface moves at `surface`, the normal towards the clay.
///
/// Across the plane the node is held up to [`CONTACT_OFFSET`]; along it the blade takes it along with a traction of at most the clay's shear strength k:
/// `adhesion = k h / (rho_s dx)`, in the unit of the velocities.
pub fn stick(velocity: DVec3, surface: DVec3, normal: DVec3, distance: f64, adhesion: f64) -> DVec3 {
    let relative = velocity - surface;
    let leaving = relative.dot(normal);
    let slide = relative - leaving * normal;
    // The strength of elastic clay is infinite.
    let (speed, most) = (slide.length(), adhesion.min(f64::MAX) * traction_share(distance));
    let kept = if speed > most { 1.0 - most / speed } else { 0.0 };
    let parting = if distance <= CONTACT_OFFSET { 0.0 } else { leaving };
    surface + parting * normal + kept * slide
}

/// A rectangle without thickness in motion over one substep. Lengths in metres or cells, as the caller likes, but all the same.
#[derive(Clone, Copy, Debug)]
pub struct Blade {
    /// Half the extent along local X.
    pub half_width: f64,
    /// Half the extent along local Y.
    pub half_height: f64,
    /// The band's half width.
    pub band: f64,
    /// The motion of the substep.
    pub motion: Motion,
}

/// What the blade means to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// Signed distance to the blade's plane at the substep's end, positive in front.
    pub distance: f64,
    /// Whether the point is within the band there, its foot inside the rectangle.
    pub is_near: bool,
    /// Whether the blade's rectangle passed over the point in the substep, however far beyond it ends.
    pub is_swept: bool,
    /// Whether the point came near anew or was swept over from outside the band.
    pub is_new: bool,
    /// The side of the blade's plane (+1 or -1) at the substep's start, where the point came from.
    pub side_before: i8,
}

impl Near {
    /// Whether a point of `side` has to be put back onto the blade's surface: it is at the blade and on its wrong side.
    #[must_use]
    pub fn is_behind(&self, side: i8) -> bool {
        (self.is_near || self.is_swept) && self.distance * f64::from(side) < 0.0
    }

    /// The side to take now, if any, for a point that has a side already or not.
    #[must_use]
    pub fn takes(&self, has_side: bool) -> Option<i8> {
        let is_at_blade = self.is_near || self.is_swept;
        (self.is_new || (is_at_blade && !has_side)).then_some(self.side_before)
    }
}

impl Blade {
    fn local(&self, pose: &Pose, point: DVec3) -> (DVec3, bool) {
        let q = pose.to_local(point);
        (q, q.x.abs() <= self.half_width && q.y.abs() <= self.half_height)
    }

    /// Signed distance to the plane at the end of the substep, if `point` is in the band with its foot inside the rectangle.
    pub fn distance_within_band(&self, point: DVec3) -> Option<f64> {
        let (q, inside) = self.local(&self.motion.end, point);
        (inside && q.z.abs() <= self.band).then_some(q.z)
    }

    /// The blade's front normal at the end of the substep.
    pub fn normal(&self) -> DVec3 {
        self.motion.end.rotation * DVec3::Z
    }

    /// What the substep means to a particle that stands at `point`, having come from `previous` in the substep before, while the blade moves from start to
    /// end. Where it came from counts: clay that flows round the rim and under the blade by its own motion comes near anew.
    pub fn near(&self, previous: DVec3, point: DVec3) -> Near {
        let (before, inside_before) = self.local(&self.motion.start, previous);
        let (after, inside_after) = self.local(&self.motion.end, point);
        let was_near = inside_before && before.z.abs() <= self.band;
        let is_near = inside_after && after.z.abs() <= self.band;
        let is_swept = (before.z < 0.0) != (after.z < 0.0) && {
            // Foot at the moment of crossing, in the blade's frame: local coordinates are linear in time up to the substep's small turn.
            let t = before.z / (before.z - after.z);
            let foot = before.lerp(after, t);
            foot.x.abs() <= self.half_width && foot.y.abs() <= self.half_height
        };
        let side_before = if before.z < 0.0 { -1 } else { 1 };
        Near { distance: after.z, is_near, is_swept, is_new: !was_near && (is_near || is_swept), side_before }
    }
}

#[cfg(test)]
mod tests {
    use super::super::spline;
    use super::*;
    use glam::DQuat;

    fn blade(from: f64, to: f64) -> Blade {
        let pose = |x| Pose { position: DVec3::new(x, 0.0, 0.0), rotation: DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2) };
        Blade {
            half_width: 6.0,
            half_height: 6.0,
            band: BAND,
            motion: Motion { start: pose(from), end: pose(to), duration: 1.0 },
        }
    }

    /// Clay that fills the space before the plane and slides along it: its nodes get the traction's whole impulse, wherever between them the plane is.
    #[test]
    fn traction_is_shared_out_whole() {
        for at in 0..100 {
            let shift = f64::from(at) * 0.01;
            let nodes = (-2..4).map(|i| f64::from(i) + shift);
            // The mass of a node [of a full one's] from the spline alone.
            let in_clay = |d: f64| (0..3000).map(|i| (f64::from(i) + 0.5) * 1e-3).map(|x| 1e-3 * spline(x - d)).sum::<f64>();
            let whole: f64 = nodes.map(|d| traction_share(d) * in_clay(d).min(1.0)).sum();
            assert!((whole - 1.0).abs() < 2e-3, "{whole} at {shift}");
        }
    }

    /// Fast clay keeps what adhesion cannot take; slow clay sticks; across the plane it is held only where it touches.
    #[test]
    fn sticking_clay_slides_beyond_its_strength() {
        let after = |speed, distance| stick(DVec3::new(speed, 0.0, 2.0), DVec3::X, DVec3::Z, distance, 0.3);
        assert!((after(5.0, 0.0) - DVec3::new(5.0 - 0.3 * 1.5, 0.0, 0.0)).length() < 1e-12);
        assert_eq!(after(1.1, 0.0), DVec3::X);
        assert_eq!(after(5.0, 1.5), DVec3::new(5.0, 0.0, 2.0));
        let elastic = stick(DVec3::Y * 9.0, DVec3::X, DVec3::Z, 1.0, f64::INFINITY);
        assert_eq!(elastic, DVec3::X);
    }

    /// A point that the blade jumps over by 3 cells keeps the side it was on.
    #[test]
    fn swept_point_takes_side_from_before() {
        let near = blade(0.0, 3.0).near(DVec3::new(1.6, 0.0, 0.0), DVec3::new(1.6, 0.0, 0.0));
        assert_eq!(near.takes(true), Some(1));
        assert!(near.distance < 0.0 && near.is_near);
    }

    #[test]
    fn point_beside_the_blade_takes_no_side() {
        let near = blade(0.0, 3.0).near(DVec3::new(1.6, 6.5, 0.0), DVec3::new(1.6, 6.5, 0.0));
        assert_eq!((near.takes(false), near.is_near), (None, false));
    }

    /// A point that was near already keeps what it has: no flip, whatever side it is on now.
    #[test]
    fn point_that_stays_near_takes_nothing() {
        let near = blade(0.0, 0.5).near(DVec3::new(0.25, 0.0, 0.0), DVec3::new(0.25, 0.0, 0.0));
        assert_eq!((near.takes(true), near.is_near), (None, true));
    }

    /// A point that was beside the rim, in front, and moves under the resting blade and behind its plane is new there: it takes the side it came from.
    #[test]
    fn point_that_comes_round_the_rim_is_new() {
        let near = blade(0.0, 0.0).near(DVec3::new(0.1, 6.1, 0.0), DVec3::new(-0.1, 5.9, 0.0));
        assert_eq!((near.takes(true), near.is_near), (Some(1), true));
    }
}
