//! When the clay's systems run.

use super::held::{HeldTime, end_frame};
use bevy::ecs::schedule::{InternedScheduleLabel, ScheduleLabel};
use bevy::prelude::*;

/// The stages of clay, in run order, one after the other. Put systems of an app into them or order against
/// them. The first three are in the schedule of [`SchedulePlugin`], the last one in [`Update`].
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ClaySystems {
    /// Engines that are ready take over, reports of frames that have ended come in:
    /// [`ClayReport`](super::clay::ClayReport) and [`ToolForce`](super::tool::ToolForce) are written here.
    Report,
    /// The app moves its tools: systems that write a [`SculptTool`](super::tool::SculptTool), its transform
    /// or its [`ToolTrail`](super::tool::ToolTrail) belong here. Empty otherwise.
    Tool,
    /// The next frame is planned from the clock and the tools and handed to the engine.
    Step,
    /// The newest surface that is ready is shown, and [`ClayStatus`](super::status::ClayStatus) and
    /// [`ClayMetrics`](super::status::ClayMetrics) are written.
    Show,
}

/// Chains [`ClaySystems`], in [`Update`] if nothing else is said: `ClayPlugins.set(SchedulePlugin::new(
/// FixedUpdate))` runs the clay at a fixed rate. The other plugins of the group take the schedule from this
/// one, and cannot do without it: it measures how long they hold the main thread.
#[derive(Clone, Copy, Debug)]
pub struct SchedulePlugin {
    schedule: InternedScheduleLabel,
}

impl SchedulePlugin {
    /// Clay that follows the clock of `schedule`.
    pub fn new(schedule: impl ScheduleLabel) -> Self {
        Self { schedule: schedule.intern() }
    }
}

impl Default for SchedulePlugin {
    fn default() -> Self {
        Self::new(Update)
    }
}

/// The schedule that was chosen.
#[derive(Resource)]
struct Chosen(InternedScheduleLabel);

/// The schedule that the clay steps in.
pub(super) fn schedule(app: &App) -> InternedScheduleLabel {
    app.world().get_resource::<Chosen>().map_or_else(|| Update.intern(), |chosen| chosen.0)
}

impl Plugin for SchedulePlugin {
    fn build(&self, app: &mut App) {
        use ClaySystems::{Report, Show, Step, Tool};
        app.init_resource::<HeldTime>()
            .insert_resource(Chosen(self.schedule))
            .configure_sets(self.schedule, (Report, Tool, Step).chain())
            .configure_sets(Update, Show.after(Step))
            .add_systems(Last, end_frame);
    }
}
