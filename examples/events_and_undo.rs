//! Undo, redo, reset, export by keys, with answers: `cargo demo events_and_undo`.

use bevy::prelude::*;
use bevy_clay::prelude::*;

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, ClayPlugins))
        .add_systems(Startup, (spawn, stage))
        .add_systems(Update, (ask, press.in_set(ClaySystems::Tool)))
        .add_observer(|done: On<ClayChanged>| info!("{:?}", done.change))
        .add_observer(|done: On<ClayExported>| info!("wrote {:?}", done.files))
        .add_observer(|trouble: On<ClayTrouble>| warn!("{}", trouble.error))
        .run()
}

fn spawn(mut commands: Commands) {
    // A history keeps the clay as it stands after each stroke, within 256 MiB.
    commands.spawn((Clay::block(Vec3::new(0.05, 0.03, 0.05)).with_cell_width(0.0035), ClayHistory::default()));
    commands.spawn(SculptTool::ball(0.009));
}

/// U takes a stroke back, Y does it again, R goes back to the start, E writes a file.
fn ask(keys: Res<ButtonInput<KeyCode>>, clay: Single<Entity, With<Clay>>, mut commands: Commands) {
    let entity = *clay;
    for key in keys.get_just_pressed() {
        match key {
            KeyCode::KeyU => commands.trigger(UndoClay { entity }),
            KeyCode::KeyY => commands.trigger(RedoClay { entity }),
            KeyCode::KeyR => commands.trigger(ResetClay { entity }),
            KeyCode::KeyE => commands.trigger(ExportClay { entity, path: "out/clay.stl".into(), options: default() }),
            _ => {}
        }
    }
}

/// Dab after dab, each a stroke.
fn press(time: Res<Time>, mut ball: Single<&mut Transform, With<SculptTool>>) {
    let t = time.elapsed_secs();
    ball.translation = Vec3::new(0.014 * (0.3 * t).sin(), 0.04 - 0.008 * (2.0 * t).sin(), 0.014 * (0.3 * t).cos());
}

fn stage(mut commands: Commands) {
    // Bevy's near plane, 10 cm from the eye, would cut off clay of centimetres.
    let lens = PerspectiveProjection { near: 0.001, ..default() };
    let eye = Transform::from_xyz(0.07, 0.09, 0.11).looking_at(Vec3::Y * 0.01, Vec3::Y);
    commands.spawn((Camera3d::default(), Projection::Perspective(lens), eye));
    let sun = Transform::from_xyz(1.0, 2.0, 1.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((DirectionalLight::default(), sun));
}
