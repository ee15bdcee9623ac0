//! Windows drawn for a processor: which cameras are turned to fewer pixels, and that nothing of it shows in
//! the main world.

use super::{app_in_step, check, settle};
use bevy::camera::visibility::RenderLayers;
use bevy::camera::{NormalizedRenderTarget, RenderTarget, Viewport};
use bevy::prelude::*;
use bevy::render::RenderApp;
use bevy::render::camera::{ExtractedCamera, SortedCamera, SortedCameras};
use bevy::render::renderer::RenderAdapterInfo;
use bevy::render::sync_world::MainEntity;
use bevy::window::{PrimaryWindow, WindowRef, WindowResized};
use bevy_clay::plugin::software::{FullDrawing, ScreenCamera, SoftwareDrawing, SoftwareDrawingPlugin, SoftwareDrawingUse};
use libtest_mimic::Failed;
use wgpu::DeviceType;

/// An app with two windows. In the first: the whole, the right half, one that is left as it is; the second
/// has one camera, a last one draws into an image.
struct Stage {
    app: App,
    windows: [Entity; 2],
    whole: Entity,
    half: Entity,
    full: Entity,
    other: Entity,
    image: Entity,
}

fn window(width: u32, height: u32) -> Window {
    Window { resolution: bevy::window::WindowResolution::new(width, height), ..default() }
}

fn stage() -> Result<Stage, Failed> {
    let mut app = app_in_step();
    app.add_plugins(SoftwareDrawingPlugin);
    let settings = SoftwareDrawing { shrink: 2, still_shrink: 2, share: 1.0, ..default() };
    app.insert_resource(settings);
    let world = app.world_mut();
    let windows = [world.spawn((window(640, 480), PrimaryWindow)).id(), world.spawn(window(300, 200)).id()];
    let picture = Image::new_target_texture(64, 64, wgpu::TextureFormat::Rgba8UnormSrgb, None);
    let picture = world.resource_mut::<Assets<Image>>().add(picture);
    let camera = |order| Camera { order, ..default() };
    let whole = world.spawn((Camera3d::default(), camera(0), Msaa::Sample4)).id();
    let viewport = Viewport { physical_position: UVec2::new(320, 0), physical_size: UVec2::new(320, 480), ..default() };
    let half = world.spawn((Camera3d::default(), Camera { viewport: Some(viewport), ..camera(3) })).id();
    let full = world.spawn((Camera3d::default(), camera(4), FullDrawing)).id();
    let target = RenderTarget::Window(WindowRef::Entity(windows[1]));
    let other = world.spawn((Camera3d::default(), camera(0), target)).id();
    let image = world.spawn((Camera3d::default(), camera(0), RenderTarget::from(picture))).id();
    settle(&mut app, "Bevy", |_| true)?;
    Ok(Stage { app, windows, whole, half, full, other, image })
}

/// What a camera draws into in the render world.
#[derive(Clone, Debug, PartialEq)]
struct Turned {
    is_window: bool,
    size: UVec2,
    viewport: Option<URect>,
    msaa: Msaa,
}

impl Stage {
    /// What `camera` draws into in the next frame in which it draws.
    fn turned(&mut self, camera: Entity) -> Result<Turned, Failed> {
        let start = std::time::Instant::now();
        loop {
            // What has not changed is not drawn again.
            self.app.world_mut().resource_mut::<SoftwareDrawing>().set_changed();
            self.app.update();
            let world = self.app.get_sub_app_mut(RenderApp).ok_or("no render world")?.world_mut();
            let mut cameras = world.query::<(&MainEntity, &ExtractedCamera, &Msaa)>();
            if let Some((_, c, msaa)) = cameras.iter(world).find(|(main, ..)| main.entity() == camera) {
                let is_window = matches!(c.target, Some(NormalizedRenderTarget::Window(_)));
                let rect = |v: &Viewport| URect { min: v.physical_position, max: v.physical_position + v.physical_size };
                let size = c.physical_target_size.unwrap_or_default();
                return Ok(Turned { is_window, size, viewport: c.viewport.as_ref().map(rect), msaa: *msaa });
            }
            check(start.elapsed() < super::PATIENCE, "the camera draws nothing")?;
        }
    }

    /// The cameras that drew in the last frame, in their order.
    fn drawn(&self) -> Result<Vec<Entity>, Failed> {
        let world = self.app.get_sub_app(RenderApp).ok_or("no render world")?.world();
        let main = |camera: &SortedCamera| Some(world.get::<MainEntity>(camera.entity)?.entity());
        Ok(world.resource::<SortedCameras>().0.iter().filter_map(main).collect())
    }

    fn screens(&mut self) -> Vec<(Entity, Entity)> {
        let world = self.app.world_mut();
        world.query::<(Entity, &ScreenCamera)>().iter(world).map(|(entity, screen)| (screen.window, entity)).collect()
    }

    fn expect(&mut self, camera: Entity, expected: &Turned) -> Result<(), Failed> {
        let turned = self.turned(camera)?;
        check(turned == *expected, format!("{turned:?} instead of {expected:?}"))
    }
}

/// On a software adapter every camera of a window draws into a picture of half the side, whatever its
/// viewport; those that are exempt, or draw into images, stay. The main world does not see it: a place in the
/// window is the same ray.
pub(super) fn cameras_of_windows_draw_fewer_pixels() -> Result<(), Failed> {
    let mut stage = stage()?;
    let turned = |size, viewport| Turned { is_window: false, size, viewport, msaa: Msaa::Off };
    let [whole, half, full, other, image] = [stage.whole, stage.half, stage.full, stage.other, stage.image];
    let size = UVec2::new(320, 240);
    stage.expect(whole, &turned(size, None))?;
    stage.expect(half, &turned(size, Some(URect::new(160, 0, 320, 240))))?;
    stage.expect(other, &turned(UVec2::new(150, 100), None))?;
    let kept = |is_window, size| Turned { is_window, size, viewport: None, msaa: Msaa::default() };
    stage.expect(full, &kept(true, UVec2::new(640, 480)))?;
    stage.expect(image, &kept(false, UVec2::new(64, 64)))?;
    let screens = stage.screens();
    check(screens.len() == 2 && stage.windows.iter().all(|w| screens.iter().any(|s| s.0 == *w)), format!("{screens:?}"))?;
    let world = stage.app.world();
    let screen = screens.iter().find(|s| s.0 == stage.windows[0]).ok_or("no screen")?.1;
    let order = world.get::<Camera>(screen).ok_or("no camera")?.order;
    check(order == 3, format!("the screen has the order {order}, the last camera it shows 3, the next 4"))?;
    check(world.get::<RenderLayers>(screen) == Some(&RenderLayers::none()), "the screen sees the app's world")?;
    let camera = world.get::<Camera>(whole).ok_or("no camera")?;
    check(camera.logical_viewport_size() == Some(Vec2::new(640.0, 480.0)), "the main world's camera has another size")?;
    check(world.get::<Msaa>(whole) == Some(&Msaa::Sample4), "the main world's camera has lost its samples")?;
    let ray = camera.viewport_to_world(&GlobalTransform::IDENTITY, Vec2::new(320.0, 240.0)).map_err(|e| e.to_string())?;
    check(ray.direction.dot(Vec3::NEG_Z) > 0.9999, format!("the middle of the window is at {:?}", ray.direction))?;
    stage.turned(whole)?;
    let drawn = stage.drawn()?;
    let place = |camera| drawn.iter().position(|drawn| *drawn == camera).unwrap_or(usize::MAX);
    check(
        place(half) < place(screen) && place(screen) < place(full),
        format!("{drawn:?}: the screen {screen} comes right after {half}"),
    )
}

/// Pictures follow the size of their window, and go with its last camera.
pub(super) fn pictures_follow_their_window() -> Result<(), Failed> {
    let mut stage = stage()?;
    let (whole, other) = (stage.whole, stage.other);
    stage.turned(whole)?;
    let [first, second] = stage.windows;
    let world = stage.app.world_mut();
    world.get_mut::<Window>(first).ok_or("no window")?.resolution.set(500.0, 400.0);
    world.write_message(WindowResized { window: first, width: 500.0, height: 400.0 });
    let expected = Turned { is_window: false, size: UVec2::new(250, 200), viewport: None, msaa: Msaa::Off };
    stage.expect(whole, &expected)?;
    stage.app.world_mut().insert_resource(SoftwareDrawing { shrink: 4, still_shrink: 4, share: 1.0, ..default() });
    stage.expect(whole, &Turned { size: UVec2::new(125, 100), ..expected })?;
    stage.app.world_mut().despawn(other);
    stage.app.update();
    let screens = stage.screens();
    check(screens.len() == 1 && screens[0].0 == first, format!("{screens:?} for {first}, and none for {second}"))?;
    stage.app.world_mut().despawn(first);
    stage.app.update();
    let screens = stage.screens();
    check(screens.is_empty(), format!("{screens:?} without a window"))
}

/// On a hardware adapter, or where it is switched off, nothing is turned; it may be switched at any time.
pub(super) fn hardware_draws_as_ever() -> Result<(), Failed> {
    let mut stage = stage()?;
    let whole = stage.whole;
    let size = UVec2::new(640, 480);
    let untouched = Turned { is_window: true, size, viewport: None, msaa: Msaa::Sample4 };
    let small = Turned { is_window: false, size: size / 2, viewport: None, msaa: Msaa::Off };
    let kind =
        |stage: &mut Stage, device_type| stage.app.world_mut().resource_mut::<RenderAdapterInfo>().device_type = device_type;
    let set = |stage: &mut Stage, when| stage.app.world_mut().resource_mut::<SoftwareDrawing>().when = when;
    kind(&mut stage, DeviceType::DiscreteGpu);
    stage.expect(whole, &untouched)?;
    check(stage.screens().is_empty(), "a screen on a hardware adapter")?;
    set(&mut stage, SoftwareDrawingUse::Always);
    stage.expect(whole, &small)?;
    kind(&mut stage, DeviceType::Cpu);
    set(&mut stage, SoftwareDrawingUse::Never);
    stage.expect(whole, &untouched)?;
    check(stage.screens().is_empty(), "a screen though it is switched off")
}
