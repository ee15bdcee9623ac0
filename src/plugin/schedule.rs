//! When the clay's systems run.

use bevy::prelude::*;

/// The stages of clay in [`Update`], in run order, one after the other. Put systems of an app into them or order against them.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ClaySystems {
    /// Reports of frames that have ended come in: [`ClayReport`](super::clay::ClayReport) is written here.
    Report,
    /// The app moves its tools: systems that write [`SculptTool::pose`](super::clay::SculptTool::pose) belong here. Empty otherwise.
    Tool,
    /// The next frame is planned from the clock and the tools and handed to the engine.
    Step,
}

/// Chains [`ClaySystems`].
pub(super) struct SchedulePlugin;

impl Plugin for SchedulePlugin {
    fn build(&self, app: &mut App) {
        app.configure_sets(Update, (ClaySystems::Report, ClaySystems::Tool, ClaySystems::Step).chain());
    }
}
