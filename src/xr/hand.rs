//! Hands: which side is which, and what a controller says.

use bevy::prelude::*;

/// A side of the body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Reflect)]
pub enum Side {
    /// The left hand.
    Left,
    /// The right hand.
    #[default]
    Right,
}

impl Side {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Left, Self::Right];

    /// The other one.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }

    /// OpenXR's path of it.
    pub(super) fn path(self) -> &'static str {
        match self {
            Self::Left => "/user/hand/left",
            Self::Right => "/user/hand/right",
        }
    }

    pub(super) fn index(self) -> usize {
        match self {
            Self::Left => 0,
            Self::Right => 1,
        }
    }
}

/// A hand by what it does; which side it is on, [`XrHands`] says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Reflect)]
pub enum XrHand {
    /// The one with the tool.
    #[default]
    Tool,
    /// The one that holds the work and the panel, and may have a tool too.
    Support,
}

/// Which hand is which; may change at any time.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq, Reflect)]
#[reflect(Resource)]
pub struct XrHands {
    /// The side of the tool hand: the right one if nothing else is said.
    pub tool: Side,
}

impl XrHands {
    /// The side of a hand.
    pub fn side(&self, hand: XrHand) -> Side {
        match hand {
            XrHand::Tool => self.tool,
            XrHand::Support => self.tool.other(),
        }
    }
}

/// What a controller says. Poses are in the world; none where it is not seen, or there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Controller {
    /// Of the hand that holds it.
    pub grip: Option<Isometry3d>,
    /// Its ray goes along -z.
    pub aim: Option<Isometry3d>,
    /// Of its tip, before a tool's own offset.
    pub tool: Option<Isometry3d>,
    /// How hard the trigger is pressed, from 0 to 1.
    pub trigger: f32,
    /// How hard the controller is held, from 0 to 1.
    pub squeeze: f32,
    /// Stick or track pad, from -1 to 1 each way.
    pub stick: Vec2,
    /// Whether the stick is pressed.
    pub stick_click: bool,
    /// Whether the menu button is pressed.
    pub menu: bool,
}

/// Both controllers as they are in this frame, read in
/// [`ClaySystems::Tool`](crate::plugin::schedule::ClaySystems::Tool). Without a session nothing is pressed
/// and nothing is seen.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub struct XrControllers {
    /// When they were there \[s\], by the runtime's clock.
    pub time: f64,
    pub(super) sides: [Controller; 2],
}

impl XrControllers {
    /// That of a side.
    pub fn get(&self, side: Side) -> &Controller {
        &self.sides[side.index()]
    }

    pub(super) fn get_mut(&mut self, side: Side) -> &mut Controller {
        &mut self.sides[side.index()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hands_change_sides_together() {
        for tool in Side::ALL {
            let hands = XrHands { tool };
            assert_eq!(hands.side(XrHand::Tool), tool);
            assert_eq!(hands.side(XrHand::Support), tool.other());
        }
    }
}
