//! The group of plugins without one of them.

use super::{check, cube, plugins, settle};
use bevy::app::PluginGroupBuilder;
use bevy::prelude::*;
use bevy_clay::plugin::{
    DiagnosticsPlugin, DrawPlugin, EnginePlugin, FollowPlugin, GpuPlugin, HapticPlugin, LookPlugin, OpsPlugin, RecoverPlugin,
    ReflectPlugin, ReportPlugin, ShowPlugin, SourcePlugin, StepPlugin,
};
use bevy_clay::prelude::*;
use libtest_mimic::Failed;

type Disable = fn(PluginGroupBuilder) -> PluginGroupBuilder;

/// All but the one that the others cannot do without.
const EACH: [(&str, Disable); 14] = [
    ("ReflectPlugin", |group| group.disable::<ReflectPlugin>()),
    ("SourcePlugin", |group| group.disable::<SourcePlugin>()),
    ("OpsPlugin", |group| group.disable::<OpsPlugin>()),
    ("EnginePlugin", |group| group.disable::<EnginePlugin>()),
    ("FollowPlugin", |group| group.disable::<FollowPlugin>()),
    ("GpuPlugin", |group| group.disable::<GpuPlugin>()),
    ("RecoverPlugin", |group| group.disable::<RecoverPlugin>()),
    ("HapticPlugin", |group| group.disable::<HapticPlugin>()),
    ("ReportPlugin", |group| group.disable::<ReportPlugin>()),
    ("StepPlugin", |group| group.disable::<StepPlugin>()),
    ("ShowPlugin", |group| group.disable::<ShowPlugin>()),
    ("DrawPlugin", |group| group.disable::<DrawPlugin>()),
    ("LookPlugin", |group| group.disable::<LookPlugin>()),
    ("DiagnosticsPlugin", |group| group.disable::<DiagnosticsPlugin>()),
];

/// An app goes on without any one plugin, with clay on either processor; what the others do, they do.
pub(super) fn any_plugin_may_be_disabled() -> Result<(), Failed> {
    for (name, disable) in EACH {
        let mut app = App::new();
        app.add_plugins((plugins(), disable(ClayPlugins.build())));
        let clays =
            [(EngineChoice::Native, SurfaceBackend::Cpu), (EngineChoice::Gpu, SurfaceBackend::Gpu)].map(|(engine, surface)| {
                let settings = ClaySettings { engine, surface, ..default() };
                app.world_mut().spawn((Clay::snapshot(cube()), settings, MaterialFile::new("none.clay.ron"))).id()
            });
        app.world_mut().spawn(SculptTool::default());
        let has = |world: &World, what: fn(EntityRef) -> bool| clays.iter().all(|clay| what(world.entity(*clay)));
        if !["EnginePlugin", "SourcePlugin"].contains(&name) {
            settle(&mut app, name, |world| has(world, |clay| clay.contains::<ClayEngine>()))?;
            if name != "ShowPlugin" {
                settle(&mut app, name, |world| has(world, |clay| clay.contains::<ClaySurface>() && clay.contains::<Mesh3d>()))?;
            }
        }
        settle(&mut app, name, |_| true)?;
        for _ in 0..10 {
            app.update();
        }
        let plain = clays.map(|clay| app.world().entity(clay).contains::<MeshMaterial3d<StandardMaterial>>());
        check(plain == [name == "LookPlugin"; 2], format!("without {name} the clays are plain: {plain:?}"))?;
        let engine = |i: usize| app.world().get::<ClayEngine>(clays[i]).map(ClayEngine::describe).unwrap_or_default();
        let is_on_device = engine(1).starts_with("GPU");
        let is_expected = !["EnginePlugin", "SourcePlugin", "GpuPlugin"].contains(&name);
        check(is_on_device == is_expected, format!("without {name} the second clay runs on `{}`", engine(1)))?;
        check(app.should_exit().is_none(), format!("without {name} the app ends"))?;
        app.world_mut().entity_mut(clays[0]).remove::<Clay>();
        app.world_mut().entity_mut(clays[1]).despawn();
        app.update();
    }
    Ok(())
}
