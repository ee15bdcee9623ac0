//! Which windows are drawn into pictures, and the cameras that show them.

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

/// A window that is drawn into a picture.
#[derive(Clone, Debug)]
pub(super) struct Screen {
    /// While its views change, and when they do not.
    pictures: [Picture; 2],
    /// The [`ScreenCamera`].
    pub(super) camera: Entity,
}

/// What a window's cameras draw into.
#[derive(Clone, Debug)]
pub(super) struct Picture {
    pub(super) image: Handle<Image>,
    /// \[pixels\]
    pub(super) size: UVec2,
}

impl Picture {
    fn new(size: UVec2, images: &mut Assets<Image>) -> Self {
        Self { image: images.add(Image::new_target_texture(size.x, size.y, TextureFormat::Rgba8UnormSrgb, None)), size }
    }

    /// Whether it had another size.
    fn resize(&mut self, size: UVec2, images: &mut Assets<Image>) -> bool {
        let image = if self.size == size { None } else { images.get_mut(&self.image) };
        let Some(mut image) = image else { return false };
        image.resize(Extent3d { width: size.x, height: size.y, ..default() });
        self.size = size;
        true
    }
}

/// What of the windows is drawn in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Due {
    /// Anything.
    pub(super) is_any: bool,
    /// What the cameras see; else that stays.
    pub(super) is_view: bool,
    /// Panels and texts; else they stay.
    pub(super) is_panels: bool,
    /// Whether the views do not change, and are worth more pixels. Holds on until they are drawn again.
    pub(super) is_still: bool,
}

/// What the render world has to know.
#[derive(Resource, Clone, Default, ExtractResource)]
pub(super) struct Screens {
    pub(super) windows: EntityHashMap<Screen>,
    /// Cameras that draw straight into those windows.
    pub(super) full: EntityHashSet,
    pub(super) due: Due,
    /// Whether the pictures have other sizes than the last ones drawn.
    pub(super) are_resized: bool,
    pub(super) has_shadows: bool,
    pub(super) meter: Meter,
}

impl Screens {
    /// The picture that a window shows.
    pub(super) fn picture<'a>(&self, screen: &'a Screen) -> &'a Picture {
        &screen.pictures[usize::from(self.due.is_still)]
    }

    /// The window's screen that this camera of the main world shows.
    pub(super) fn shown_by(&self, camera: Entity) -> Option<(Entity, &Screen)> {
        self.windows.iter().find(|(_, screen)| screen.camera == camera).map(|(window, screen)| (*window, screen))
    }
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
        let sizes = [settings.shrink, settings.still_shrink].map(|by| (place.physical_size() / by.max(1)).max(UVec2::ONE));
        match screens.windows.get_mut(&window) {
            None => {
                let pictures = sizes.map(|size| Picture::new(size, &mut images));
                let camera = commands.spawn(screen_camera(window, order)).id();
                screens.windows.insert(window, Screen { pictures, camera });
                screens.are_resized = true;
            }
            Some(screen) => {
                if let Ok(mut camera) = shown.get_mut(screen.camera)
                    && camera.order != order
                {
                    camera.order = order;
                }
                let pairs = screen.pictures.iter_mut().zip(sizes);
                let are_resized = pairs.fold(false, |any, (picture, size)| picture.resize(size, &mut images) | any);
                screens.are_resized |= are_resized;
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

/// Shows the picture, and nothing of the app's world. What is drawn by it is laid over the picture.
fn screen_camera(window: Entity, order: isize) -> impl Bundle {
    let camera = Camera { order, clear_color: ClearColorConfig::Custom(Color::NONE), ..default() };
    let target = RenderTarget::Window(WindowRef::Entity(window));
    let kind = (Camera2d, Msaa::Off, RenderLayers::none());
    (Name::new("screen camera"), ScreenCamera { window, picture_count: 0 }, kind, camera, target)
}
