//! Which camera the pointer is in, and where its ray meets the clay.

use bevy::camera::RenderTarget;
use bevy::prelude::*;
use bevy::window::PrimaryWindow;
use bevy_clay::prelude::*;
use bevy_egui::input::EguiWantsInput;

/// Keeps [`Pointer`] up to date.
pub(crate) struct PointerPlugin;

impl Plugin for PointerPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Pointer>().add_systems(Update, point.before(ClaySystems::Report));
    }
}

/// Where the pointer is.
#[derive(Resource, Clone, Debug, Default)]
pub(crate) struct Pointer {
    /// The camera whose picture it is in; while a button is held, the one in which it was pressed.
    pub(crate) camera: Option<Entity>,
    /// None outside the window and over a panel.
    pub(crate) aim: Option<Aim>,
    /// Whether the clay is pressed: presses that begin on a panel are the panel's.
    pub(crate) is_down: bool,
}

/// What is under the pointer, as the camera sees it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Aim {
    /// From the eye through the pointer.
    pub(crate) ray: Ray3d,
    /// To the eye's right.
    pub(crate) right: Vec3,
    /// Where the eye looks.
    pub(crate) forward: Vec3,
}

/// Cameras that look at the world.
type Eyes<'a> = (Entity, &'a Camera, &'a RenderTarget, &'a GlobalTransform);

/// Points where the mouse does.
pub(crate) fn point(
    windows: Query<(Entity, &Window, Has<PrimaryWindow>)>,
    cameras: Query<Eyes, With<Camera3d>>,
    buttons: Res<ButtonInput<MouseButton>>,
    egui: Res<EguiWantsInput>,
    mut pointer: ResMut<Pointer>,
) {
    let primary = windows.iter().find_map(|(window, _, is_primary)| is_primary.then_some(window));
    let cursor = windows.iter().find_map(|(window, it, _)| Some((window, it.cursor_position()?)));
    let is_dragging = buttons.get_pressed().any(|button| !buttons.just_pressed(*button));
    if !is_dragging {
        let seen = cameras.iter().map(|(entity, camera, target, _)| (entity, camera, target));
        pointer.camera = cursor.and_then(|cursor| camera_at(seen, primary, cursor));
    }
    let is_panels = egui.wants_any_pointer_input() && !pointer.is_down;
    pointer.aim = pointer.camera.filter(|_| !is_panels).and_then(|entity| {
        let (_, camera, target, place) = cameras.get(entity).ok()?;
        let (_, at) = cursor.filter(|(window, _)| is_shown_in(target, primary, *window))?;
        let ray = camera.viewport_to_world(place, at).ok()?;
        Some(Aim { ray, right: *place.right(), forward: *place.forward() })
    });
    pointer.is_down = match pointer.is_down {
        true => buttons.pressed(MouseButton::Left),
        false => buttons.just_pressed(MouseButton::Left) && pointer.aim.is_some(),
    };
}

/// The camera whose picture is at this place of this window: of several the one that is drawn last, for it is
/// the one that is seen.
fn camera_at<'a>(
    cameras: impl Iterator<Item = (Entity, &'a Camera, &'a RenderTarget)>,
    primary: Option<Entity>,
    (window, at): (Entity, Vec2),
) -> Option<Entity> {
    cameras
        .filter(|(_, camera, target)| camera.is_active && is_shown_in(target, primary, window))
        .filter(|(_, camera, _)| camera.logical_viewport_rect().is_some_and(|rect| rect.contains(at)))
        .max_by_key(|(_, camera, _)| camera.order)
        .map(|(entity, ..)| entity)
}

fn is_shown_in(target: &RenderTarget, primary: Option<Entity>, window: Entity) -> bool {
    matches!(target, RenderTarget::Window(it) if it.normalize(primary).is_some_and(|it| it.entity() == window))
}

/// Where a ray meets the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    pub(crate) point: Vec3,
    /// Smooth, outwards.
    pub(crate) normal: Vec3,
    /// From the ray's origin.
    pub(crate) distance: f32,
}

/// Where `ray` first meets the surface. The clay's own frame is the world's.
pub(crate) fn cast(surface: &ClaySurface, ray: Ray3d) -> Option<Hit> {
    let hit = surface.cast(ray)?;
    Some(Hit { point: hit.point.as_vec3(), normal: hit.normal, distance: hit.distance as f32 })
}

/// Middle and half the diagonal of the surface's box.
pub(crate) fn ball(surface: &ClaySurface) -> Option<(Vec3, f32)> {
    let (low, high) = surface.bounds()?;
    Some(((low + high).as_vec3() / 2.0, (high - low).length() as f32 / 2.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::camera::{ComputedCameraValues, ImageRenderTarget, RenderTargetInfo, Viewport};
    use bevy::ecs::system::RunSystemOnce;
    use bevy::window::WindowRef;

    const WINDOW: UVec2 = UVec2::new(800, 600);
    /// The inset's corner and size.
    const INSET: (UVec2, UVec2) = (UVec2::new(600, 0), UVec2::new(200, 150));
    const IN_INSET: Vec2 = Vec2::new(700.0, 75.0);
    const BESIDE: Vec2 = Vec2::new(100.0, 300.0);

    /// A camera as it is when Bevy has looked at it: all of what it draws into, or a part.
    fn camera(order: isize, part: Option<(UVec2, UVec2)>) -> Camera {
        let viewport = part.map(|(physical_position, physical_size)| Viewport { physical_position, physical_size, ..default() });
        let clip_from_view = Mat4::perspective_infinite_reverse_rh(1.0, 4.0 / 3.0, 0.01);
        let target_info = Some(RenderTargetInfo { physical_size: WINDOW, scale_factor: 1.0 });
        let computed = ComputedCameraValues { clip_from_view, target_info, ..default() };
        Camera { order, viewport, computed, ..default() }
    }

    /// A camera at `x`, looking ahead.
    fn spawn(world: &mut World, camera: Camera, x: f32, target: RenderTarget) -> Entity {
        world.spawn((Camera3d::default(), camera, target, GlobalTransform::from_xyz(x, 0.0, 0.0))).id()
    }

    /// The app's window with a view of all of it and an inset over that.
    struct Desk {
        world: World,
        window: Entity,
        view: Entity,
        inset: Entity,
    }

    impl Desk {
        fn new() -> Self {
            let mut world = World::new();
            world.init_resource::<ButtonInput<MouseButton>>();
            world.init_resource::<EguiWantsInput>();
            world.init_resource::<Pointer>();
            let window = world.spawn((Window { resolution: WINDOW.into(), ..default() }, PrimaryWindow)).id();
            // The inset first: what is spawned last is not what is seen.
            let inset = spawn(&mut world, camera(1, Some(INSET)), 5.0, RenderTarget::default());
            let view = spawn(&mut world, camera(0, None), 0.0, RenderTarget::default());
            Self { world, window, view, inset }
        }

        /// Where the pointer is found to be at this place.
        fn point_at(&mut self, at: Vec2) -> Pointer {
            let mut window = self.world.get_mut::<Window>(self.window).expect("a window");
            window.set_cursor_position(Some(at));
            self.world.run_system_once(point).expect("a pointer");
            self.world.resource_mut::<ButtonInput<MouseButton>>().clear();
            self.world.resource::<Pointer>().clone()
        }
    }

    #[test]
    fn the_pointer_is_in_the_camera_that_is_seen() {
        let mut desk = Desk::new();
        let (beside, inside) = (desk.point_at(BESIDE), desk.point_at(IN_INSET));
        assert_eq!((beside.camera, inside.camera), (Some(desk.view), Some(desk.inset)));
        let rays = [beside, inside].map(|pointer| pointer.aim.expect("an aim").ray);
        assert!(rays[0].origin.x < 1.0 && rays[1].origin.x > 4.0, "rays of other eyes: {rays:?}");
        // In the middle of its picture a camera looks straight ahead.
        assert!(rays[1].direction.dot(Vec3::NEG_Z) > 0.999, "{rays:?}");
    }

    #[test]
    fn cameras_that_are_not_seen_do_not_take_the_pointer() {
        let mut desk = Desk::new();
        let other = desk.world.spawn(Window::default()).id();
        let image = RenderTarget::Image(ImageRenderTarget { handle: Handle::default(), scale_factor: 1.0 });
        spawn(&mut desk.world, camera(9, None), 9.0, image);
        spawn(&mut desk.world, camera(9, None), 9.0, RenderTarget::Window(WindowRef::Entity(other)));
        spawn(&mut desk.world, Camera { is_active: false, ..camera(9, None) }, 9.0, RenderTarget::default());
        assert_eq!(desk.point_at(BESIDE).camera, Some(desk.view));
        assert_eq!(desk.point_at(IN_INSET).camera, Some(desk.inset));
    }

    #[test]
    fn a_drag_stays_with_the_camera_it_began_in() {
        let mut desk = Desk::new();
        desk.world.resource_mut::<ButtonInput<MouseButton>>().press(MouseButton::Left);
        assert!(desk.point_at(BESIDE).is_down);
        let dragged = desk.point_at(IN_INSET);
        assert_eq!((dragged.camera, dragged.is_down), (Some(desk.view), true));
        assert!(dragged.aim.expect("an aim").ray.origin.x < 1.0);
        desk.world.resource_mut::<ButtonInput<MouseButton>>().release(MouseButton::Left);
        assert_eq!(desk.point_at(IN_INSET).camera, Some(desk.inset));
    }
}
