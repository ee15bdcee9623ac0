//! When the systems of hands run.

use bevy::prelude::*;

/// The stages of hands, within [`ClaySystems::Tool`](crate::plugin::schedule::ClaySystems::Tool): systems
/// that need the controllers of this frame come after the first, those that move what hands hold come after
/// the second.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum XrSystems {
    /// [`XrControllers`](super::hand::XrControllers) are written.
    Read,
    /// Tools, work and strokes follow them.
    Hold,
}
