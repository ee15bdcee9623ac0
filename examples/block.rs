//! A block of clay, pressed by a ball: `cargo demo block`.

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
    // Lengths in metres. The clay brings a mesh and a material for it.
    commands.spawn(Clay::block(Vec3::new(0.06, 0.03, 0.06)).with_cell_width(0.004));
    // A tool is a shape that clay feels; what is drawn of it is the app's.
    let look = (Mesh3d(meshes.add(Sphere::new(0.008))), MeshMaterial3d(colours.add(Color::srgb(0.3, 0.4, 0.6))));
    commands.spawn((SculptTool::ball(0.008), look));
}

/// The clay sees all of the way from one frame's pose to the next.
fn press(time: Res<Time>, mut ball: Single<&mut Transform, With<SculptTool>>) {
    let t = time.elapsed_secs();
    ball.translation = Vec3::new(0.014 * t.sin(), 0.036 - 0.006 * (2.0 * t).cos(), 0.014 * t.cos());
}

fn stage(mut commands: Commands) {
    // Bevy's near plane, 10 cm from the eye, would cut off clay of centimetres.
    let lens = PerspectiveProjection { near: 0.001, ..default() };
    let eye = Transform::from_xyz(0.07, 0.09, 0.11).looking_at(Vec3::Y * 0.01, Vec3::Y);
    commands.spawn((Camera3d::default(), Projection::Perspective(lens), eye));
    let sun = Transform::from_xyz(1.0, 2.0, 1.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((DirectionalLight::default(), sun));
}
