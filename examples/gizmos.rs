//! What the solver has of clay and tools, drawn over them: `cargo demo gizmos`. G hides and shows it.

use bevy::prelude::*;
use bevy_clay::prelude::*;

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, ClayPlugins, ClayGizmosPlugin))
        .add_systems(Startup, (spawn, stage))
        .add_systems(Update, (press.in_set(ClaySystems::Tool), switch))
        .run()
}

fn spawn(mut commands: Commands) {
    commands.spawn(Clay::block(Vec3::new(0.05, 0.03, 0.05)).with_cell_width(0.0035));
    // Neither tool has a mesh: what is seen of them is what the clay has.
    commands.spawn(SculptTool::ball(0.009));
    commands.spawn(SculptTool::blade(0.03, 0.05));
}

/// A ball that is drawn over the clay and a knife that goes through it, to and fro.
fn press(time: Res<Time>, mut tools: Query<(&mut Transform, &SculptTool)>) {
    let t = time.elapsed_secs();
    for (mut place, tool) in &mut tools {
        place.translation = match tool.shape {
            ToolShape::Sphere { .. } => Vec3::new(0.012 * t.sin(), 0.033, -0.012),
            _ => Vec3::new(0.02 * (0.5 * t).sin(), 0.028, 0.012),
        };
    }
}

/// `enabled` is for all of it; `ClayGizmos` has a colour for each kind, and none for what is not drawn.
fn switch(keys: Res<ButtonInput<KeyCode>>, mut store: ResMut<GizmoConfigStore>) {
    if keys.just_pressed(KeyCode::KeyG) {
        let (config, _) = store.config_mut::<ClayGizmos>();
        config.enabled = !config.enabled;
    }
}

fn stage(mut commands: Commands) {
    // Bevy's near plane, 10 cm from the eye, would cut off clay of centimetres.
    let lens = PerspectiveProjection { near: 0.001, ..default() };
    let eye = Transform::from_xyz(0.06, 0.08, 0.09).looking_at(Vec3::Y * 0.015, Vec3::Y);
    commands.spawn((Camera3d::default(), Projection::Perspective(lens), eye));
    let sun = Transform::from_xyz(1.0, 2.0, 1.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((DirectionalLight::default(), sun));
}
