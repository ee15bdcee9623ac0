//! Clay in a Bevy app: Bevy's clock and entities go in, frame plans go to the engine, reports come out as messages.
//!
//! | file         | takes                               | makes                                          |
//! |--------------|-------------------------------------|------------------------------------------------|
//! | [`schedule`] | -                                   | [`ClaySystems`](schedule::ClaySystems), in run order |
//! | [`clay`]     | snapshots, clock, tool poses        | frame plans, [`ClayReport`](clay::ClayReport)  |
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_clay::prelude::*;
//!
//! fn spawn_clay(mut commands: Commands) -> Result {
//!     let scene = Scene::from_ron("(clay: [Box(size: (0.04, 0.04, 0.04))], cell_width: 0.004)")?;
//!     let snapshot = scene.build(std::path::Path::new("."))?.snapshot;
//!     commands.spawn((Clay::new(&snapshot)?, snapshot.material));
//!     Ok(())
//! }
//!
//! App::new().add_plugins((MinimalPlugins, ClayPlugins)).add_systems(Startup, spawn_clay).run();
//! ```

pub mod clay;
pub mod schedule;

use bevy::app::{PluginGroup, PluginGroupBuilder};

/// What most programs need.
pub mod prelude {
    pub use super::ClayPlugins;
    pub use super::clay::{Clay, ClayReport, SculptTool};
    pub use super::schedule::ClaySystems;
}

/// Everything the crate adds to a Bevy app. Needs Bevy's `TimePlugin`, which `MinimalPlugins` and `DefaultPlugins` hold.
#[derive(Clone, Copy, Debug, Default)]
pub struct ClayPlugins;

impl PluginGroup for ClayPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>().add(schedule::SchedulePlugin).add(clay::StepPlugin)
    }
}
