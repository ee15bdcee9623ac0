//! egui beside the clay's own panels: the bar of tools, the help, and the camera that they are drawn by.

use crate::hand::{DEPTHS, Hand, SIZES, ToolKind};
use crate::pace::Pace;
use crate::stroke::Stroke;
use crate::view::Orbit;
use bevy::input::common_conditions::input_just_pressed;
use bevy::prelude::*;
use bevy::render::renderer::RenderAdapterInfo;
use bevy_clay::prelude::*;
use bevy_egui::input::egui_wants_any_keyboard_input;
use bevy_egui::{EguiContexts, EguiGlobalSettings, EguiPrimaryContextPass, PrimaryEguiContext, egui};
use wgpu::DeviceType;

/// Draws the bar and the help; gives one camera the panels.
pub(crate) struct HudPlugin;

impl Plugin for HudPlugin {
    fn build(&self, app: &mut App) {
        let toggle = toggle_help.run_if(input_just_pressed(KeyCode::KeyH)).run_if(not(egui_wants_any_keyboard_input));
        app.insert_resource(EguiGlobalSettings { auto_create_primary_context: false, ..default() })
            .init_resource::<Help>()
            .add_observer(put_on_view)
            .add_observer(put_on_screen)
            .add_systems(Update, toggle)
            .add_systems(EguiPrimaryContextPass, (bar, help).chain());
    }
}

/// The first view has the panels, unless a processor draws.
fn put_on_view(
    view: On<Add, Orbit>,
    adapter: Res<RenderAdapterInfo>,
    panels: Query<(), With<PrimaryEguiContext>>,
    mut commands: Commands,
) {
    if adapter.device_type != DeviceType::Cpu && panels.is_empty() {
        commands.entity(view.entity).insert(PrimaryEguiContext);
    }
}

/// Where a processor draws, the panels stand over the small picture, in the window's own pixels.
fn put_on_screen(screen: On<Add, ScreenCamera>, panels: Query<(), With<PrimaryEguiContext>>, mut commands: Commands) {
    if panels.is_empty() {
        commands.entity(screen.entity).insert(PrimaryEguiContext);
    }
}

/// Whether the help is open.
#[derive(Resource, Default)]
struct Help(bool);

fn toggle_help(mut help: ResMut<Help>) {
    help.0 = !help.0;
}

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

/// The bar of tools.
fn bar(
    mut contexts: EguiContexts,
    (mut hand, mut help): (ResMut<Hand>, ResMut<Help>),
    (stroke, pace): (Option<Res<Stroke>>, Res<Pace>),
    clay: Single<&ClayClock>,
) {
    let Ok(ctx) = contexts.ctx_mut() else { return };
    let frame = egui::Window::new("tools").title_bar(false).resizable(false).anchor(egui::Align2::CENTER_BOTTOM, [0.0, -8.0]);
    frame.show(ctx, |ui| {
        ui.horizontal(|ui| {
            ui.add_enabled_ui(stroke.is_none(), |ui| {
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
        ui.label(format!("left button presses, right button turns, wheel zooms, H for help; {state}"));
    });
}

/// The help.
fn help(mut contexts: EguiContexts, mut help: ResMut<Help>) {
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
