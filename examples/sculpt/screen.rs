//! Where the picture is drawn: straight into the window, or, where a processor has to draw it without a
//! graphics unit, into a smaller picture that is stretched over the window behind the panels. A quarter of
//! the pixels take a quarter of the time; and the small picture is drawn anew only when something in it has
//! changed, and for no more than half of the time, so that the clay gets the rest.

use crate::stage::Orbit;
use crate::stroke::Work;
use crate::tools::InHand;
use bevy::camera::RenderTarget;
use bevy::prelude::*;
use bevy::render::render_resource::{Extent3d, TextureFormat};
use bevy::window::PrimaryWindow;
use bevy_clay::prelude::ClaySurface;
use bevy_egui::{EguiContexts, EguiTextureHandle, EguiUserTextures, PrimaryEguiContext, egui};

/// Pixels of the window's side per pixel of the small picture.
const SHRINK: u32 = 2;

/// The picture that is stretched over the window.
#[derive(Resource)]
pub(crate) struct SmallPicture {
    image: Handle<Image>,
    texture: egui::TextureId,
}

/// When the picture was drawn last, and whether it shows what there is.
#[derive(Debug, Default)]
pub(crate) struct Drawn {
    is_stale: bool,
    /// Time since then \[s\].
    age: f32,
    /// What drawing takes \[s\], about.
    cost: f32,
}

/// What the eye sees change.
type Seen = Or<(Changed<ClaySurface>, Changed<Orbit>, (With<InHand>, Or<(Changed<Transform>, Changed<Visibility>)>))>;

/// Lets the eye draw the small picture when it is due.
pub(crate) fn refresh(
    picture: Option<Res<SmallPicture>>,
    seen: Query<(), Seen>,
    surface: Query<(), Changed<ClaySurface>>,
    mut eye: Single<&mut Camera, With<Camera3d>>,
    (time, work): (Res<Time<Real>>, Res<Work>),
    mut drawn: Local<Drawn>,
) {
    /// A window that opens is drawn a few times in any case: its shaders are made meanwhile.
    const OPENING: f32 = 3.0;
    /// Part of its greatest value that the cost keeps per frame.
    const FADING: f32 = 0.95;
    /// Least time between pictures of a tool that moves in clay that does not \[s\].
    const TOOL_ALONE: f32 = 0.25;
    if picture.is_none() {
        return;
    }
    let delta = time.delta_secs();
    drawn.age += delta;
    drawn.cost = (drawn.cost * FADING).max(delta.min(0.5));
    drawn.is_stale |= !seen.is_empty() || time.elapsed_secs() < OPENING;
    // New clay goes before a tool that has moved: between a press and its answer the tool alone is not worth
    // a picture.
    let gap = match (surface.is_empty(), work.stroke.is_some()) {
        (false, _) => drawn.cost,
        (true, true) => TOOL_ALONE.max(2.0 * drawn.cost),
        (true, false) => 2.0 * drawn.cost,
    };
    let is_due = drawn.is_stale && drawn.age > gap;
    if eye.is_active != is_due {
        eye.is_active = is_due;
    }
    if is_due {
        *drawn = Drawn { is_stale: false, age: 0.0, cost: drawn.cost };
    }
}

/// The size of a picture for a window.
fn size_for(window: &Window) -> Extent3d {
    let side = |pixels: u32| (pixels / SHRINK).max(1);
    Extent3d { width: side(window.physical_width()), height: side(window.physical_height()), ..default() }
}

/// Lets `camera` draw into a small picture, and another one stretch it over the window.
pub(crate) fn set_small(
    commands: &mut Commands,
    images: &mut Assets<Image>,
    textures: &mut EguiUserTextures,
    camera: Entity,
    window: &Window,
) {
    let size = size_for(window);
    let image = images.add(Image::new_target_texture(size.width, size.height, TextureFormat::Rgba8UnormSrgb, None));
    let texture = textures.add_image(EguiTextureHandle::Strong(image.clone()));
    let before = Camera { order: -1, ..default() };
    commands.entity(camera).insert((before, RenderTarget::Image(image.clone().into())));
    commands.spawn((Name::new("window camera"), Camera2d, Msaa::Off, PrimaryEguiContext));
    commands.insert_resource(SmallPicture { image, texture });
}

/// Keeps the picture in step with the window.
pub(crate) fn fit(
    picture: Option<Res<SmallPicture>>,
    window: Query<&Window, (With<PrimaryWindow>, Changed<Window>)>,
    mut images: ResMut<Assets<Image>>,
) {
    let (Some(picture), Ok(window)) = (picture, window.single()) else { return };
    let size = size_for(window);
    if images.get(&picture.image).is_some_and(|image| image.texture_descriptor.size != size)
        && let Some(mut image) = images.get_mut(&picture.image)
    {
        image.resize(size);
    }
}

/// Stretches the picture over the window, behind the panels.
pub(crate) fn show(picture: Option<Res<SmallPicture>>, mut contexts: EguiContexts) {
    let (Some(picture), Ok(ctx)) = (picture, contexts.ctx_mut()) else { return };
    let whole = egui::Rect::from_min_max(egui::Pos2::ZERO, egui::pos2(1.0, 1.0));
    ctx.layer_painter(egui::LayerId::background()).image(picture.texture, ctx.content_rect(), whole, egui::Color32::WHITE);
}

/// From the eye through the place `cursor` of the window.
pub(crate) fn ray(window: &Window, cursor: Vec2, camera: &Camera, place: &GlobalTransform) -> Option<Ray3d> {
    let scale = camera.logical_viewport_size()? / window.size();
    camera.viewport_to_world(place, cursor * scale).ok()
}
