//! Clay on screen: the left button presses, U takes the last stroke back, E writes a file.
use bevy::prelude::*;
use bevy_clay::prelude::*;

const RADIUS: f32 = 0.008;

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, ClayPlugins))
        .add_systems(Startup, spawn)
        .add_systems(Update, (ask, hand.in_set(ClaySystems::Tool), say.after(ClaySystems::Report)))
        .add_observer(|done: On<ClayChanged>| info!("{:?}", done.change))
        .add_observer(|done: On<ClayExported>| info!("wrote {:?}", done.files))
        .add_observer(|trouble: On<ClayTrouble>| warn!("{}", trouble.error))
        .run()
}

fn spawn(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut colours: ResMut<Assets<StandardMaterial>>) {
    commands.spawn((Clay::block(Vec3::new(0.06, 0.03, 0.06)).with_cell_width(0.004), ClayHistory::default()));
    let look = (Mesh3d(meshes.add(Sphere::new(RADIUS))), MeshMaterial3d(colours.add(Color::srgb(0.3, 0.4, 0.6))));
    commands.spawn((SculptTool::ball(RADIUS), look, Transform::from_xyz(0.0, 0.06, 0.0)));
    // Bevy's near plane, 10 cm from the eye, would cut off clay of centimetres.
    let lens = PerspectiveProjection { near: 0.001, ..default() };
    let eye = Transform::from_xyz(0.07, 0.09, 0.11).looking_at(Vec3::Y * 0.01, Vec3::Y);
    commands.spawn((Camera3d::default(), Projection::Perspective(lens), eye));
    commands.spawn((DirectionalLight::default(), Transform::from_xyz(1.0, 2.0, 1.0).looking_at(Vec3::ZERO, Vec3::Y)));
}

/// The ball hovers where the pointer meets the clay, and goes in while the button is down.
fn hand(
    (window, buttons, time): (Single<&Window>, Res<ButtonInput<MouseButton>>, Res<Time>),
    eye: Single<(&Camera, &GlobalTransform)>,
    clay: Single<(&ClaySurface, &GlobalTransform)>,
    ball: Single<(&mut Transform, &mut SculptTool)>,
) {
    let (mut place, mut tool) = ball.into_inner();
    tool.is_active = false;
    let ray = window.cursor_position().and_then(|at| eye.0.viewport_to_world(eye.1, at).ok());
    let (Some(ray), Ok(space)) = (ray, ClaySpace::new(clay.1)) else { return };
    let Some(hit) = clay.0.cast(space.ray_to_clay(ray)) else { return };
    tool.is_active = true;
    let (depth, speed) = if buttons.pressed(MouseButton::Left) { (0.004, 0.05) } else { (-0.004, 1.0) };
    let goal = space.point_to_world(hit.point + (f64::from(RADIUS) - depth) * hit.normal.as_dvec3());
    place.translation = place.translation.move_towards(goal, speed * time.delta_secs());
}

fn ask(keys: Res<ButtonInput<KeyCode>>, clay: Single<Entity, With<Clay>>, mut commands: Commands) {
    if keys.just_pressed(KeyCode::KeyU) {
        commands.trigger(UndoClay { entity: *clay });
    }
    if keys.just_pressed(KeyCode::KeyE) {
        commands.trigger(ExportClay { entity: *clay, path: "clay.stl".into(), options: default() });
    }
}

fn say(tool: Single<&ToolForce, Changed<ToolForce>>) {
    info!("{:.2} N", tool.force.length());
}
