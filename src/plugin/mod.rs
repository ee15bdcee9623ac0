//! Clay in a Bevy app: Bevy's clock and entities go in, frame plans go to the engine, reports and meshes come
//! out.
//!
//! | file            | takes                         | makes                                             |
//! |-----------------|-------------------------------|---------------------------------------------------|
//! | [`schedule`]    | -                             | [`ClaySystems`], in run order                     |
//! | [`clay`]        | what an app gives and gets    | [`Clay`], its settings, status and reports        |
//! | [`engine`]      | snapshots, settings           | [`ClayEngine`], started away from the main thread |
//! | `gpu`           | GPU engines                   | their passes in the app's render graph            |
//! | [`follow`]      | clay files                    | [`ClayMaterial`], when they change                |
//! | [`recover`]     | errors of the graphics device | an app that goes on                               |
//! | `report`        | frames that have ended        | [`ClayReport`], [`ClayStatus`]                    |
//! | [`tool`]        | [`SculptTool`]                | ways, swept                                       |
//! | `step`        | clock, ways, material         | frame plans                                       |
//! | [`show`]        | surface particles             | the mesh, made away from the main thread          |
//! | `draw`          | particles on the device       | the mesh, made there                              |
//! | [`diagnostics`] | status                        | Bevy diagnostics under `clay/`                    |
//! | `held`          | the plugin's own systems      | how long they hold the main thread                |
//! | `reflect`       | the solver's types            | their reflection                                  |
//!
//! [`ClaySystems`]: schedule::ClaySystems
//! [`Clay`]: clay::Clay
//! [`ClayEngine`]: engine::ClayEngine
//! [`ClayMaterial`]: crate::sim::material::ClayMaterial
//! [`ClayReport`]: clay::ClayReport
//! [`ClayStatus`]: clay::ClayStatus
//! [`SculptTool`]: tool::SculptTool
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_clay::prelude::*;
//!
//! fn spawn_clay(mut commands: Commands) -> Result {
//!     let scene = ClayScene::from_ron("(clay: [Box(size: (0.04, 0.04, 0.04))], cell_width: 0.004)")?;
//!     commands.spawn(Clay::new(scene.build(std::path::Path::new("."))?.snapshot));
//!     Ok(())
//! }
//!
//! App::new().add_plugins((DefaultPlugins, ClayPlugins)).add_systems(Startup, spawn_clay).run();
//! ```

mod bridge;
pub mod clay;
pub mod diagnostics;
pub mod draw;
pub mod engine;
pub mod follow;
mod gpu;
mod held;
mod pace;
mod plans;
pub mod recover;
mod reflect;
mod report;
pub mod schedule;
pub mod show;
mod step;
pub mod tool;

use bevy::app::{PluginGroup, PluginGroupBuilder};

/// What most programs need.
pub mod prelude {
    pub use super::ClayPlugins;
    pub use super::clay::{Clay, ClayReport, ClaySettings, ClayStatus, EngineChoice, MeshQuality, PassTimes, SurfaceBackend};
    pub use super::engine::ClayEngine;
    pub use super::follow::MaterialFile;
    pub use super::schedule::ClaySystems;
    pub use super::show::ClaySurface;
    pub use super::tool::SculptTool;
}

/// Everything the crate adds to a Bevy app. Needs Bevy's `TimePlugin` and `TaskPoolPlugin`, which
/// `MinimalPlugins` and `DefaultPlugins` hold; shows meshes where the app has them, with standard materials
/// where it has those.
#[derive(Clone, Copy, Debug, Default)]
pub struct ClayPlugins;

impl PluginGroup for ClayPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>()
            .add(schedule::SchedulePlugin)
            .add(reflect::ReflectPlugin)
            .add(engine::EnginePlugin)
            .add(follow::FollowPlugin)
            .add(gpu::GpuPlugin)
            .add(recover::RecoverPlugin)
            .add(report::ReportPlugin)
            .add(step::StepPlugin)
            .add(show::ShowPlugin)
            .add(draw::DrawPlugin)
            .add(diagnostics::DiagnosticsPlugin)
    }
}
