//! Keys, the bar of tools, and the help.

use crate::args::Args;
use crate::pace::Pace;
use crate::stroke::Work;
use crate::tools::{DEPTHS, Hand, SIZES, ToolKind};
use crate::watch::Watch;
use bevy::prelude::*;
use bevy_clay::prelude::*;
use bevy_clay::scene::export::free_file;
use bevy_egui::input::EguiWantsInput;
use bevy_egui::{EguiContexts, egui};

/// Whether the help is open.
#[derive(Resource, Default)]
pub(crate) struct Help(bool);

/// What the keys and the mouse do.
const CONTROLS: [(&str, &str); 13] = [
    ("left button", "press the tool in; hold for depth, drag to draw; with the knife, draw the cut"),
    ("wheel while pressing", "deeper or shallower"),
    ("right or middle drag", "turn the view"),
    ("Shift + right drag", "move the view"),
    ("wheel", "zoom"),
    ("1 2 3 4 5", "ball, rod, block, board, knife"),
    ("[ ]  or  Shift+B, B", "smaller, larger tool"),
    ("U  or  Ctrl+Z", "take the last stroke back"),
    ("Ctrl+Y", "do it again"),
    ("Space", "pause"),
    ("R", "reset the clay"),
    ("E", "export the surface"),
    ("H, Esc", "this help, quit"),
];

/// What keys change.
type KeysOf<'a> = (Res<'a, ButtonInput<KeyCode>>, Res<'a, EguiWantsInput>);

/// Keys.
pub(crate) fn keys(
    (keys, egui): KeysOf,
    clay: Single<(Entity, &mut ClayClock), With<Clay>>,
    work: Res<Work>,
    (mut hand, mut help, mut watch): (ResMut<Hand>, ResMut<Help>, ResMut<Watch>),
    args: Res<Args>,
    mut commands: Commands,
) {
    const STEP: f32 = 1.15;
    if egui.wants_keyboard_input() {
        return;
    }
    let (entity, mut clock) = clay.into_inner();
    let digits = [KeyCode::Digit1, KeyCode::Digit2, KeyCode::Digit3, KeyCode::Digit4, KeyCode::Digit5];
    for (key, kind) in digits.into_iter().zip(ToolKind::ALL) {
        // The tool in the clay stays what it is until it is lifted.
        if keys.just_pressed(key) && work.stroke.is_none() {
            hand.kind = kind;
        }
    }
    let is_shifted = keys.any_pressed([KeyCode::ShiftLeft, KeyCode::ShiftRight]);
    if keys.just_pressed(KeyCode::BracketRight) || (keys.just_pressed(KeyCode::KeyB) && !is_shifted) {
        hand.resize(STEP);
    }
    if keys.just_pressed(KeyCode::BracketLeft) || (keys.just_pressed(KeyCode::KeyB) && is_shifted) {
        hand.resize(1.0 / STEP);
    }
    let is_control = keys.any_pressed([KeyCode::ControlLeft, KeyCode::ControlRight]);
    if work.stroke.is_none() && (keys.just_pressed(KeyCode::KeyU) || (is_control && keys.just_pressed(KeyCode::KeyZ))) {
        commands.trigger(UndoClay { entity });
    }
    if work.stroke.is_none() && is_control && keys.just_pressed(KeyCode::KeyY) {
        commands.trigger(RedoClay { entity });
    }
    if keys.just_pressed(KeyCode::Space) {
        clock.paused = !clock.paused;
    }
    if keys.just_pressed(KeyCode::KeyR) {
        commands.trigger(ResetClay { entity });
    }
    if keys.just_pressed(KeyCode::KeyE) {
        match free_file(&args.out, ExportFormat::default()) {
            Ok(path) => commands.trigger(ExportClay { entity, path, options: ExportOptions::default() }),
            Err(error) => warn!("{error}"),
        }
    }
    if keys.just_pressed(KeyCode::KeyH) {
        help.0 = !help.0;
    }
    if keys.just_pressed(KeyCode::Escape) {
        watch.is_over = true;
    }
}

/// The bar of tools.
pub(crate) fn bar(
    mut contexts: EguiContexts,
    (mut hand, mut help): (ResMut<Hand>, ResMut<Help>),
    (work, pace, watch): (Res<Work>, Res<Pace>, Res<Watch>),
    clay: Single<&ClayClock>,
) {
    let Ok(ctx) = contexts.ctx_mut() else { return };
    let frame = egui::Window::new("tools").title_bar(false).resizable(false).anchor(egui::Align2::CENTER_BOTTOM, [0.0, -8.0]);
    frame.show(ctx, |ui| {
        ui.horizontal(|ui| {
            ui.add_enabled_ui(work.stroke.is_none(), |ui| {
                for (number, kind) in (1..).zip(ToolKind::ALL) {
                    ui.selectable_value(&mut hand.bypass_change_detection().kind, kind, format!("{number} {}", kind.name()))
                        .on_hover_text(kind.hover());
                }
            });
            ui.separator();
            ui.spacing_mut().slider_width = 80.0;
            let size = egui::Slider::new(&mut hand.size, SIZES).logarithmic(true).show_value(false);
            ui.add(size).on_hover_text("Size of the tool; [ and ] change it too.");
            ui.label(format!("{:.1} mm", 2e3 * hand.unit * hand.size)).on_hover_text("Size of the tool.");
            ui.separator();
            let depth = egui::Slider::new(&mut hand.depth, DEPTHS).logarithmic(true).show_value(false);
            ui.add(depth).on_hover_text("How deep the tool goes when held; the wheel changes it while you press.");
            ui.label(format!("{:.1} mm deep", 1e3 * hand.depth_max())).on_hover_text("How deep the tool goes when held.");
            ui.separator();
            ui.toggle_value(&mut help.0, "help").on_hover_text("What mouse and keys do (H).");
        });
        let state = match (clay.paused, pace.is_at_rest) {
            (true, _) => "paused",
            (_, true) => "the clay is at rest",
            _ => "the clay moves",
        };
        let answer = watch.answers.last().map_or(String::new(), |ms| format!(", answered in {ms:.0} ms"));
        ui.label(format!("left button presses, right button turns, wheel zooms, H for help; {state}{answer}"));
    });
}

/// The help.
pub(crate) fn help(mut contexts: EguiContexts, mut help: ResMut<Help>) {
    let Ok(ctx) = contexts.ctx_mut() else { return };
    egui::Window::new("Help").open(&mut help.0).resizable(false).anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0]).show(
        ctx,
        |ui| {
            egui::Grid::new("controls").num_columns(2).spacing([20.0, 4.0]).show(ui, |ui| {
                for (input, effect) in CONTROLS {
                    ui.strong(input);
                    ui.label(effect);
                    ui.end_row();
                }
            });
        },
    );
}
