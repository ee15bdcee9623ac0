//! Undo and redo by the support hand's stick.

use super::hand::{XrControllers, XrHand, XrHands};
use crate::plugin::clay::Clay;
use crate::plugin::events::{RedoClay, UndoClay};
use bevy::prelude::*;

/// A stick is pushed from here on, and back below.
const PUSHED: (f32, f32) = (0.7, 0.3);

/// Which way a stick is pushed: left, right, or neither.
fn pushed(stick: Vec2, was: i8) -> i8 {
    let limit = if was == 0 { PUSHED.0 } else { PUSHED.1 };
    // Up and down is for others.
    let is_sideways = stick.x.abs() > limit && stick.x.abs() > stick.y.abs();
    if is_sideways { if stick.x < 0.0 { -1 } else { 1 } } else { 0 }
}

/// Left takes a stroke back, right does it again; each push counts once.
pub(super) fn push(
    controllers: Res<XrControllers>,
    hands: Res<XrHands>,
    clays: Query<Entity, With<Clay>>,
    mut was: Local<i8>,
    mut commands: Commands,
) {
    let now = pushed(controllers.get(hands.side(XrHand::Support)).stick, *was);
    let is_new = now != std::mem::replace(&mut *was, now);
    for entity in clays.iter().filter(|_| is_new && now != 0) {
        if now < 0 {
            commands.trigger(UndoClay { entity });
        } else {
            commands.trigger(RedoClay { entity });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sticks_count_once_a_push() {
        let mut was = 0;
        let mut counted = vec![];
        for x in [0.0, -0.5, -0.8, -0.9, -0.5, -0.2, -0.8, 0.0, 0.9, 0.4] {
            let now = pushed(Vec2::new(x, 0.1), was);
            if now != was && now != 0 {
                counted.push(now);
            }
            was = now;
        }
        assert_eq!(counted, [-1, -1, 1]);
        assert_eq!(pushed(Vec2::new(0.75, 0.9), 0), 0, "up");
    }
}
