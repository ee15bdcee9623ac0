//! Which windows are drawn into small pictures, and the cameras that show them.

use super::meter::Meter;
use super::settings::{FullDrawing, ScreenCamera, SoftwareDrawing, SoftwareDrawingUse};
use bevy::camera::visibility::RenderLayers;
use bevy::camera::{CameraUpdateSystems, RenderTarget};
use bevy::ecs::entity::{EntityHashMap, EntityHashSet};
use bevy::prelude::*;
use bevy::render::extract_resource::ExtractResource;
use bevy::render::render_resource::{Extent3d, TextureFormat};
use bevy::render::renderer::RenderAdapterInfo;
use bevy::window::{PrimaryWindow, WindowRef};
use wgpu::DeviceType;

/// A window that is drawn into a small picture.
#[derive(Clone, Debug)]
pub(super) struct Screen {
    pub(super) picture: Handle<Image>,
    /// Pixels of the picture.
    pub(super) size: UVec2,
    /// The [`ScreenCamera`].
    pub(super) camera: Entity,
}

/// What the render world has to know.
#[derive(Resource, Clone, Default, ExtractResource)]
pub(super) struct Screens {
    pub(super) windows: EntityHashMap<Screen>,
    /// Cameras that draw straight into those windows.
    pub(super) full: EntityHashSet,
    /// Whether the windows are drawn in this frame.
    pub(super) is_due: bool,
    pub(super) has_shadows: bool,
    pub(super) meter: Meter,
}

pub(super) fn build(app: &mut App) {
    app.add_systems(PostUpdate, keep.before(CameraUpdateSystems));
}

/// The app's cameras.
type Drawing<'a> = (Entity, &'a Camera, &'a RenderTarget, Has<FullDrawing>);

/// Gives every window that cameras draw into a picture and a camera that shows it, and takes them back.
fn keep(
    (settings, adapter): (Res<SoftwareDrawing>, Option<Res<RenderAdapterInfo>>),
    windows: Query<(Entity, &Window, Has<PrimaryWindow>)>,
    cameras: Query<Drawing, Without<ScreenCamera>>,
    mut shown: Query<&mut Camera, With<ScreenCamera>>,
    mut screens: ResMut<Screens>,
    mut images: ResMut<Assets<Image>>,
    mut commands: Commands,
) {
    let is_on = is_on(settings.when, adapter.as_deref());
    let primary = windows.iter().find_map(|(window, _, is_primary)| is_primary.then_some(window));
    // The order of each window's last camera.
    let mut orders = EntityHashMap::<isize>::default();
    screens.full.clear();
    for (entity, camera, target, is_full) in cameras.iter().filter(|_| is_on) {
        let RenderTarget::Window(window) = target else { continue };
        let Some(window) = window.normalize(primary) else { continue };
        if is_full {
            screens.full.insert(entity);
        } else {
            orders.entry(window.entity()).and_modify(|order| *order = camera.order.max(*order)).or_insert(camera.order);
        }
    }
    screens.has_shadows = settings.shadows;
    screens.windows.retain(|window, screen| {
        // A camera that somebody else despawned is made anew.
        let is_wanted = orders.contains_key(window) && windows.contains(*window) && shown.contains(screen.camera);
        if !is_wanted {
            commands.entity(screen.camera).try_despawn();
        }
        is_wanted
    });
    for (window, place, _) in &windows {
        let Some(&order) = orders.get(&window) else { continue };
        let size = (place.physical_size() / settings.shrink.max(1)).max(UVec2::ONE);
        match screens.windows.get_mut(&window) {
            None => {
                let picture = images.add(Image::new_target_texture(size.x, size.y, TextureFormat::Rgba8UnormSrgb, None));
                let camera = commands.spawn(screen_camera(window, order)).id();
                screens.windows.insert(window, Screen { picture, size, camera });
            }
            Some(screen) => {
                if let Ok(mut camera) = shown.get_mut(screen.camera)
                    && camera.order != order
                {
                    camera.order = order;
                }
                if screen.size != size
                    && let Some(mut image) = images.get_mut(&screen.picture)
                {
                    image.resize(Extent3d { width: size.x, height: size.y, ..default() });
                    screen.size = size;
                }
            }
        }
    }
}

/// Whether windows are drawn for a processor.
fn is_on(when: SoftwareDrawingUse, adapter: Option<&RenderAdapterInfo>) -> bool {
    match when {
        SoftwareDrawingUse::Auto => adapter.is_some_and(|adapter| adapter.device_type == DeviceType::Cpu),
        SoftwareDrawingUse::Always => true,
        SoftwareDrawingUse::Never => false,
    }
}

/// Shows the picture, and nothing of the app's world.
fn screen_camera(window: Entity, order: isize) -> impl Bundle {
    let camera = Camera { order, ..default() };
    let target = RenderTarget::Window(WindowRef::Entity(window));
    let kind = (Camera2d, Msaa::Off, RenderLayers::none());
    (Name::new("screen camera"), ScreenCamera { window, picture_count: 0 }, kind, camera, target)
}
