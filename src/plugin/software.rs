//! Drawing that a processor can do: for apps that find no graphics device but a software adapter, where every
//! pixel takes the time of the cores that the clay is worked on with.
//!
//! With [`SoftwareDrawingPlugin`] the cameras of a window are drawn without shadows and without multisampling
//! into a picture of fewer pixels, which is stretched over the window; they are drawn anew only when
//! something in their view has changed, for no more than a share of the time, and once in all pixels when
//! nothing has for a while. Nothing of it shows in the main world: cameras keep their
//! [`RenderTarget`](bevy::camera::RenderTarget), size and [`Msaa`], lights keep their shadows, and
//! [`Camera::viewport_to_world`] takes the pointer's place in the window as ever. On a hardware adapter
//! nothing is changed.
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_clay::prelude::*;
//!
//! App::new().add_plugins((DefaultPlugins, ClayPlugins, SoftwareDrawingPlugin)).run();
//! ```
//!
//! - The stretched picture is shown by a camera of its own for each window, a [`ScreenCamera`], which comes
//!   right after the window's last camera. Panels and texts belong to it: they are drawn in the window's own
//!   pixels, kept, and laid over the picture; while a view changes they are drawn less often. It
//!   comes up in the first frame; an observer of `On<Add, ScreenCamera>` learns of it.
//! - Cameras with [`FullDrawing`] stay as they are. Of those that target the same window, the ones that come
//!   after the others are seen.
//! - Cameras that draw into images of the app are left alone, but for the shadows.
//! - [`PlainLook`] is a material that a processor shades fast, for apps that want it.

mod budget;
mod meter;
mod plain;
mod render;
mod screens;
mod settings;
mod stretch;

pub use plain::PlainLook;
pub use settings::{FullDrawing, ScreenCamera, SoftwareDrawing, SoftwareDrawingUse};

use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::extract_resource::ExtractResourcePlugin;

use screens::Screens;

/// Draws the app's windows so that a processor can; see the [module](self). Takes effect where the app
/// renders, by default on a software adapter alone: see [`SoftwareDrawing::when`].
#[derive(Clone, Copy, Debug, Default)]
pub struct SoftwareDrawingPlugin;

impl Plugin for SoftwareDrawingPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<SoftwareDrawing>().register_type::<FullDrawing>().register_type::<ScreenCamera>();
        app.init_resource::<SoftwareDrawing>();
        if app.get_sub_app(RenderApp).is_none() {
            warn!("nothing is drawn for a processor: the app does not render");
            return;
        }
        stretch::embed(app);
        plain::build(app);
        app.init_resource::<Screens>().add_plugins(ExtractResourcePlugin::<Screens>::default());
        screens::build(app);
        budget::build(app);
    }

    fn finish(&self, app: &mut App) {
        if let Some(render) = app.get_sub_app_mut(RenderApp) {
            render::build(render);
            stretch::build(render);
        }
    }
}
