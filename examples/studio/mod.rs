//! What `headless` and `gallery` take their pictures with: an app that renders without a window, into files.
//!
//! An example takes it in by `#[path = "../studio/mod.rs"] mod studio;`.

use bevy::app::ScheduleRunnerPlugin;
use bevy::asset::RenderAssetUsages;
use bevy::log::LogPlugin;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use bevy_clay::scene::line::named;
use bevy_clay::sim::prelude::*;
use bevy_clay::surface::mesh::Mesh as Surface;
use std::path::PathBuf;
use std::time::Duration;

/// The exit of an app that leaves out the pictures that it has not taken so far.
pub(crate) const STOPPED: AppExit = AppExit::from_code(130);

/// Runs an app without a window until it exits, which `add` gives what takes the pictures `files`; says which
/// files there are then.
///
/// # Errors
/// No graphics adapter, or a picture that was not written, unless the app was [`STOPPED`].
pub(crate) fn take(files: Vec<PathBuf>, add: impl FnOnce(&mut App)) -> Result<Vec<PathBuf>, String> {
    if GpuMode::from_env()? == GpuMode::Off {
        return Err("CLAY_GPU=off, and pictures need a graphics adapter".into());
    }
    GpuDevice::headless().map_err(|e| e.to_string())?;
    // A picture of an earlier run must not pass for one of this.
    for file in files.iter().filter(|f| f.exists()) {
        std::fs::remove_file(file).map_err(|e| format!("{}: {e}", named(file)))?;
    }
    let window = WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
    let render = RenderPlugin { synchronous_pipeline_compilation: true, ..default() };
    let log = LogPlugin { filter: "error,bevy_clay=warn".into(), ..default() };
    let plugins = DefaultPlugins.set(window).set(render).set(log).disable::<WinitPlugin>();
    let mut app = App::new();
    app.add_plugins((plugins, ScheduleRunnerPlugin::run_loop(Duration::ZERO)));
    add(&mut app);
    if app.run() == STOPPED {
        return Ok(files.into_iter().filter(|file| file.exists()).collect());
    }
    match files.iter().find(|f| !f.exists()) {
        Some(missing) => Err(format!("{} was not written", named(missing))),
        None => Ok(files),
    }
}

/// The asset of a surface.
pub(crate) fn mesh(surface: &Surface) -> Mesh {
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, surface.positions.clone())
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, surface.normals.clone().unwrap_or_default())
        .with_inserted_indices(Indices::U32(surface.triangles.as_flattened().to_vec()))
}
