//! Clay in a material of the app's own, of any kind: `cargo demo custom_material`.

use bevy::prelude::*;
use bevy_clay::prelude::*;

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, ClayPlugins))
        .add_systems(Startup, (spawn, stage))
        .add_systems(Update, (press.in_set(ClaySystems::Tool), glow))
        .run()
}

fn spawn(mut commands: Commands, mut materials: ResMut<Assets<StandardMaterial>>) {
    // A clay that has a `MeshMaterial3d` keeps it; what the clay is made of is another matter.
    let glaze =
        StandardMaterial { base_color: Color::srgb(0.1, 0.3, 0.35), perceptual_roughness: 0.25, clearcoat: 1.0, ..default() };
    let clay = Clay::block(Vec3::new(0.05, 0.03, 0.05)).with_cell_width(0.0035);
    commands.spawn((clay, Preset::Wax.material(), MeshMaterial3d(materials.add(glaze))));
    commands.spawn(SculptTool::ball(0.009));
}

/// The clay glows the more, the harder it is pressed.
fn glow(
    clay: Single<&MeshMaterial3d<StandardMaterial>, With<Clay>>,
    tool: Single<&ToolForce, Changed<ToolForce>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    if let Some(mut glaze) = materials.get_mut(&clay.0) {
        glaze.emissive = LinearRgba::rgb(0.02, 0.01, 0.0) * tool.force.length();
    }
}

fn press(time: Res<Time>, mut ball: Single<&mut Transform, With<SculptTool>>) {
    let t = time.elapsed_secs();
    ball.translation = Vec3::new(0.01 * t.sin(), 0.036 - 0.006 * (2.0 * t).cos(), 0.01 * t.cos());
}

fn stage(mut commands: Commands) {
    // Bevy's near plane, 10 cm from the eye, would cut off clay of centimetres.
    let lens = PerspectiveProjection { near: 0.001, ..default() };
    let eye = Transform::from_xyz(0.07, 0.09, 0.11).looking_at(Vec3::Y * 0.01, Vec3::Y);
    commands.spawn((Camera3d::default(), Projection::Perspective(lens), eye));
    let sun = Transform::from_xyz(1.0, 2.0, 1.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((DirectionalLight::default(), sun));
}
