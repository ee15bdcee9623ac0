//! Errors of the graphics device that must not end the app: those that the clay makes, and the loss of the
//! device.
//!
//! Bevy quits on every such error unless the app has a handler of its own ([`RenderErrorHandler`]). While an
//! engine or a surface of clay is on the graphics device, and no longer, [`RecoverPlugin`] puts one in its
//! place:
//!
//! - An error that names an object of this crate (all their labels begin with `bevy_clay:`) stops the clay's
//!   work on the device, which goes on with the processor.
//! - A lost device is made anew, as the app's `RenderPlugin` made it. Where that was given a device by hand,
//!   the plugin cannot know how to make another: it says so in one line, and leaves the loss to the handler
//!   whose place it took. In a headset the device is OpenXR's: there that handler is the one of
//!   `xr::runtime::plugins`, which ends the session and lets the app go on.
//! - All else goes to that handler.
//!
//! An app that handles the loss of its device itself puts its handler in after `ClayPlugins`: then that
//! handler decides on losses too.

use super::draw::{self, Compiled, Drawn};
use super::engine::{ClayEngine, EngineStart};
use super::gpu::Bridges;
use crate::sim::gpu::label::LABEL;
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::error_handler::{ErrorType, RenderError, RenderErrorHandler, RenderErrorPolicy};
use bevy::render::settings::{RenderCreation, WgpuSettings};

/// Keeps the app alive when the clay's work on the graphics device fails or the device is lost. Disable it
/// where the app wants Bevy's own behaviour: `ClayPlugins.build().disable::<RecoverPlugin>()`. Without it
/// such an error ends the app, unless the app handles it.
#[derive(Clone, Copy, Debug, Default)]
pub struct RecoverPlugin;

/// Updates of the app after which what clay did last on the device can make no error any more.
const LINGER: u32 = 8;

/// Who is asked about an error.
#[derive(Resource)]
struct Guard {
    /// The handler that stood when the plugin was added, Bevy's own as a rule: it does not decide on losses.
    first: RenderErrorHandler,
    /// The handler in whose place the plugin's stands; nothing while that is not there.
    before: Option<RenderErrorHandler>,
    /// How to make a device anew; nothing where the app made it by hand.
    settings: Option<Box<WgpuSettings>>,
    /// Updates since clay was last on the device.
    idle: u32,
    /// Whether it was said that a device is not made anew.
    is_loss_told: bool,
}

/// The handler of this plugin: of each function there may be several addresses.
const HANDLER: RenderErrorHandler = RenderErrorHandler(handle);

fn is_same(a: &RenderErrorHandler, b: &RenderErrorHandler) -> bool {
    std::ptr::fn_addr_eq(a.0, b.0)
}

impl Plugin for RecoverPlugin {
    fn build(&self, app: &mut App) {
        // As `RenderPlugin` does, if it was added before.
        app.init_resource::<RenderErrorHandler>();
        let first = RenderErrorHandler(app.world().resource::<RenderErrorHandler>().0);
        app.insert_resource(Guard { first, before: None, settings: None, idle: 0, is_loss_told: false }).add_systems(Last, guard);
    }

    fn finish(&self, app: &mut App) {
        let settings = app.get_added_plugins::<RenderPlugin>().first().and_then(|plugin| match &plugin.render_creation {
            RenderCreation::Automatic(settings) => Some(settings.clone()),
            RenderCreation::Manual(_) => None,
        });
        app.world_mut().resource_mut::<Guard>().settings = settings;
    }
}

/// Puts the plugin's handler in while clay is on the device, and the app's own back afterwards.
fn guard(
    clays: Query<(Option<&ClayEngine>, Option<&EngineStart>, Has<Drawn>)>,
    compiled: Option<Res<Compiled>>,
    handler: Option<ResMut<RenderErrorHandler>>,
    mut guard: ResMut<Guard>,
) {
    let Some(mut handler) = handler else { return };
    let is_on_device = |(engine, start, is_drawn): (Option<&ClayEngine>, Option<&EngineStart>, bool)| {
        is_drawn || engine.is_some_and(|e| e.bridge.is_some()) || start.is_some_and(EngineStart::is_on_device)
    };
    let is_used = compiled.is_some_and(|compiled| compiled.is_under_way()) || clays.iter().any(is_on_device);
    guard.idle = if is_used { 0 } else { guard.idle.saturating_add(1) };
    let is_in = is_same(&handler, &HANDLER);
    if guard.idle < LINGER && (is_used || guard.before.is_some()) {
        if !is_in {
            guard.before = Some(std::mem::replace(&mut *handler, HANDLER));
        }
    } else if let Some(before) = guard.before.take()
        && is_in
    {
        *handler = before;
    }
}

/// Stops the clay's work on the device for this `reason`: it goes on with the processor.
pub(crate) fn give_up(render: &World, reason: &str) {
    if let Some(bridges) = render.get_resource::<Bridges>() {
        bridges.fail(reason);
    }
    draw::fail(render, reason);
}

/// What to do about an error.
fn handle(error: &RenderError, main: &mut World, render: &mut World) -> RenderErrorPolicy {
    let is_lost = matches!(error.ty, ErrorType::DeviceLost);
    if !is_lost && error.description.contains(LABEL) {
        give_up(render, &error.description);
        return RenderErrorPolicy::Ignore;
    }
    let Some(mut guard) = main.get_resource_mut::<Guard>() else { return RenderErrorPolicy::StopRendering };
    let before = RenderErrorHandler(guard.before.as_ref().unwrap_or(&guard.first).0);
    if is_lost && is_same(&before, &guard.first) {
        if let Some(settings) = guard.settings.clone() {
            warn!("the graphics device was lost; another one is made");
            return RenderErrorPolicy::Recover(RenderCreation::Automatic(settings));
        }
        // Asked again in every frame of an app that goes on without another, it says it once.
        if !std::mem::replace(&mut guard.is_loss_told, true) {
            error!(
                "the graphics device was lost and is not made anew: RenderPlugin was given it by hand, so the app's RenderErrorHandler has to give another"
            );
        }
    }
    (before.0)(error, main, render)
}
