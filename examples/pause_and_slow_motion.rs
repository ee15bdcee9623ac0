//! The clay's own clock: Space pauses it, S makes it ten times slower: `cargo demo pause_and_slow_motion`.

use bevy::prelude::*;
use bevy_clay::prelude::*;

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, ClayPlugins))
        .add_systems(Startup, (spawn, stage))
        .add_systems(Update, (clock.before(ClaySystems::Report), title.after(ClaySystems::Show)))
        .run()
}

fn spawn(mut commands: Commands) {
    // Putty slumps by its own weight: something to watch.
    let clay = Clay::block(Vec3::new(0.02, 0.05, 0.02)).with_cell_width(0.003);
    commands.spawn((clay, Preset::Putty.material()));
}

/// The app's other clocks go on as they are.
fn clock(keys: Res<ButtonInput<KeyCode>>, mut clock: Single<&mut ClayClock>) {
    if keys.just_pressed(KeyCode::Space) {
        clock.paused = !clock.paused;
    }
    if keys.just_pressed(KeyCode::KeyS) {
        clock.speed = if clock.speed < 1.0 { 1.0 } else { 0.1 };
    }
}

/// A machine that is too slow for the clay shows it slower than its clock: `rate` is what came of it.
fn title(clay: Single<(&ClayClock, &ClayMetrics)>, mut window: Single<&mut Window>) {
    let (clock, metrics) = *clay;
    let state = if clock.paused { "paused".into() } else { format!("speed {}, {:.2} reached", clock.speed, metrics.rate) };
    window.title = format!("Space pauses, S slows down: {:.2} s, {state}", metrics.time);
}

fn stage(mut commands: Commands) {
    // Bevy's near plane, 10 cm from the eye, would cut off clay of centimetres.
    let lens = PerspectiveProjection { near: 0.001, ..default() };
    let eye = Transform::from_xyz(0.07, 0.09, 0.11).looking_at(Vec3::Y * 0.01, Vec3::Y);
    commands.spawn((Camera3d::default(), Projection::Perspective(lens), eye));
    let sun = Transform::from_xyz(1.0, 2.0, 1.0).looking_at(Vec3::ZERO, Vec3::Y);
    commands.spawn((DirectionalLight::default(), sun));
}
