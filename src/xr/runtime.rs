//! The OpenXR runtime: whether there is one, and an app's plugins on it.

use super::frames::FramesPlugin;
use bevy::app::{PluginGroup, PluginGroupBuilder};
use bevy::render::pipelined_rendering::PipelinedRenderingPlugin;
use bevy_mod_openxr::add_xr_plugins;
use bevy_mod_openxr::exts::OxrExtensions;
use bevy_mod_openxr::features::handtracking::HandTrackingPlugin;
use bevy_mod_openxr::init::OxrInitPlugin;
use bevy_mod_openxr::render::OxrRenderPlugin;
use bevy_mod_openxr::types::{AppInfo, Version};

/// Why there is nothing to see through.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NoRuntime {
    /// OpenXR's loader is not installed.
    #[error("OpenXR's loader is not there: {0}")]
    NoLoader(String),
    /// No runtime is set up, or it does not run.
    #[error("no OpenXR runtime answers: {0}")]
    NoInstance(String),
    /// The runtime has no headset.
    #[error("the OpenXR runtime {runtime} has no headset: {error}")]
    NoHeadset {
        /// Its name.
        runtime: String,
        /// Its own words.
        error: String,
    },
}

/// Asks for a runtime with a headset, and what it is called.
///
/// # Errors
/// There is none.
pub fn find() -> Result<String, NoRuntime> {
    #[cfg(windows)]
    let entry = openxr::Entry::linked();
    #[cfg(not(windows))]
    // SAFETY: a loader of this name is what every OpenXR program loads.
    let entry = unsafe { openxr::Entry::load() }.map_err(|error| NoRuntime::NoLoader(error.to_string()))?;
    let info = openxr::ApplicationInfo {
        application_name: "bevy_clay",
        application_version: 1,
        engine_name: "Bevy",
        engine_version: Version::BEVY.to_u32(),
        api_version: openxr::Version::new(1, 0, 34),
    };
    let none = |error: openxr::sys::Result| NoRuntime::NoInstance(error.to_string());
    let instance = entry.create_instance(&info, &openxr::ExtensionSet::default(), &[]).map_err(none)?;
    let runtime = instance.properties().map_err(none)?.runtime_name;
    match instance.system(openxr::FormFactor::HEAD_MOUNTED_DISPLAY) {
        Ok(_) => Ok(runtime),
        Err(error) => Err(NoRuntime::NoHeadset { runtime, error: error.to_string() }),
    }
}

/// An app's plugins, `DefaultPlugins` as a rule, drawing into a headset: those of `bevy_mod_openxr` with the
/// extensions that sculpting uses, and without pipelined rendering, whose extra frame a hand feels. Where
/// there is no runtime the app draws as it would without.
///
/// The graphics device is the runtime's: what the app asked for in `RenderPlugin` is not heard, and a device
/// that is lost is not made anew (see [`RecoverPlugin`](crate::plugin::RecoverPlugin)).
pub fn plugins<G: PluginGroup>(group: G) -> PluginGroupBuilder {
    let mut exts = OxrExtensions::default();
    let wanted = exts.raw_mut();
    wanted.ext_hand_interaction = true;
    wanted.logitech_mx_ink_stylus_interaction = true;
    let app_info = AppInfo { name: "bevy_clay".into(), version: Version(0, 1, 0) };
    let mut group = group.build();
    if group.contains::<PipelinedRenderingPlugin>() {
        group = group.disable::<PipelinedRenderingPlugin>();
    }
    let group = add_xr_plugins(group).set(OxrInitPlugin { app_info, exts, ..OxrInitPlugin::default() });
    // Of bare hands their pinch is taken, not their joints.
    let group = group.disable::<HandTrackingPlugin>();
    group.disable::<OxrRenderPlugin>().add_after::<OxrRenderPlugin>(FramesPlugin)
}
