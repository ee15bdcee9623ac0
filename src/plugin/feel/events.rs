//! What an app is told of a tool in an arm's hand: entity events, of the tool.

use crate::haptics::device::fault::Fault;
use bevy::prelude::*;

/// The tool in the hand has come to the clay, or has left it.
#[derive(EntityEvent, Clone, Copy, Debug)]
pub struct HapticContact {
    /// The tool.
    pub entity: Entity,
    /// The clay that is felt.
    pub clay: Entity,
    /// Whether it has come.
    pub has_begun: bool,
}

/// The blade in the hand has begun to cut.
#[derive(EntityEvent, Clone, Copy, Debug)]
pub struct HapticCut {
    /// The tool.
    pub entity: Entity,
    /// The clay.
    pub clay: Entity,
}

/// Something is wrong with the arm, or no more. Whatever it is, there is no force meanwhile that the hand did
/// not ask for, and the app goes on.
#[derive(EntityEvent, Clone, Debug)]
pub struct HapticFault {
    /// The tool.
    pub entity: Entity,
    /// What a running device tells; none where there is no device to tell.
    pub fault: Option<Fault>,
    /// Whether it has begun.
    pub has_begun: bool,
    /// What it means and what helps, in the device's words where it has some.
    pub message: String,
}

/// A device has taken up the hand's loop.
#[derive(EntityEvent, Clone, Debug)]
pub struct HapticReady {
    /// The tool.
    pub entity: Entity,
    /// The device's name.
    pub device: String,
    /// Whether it stands in for one that is away.
    pub is_stand_in: bool,
}
