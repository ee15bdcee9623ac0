//! Two hands at once, each with a tool of its own shape: `cargo demo two_tools`.

use bevy::prelude::*;
use bevy_clay::prelude::*;

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, ClayPlugins))
        .add_systems(Startup, (spawn, stage))
        .add_systems(Update, pinch.in_set(ClaySystems::Tool))
        .run()
}

/// From which side a hand comes.
#[derive(Component)]
struct Side(f32);

fn spawn(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut colours: ResMut<Assets<StandardMaterial>>) {
    commands.spawn(Clay::ball(0.025).with_cell_width(0.003));
    let colour = MeshMaterial3d(colours.add(Color::srgb(0.3, 0.4, 0.6)));
    // Any number of tools, told apart by their entities.
    commands.spawn((SculptTool::ball(0.009), Side(-1.0), Mesh3d(meshes.add(Sphere::new(0.009))), colour.clone()));
    let plate = Vec3::new(0.004, 0.012, 0.012);
    let tool = SculptTool::new(ToolShape::Box { half_size: plate.as_dvec3() });
    commands.spawn((tool, Side(1.0), Mesh3d(meshes.add(Cuboid::from_size(2.0 * plate))), colour));
}

/// Both go in and out again.
fn pinch(time: Res<Time>, mut hands: Query<(&Side, &mut Transform)>) {
    for (Side(side), mut hand) in &mut hands {
        hand.translation = Vec3::new(side * (0.032 + 0.008 * time.elapsed_secs().cos()), 0.025, 0.0);
    }
}

fn stage(mut commands: Commands) {
    // Bevy's near plane, 10 cm from the eye, would cut off clay of centimetres.
    let lens = PerspectiveProjection { near: 0.001, ..default() };
    let eye = Transform::from_xyz(0.07, 0.09, 0.11).looking_at(Vec3::Y * 0.01, Vec3::Y);
    commands.spawn((Camera3d::default(), Projection::Perspective(lens), eye));
    let sun = Transform::from_xyz(1.0, 2.0, 1.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((DirectionalLight::default(), sun));
}
