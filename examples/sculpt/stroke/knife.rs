//! The knife's way through the clay: along the line that is drawn, away from the eye.

use crate::hand::Hand;
use crate::pointer::{Aim, Hit, ball};
use bevy::prelude::*;
use bevy_clay::prelude::*;
use std::collections::VecDeque;

/// How far the pointer goes before the knife knows its direction \[units of the tools\].
const HEADING_AFTER: f32 = 0.3;
/// Distance of the poses on the line \[units of the tools\].
const STEP: f32 = 0.1;

/// A knife's line.
#[derive(Clone, Debug)]
pub(super) struct Line {
    /// Where the pointer was, in the plane through the middle of the clay that faces the eye.
    last: Vec3,
    heading: Option<Vec3>,
    /// Poses that the knife has still to reach: it follows the line drawn, however far the hand is ahead.
    pub(super) ahead: VecDeque<Transform>,
}

impl Line {
    /// A line that begins under the pointer.
    pub(super) fn new(surface: &ClaySurface, aim: Aim) -> Self {
        Self { last: through(surface, aim), heading: None, ahead: VecDeque::new() }
    }

    /// Takes in where the pointer is now, over or beside the surface, which is `distance` \[m\] away. Handed
    /// back is the pose in which the knife is put down, once it knows its direction.
    pub(super) fn follow(&mut self, surface: &ClaySurface, aim: Aim, distance: f32, hand: &Hand) -> Option<Transform> {
        let at = through(surface, aim);
        let step = at - self.last;
        match &mut self.heading {
            Some(heading) if step.length() > STEP * hand.unit => {
                // The knife turns into a bend within its own size.
                *heading = (*heading * hand.unit + step).normalize_or(*heading);
                self.last = at;
                self.ahead.push_back(pose(hand, aim.ray, distance, *heading, at));
                None
            }
            None if step.length() > HEADING_AFTER * hand.unit => {
                let heading = *self.heading.insert(step.normalize());
                Some(pose(hand, aim.ray, distance, heading, self.last))
            }
            _ => None,
        }
    }
}

/// The knife over the clay, before it knows its direction.
pub(super) fn ready(surface: &ClaySurface, aim: Aim, distance: f32, hand: &Hand) -> Transform {
    pose(hand, aim.ray, distance, aim.right, through(surface, aim))
}

/// The knife: its plane holds the view ray and the heading. Deep as by habit it reaches through the clay;
/// else to its depth below the surface, which is `distance` \[m\] away.
fn pose(hand: &Hand, ray: Ray3d, distance: f32, heading: Vec3, middle: Vec3) -> Transform {
    let up = -*ray.direction;
    let along = (heading - up * heading.dot(up)).normalize_or(up.any_orthonormal_vector());
    let translation =
        if hand.depth >= 1.0 { middle } else { ray.origin + ray.direction * (distance + hand.depth_max() - hand.knife_reach()) };
    Transform { translation, rotation: Quat::from_mat3(&Mat3::from_cols(along, up, along.cross(up))), scale: Vec3::ONE }
}

/// Where the ray meets the plane through the middle of the clay that faces the eye.
fn through(surface: &ClaySurface, aim: Aim) -> Vec3 {
    let (middle, radius) = ball(surface).unwrap_or_default();
    on_plane(aim, middle).unwrap_or_else(|| aim.ray.get_point(radius))
}

/// A place beside the clay, where a cut may begin.
pub(super) fn beside(surface: &ClaySurface, aim: Aim) -> Option<Hit> {
    let (middle, radius) = ball(surface)?;
    let point = on_plane(aim, middle)?;
    let distance = aim.ray.origin.distance(point) - radius;
    (point.distance(middle) < 3.0 * radius).then_some(Hit { point, normal: -aim.forward, distance })
}

/// Where the ray meets the plane through `point` that faces the eye.
pub(super) fn on_plane(aim: Aim, point: Vec3) -> Option<Vec3> {
    let along = aim.ray.direction.dot(aim.forward);
    let distance = (point - aim.ray.origin).dot(aim.forward) / along;
    (along.abs() > 1e-3 && distance > 0.0).then(|| aim.ray.get_point(distance))
}
