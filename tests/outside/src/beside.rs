//! All names of the prelude beside those of Bevy with its default features and of avian: a name that two of
//! them have does not compile where it is used.
use avian3d::prelude::*;
use bevy::prelude::*;
use bevy_clay::prelude::*;

/// The types of the prelude.
type All = (
    (Clay, ClayChange, ClayChanged, ClayClock, ClayEngine, ClayEngineLost, ClayError, ClayExported, ClayGravity),
    (ClayHistory, ClayLaw, ClayMaterial, ClayMetrics, ClayPlugins, ClayReady, ClayReport, ClayScene, ClaySettings),
    (ClaySource, ClaySpace, ClayStatus, ClaySurface, ClaySystems, ClayTrouble, Contact, DropOffcuts, EngineChoice),
    (ExportClay, ExportFormat, ExportOptions, BodyFiles, FrameReport, ToolReport, Health, InertiaScaling, IntegratorChoice, StepAccuracy, Backlog),
    (MaterialFile, MeshQuality, NativeEngine, NoAutoMaterial, Planner, Decision, Pose, Preset, RedoClay, ResampleClay),
    (ResetClay, SchedulePlugin, SculptTool, Snapshot, SurfaceBackend, Tool, ToolForce, ToolShape, ToolStatus),
    (ToolTrail, TouchesOnly, UndoClay, Weld, Box<dyn Engine>, EngineError),
);

fn main() -> AppExit {
    info!("{} bytes", size_of::<All>());
    App::new()
        .add_plugins((DefaultPlugins, PhysicsPlugins::default(), ClayPlugins))
        .add_systems(Startup, |mut commands: Commands| {
            commands.spawn((Clay::ball(0.02), RigidBody::Static, Transform::default()));
        })
        .run()
}
