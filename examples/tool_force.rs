//! What a tool feels, as an arrow and in the window's title: `cargo demo tool_force`.

use bevy::prelude::*;
use bevy_clay::prelude::*;

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, ClayPlugins))
        .add_systems(Startup, (spawn, stage))
        .add_systems(Update, (press.in_set(ClaySystems::Tool), show.after(ClaySystems::Report)))
        .run()
}

fn spawn(mut commands: Commands) {
    commands.spawn(Clay::block(Vec3::new(0.05, 0.03, 0.05)).with_cell_width(0.0035));
    commands.spawn(SculptTool::ball(0.009));
}

/// A push towards one side, so that the force is no mere weight.
fn press(time: Res<Time>, mut ball: Single<&mut Transform, With<SculptTool>>) {
    let t = 0.7 * time.elapsed_secs();
    ball.translation = Vec3::new(0.012 * t.sin(), 0.035 - 0.005 * (2.0 * t).cos(), 0.0);
}

/// Force and torque stand in the world's frame, and are those of the last frame that has ended.
fn show(tool: Single<(&Transform, &ToolForce, &SculptTool)>, mut gizmos: Gizmos, mut window: Single<&mut Window>) {
    const METRES_PER_NEWTON: f32 = 0.005;
    let (place, felt, tool) = *tool;
    let radius = tool.shape.bounding_radius() as f32;
    gizmos.sphere(place.to_isometry(), radius, Color::srgb(0.4, 0.6, 0.9));
    gizmos.arrow(place.translation, place.translation + felt.force * METRES_PER_NEWTON, Color::srgb(1.0, 0.8, 0.2));
    let touch = if felt.clay.is_some() { "touches" } else { "is free" };
    window.title = format!("{:.2} N, {:.4} N m, {touch}", felt.force.length(), felt.torque.length());
}

fn stage(mut commands: Commands) {
    // Bevy's near plane, 10 cm from the eye, would cut off clay of centimetres.
    let lens = PerspectiveProjection { near: 0.001, ..default() };
    let eye = Transform::from_xyz(0.07, 0.09, 0.11).looking_at(Vec3::Y * 0.01, Vec3::Y);
    commands.spawn((Camera3d::default(), Projection::Perspective(lens), eye));
    let sun = Transform::from_xyz(1.0, 2.0, 1.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((DirectionalLight::default(), sun));
}
