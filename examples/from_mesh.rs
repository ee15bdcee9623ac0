//! Clay in the shape of any closed mesh of the app: `cargo demo from_mesh`.

use bevy::prelude::*;
use bevy_clay::prelude::*;

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, ClayPlugins))
        .add_systems(Startup, (spawn, stage))
        .add_systems(Update, press.in_set(ClaySystems::Tool))
        .add_observer(ready)
        .run()
}

fn spawn(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut colours: ResMut<Assets<StandardMaterial>>) {
    // A handle that is still loading does as well: `Clay::mesh(assets.load("vase.glb#Mesh0/Primitive0"))`.
    let torus = meshes.add(Mesh::from(Torus::new(0.012, 0.032)).translated_by(Vec3::Y * 0.01));
    commands.spawn(Clay::mesh(torus).with_cell_width(0.0025));
    let look = (Mesh3d(meshes.add(Sphere::new(0.006))), MeshMaterial3d(colours.add(Color::srgb(0.3, 0.4, 0.6))));
    commands.spawn((SculptTool::ball(0.006), look));
}

/// The mesh is filled away from the main thread; this is when the clay is there.
fn ready(news: On<ClayReady>, clays: Query<&ClayStatus>) {
    if let Ok(status) = clays.get(news.entity) {
        info!("{} particles", status.particle_count);
    }
}

fn press(time: Res<Time>, mut ball: Single<&mut Transform, With<SculptTool>>) {
    let t = time.elapsed_secs();
    ball.translation = Vec3::new(0.022 * t.sin(), 0.024 - 0.004 * (3.0 * t).cos(), 0.022 * t.cos());
}

fn stage(mut commands: Commands) {
    // Bevy's near plane, 10 cm from the eye, would cut off clay of centimetres.
    let lens = PerspectiveProjection { near: 0.001, ..default() };
    let eye = Transform::from_xyz(0.07, 0.09, 0.11).looking_at(Vec3::Y * 0.01, Vec3::Y);
    commands.spawn((Camera3d::default(), Projection::Perspective(lens), eye));
    let sun = Transform::from_xyz(1.0, 2.0, 1.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((DirectionalLight::default(), sun));
}
