//! Clay in a Bevy app: Bevy's clock and entities go in, frame plans go to the engine, reports and meshes come
//! out.
//!
//! | file            | takes                         | makes                                             |
//! |-----------------|-------------------------------|---------------------------------------------------|
//! | [`schedule`]    | -                             | [`ClaySystems`], in run order                     |
//! | [`space`]       | an entity's transform         | [`ClaySpace`], between it and the clay's frame    |
//! | [`clock`]       | the schedule's clock          | [`ClayClock`], the clay's own, and gravity        |
//! | [`status`]      | reports                       | [`ClayStatus`], [`ClayMetrics`], [`ClayError`]    |
//! | [`clay`]        | what an app gives and gets    | [`Clay`], its settings and reports                |
//! | [`source`]      | shapes, meshes, files         | [`ClaySource`], what clay starts from             |
//! | `base`          | sources                       | the snapshot that engines start from              |
//! | [`engine`]      | snapshots, settings           | [`ClayEngine`], started away from the main thread |
//! | [`events`]      | what an app asks              | what it is told                                   |
//! | [`ops`]         | questions, states             | the clay reset, resampled, undone, exported       |
//! | [`undo`]        | strokes                       | [`ClayHistory`], the clay as it stood after each  |
//! | `gpu`           | GPU engines                   | their passes in the app's render graph            |
//! | [`follow`]      | clay files                    | [`ClayMaterial`], when they change                |
//! | [`record`]      | engines                       | a run on file, [`ClayRecording`]                  |
//! | [`recover`]     | errors of the graphics device | an app that goes on                               |
//! | `report`        | frames that have ended        | [`ClayReport`], [`ToolForce`], [`ClayStatus`]     |
//! | [`tool`]        | [`SculptTool`]                | ways, swept                                       |
//! | `step`        | clock, ways, material         | frame plans                                       |
//! | [`feel`]        | a haptic arm, a hand's samples | ways of its tool, models, [`HapticSession`]     |
//! | `run`           | plans' orders, time           | frames, submitted and polled                      |
//! | [`show`]        | surface particles             | the mesh, made away from the main thread          |
//! | `draw`          | particles on the device       | the mesh, made there                              |
//! | [`gizmos`]      | tools, forces, surface particles | lines over them, for those who look for what is
//! wrong |
//! | [`look`]        | a standard material           | one that looks like clay                          |
//! | [`software`]    | cameras of windows            | fewer pixels, where a processor draws them        |
//! | [`diagnostics`] | status                        | Bevy diagnostics under `clay/`                    |
//! | [`material`]    | clay without a material       | one of the plugin's                               |
//! | `entity`        | what is shown                 | components of the entity, put and taken away      |
//! | `held`          | the plugin's own systems      | how long they hold the main thread                |
//! | `reflect`       | the solver's types            | their reflection                                  |
//!
//! [`ClaySystems`]: schedule::ClaySystems
//! [`Clay`]: clay::Clay
//! [`ClayEngine`]: engine::ClayEngine
//! [`ClayMaterial`]: crate::sim::material::ClayMaterial
//! [`ClayReport`]: clay::ClayReport
//! [`ClayStatus`]: status::ClayStatus
//! [`ClayMetrics`]: status::ClayMetrics
//! [`ClayError`]: status::ClayError
//! [`ClaySource`]: source::ClaySource
//! [`ClaySpace`]: space::ClaySpace
//! [`ClayClock`]: clock::ClayClock
//! [`ToolForce`]: tool::ToolForce
//! [`ClayHistory`]: undo::ClayHistory
//! [`SculptTool`]: tool::SculptTool
//! [`HapticSession`]: feel::HapticSession
//! [`ClayRecording`]: record::ClayRecording
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_clay::prelude::*;
//!
//! fn spawn_clay(mut commands: Commands) {
//!     commands.spawn(Clay::block(Vec3::new(0.06, 0.03, 0.06)));
//! }
//!
//! App::new().add_plugins((DefaultPlugins, ClayPlugins)).add_systems(Startup, spawn_clay).run();
//! ```

mod base;
mod bridge;
pub mod clay;
pub mod clock;
pub mod diagnostics;
pub mod draw;
pub mod engine;
mod entity;
pub mod events;
pub mod feel;
pub mod follow;
pub mod gizmos;
mod gpu;
mod held;
pub mod look;
pub mod material;
pub mod ops;
mod pace;
mod plans;
pub mod record;
pub mod recover;
mod reflect;
mod report;
mod run;
pub mod schedule;
pub mod show;
pub mod software;
pub mod source;
pub mod space;
pub mod status;
mod step;
pub mod tool;
pub mod undo;

pub use base::SourcePlugin;
pub use diagnostics::DiagnosticsPlugin;
pub use draw::DrawPlugin;
pub use engine::EnginePlugin;
pub use feel::HapticPlugin;
pub use follow::FollowPlugin;
pub use gpu::GpuPlugin;
pub use look::LookPlugin;
pub use ops::OpsPlugin;
pub use recover::RecoverPlugin;
pub use reflect::ReflectPlugin;
pub use report::ReportPlugin;
pub use schedule::SchedulePlugin;
pub use show::ShowPlugin;
pub use step::StepPlugin;

use bevy::app::{PluginGroup, PluginGroupBuilder};

/// What most programs need.
pub mod prelude {
    pub use super::ClayPlugins;
    pub use super::clay::{Clay, ClayReport, ClaySettings, EngineChoice, MeshQuality, SurfaceBackend};
    pub use super::clock::{ClayClock, ClayGravity};
    pub use super::engine::ClayEngine;
    pub use super::events::{
        ClayChange, ClayChanged, ClayEngineLost, ClayExported, ClayReady, ClayTrouble, DropOffcuts, ExportClay, RedoClay,
        ResampleClay, ResetClay, UndoClay,
    };
    pub use super::feel::events::{HapticContact, HapticCut, HapticFault, HapticReady};
    pub use super::feel::session::{HapticPhase, HapticSession};
    pub use super::feel::settings::{ArmChoice, HapticSettings, SimulatedHand};
    pub use super::follow::MaterialFile;
    pub use super::gizmos::{ClayGizmos, ClayGizmosPlugin};
    pub use super::look::{ClayLook, ClayLookMaterial};
    pub use super::material::NoAutoMaterial;
    pub use super::record::ClayRecording;
    pub use super::schedule::{ClaySystems, SchedulePlugin};
    pub use super::show::ClaySurface;
    pub use super::software::{FullDrawing, PlainLook, ScreenCamera, SoftwareDrawing, SoftwareDrawingPlugin};
    pub use super::source::ClaySource;
    pub use super::space::ClaySpace;
    pub use super::status::{ClayError, ClayMetrics, ClayStatus};
    pub use super::tool::{SculptTool, ToolForce, ToolStatus, ToolTrail, TouchesOnly};
    pub use super::undo::ClayHistory;
}

/// Everything the crate adds to a Bevy app. Needs Bevy's `TimePlugin` and `TaskPoolPlugin`, which
/// `MinimalPlugins` and `DefaultPlugins` hold; shows meshes where the app has them, in a material that looks
/// like clay where it has standard materials.
///
/// Each plugin of the group may be disabled, `ClayPlugins.build().disable::<RecoverPlugin>()`, and says what
/// goes missing with it; only [`SchedulePlugin`] has to stay.
///
/// Removing [`Clay`](clay::Clay) takes away all that they put on its entity, but for what is the app's to
/// write: [`ClaySettings`](clay::ClaySettings), [`ClayMaterial`](crate::sim::material::ClayMaterial),
/// [`Transform`](bevy::prelude::Transform) and [`Visibility`](bevy::prelude::Visibility) stay.
///
/// What they change in an app beside the entities with clay: [`DrawPlugin`] asks for the usage `STORAGE` on
/// the buffers of Bevy's mesh allocator, and [`RecoverPlugin`] stands before the app's
/// [`RenderErrorHandler`](bevy::render::error_handler::RenderErrorHandler) while clay is on the graphics
/// device.
#[derive(Clone, Copy, Debug, Default)]
pub struct ClayPlugins;

impl PluginGroup for ClayPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>()
            .add(SchedulePlugin::default())
            .add(ReflectPlugin)
            .add(SourcePlugin)
            .add(EnginePlugin)
            .add(FollowPlugin)
            .add(GpuPlugin)
            .add(RecoverPlugin)
            .add(ReportPlugin)
            .add(OpsPlugin)
            .add(HapticPlugin)
            .add(StepPlugin)
            .add(ShowPlugin)
            .add(DrawPlugin)
            .add(LookPlugin)
            .add(DiagnosticsPlugin)
    }
}
