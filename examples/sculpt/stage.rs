//! Board, lights and camera.

use crate::tools::Hand;
use bevy::input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll, MouseScrollUnit};
use bevy::light::CascadeShadowConfigBuilder;
use bevy::prelude::*;
use bevy_egui::input::EguiWantsInput;

/// What is behind everything.
pub(crate) const BACKGROUND: Color = Color::srgb(0.60, 0.64, 0.67);
const BOARD: Color = Color::srgb(0.46, 0.40, 0.33);

/// A camera on a ball about what it looks at.
#[derive(Component, Clone, Debug)]
pub(crate) struct Orbit {
    pub(crate) target: Vec3,
    /// About the vertical \[rad\].
    pub(crate) yaw: f32,
    /// Above the horizontal \[rad\].
    pub(crate) pitch: f32,
    /// \[m\]
    pub(crate) distance: f32,
    /// Nearest and farthest \[m\].
    range: (f32, f32),
}

impl Orbit {
    fn transform(&self) -> Transform {
        let way = Quat::from_euler(EulerRot::YXZ, self.yaw, -self.pitch, 0.0) * Vec3::Z;
        Transform::from_translation(self.target + way * self.distance).looking_at(self.target, Vec3::Y)
    }
}

/// Sets board, lights and camera about clay that fills the ball of `radius` \[m\] about `middle`; the camera is
/// handed back.
pub(crate) fn set(
    commands: &mut Commands,
    meshes: &mut Assets<Mesh>,
    materials: &mut Assets<StandardMaterial>,
    (middle, radius): (Vec3, f32),
    floor: f32,
) -> Entity {
    // A hair below the clay's underside, which would flicker through it. A board, not a whole table: each
    // pixel costs a software renderer much.
    let (board, height) = (1.75 * radius, 0.14 * radius);
    commands.spawn((
        Name::new("board"),
        Mesh3d(meshes.add(Cylinder::new(board, height).mesh().resolution(96).build())),
        MeshMaterial3d(materials.add(StandardMaterial {
            base_color: BOARD,
            perceptual_roughness: 0.9,
            reflectance: 0.2,
            ..default()
        })),
        Transform::from_xyz(middle.x, floor - 2e-3 * radius - height / 2.0, middle.z),
    ));
    let light = |illuminance, color, from: Vec3| {
        let light = DirectionalLight { illuminance, color, shadow_maps_enabled: false, ..default() };
        (light, Transform::from_translation(from).looking_at(Vec3::ZERO, Vec3::Y))
    };
    let (mut key, place) = light(9000.0, Color::srgb(1.0, 0.96, 0.90), Vec3::new(-1.5, 1.15, 0.35));
    key.shadow_maps_enabled = true;
    // Bevy's own bias is meant for rooms, not for a lump of clay.
    key.shadow_depth_bias = 0.06 * radius;
    let shadows = CascadeShadowConfigBuilder {
        num_cascades: 1,
        minimum_distance: 0.1 * radius,
        maximum_distance: 7.0 * radius,
        ..default()
    };
    commands.spawn((Name::new("key light"), key, place, shadows.build()));
    commands.spawn((Name::new("fill light"), light(1500.0, Color::srgb(0.80, 0.88, 1.0), Vec3::new(1.6, 0.7, 0.4))));
    commands.insert_resource(GlobalAmbientLight { brightness: 260.0, color: Color::srgb(0.92, 0.95, 1.0), ..default() });
    let orbit = Orbit {
        target: middle - Vec3::Y * 0.1 * radius,
        yaw: 0.5,
        pitch: 0.55,
        distance: 4.4 * radius,
        range: (1.2 * radius, 16.0 * radius),
    };
    let projection = PerspectiveProjection { fov: 0.62, near: 0.05 * radius, far: 100.0 * radius, ..default() };
    let camera = (Camera3d::default(), orbit.transform(), orbit, Projection::Perspective(projection));
    commands.spawn((Name::new("eye"), camera)).id()
}

/// Turns, moves and zooms the camera by the mouse: right or middle drag turns, with shift it moves, the wheel
/// zooms.
pub(crate) fn orbit(
    camera: Single<(&mut Orbit, &mut Transform)>,
    buttons: Res<ButtonInput<MouseButton>>,
    keys: Res<ButtonInput<KeyCode>>,
    motion: Res<AccumulatedMouseMotion>,
    scroll: Res<AccumulatedMouseScroll>,
    egui: Res<EguiWantsInput>,
    mut hand: ResMut<Hand>,
) {
    const TURN: f32 = 0.006;
    const MOVE: f32 = 0.0011;
    const ZOOM: f32 = 1.12;
    let (mut orbit, mut transform) = camera.into_inner();
    let before = (orbit.target, orbit.yaw, orbit.pitch, orbit.distance);
    if buttons.any_pressed([MouseButton::Right, MouseButton::Middle]) && !egui.is_using_pointer() {
        if keys.any_pressed([KeyCode::ShiftLeft, KeyCode::ShiftRight]) {
            let shift = transform.right() * -motion.delta.x + transform.up() * motion.delta.y;
            let distance = orbit.distance;
            orbit.target += shift * MOVE * distance;
        } else {
            orbit.yaw -= motion.delta.x * TURN;
            orbit.pitch = (orbit.pitch + motion.delta.y * TURN).clamp(-0.1, 1.5);
        }
    }
    let lines = scroll.delta.y * if scroll.unit == MouseScrollUnit::Line { 1.0 } else { 1.0 / 16.0 };
    if lines != 0.0 && !egui.wants_any_pointer_input() {
        if buttons.pressed(MouseButton::Left) {
            hand.deepen(1.15f32.powf(lines));
        } else {
            orbit.distance = (orbit.distance * ZOOM.powf(-lines)).clamp(orbit.range.0, orbit.range.1);
        }
    }
    if before != (orbit.target, orbit.yaw, orbit.pitch, orbit.distance) {
        *transform = orbit.transform();
    }
}
