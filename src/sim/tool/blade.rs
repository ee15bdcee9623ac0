//! The blade's side test: which side of a moving blade a point is on, and whether the blade swept over it.
//!
//! A point takes its side when it comes near the blade anew (within the band, with its foot inside the blade)
//! or when the blade swept over it within the substep; the side is the one it was on before, or, coming from
//! beside the blade, the one that it came to without going through the blade. It keeps the side while it is
//! near and after the blade has left. Sides found from the present distance alone leak 4-97 % of the
//! particles, these 0 % (a test sweeps the blade at up to 3 cells per substep). The band is as wide as
//! splines reach across the plane: within 1.5 cells at every angle, up to 3 % of the momentum of clay that
//! leaves a blade got through in a quarter of a cell.

use super::super::material::ClayMaterial;
use super::contact::CONTACT_OFFSET;
use super::outline::{Foot, Outline};
use super::path::{Motion, Pose};
use glam::{DMat3, DQuat, DVec3};

/// How far a quadratic spline reaches along each axis \[cells\]: half the width of the band about a blade
/// along the grid in which nodes are two-sided and particles take a side. Across one that stands askew
/// splines reach further, by the sum of its normal's components.
pub const BAND: f64 = 1.5;

/// Least way of a wire in a substep \[cells\] that it parts clay along: rounding leaves 1e-14, and a tenth
/// of a micrometre a second is 1e-9 in cells of 2 mm.
const WIRE_WAY_MIN: f64 = 1e-9;

/// How long the strip is that a wire leaves behind, over its way in the substep, as clay may come as far
/// against it; and what is added \[cells\]. One of a cell parted clay up to that beyond where a wire turned.
const WIRE_STRIP: [f64; 2] = [2.0, 0.05];

/// Where a particle found behind a blade is put: this far in front of it \[cells\].
pub const SET_BACK: f64 = 1e-3;

/// Least reach \[cells\] that [`traction_share`] divides by: where hardly any clay reaches the node the share
/// grows beyond all bounds.
pub(crate) const TRACTION_REACH_MIN: f64 = 1e-3;

/// Acceleration of a node at `distance` \[cells\] before a plane, positive in the clay, by a traction t of
/// the plane on the clay, over `t / (rho_s dx)`.
///
/// The traction is shared by the nodes as clay of one stress shares its own: `N(d) / S(d)`, N the quadratic
/// spline at the plane (it sums to 1), S the part of the spline, and so of the node's full mass, that is on
/// the clay's side. 0 from [`BAND`] on.
pub fn traction_share(distance: f64) -> f64 {
    let (d, reach) = (distance, BAND - distance.abs());
    let (at_plane, in_clay) = match d {
        _ if reach <= 0.0 => (0.0, 1.0),
        _ if d > 0.5 => (0.5 * reach * reach, 1.0 - reach.powi(3) / 6.0),
        _ if d < -0.5 => (3.0, reach.max(TRACTION_REACH_MIN)),
        _ => (0.75 - d * d, 0.5 + 0.75 * d - d.powi(3) / 3.0),
    };
    at_plane / in_clay
}

/// Velocity that a sticking blade leaves of `velocity` at a node `distance` \[cells\] before it, whose
/// surface moves at `surface`, the normal towards the clay.
///
/// Across the plane the node is held up to [`CONTACT_OFFSET`]; along it the blade takes it along with a
/// traction of at most the clay's present shear strength.
pub fn stick(velocity: DVec3, surface: DVec3, normal: DVec3, distance: f64, adhesion: Adhesion) -> DVec3 {
    let relative = velocity - surface;
    let leaving = relative.dot(normal);
    let slide = relative - leaving * normal;
    let speed = slide.length();
    let most = adhesion.at(speed) * traction_share(distance);
    let kept = if speed > most { 1.0 - most / speed } else { 0.0 };
    let parting = if distance <= CONTACT_OFFSET { 0.0 } else { leaving };
    surface + parting * normal + kept * slide
}

/// What a sticking blade holds clay by: tractions tau as the velocities `tau h / (rho_s dx)` that they give
/// to clay one cell deep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adhesion {
    /// Of the shear strength of clay at a tool.
    pub strength: f64,
    /// Of what its viscosity adds where it slides by 1, the cell along the blade being what shears.
    pub viscous: f64,
    /// The power n of the speed with which that goes.
    pub flow_index: f64,
}

impl Adhesion {
    /// That of fresh clay, where a traction of 1 Pa gives `velocity` and a slide of 1 is a shear `rate` [1/s]
    /// in a cell.
    pub fn new(material: &ClayMaterial, velocity: f64, rate: f64) -> Self {
        let (strength, viscous) = (material.shear_strength_at_tool(), material.viscous_shear_stress(rate));
        Self { strength: strength * velocity, viscous: viscous * velocity, flow_index: material.flow_index }
    }

    /// The same of clay that has lost this share of its strength.
    #[must_use]
    pub fn weakened(self, lost: f64) -> Self {
        Self { strength: self.strength * (1.0 - lost).max(0.0), ..self }
    }

    /// The most at a slide of `speed`.
    fn at(&self, speed: f64) -> f64 {
        let viscous = if self.viscous > 0.0 { self.viscous * speed.powf(self.flow_index) } else { 0.0 };
        // The strength of elastic clay is infinite.
        self.strength.min(f64::MAX) + viscous
    }
}

/// A blade without thickness, or the middle of a plate, in motion over one substep. Lengths in metres or
/// cells, as the caller likes, but all the same.
#[derive(Clone, Copy, Debug)]
pub struct Blade {
    /// Its shape; a wire's is the strip that it leaves behind.
    pub(super) outline: Outline,
    /// The half width of the band about a blade along the grid.
    pub(super) reach: f64,
    /// The motion of the substep; a wire's is that of its strip.
    pub(super) motion: Motion,
    /// Where a wire that moves stands along Y in the frame of its strip.
    pub(super) wire_at: Option<f64>,
    /// Whether it holds the clay on either side off it: a wire does not.
    pub holds: bool,
}

/// What the blade means to a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// Signed distance to the blade at the substep's end, positive in front.
    pub distance: f64,
    /// Unit normal of the blade's front there.
    pub normal: DVec3,
    /// Whether the point is within the band there, its foot inside the blade.
    pub is_near: bool,
    /// Whether the blade passed over the point in the substep, however far beyond it ends.
    pub is_swept: bool,
    /// Whether the point came near anew or was swept over from outside the band.
    pub is_new: bool,
    /// Whether the blade holds the point off, being near or having swept over it.
    pub is_held: bool,
    /// The side of the blade (+1 or -1) where the point came from; of one from beside the blade, the side
    /// that it came to round the rim.
    pub side_before: i8,
}

impl Near {
    /// Whether a point of `side` has to be put back onto the blade's surface: it is at the blade and on its
    /// wrong side.
    #[must_use]
    pub fn is_behind(&self, side: i8) -> bool {
        self.is_held && self.distance * f64::from(side) < 0.0
    }

    /// The side to take now, if any, for a point that has a side already or not.
    #[must_use]
    pub fn takes(&self, has_side: bool) -> Option<i8> {
        let is_at_blade = self.is_near || self.is_swept;
        (self.is_new || (is_at_blade && !has_side)).then_some(self.side_before)
    }
}

impl Blade {
    /// The blade of `outline` in `motion`; `cell` is the width of a cell in the caller's unit.
    pub(crate) fn new(outline: Outline, motion: Motion, cell: f64) -> Self {
        match outline {
            Outline::Wire { half_length } => Self::wire(half_length, motion, cell),
            Outline::Rectangle { .. } | Outline::Triangle { .. } | Outline::Strip { .. } | Outline::Plate { .. } => {
                Self { outline, reach: BAND * cell, motion, wire_at: None, holds: true }
            }
        }
    }

    /// The strip that a wire leaves behind in the substep: along the wire and the way it goes, its front
    /// where the wire's is. A wire that stands, or moves along itself, leaves none.
    fn wire(half_length: f64, motion: Motion, cell: f64) -> Self {
        let axis = motion.end.rotation * DVec3::X;
        let way = (motion.end.position - motion.start.position).reject_from(axis);
        // Passed over by the strip, every point beside the cut has its turn.
        let half_height = 0.5 * (WIRE_STRIP[0] * way.length() + WIRE_STRIP[1] * cell).min(cell);
        let mut strip = Self {
            outline: Outline::Rectangle { half_width: half_length, half_height },
            reach: BAND * cell,
            motion,
            wire_at: None,
            holds: false,
        };
        let Some(ahead) = way.try_normalize().filter(|_| way.length() > WIRE_WAY_MIN * cell) else {
            strip.outline = Outline::Wire { half_length };
            return strip;
        };
        let front = axis.cross(ahead);
        let sign = if front.dot(motion.end.rotation * DVec3::Z) < 0.0 { -1.0 } else { 1.0 };
        let rotation = DQuat::from_mat3(&DMat3::from_cols(axis, ahead * sign, front * sign));
        let behind = |pose: Pose| Pose { position: pose.position - ahead * half_height, rotation };
        strip.wire_at = Some(half_height * sign);
        strip.motion = Motion { start: behind(motion.start), end: behind(motion.end), ..motion };
        strip
    }

    /// Half the width of the band about it, at most.
    pub(crate) fn band(&self) -> f64 {
        match self.outline {
            // Its normals are many.
            Outline::Strip { .. } => 3f64.sqrt() * self.reach,
            Outline::Rectangle { .. } | Outline::Triangle { .. } | Outline::Plate { .. } | Outline::Wire { .. } => {
                self.band_along(self.outline.foot(DVec3::ZERO).normal)
            }
        }
    }

    /// Half the width of the band where its front's normal is `normal`, in its own frame.
    fn band_along(&self, normal: DVec3) -> f64 {
        self.reach * (self.motion.end.rotation * normal).abs().element_sum()
    }

    /// Whether a point with this foot is within the band.
    fn is_near(&self, foot: &Foot) -> bool {
        foot.is_inside && foot.distance.abs() <= self.band_along(foot.normal)
    }

    /// Its outline and motion: those of its strip for a wire that moves.
    pub(crate) fn strip(&self) -> (Outline, Motion) {
        (self.outline, self.motion)
    }

    /// Signed distance to the blade at the end of the substep and the unit normal of its front there, if
    /// `point` is in the band with its foot inside the blade, and the blade holds clay off.
    pub fn within_band(&self, point: DVec3) -> Option<(f64, DVec3)> {
        let foot = self.outline.foot(self.motion.end.to_local(point));
        (self.holds && self.is_near(&foot)).then(|| (foot.distance, self.motion.end.rotation * foot.normal))
    }

    /// The blade as a particle of `side` (+1, -1) has it before it at the step's end, standing at `at` then
    /// and at `start` when the step began: its distance, negative behind the blade, and the unit normal
    /// towards the side. None beside the blade, of what came behind it round its rim, and of blades that hold
    /// nothing off.
    pub(crate) fn flank(&self, side: i8, start: DVec3, at: DVec3) -> Option<(f64, DVec3)> {
        let (sign, end) = (f64::from(side), self.motion.end);
        let local = end.to_local(at);
        let foot = self.outline.foot(local);
        let distance = sign * foot.distance;
        let is_behind = distance < 0.0;
        let went_through = || {
            let start = end.to_local(start);
            let from = self.outline.foot(start);
            sign * from.distance >= 0.0 && (from.is_inside || self.outline.is_crossed(start, local))
        };
        let is_before = self.holds && foot.is_inside && (!is_behind || went_through());
        is_before.then(|| (distance, end.rotation * foot.normal * sign))
    }

    /// Distance of `point` on `side` of the blade as it stands at the step's start, wherever that ends.
    pub(crate) fn distance_before(&self, side: i8, point: DVec3) -> f64 {
        self.distance_of(side, self.motion.start.to_local(point))
    }

    /// The same of a point in the blade's own frame.
    pub(crate) fn distance_of(&self, side: i8, local: DVec3) -> f64 {
        f64::from(side) * self.outline.foot(local).distance
    }

    /// How far `point` on `side` is at least from the [flank](Self::flank) at the step's end, if it stays
    /// where it is; by what it moves until then it may come nearer. Nothing is known of bent blades, whose
    /// flanks are many.
    pub(crate) fn distance_least(&self, side: i8, point: DVec3) -> f64 {
        match self.outline {
            _ if !self.holds => f64::INFINITY,
            Outline::Strip { .. } => f64::NEG_INFINITY,
            Outline::Rectangle { .. } | Outline::Triangle { .. } | Outline::Plate { .. } | Outline::Wire { .. } => {
                self.distance_of(side, self.motion.end.to_local(point))
            }
        }
    }

    /// A point of the blade's own frame brought to `distance` on `side` of it, along the normal.
    pub(crate) fn at_distance(&self, side: i8, local: DVec3, distance: f64) -> DVec3 {
        let foot = self.outline.foot(local);
        local + foot.normal * (f64::from(side) * distance - foot.distance)
    }

    /// What the substep means to a particle that stands at `point`, having come from `previous` in the
    /// substep before, while the blade moves from start to end. Where it came from counts: clay that flows
    /// round the rim and under the blade by its own motion comes near anew.
    pub fn near(&self, previous: DVec3, point: DVec3) -> Near {
        let (before, after) = (self.motion.start.to_local(previous), self.motion.end.to_local(point));
        let (from, to) = (self.outline.foot(before), self.outline.foot(after));
        let (was_near, is_near) = (self.is_near(&from), self.is_near(&to));
        // In the blade's frame, where coordinates are linear in time up to the substep's small turn.
        let is_swept = self.holds && self.outline.is_crossed(before, after);
        let is_new = self.holds && !was_near && (is_near || is_swept);
        let is_behind = if is_new && !from.is_inside {
            let went_through = self.is_crossed_from_beside(previous, before, point, after);
            (to.distance < 0.0) != went_through
        } else {
            from.distance < 0.0
        };
        Near {
            distance: to.distance,
            normal: self.motion.end.rotation * to.normal,
            is_near,
            is_swept,
            is_new,
            is_held: self.holds && (is_near || is_swept),
            side_before: if is_behind { -1 } else { 1 },
        }
    }

    /// The same in an implicit step: its side is the one where it stands as the step begins. The step before
    /// was long, and clay that left the blade in it seems to come from behind if it is set against where the
    /// blade stands since.
    pub(crate) fn near_implicitly(&self, previous: DVec3, point: DVec3) -> Near {
        let is_behind = self.distance_before(1, point) < 0.0;
        Near { side_before: if is_behind { -1 } else { 1 }, ..self.near(previous, point) }
    }

    /// Whether a particle from beside the rim came to where it is through the blade. Its way is that of the
    /// substep before, when the blade was a step short of its start, and then the blade's of this one. Set
    /// against the start alone, clay that the blade pushes ahead of itself and past its rim would seem to
    /// come from behind.
    fn is_crossed_from_beside(&self, previous: DVec3, before: DVec3, point: DVec3, after: DVec3) -> bool {
        // As if the blade had always gone as it goes now: its own frame is linear in time up to the substep's
        // small turn.
        let was = 2.0 * before - self.motion.end.to_local(previous);
        let now = self.motion.start.to_local(point);
        self.outline.is_crossed(was, now) != self.outline.is_crossed(now, after)
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::spline::spline;
    use super::super::profile::Profile;
    use super::*;
    use glam::{DQuat, DVec2};
    use std::f64::consts::FRAC_PI_4;

    fn blade(from: f64, to: f64) -> Blade {
        let pose = |x| Pose { position: DVec3::new(x, 0.0, 0.0), rotation: DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2) };
        let motion = Motion { start: pose(from), end: pose(to), duration: 1.0 };
        Blade::new(Outline::Rectangle { half_width: 6.0, half_height: 6.0 }, motion, 1.0)
    }

    /// Clay that fills the space before the plane and slides along it: its nodes get the traction's whole
    /// impulse, wherever between them the plane is.
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

    /// Fast clay keeps what adhesion cannot take; slow clay sticks; across the plane it is held only where it
    /// touches.
    #[test]
    fn sticking_clay_slides_beyond_its_strength() {
        let of = |strength| Adhesion { strength, viscous: 0.0, flow_index: 1.0 };
        let after = |speed, distance| stick(DVec3::new(speed, 0.0, 2.0), DVec3::X, DVec3::Z, distance, of(0.3));
        assert!((after(5.0, 0.0) - DVec3::new(5.0 - 0.3 * 1.5, 0.0, 0.0)).length() < 1e-12);
        assert_eq!(after(1.1, 0.0), DVec3::X);
        assert_eq!(after(5.0, 1.5), DVec3::new(5.0, 0.0, 2.0));
        let elastic = stick(DVec3::Y * 9.0, DVec3::X, DVec3::Z, 1.0, of(f64::INFINITY));
        assert_eq!(elastic, DVec3::X);
        // Half worked off, and a viscous tenth of the root of its speed.
        let viscous = Adhesion { viscous: 0.1, flow_index: 0.5, ..of(0.3).weakened(0.5) };
        let slow = stick(DVec3::new(5.0, 0.0, 0.0), DVec3::X, DVec3::Z, 0.0, viscous);
        assert!((slow.x - (5.0 - (0.15 + 0.2) * 1.5)).abs() < 1e-12, "{slow}");
        assert_eq!(of(f64::INFINITY).weakened(0.0).strength, f64::INFINITY);
        assert_eq!(of(0.3).weakened(-1.0).strength, 0.6);
    }

    /// At every angle the band is as wide as the node furthest from the plane that a particle in it reaches.
    #[test]
    fn band_is_what_splines_reach() {
        let profile = Profile::new(&[DVec2::new(-9.0, 0.0), DVec2::new(9.0, 0.0)]).expect("a profile");
        let flat = Outline::Rectangle { half_width: 9.0, half_height: 9.0 };
        let corner = DVec3::new(1.5, 1.5, 1.5);
        for outline in
            [flat, Outline::Plate { half_size: DVec3::new(9.0, 9.0, 0.4) }, Outline::Strip { profile, half_height: 9.0 }]
        {
            for [turn, tilt] in [[0.0, 0.0], [FRAC_PI_4, 0.0], [0.3, -0.7], [2.5, 0.62]] {
                let rotation = DQuat::from_rotation_y(turn) * DQuat::from_rotation_x(tilt);
                let pose = Pose { rotation, ..Pose::default() };
                let blade = Blade::new(outline, Motion { start: pose, end: pose, duration: 1.0 }, 1.0);
                let front = rotation * DVec3::Z;
                // The corner of the spline that is furthest before the plane.
                let reach = front.dot(corner * front.signum());
                let is_near =
                    |distance: f64| [1.0, -1.0].map(|side| blade.near(front * distance * side, front * distance * side).is_near);
                assert_eq!((is_near(reach - 1e-9), is_near(reach + 1e-9)), ([true; 2], [false; 2]), "{outline:?} {turn} {tilt}");
                assert!(blade.band() > reach - 1e-9);
                assert!(
                    blade.within_band(front * (reach - 1e-9)).is_some() && blade.within_band(front * (reach + 1e-9)).is_none()
                );
            }
        }
    }

    /// Clay that leaves a blade which has been put down has the side where it stands, however long the step
    /// before was.
    #[test]
    fn leaving_point_has_the_side_where_it_stands() {
        let (blade, now) = (blade(0.0, 0.0), DVec3::X * 0.2);
        let before = now - DVec3::X * 0.25;
        assert_eq!(blade.near(before, now).takes(false), Some(-1), "as if the blade had been there");
        assert_eq!(blade.near_implicitly(before, now).takes(false), Some(1));
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

    /// Clay that comes from beside the rim of a resting blade, from in front, is behind it if it went round,
    /// and belongs in front if it went through.
    #[test]
    fn point_from_beside_the_rim_is_new() {
        let from = DVec3::new(0.1, 6.1, 0.0);
        let takes = |y| blade(0.0, 0.0).near(from, DVec3::new(-0.1, y, 0.0)).takes(true);
        assert_eq!((takes(5.95), takes(5.85)), (Some(-1), Some(1)));
    }

    /// Clay that a blade pushes ahead of itself at its own speed slides past the rim to under it: it never
    /// was behind.
    #[test]
    fn point_pushed_ahead_comes_from_ahead() {
        let near = blade(0.0, 0.25).near(DVec3::new(-0.15, 6.1, 0.0), DVec3::new(0.1, 5.9, 0.0));
        assert_eq!((near.takes(true), near.is_behind(1)), (Some(1), true));
    }

    fn motion(from: DVec3, to: DVec3) -> Motion {
        let pose = |position| Pose { position, ..Pose::default() };
        Motion { start: pose(from), end: pose(to), duration: 1.0 }
    }

    /// A gouge: inside it is in front, its lip is its end, and what its bottom sweeps over is put back along
    /// the bottom's normal.
    #[test]
    fn bent_blade_has_the_sides_of_its_bend() {
        let profile = Profile::new(&[DVec2::new(-2.0, 2.0), DVec2::new(-2.0, 0.0), DVec2::new(2.0, 0.0), DVec2::new(2.0, 2.0)]);
        let outline = Outline::Strip { profile: profile.expect("a profile"), half_height: 1.0 };
        let gouge = Blade::new(outline, motion(DVec3::ZERO, DVec3::Z * 0.1), 1.0);
        let near = |at| gouge.near(at, at);
        assert_eq!(near(DVec3::new(0.0, 0.0, 0.5)).takes(false), Some(1));
        assert_eq!(near(DVec3::new(0.0, 0.0, -0.5)).takes(false), Some(-1));
        assert_eq!(near(DVec3::new(2.5, 0.0, 1.0)).takes(false), Some(-1));
        assert_eq!(near(DVec3::new(0.0, 1.5, 0.5)).takes(false), None, "beyond its height");
        assert_eq!(near(DVec3::new(2.2, 0.0, 2.5)).takes(false), None, "beyond its lip");
        let swept = near(DVec3::new(0.5, 0.0, 0.05));
        assert!(swept.is_swept && swept.is_behind(1) && (swept.distance + 0.05).abs() < 1e-12 && swept.normal == DVec3::Z);
    }

    /// Clay beside a pointed blade's tip is not near it.
    #[test]
    fn pointed_blade_ends_at_its_flanks() {
        let blade = Blade::new(Outline::Triangle { half_width: 2.0, half_height: 2.0 }, motion(DVec3::ZERO, DVec3::ZERO), 1.0);
        let is_near = |x, y| blade.near(DVec3::new(x, y, 0.3), DVec3::new(x, y, 0.3)).is_near;
        assert!(is_near(1.4, 1.0) && !is_near(1.6, 1.0) && is_near(0.1, -1.7) && !is_near(0.3, -1.7));
    }

    /// A wire tags what it passes, on the side where the point is, whichever way the wire goes; it tags
    /// nothing twice, holds nothing off and, standing, does nothing.
    #[test]
    fn wire_parts_what_it_passes() {
        for way in [DVec3::Y, DVec3::NEG_Y, DVec3::new(0.0, 0.8, 0.6)] {
            let wire = Blade::new(Outline::Wire { half_length: 3.0 }, motion(DVec3::ZERO, way * 0.1), 1.0);
            let front = DVec3::X.cross(way) * if DVec3::X.cross(way).z < 0.0 { -1.0 } else { 1.0 };
            for (along, depth, side) in [(0.0, 0.5, 1), (2.9, -1.4, -1)] {
                let at = DVec3::X * along - way * 0.05 + front * depth;
                let near = wire.near(at, at);
                assert_eq!((near.takes(false), near.takes(true)), (Some(side), None), "{way} {along}");
                assert_eq!(wire.within_band(at), None);
            }
            // Ahead it has not been yet, and where it came from it may have turned.
            let takes = |at: DVec3| wire.near(at, at).takes(false);
            assert_eq!([0.15, -0.2].map(|along| takes(way * along + front * 0.2)), [None; 2], "{way}");
        }
        // Along itself it goes with what rounding leaves across.
        for way in [DVec3::ZERO, DVec3::X * 0.1, DVec3::new(0.1, 1e-15, -1e-15)] {
            let still = Blade::new(Outline::Wire { half_length: 3.0 }, motion(DVec3::ZERO, way), 1.0);
            assert_eq!(still.near(DVec3::ZERO, DVec3::ZERO).takes(false), None, "{way}");
        }
    }
}
