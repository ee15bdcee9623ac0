//! Keys that ask something of the clay, which answers by events, and the one that quits.

use crate::stroke::Stroke;
use bevy::input::common_conditions::input_just_pressed;
use bevy::prelude::*;
use bevy_clay::prelude::*;
use bevy_clay::scene::export::free_file;
use bevy_egui::input::egui_wants_any_keyboard_input;
use std::path::PathBuf;

/// Undo, redo, reset, export, pause, quit.
pub(crate) struct KeysPlugin {
    /// Where exported files go.
    pub(crate) export_folder: PathBuf,
}

impl Plugin for KeysPlugin {
    fn build(&self, app: &mut App) {
        let systems = (
            undo_and_redo.run_if(not(resource_exists::<Stroke>)),
            pause.run_if(input_just_pressed(KeyCode::Space)),
            reset.run_if(input_just_pressed(KeyCode::KeyR)),
            export.run_if(input_just_pressed(KeyCode::KeyE)),
            quit.run_if(input_just_pressed(KeyCode::Escape)),
        );
        app.insert_resource(ExportFolder(self.export_folder.clone()))
            .add_systems(Update, systems.run_if(not(egui_wants_any_keyboard_input)).before(ClaySystems::Report));
    }
}

#[derive(Resource)]
struct ExportFolder(PathBuf);

fn undo_and_redo(keys: Res<ButtonInput<KeyCode>>, clay: Single<Entity, With<Clay>>, mut commands: Commands) {
    let entity = *clay;
    let is_control = keys.any_pressed([KeyCode::ControlLeft, KeyCode::ControlRight]);
    if keys.just_pressed(KeyCode::KeyU) || (is_control && keys.just_pressed(KeyCode::KeyZ)) {
        commands.trigger(UndoClay { entity });
    }
    if is_control && keys.just_pressed(KeyCode::KeyY) {
        commands.trigger(RedoClay { entity });
    }
}

fn pause(mut clock: Single<&mut ClayClock>) {
    clock.paused = !clock.paused;
}

fn reset(clay: Single<Entity, With<Clay>>, mut commands: Commands) {
    commands.trigger(ResetClay { entity: *clay });
}

fn export(clay: Single<Entity, With<Clay>>, folder: Res<ExportFolder>, mut notice: ResMut<ClayNotice>, mut commands: Commands) {
    match free_file(&folder.0, ExportFormat::default()) {
        Ok(path) => commands.trigger(ExportClay { entity: *clay, path, options: ExportOptions::default() }),
        Err(error) => notice.warn(error.to_string()),
    }
}

fn quit(mut exit: MessageWriter<AppExit>) {
    exit.write(AppExit::Success);
}
