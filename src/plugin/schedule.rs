//! When the clay's systems run.

use super::held::HeldTime;
use bevy::prelude::*;

/// The stages of clay in [`Update`], in run order, one after the other. Put systems of an app into them or
/// order against them.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ClaySystems {
    /// Engines that are ready take over, reports of frames that have ended come in:
    /// [`ClayReport`](super::clay::ClayReport) is written here.
    Report,
    /// The app moves its tools: systems that write a [`SculptTool`](super::tool::SculptTool) or its transform
    /// belong here. Empty otherwise.
    Tool,
    /// The next frame is planned from the clock and the tools and handed to the engine.
    Step,
    /// The newest surface that is ready is shown, and [`ClayStatus`](super::clay::ClayStatus) written.
    Show,
}

/// Chains [`ClaySystems`].
pub(super) struct SchedulePlugin;

impl Plugin for SchedulePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<HeldTime>()
            .configure_sets(Update, (ClaySystems::Report, ClaySystems::Tool, ClaySystems::Step, ClaySystems::Show).chain());
    }
}
