//! Several clays, each of its own stuff and place, and a tool that touches only one: `cargo demo
//! several_clays`.

use bevy::prelude::*;
use bevy_clay::prelude::*;

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, ClayPlugins))
        .add_systems(Startup, (spawn, stage))
        .add_systems(Update, press.in_set(ClaySystems::Tool))
        .run()
}

fn spawn(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut colours: ResMut<Assets<StandardMaterial>>) {
    let clay = Clay::block(Vec3::new(0.03, 0.02, 0.03)).with_cell_width(0.0025);
    let soft = commands.spawn((clay.clone(), Transform::from_xyz(-0.03, 0.0, 0.0))).id();
    // Stiffer clay, turned and seen through a magnifying glass.
    let place = Transform::from_xyz(0.03, 0.0, 0.0).with_rotation(Quat::from_rotation_y(0.5)).with_scale(Vec3::splat(1.3));
    commands.spawn((clay, Preset::Plasticine.material(), place));
    let look = (Mesh3d(meshes.add(Sphere::new(0.007))), MeshMaterial3d(colours.add(Color::srgb(0.3, 0.4, 0.6))));
    // The first tool touches every clay that it meets, the second one only the soft one.
    commands.spawn((SculptTool::ball(0.007), look.clone()));
    commands.spawn((SculptTool::ball(0.007), TouchesOnly(vec![soft]), look));
}

/// Both go to and fro over both clays, one behind the other.
fn press(time: Res<Time>, mut balls: Query<&mut Transform, With<SculptTool>>) {
    for (number, mut ball) in balls.iter_mut().enumerate() {
        let z = 0.018 * number as f32 - 0.009;
        ball.translation = Vec3::new(0.05 * (0.7 * time.elapsed_secs()).sin(), 0.023, z);
    }
}

fn stage(mut commands: Commands) {
    // Bevy's near plane, 10 cm from the eye, would cut off clay of centimetres.
    let lens = PerspectiveProjection { near: 0.001, ..default() };
    let eye = Transform::from_xyz(0.05, 0.09, 0.13).looking_at(Vec3::Y * 0.01, Vec3::Y);
    commands.spawn((Camera3d::default(), Projection::Perspective(lens), eye));
    let sun = Transform::from_xyz(1.0, 2.0, 1.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((DirectionalLight::default(), sun));
}
