//! The work in hands: one moves it, two scale it.

use super::hand::{Controller, XrControllers, XrHand, XrHands};
use super::tool::HeldBy;
use bevy::prelude::*;

/// What hands move and scale: put on the [`Clay`](crate::plugin::clay::Clay), or on the parent of all that
/// stands together. The tracking root, which the head and the hands hang from, never moves: a scaled head
/// would see with other eyes.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Component, Clone, Debug, Default, PartialEq)]
#[require(Transform, Visibility)]
pub struct WorkRoot;

/// How much larger the work may be than it is.
pub const SCALES: std::ops::RangeInclusive<f32> = 0.1..=10.0;
/// Hands nearer together than this \[m\] neither scale nor turn.
const APART: f32 = 0.02;
/// A hand is closed from here on, and open again below.
const CLOSED: (f32, f32) = (0.6, 0.4);

/// The hands that hold, and the work as they took hold of it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Hold {
    work: Transform,
    hands: [Option<Isometry3d>; 2],
}

/// The turn about the vertical of a rotation.
fn yaw(rotation: Quat) -> Quat {
    let about = Quat::from_xyzw(0.0, rotation.y, 0.0, rotation.w);
    if about.length_squared() > 1e-12 { about.normalize() } else { Quat::IDENTITY }
}

/// The work in one hand that went from `then` to `now`; upright: turned about the vertical alone.
fn carried(work: Transform, then: Isometry3d, now: Isometry3d, is_upright: bool) -> Transform {
    let turn = now.rotation * then.rotation.inverse();
    let turn = if is_upright { yaw(turn) } else { turn };
    let [from, to] = [then, now].map(|pose| Vec3::from(pose.translation));
    Transform {
        translation: to + turn * (work.translation - from),
        rotation: (turn * work.rotation).normalize(),
        scale: work.scale,
    }
}

/// The work between two hands that went from `then` to `now`: the points that they hold stay in them, as far
/// as a scale within [`SCALES`] and, upright, a turn about the vertical can have it.
fn stretched(work: Transform, then: [Vec3; 2], now: [Vec3; 2], is_upright: bool) -> Transform {
    let [from, to] = [then, now].map(|[a, b]| (a + b) / 2.0);
    let [span_then, span_now] = [then, now].map(|[a, b]| b - a);
    let is_apart = span_then.length() > APART && span_now.length() > APART;
    let factor = if is_apart { span_now.length() / span_then.length() } else { 1.0 };
    let scale = (work.scale.x * factor).clamp(*SCALES.start(), *SCALES.end());
    let factor = scale / work.scale.x;
    let flat = |span: Vec3| if is_upright { span.with_y(0.0) } else { span };
    let turn = match (flat(span_then).try_normalize(), flat(span_now).try_normalize()) {
        (Some(a), Some(b)) if is_apart && flat(span_then).length().min(flat(span_now).length()) > APART => {
            let turn = Quat::from_rotation_arc(a, b);
            if is_upright { yaw(turn) } else { turn }
        }
        _ => Quat::IDENTITY,
    };
    Transform {
        translation: to + turn * (work.translation - from) * factor,
        rotation: (turn * work.rotation).normalize(),
        scale: Vec3::splat(scale),
    }
}

impl Hold {
    /// The work now, with the hands at `now`.
    fn work(&self, now: [Option<Isometry3d>; 2], is_upright: bool) -> Transform {
        let moved = match (self.hands, now) {
            ([Some(a), Some(b)], [Some(c), Some(d)]) => {
                let at = |pose: Isometry3d| Vec3::from(pose.translation);
                stretched(self.work, [at(a), at(b)], [at(c), at(d)], is_upright)
            }
            ([Some(then), None], [Some(now), None]) | ([None, Some(then)], [None, Some(now)]) => {
                carried(self.work, then, now, is_upright)
            }
            _ => self.work,
        };
        if moved.is_finite() { moved } else { self.work }
    }
}

/// How hands move the work.
#[derive(Resource, Clone, Copy, Debug, PartialEq, Eq, Reflect)]
#[reflect(Resource)]
pub struct GrabSettings {
    /// Whether what stands stays upright: hands turn it about the vertical alone.
    pub is_upright: bool,
}

impl Default for GrabSettings {
    fn default() -> Self {
        Self { is_upright: true }
    }
}

/// Which hands are closed, and what they hold.
#[derive(Default)]
pub(super) struct Grips {
    closed: [bool; 2],
    holds: Vec<(Entity, Hold)>,
}

impl Grips {
    /// Where the hands that hold the work are: the support hand, and the tool hand if that is closed as well.
    /// A support hand without a tool holds by its trigger too, for controllers that have no grip.
    fn holding(&mut self, controllers: &XrControllers, hands: XrHands, support_has_tool: bool) -> [Option<Isometry3d>; 2] {
        let mut grips = [None; 2];
        for (i, hand) in [XrHand::Support, XrHand::Tool].into_iter().enumerate() {
            let Controller { grip, trigger, squeeze, .. } = controllers.get(hands.side(hand));
            let by_trigger = if hand == XrHand::Support && !support_has_tool { *trigger } else { 0.0 };
            let limit = if self.closed[i] { CLOSED.1 } else { CLOSED.0 };
            self.closed[i] = grip.is_some() && squeeze.max(by_trigger) > limit;
            grips[i] = grip.filter(|_| self.closed[i]);
        }
        if grips[0].is_none() {
            grips[1] = None;
        }
        grips
    }
}

/// Moves the work with the hands that hold it.
pub(super) fn grab(
    (controllers, hands, settings): (Res<XrControllers>, Res<XrHands>, Res<GrabSettings>),
    tools: Query<&HeldBy>,
    mut works: Query<(Entity, &mut Transform), With<WorkRoot>>,
    mut grips: Local<Grips>,
) {
    let support_has_tool = tools.iter().any(|held| held.hand == XrHand::Support && !held.is_away);
    let now = grips.holding(&controllers, *hands, support_has_tool);
    let is_held = |hold: &Hold| [0, 1].map(|i| hold.hands[i].is_some()) == [0, 1].map(|i| now[i].is_some());
    grips.holds.retain(|(work, hold)| now[0].is_some() && is_held(hold) && works.contains(*work));
    if now[0].is_none() {
        return;
    }
    for (entity, mut work) in &mut works {
        match grips.holds.iter().find(|(held, _)| *held == entity) {
            Some((_, hold)) => {
                work.set_if_neq(hold.work(now, settings.is_upright));
            }
            None => grips.holds.push((entity, Hold { work: *work, hands: now })),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::hand::Side;
    use super::*;

    fn work() -> Transform {
        Transform::from_xyz(0.1, 0.9, -0.5).with_rotation(Quat::from_rotation_y(0.3)).with_scale(Vec3::splat(2.0))
    }

    fn near(a: Vec3, b: Vec3) -> bool {
        a.distance(b) < 1e-5
    }

    /// What a hand holds stays in it, and upright work stays upright whatever the hand does.
    #[test]
    fn one_hand_carries_upright_work() {
        let then = Isometry3d::new(Vec3::new(0.2, 1.0, -0.4), Quat::from_euler(EulerRot::YXZ, 0.1, 0.2, -0.3));
        let now = Isometry3d::new(Vec3::new(-0.1, 1.2, -0.3), Quat::from_euler(EulerRot::YXZ, 1.1, -0.9, 0.5));
        for is_upright in [true, false] {
            let moved = carried(work(), then, now, is_upright);
            let held = work().compute_affine().inverse().transform_point3(then.translation.into());
            assert!(near(moved.transform_point(held), now.translation.into()));
            assert_eq!(moved.scale, work().scale);
            assert_eq!(near(moved.rotation * Vec3::Y, Vec3::Y), is_upright);
        }
    }

    #[test]
    fn two_hands_keep_what_they_hold() {
        let then = [Vec3::new(-0.1, 1.0, -0.4), Vec3::new(0.1, 1.0, -0.4)];
        let now = [Vec3::new(0.3, 1.1, -0.5), Vec3::new(0.3, 1.1, -0.2)];
        let moved = stretched(work(), then, now, true);
        assert!((moved.scale.x / work().scale.x - 1.5).abs() < 1e-5);
        let held = then.map(|point| work().compute_affine().inverse().transform_point3(point));
        assert!(near(moved.transform_point(held[0]), now[0]) && near(moved.transform_point(held[1]), now[1]));
        assert!(near(moved.rotation * Vec3::Y, Vec3::Y));
    }

    /// Never out of bounds, never negative, never upside down: not for hands that cross or meet either.
    #[test]
    fn scales_stay_within_bounds() {
        let then = [Vec3::new(-0.1, 1.0, -0.4), Vec3::new(0.1, 1.0, -0.4)];
        let ends = [
            [Vec3::new(-9.0, 1.0, -0.4), Vec3::new(9.0, 1.0, -0.4)],
            [Vec3::new(-0.011, 1.0, -0.4), Vec3::new(0.011, 1.0, -0.4)],
            [Vec3::new(0.0, 1.0, -0.4), Vec3::new(0.0, 1.0, -0.4)],
            [then[1], then[0]],
            [Vec3::new(0.0, 0.5, -0.4), Vec3::new(0.0, 1.5, -0.4)],
        ];
        for is_upright in [true, false] {
            for start in [0.1, 1.0, 10.0] {
                for now in ends {
                    let moved = stretched(work().with_scale(Vec3::splat(start)), then, now, is_upright);
                    assert!(SCALES.contains(&moved.scale.x) && moved.is_finite(), "{moved:?}");
                    assert!(moved.scale.y == moved.scale.x && moved.scale.z == moved.scale.x);
                    assert!(!is_upright || near(moved.rotation * Vec3::Y, Vec3::Y), "{moved:?}");
                }
            }
        }
        assert!((stretched(work(), then, ends[0], true).scale.x - 10.0).abs() < 1e-5);
        assert_eq!(stretched(work(), then, ends[2], true).scale, work().scale, "hands that meet");
    }

    /// Hands of no place leave the work where it is.
    #[test]
    fn senseless_hands_move_nothing() {
        let hold = Hold { work: work(), hands: [Some(Isometry3d::IDENTITY), None] };
        assert_eq!(hold.work([Some(Isometry3d::from_translation(Vec3::NAN)), None], true), work());
        assert_eq!(hold.work([None, None], true), work());
    }

    /// The support hand alone moves, the tool hand alone does not, and both scale; the tool hand may close
    /// before the other one.
    #[test]
    fn grips_belong_to_the_support_hand() {
        let mut world = World::new();
        world.init_resource::<XrHands>();
        world.init_resource::<GrabSettings>();
        world.init_resource::<XrControllers>();
        let entity = world.spawn((WorkRoot, work())).id();
        let mut frame = |left: (f32, f32), right: (f32, f32)| {
            for (side, (x, squeeze)) in [(Side::Left, left), (Side::Right, right)] {
                let grip = Some(Isometry3d::from_xyz(x, 1.0, -0.4));
                *world.resource_mut::<XrControllers>().get_mut(side) = Controller { grip, squeeze, ..default() };
            }
            world.run_system_cached(grab).expect("runs");
            *world.get::<Transform>(entity).expect("the work")
        };
        frame((-0.1, 0.0), (0.1, 1.0));
        assert_eq!(frame((-0.1, 0.0), (0.3, 1.0)), work(), "the tool hand alone");
        frame((-0.1, 1.0), (0.3, 0.0));
        assert!(near(frame((0.0, 1.0), (0.3, 0.0)).translation, work().translation + Vec3::X * 0.1));
        frame((0.0, 1.0), (0.2, 1.0));
        assert!((frame((0.0, 1.0), (0.3, 1.0)).scale.x - 3.0).abs() < 1e-5);
        assert!((frame((0.0, 0.0), (0.6, 0.0)).scale.x - 3.0).abs() < 1e-5, "let go");
    }
}
