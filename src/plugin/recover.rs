//! Errors of the graphics device that must not end the app: those that the clay makes, and the loss of the
//! device.
//!
//! Bevy quits on every such error unless the app has a handler of its own ([`RenderErrorHandler`]).
//! [`RecoverPlugin`] puts one before it: a fault of the clay's own work stops the clay's engine, and a lost
//! device is made anew, as the app's `RenderPlugin` made it. All else goes to the handler that was there. An
//! app that handles the loss of its device itself puts its handler in after `ClayPlugins`.

use super::gpu::Bridges;
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::error_handler::{ErrorType, RenderError, RenderErrorHandler, RenderErrorPolicy};
use bevy::render::settings::{RenderCreation, WgpuSettings};

/// Keeps the app alive when the clay's work on the graphics device fails or the device is lost. Disable it
/// where the app wants Bevy's own behaviour: `ClayPlugins.build().disable::<RecoverPlugin>()`.
#[derive(Clone, Copy, Debug, Default)]
pub struct RecoverPlugin;

/// What is asked where the clay has no say.
#[derive(Resource)]
struct Before {
    handler: RenderErrorHandler,
    /// Whether the app put a handler of its own there, after this plugin.
    is_own: bool,
    /// How to make a device anew; nothing where the app made it by hand.
    settings: Option<WgpuSettings>,
}

/// The handler of this plugin: of each function there may be several addresses.
const HANDLER: RenderErrorHandler = RenderErrorHandler(handle);

impl Plugin for RecoverPlugin {
    fn build(&self, app: &mut App) {
        let handler = app.world_mut().remove_resource::<RenderErrorHandler>().unwrap_or_default();
        app.insert_resource(Before { handler, is_own: false, settings: None }).insert_resource(HANDLER);
    }

    fn finish(&self, app: &mut App) {
        let settings = app.get_added_plugins::<RenderPlugin>().first().and_then(|plugin| match &plugin.render_creation {
            RenderCreation::Automatic(settings) => Some((**settings).clone()),
            RenderCreation::Manual(_) => None,
        });
        let present = app.world_mut().remove_resource::<RenderErrorHandler>();
        let own = present.filter(|present| !std::ptr::fn_addr_eq(present.0, HANDLER.0));
        if let Some(mut before) = app.world_mut().get_resource_mut::<Before>() {
            before.settings = settings;
            if let Some(handler) = own {
                (before.handler, before.is_own) = (handler, true);
            }
        }
        app.insert_resource(HANDLER);
    }
}

/// What to do about an error.
fn handle(error: &RenderError, main: &mut World, render: &mut World) -> RenderErrorPolicy {
    let is_lost = matches!(error.ty, ErrorType::DeviceLost);
    if !is_lost && is_of_clay(&error.description) {
        if let Some(bridges) = render.get_resource::<Bridges>() {
            bridges.fail(&error.description);
        }
        return RenderErrorPolicy::Ignore;
    }
    let Some(before) = main.remove_resource::<Before>() else { return RenderErrorPolicy::StopRendering };
    let policy = match &before.settings {
        Some(settings) if is_lost && !before.is_own => {
            warn!("the graphics device was lost; another one is made");
            RenderErrorPolicy::Recover(RenderCreation::Automatic(Box::new(settings.clone())))
        }
        _ => (before.handler.0)(error, main, render),
    };
    main.insert_resource(before);
    policy
}

/// Whether an error names something of the clay's: all its labels start so.
fn is_of_clay(description: &str) -> bool {
    description.contains("'clay") || description.contains("\"clay")
}
