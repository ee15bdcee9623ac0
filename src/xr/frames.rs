//! The frames that go to the headset, in the place of bevy_mod_openxr's own plugin for them, which panics
//! where a runtime goes away: here the session is over then, and the app goes on without a headset. So it is
//! where the graphics device is lost: it is the runtime's, and only a new session of a new process has
//! another.

use super::session::RuntimeLost;
use crate::plugin::recover;
use bevy::prelude::*;
use bevy::render::error_handler::{ErrorType, RenderError, RenderErrorHandler, RenderErrorPolicy};
use bevy::render::extract_resource::ExtractResourcePlugin;
use bevy::render::texture::ManualTextureViews;
use bevy::render::{Render, RenderApp};
use bevy_mod_openxr::init::should_run_frame_loop;
use bevy_mod_openxr::layer_builder::ProjectionLayer;
use bevy_mod_openxr::render::{
    add_texture_view, clean_views, end_frame, init_views, locate_views, update_cameras, update_views, update_views_render_world,
};
use bevy_mod_openxr::resources::{
    OxrCurrentSessionConfig, OxrFrameState, OxrFrameStream, OxrFrameWaiter, OxrInstance, OxrRenderLayers, OxrSessionStarted,
    OxrSwapchain, OxrSwapchainImages, OxrViews,
};
use bevy_mod_openxr::session::OxrSession;
use bevy_mod_xr::camera::{XrCamera, XrViewInit};
use bevy_mod_xr::session::{XrFirst, XrHandleEvents, XrPreDestroySession, XrRenderSystems, XrSessionCreated, XrState};
use bevy_mod_xr::spaces::XrPrimaryReferenceSpace;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Draws for the headset.
pub(super) struct FramesPlugin;

/// Whether the runtime is gone: both worlds have the same.
#[derive(Resource, Clone, Default)]
struct Gone(Arc<AtomicBool>);

impl Gone {
    fn is(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Notes that a call to the runtime failed.
    fn note(&self, call: &str, error: &dyn std::fmt::Display) {
        if !self.0.swap(true, Ordering::Relaxed) {
            error!("the OpenXR runtime does not go on ({call}: {error}); the app does, without a headset");
        }
    }
}

/// The handler of errors of the graphics device that stood before this plugin's.
#[derive(Resource)]
struct Before(RenderErrorHandler);

/// What the runtime made on a device that is lost would be freed twice if it were freed again.
fn leave_alone(world: &mut World) {
    std::mem::forget(world.remove_resource::<OxrSwapchain>());
    std::mem::forget(world.get_resource::<OxrSession>().cloned());
}

/// A device that is lost ends the session and not the app, whose clay goes on with the processor. What else
/// is wrong goes to the handler before.
fn handle(error: &RenderError, main: &mut World, render: &mut World) -> RenderErrorPolicy {
    if matches!(error.ty, ErrorType::DeviceLost) {
        // Asked in every frame from then on, it says it once.
        if let Some(gone) = main.get_resource::<Gone>().filter(|gone| !gone.is()).cloned() {
            recover::give_up(render, "the graphics device was lost");
            gone.note("graphics device", &"it was lost, and OpenXR gives no other");
            [main, render].into_iter().for_each(leave_alone);
        }
        return RenderErrorPolicy::StopRendering;
    }
    match main.get_resource::<Before>().map(|before| before.0.0) {
        Some(before) => before(error, main, render),
        None => RenderErrorPolicy::StopRendering,
    }
}

/// Whether the session has frames.
fn has_frames(gone: Res<Gone>, started: Option<Res<OxrSessionStarted>>, state: Option<Res<XrState>>) -> bool {
    !gone.is() && should_run_frame_loop(started, state)
}

impl Plugin for FramesPlugin {
    fn build(&self, app: &mut App) {
        if !app.world().contains_resource::<OxrInstance>() {
            return;
        }
        let gone = Gone::default();
        // As `RenderPlugin` does, if it was added before.
        app.init_resource::<RenderErrorHandler>();
        let before = std::mem::replace(&mut *app.world_mut().resource_mut::<RenderErrorHandler>(), RenderErrorHandler(handle));
        app.insert_resource(Before(before));
        app.add_plugins((
            ExtractResourcePlugin::<OxrFrameState>::default(),
            ExtractResourcePlugin::<OxrCurrentSessionConfig>::default(),
            ExtractResourcePlugin::<OxrSwapchainImages>::default(),
            ExtractResourcePlugin::<OxrViews>::default(),
        ))
        .insert_resource(gone.clone())
        .init_resource::<OxrViews>()
        .add_systems(XrPreDestroySession, clean_views)
        .add_systems(XrSessionCreated, init_views::<true>.in_set(XrViewInit).run_if(resource_exists::<OxrSession>))
        .add_systems(
            XrFirst,
            (
                (listen_for_life, close).chain().before(XrHandleEvents::Poll),
                (wait_frame, update_cameras).chain().run_if(has_frames).in_set(XrHandleEvents::FrameLoop),
            ),
        )
        .add_systems(
            PostUpdate,
            (locate_views, update_views)
                .chain()
                .before(TransformSystems::Propagate)
                .run_if(has_frames.and_then(resource_exists::<OxrFrameState>)),
        );
        let Some(render_app) = app.get_sub_app_mut(RenderApp) else { return };
        render_app
            .insert_resource(gone)
            .insert_resource(OxrRenderLayers(vec![Box::new(ProjectionLayer)]))
            .add_systems(XrPreDestroySession, clean_views)
            .add_systems(
                Render,
                (begin_frame, acquire_image, locate_views.run_if(has_frames), update_views_render_world, wait_image)
                    .chain()
                    .in_set(XrRenderSystems::PreRender)
                    .run_if(has_frames),
            )
            .add_systems(
                Render,
                (release_image, end_frame.run_if(has_frames)).chain().run_if(has_frames).in_set(XrRenderSystems::PostRender),
            );
    }
}

/// Asks the runtime something that costs little, before what expects an answer does.
fn listen_for_life(
    (gone, started): (Res<Gone>, Option<Res<OxrSessionStarted>>),
    (session, base): (Option<Res<OxrSession>>, Option<Res<XrPrimaryReferenceSpace>>),
    frame: Option<Res<OxrFrameState>>,
) {
    let (Some(session), Some(base), Some(frame)) = (session, base, frame) else { return };
    if gone.is() || !started.is_some_and(|started| started.0) {
        return;
    }
    let views = openxr::ViewConfigurationType::PRIMARY_STEREO;
    if let Err(error) = session.locate_views(views, frame.predicted_display_time, &base) {
        gone.note("locate_views", &error);
    }
}

/// Ends the session of a runtime that is gone.
fn close(gone: Res<Gone>, mut state: ResMut<XrState>, eyes: Query<Entity, With<XrCamera>>, mut commands: Commands) {
    if gone.is() && *state != XrState::Unavailable {
        *state = XrState::Unavailable;
        commands.insert_resource(OxrSessionStarted(false));
        eyes.iter().for_each(|eye| commands.entity(eye).despawn());
        commands.trigger(RuntimeLost);
    }
}

fn wait_frame(gone: Res<Gone>, mut waiter: ResMut<OxrFrameWaiter>, mut commands: Commands) {
    match waiter.wait() {
        Ok(state) => commands.insert_resource(OxrFrameState(state)),
        Err(error) => gone.note("wait_frame", &error),
    }
}

fn begin_frame(gone: Res<Gone>, mut stream: ResMut<OxrFrameStream>) {
    if let Err(error) = stream.begin() {
        gone.note("begin_frame", &error);
    }
}

/// Takes the next image of each eye.
fn acquire_image(
    (gone, state): (Res<Gone>, Res<OxrFrameState>),
    (images, config): (Res<OxrSwapchainImages>, Res<OxrCurrentSessionConfig>),
    mut swapchain: ResMut<OxrSwapchain>,
    mut views: ResMut<ManualTextureViews>,
) {
    if gone.is() || !state.should_render {
        return;
    }
    match swapchain.acquire_image() {
        Ok(index) => {
            for eye in 0..2 {
                add_texture_view(&mut views, &images[index as usize], &config, eye);
            }
        }
        Err(error) => gone.note("acquire_image", &error),
    }
}

fn wait_image((gone, state): (Res<Gone>, Res<OxrFrameState>), mut swapchain: ResMut<OxrSwapchain>) {
    if !gone.is()
        && state.should_render
        && let Err(error) = swapchain.wait_image(openxr::Duration::INFINITE)
    {
        gone.note("wait_image", &error);
    }
}

fn release_image((gone, state): (Res<Gone>, Res<OxrFrameState>), mut swapchain: ResMut<OxrSwapchain>) {
    if !gone.is()
        && state.should_render
        && let Err(error) = swapchain.release_image()
    {
        gone.note("release_image", &error);
    }
}
