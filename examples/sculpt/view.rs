//! A camera that the mouse turns, moves and zooms. There may be several: the one that the pointer is in goes.

use crate::pointer::{Pointer, point};
use crate::start::Extent;
use bevy::input::common_conditions::input_pressed;
use bevy::input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll, MouseScrollUnit};
use bevy::prelude::*;
use bevy_clay::prelude::*;
use bevy_egui::input::{EguiWantsInput, egui_wants_any_pointer_input};

/// Sets up the eye; moves it and all other cameras with an [`Orbit`].
pub(crate) struct ViewPlugin;

impl Plugin for ViewPlugin {
    fn build(&self, app: &mut App) {
        let zoom = zoom.run_if(not(input_pressed(MouseButton::Left))).run_if(not(egui_wants_any_pointer_input));
        app.add_systems(Startup, spawn).add_systems(Update, (turn, zoom, place).chain().after(point).before(ClaySystems::Report));
    }
}

/// A camera on a ball about what it looks at.
#[derive(Component, Clone, Debug)]
#[require(Camera3d)]
pub(crate) struct Orbit {
    target: Vec3,
    /// About the vertical \[rad\].
    yaw: f32,
    /// Above the horizontal \[rad\].
    pitch: f32,
    /// \[m\]
    distance: f32,
    /// Nearest and farthest \[m\].
    range: (f32, f32),
}

fn spawn(extent: Res<Extent>, mut commands: Commands) {
    let Extent { middle, radius, .. } = *extent;
    let orbit = Orbit {
        target: middle - Vec3::Y * 0.1 * radius,
        yaw: 0.5,
        pitch: 0.55,
        distance: 4.4 * radius,
        range: (1.2 * radius, 16.0 * radius),
    };
    // Bevy's near plane, 10 cm from the eye, would cut off clay of centimetres.
    let lens = PerspectiveProjection { fov: 0.62, near: 0.05 * radius, far: 100.0 * radius, ..default() };
    commands.spawn((Name::new("eye"), orbit, Projection::Perspective(lens)));
}

/// Right or middle drag turns, with shift it moves.
fn turn(
    pointer: Res<Pointer>,
    mut cameras: Query<(&mut Orbit, &Transform)>,
    (buttons, keys): (Res<ButtonInput<MouseButton>>, Res<ButtonInput<KeyCode>>),
    motion: Res<AccumulatedMouseMotion>,
    egui: Res<EguiWantsInput>,
) {
    const TURN: f32 = 0.006;
    const MOVE: f32 = 0.0011;
    let is_dragged = buttons.any_pressed([MouseButton::Right, MouseButton::Middle]) && motion.delta != Vec2::ZERO;
    let Some(camera) = pointer.camera.filter(|_| is_dragged && !egui.is_using_pointer()) else { return };
    let Ok((mut orbit, transform)) = cameras.get_mut(camera) else { return };
    if keys.any_pressed([KeyCode::ShiftLeft, KeyCode::ShiftRight]) {
        let way = transform.right() * -motion.delta.x + transform.up() * motion.delta.y;
        let distance = orbit.distance;
        orbit.target += way * MOVE * distance;
    } else {
        orbit.yaw -= motion.delta.x * TURN;
        orbit.pitch = (orbit.pitch + motion.delta.y * TURN).clamp(-0.1, 1.5);
    }
}

/// The wheel zooms.
fn zoom(pointer: Res<Pointer>, mut cameras: Query<&mut Orbit>, scroll: Res<AccumulatedMouseScroll>) {
    const ZOOM: f32 = 1.12;
    let Some(camera) = pointer.camera.filter(|_| scroll.delta.y != 0.0) else { return };
    let Ok(mut orbit) = cameras.get_mut(camera) else { return };
    let (nearest, farthest) = orbit.range;
    orbit.distance = (orbit.distance * ZOOM.powf(-lines(&scroll))).clamp(nearest, farthest);
}

/// Lines that the wheel turned, whatever the device counts in.
pub(crate) fn lines(scroll: &AccumulatedMouseScroll) -> f32 {
    match scroll.unit {
        MouseScrollUnit::Line => scroll.delta.y,
        MouseScrollUnit::Pixel => scroll.delta.y / 16.0,
    }
}

/// Puts cameras where their orbits say.
fn place(mut cameras: Query<(&Orbit, &mut Transform), Changed<Orbit>>) {
    for (orbit, mut transform) in &mut cameras {
        let way = Quat::from_euler(EulerRot::YXZ, orbit.yaw, -orbit.pitch, 0.0) * Vec3::Z;
        *transform = Transform::from_translation(orbit.target + way * orbit.distance).looking_at(orbit.target, Vec3::Y);
    }
}
