//! Clay that steps at a fixed rate, as the rest of a game's physics does: `cargo demo fixed_update`.

use bevy::prelude::*;
use bevy_clay::prelude::*;

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, ClayPlugins.set(SchedulePlugin::new(FixedUpdate))))
        .insert_resource(Time::<Fixed>::from_hz(100.0))
        .add_systems(Startup, (spawn, stage))
        // The clay's tools move in the clay's schedule.
        .add_systems(FixedUpdate, roll.in_set(ClaySystems::Tool))
        .run()
}

fn spawn(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut colours: ResMut<Assets<StandardMaterial>>) {
    commands.spawn(Clay::block(Vec3::new(0.05, 0.02, 0.05)).with_cell_width(0.0035));
    let (radius, half_length) = (0.008, 0.02);
    let look = Mesh3d(meshes.add(Capsule3d::new(radius, 2.0 * half_length)));
    let tool = SculptTool::new(ToolShape::Capsule { radius: radius.into(), half_length: half_length.into() });
    commands.spawn((tool, look, MeshMaterial3d(colours.add(Color::srgb(0.6, 0.5, 0.4)))));
}

/// A rolling pin, its axis across its way.
fn roll(time: Res<Time>, mut pin: Single<&mut Transform, With<SculptTool>>) {
    let way = 0.015 * time.elapsed_secs().sin();
    pin.translation = Vec3::new(way, 0.0255, 0.0);
    pin.rotation = Quat::from_rotation_z(-way / 0.008) * Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
}

fn stage(mut commands: Commands) {
    // Bevy's near plane, 10 cm from the eye, would cut off clay of centimetres.
    let lens = PerspectiveProjection { near: 0.001, ..default() };
    let eye = Transform::from_xyz(0.07, 0.09, 0.11).looking_at(Vec3::Y * 0.01, Vec3::Y);
    commands.spawn((Camera3d::default(), Projection::Perspective(lens), eye));
    let sun = Transform::from_xyz(1.0, 2.0, 1.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((DirectionalLight::default(), sun));
}
