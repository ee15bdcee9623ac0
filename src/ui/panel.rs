//! The window that changes the clay.

use super::material::{self, Row};
use super::notice::ClayNotice;
use super::status::{MARGIN, scrolled};
use crate::plugin::clay::{ClaySettings, EngineChoice, MeshQuality, SurfaceBackend};
use crate::plugin::clock::ClayClock;
use crate::plugin::events::{DropOffcuts, ExportClay, RedoClay, ResampleClay, ResetClay, UndoClay};
use crate::plugin::status::{ClayMetrics, ClayStatus};
use crate::plugin::undo::ClayHistory;
use crate::scene::export::{BodyFiles, ExportFormat, ExportOptions, free_file};
use crate::sim::material::ClayMaterial;
use crate::sim::planner::{InertiaScaling, IntegratorChoice, StepAccuracy};
use bevy::prelude::*;
use bevy_egui::{EguiContexts, egui};
use std::path::PathBuf;

/// Where exports go.
#[derive(Resource, Clone, Debug)]
pub(super) struct ExportFolder(pub(super) PathBuf);

/// What the window holds beside the clay.
#[derive(Resource, Clone, Debug, Default)]
pub(super) struct PanelState {
    /// The piece of clay that is shown, if there are several.
    selected: Option<Entity>,
    /// Cell width \[m\] while it is being chosen.
    cell_width: Option<f64>,
    format: ExportFormat,
    /// Whether each piece is exported into a file of its own.
    is_apart: bool,
}

/// Cells per cell that the slider offers: a quarter to four times the width the clay was last put on.
const GRID_RANGE: f64 = 4.0;

/// What the window changes.
type Shown<'a> = (
    Entity,
    Option<&'a Name>,
    Option<&'a ClayHistory>,
    (&'a ClayStatus, &'a ClayMetrics),
    (&'a mut ClayMaterial, &'a mut ClaySettings, &'a mut ClayClock),
);

/// The window.
pub(super) fn window(
    mut contexts: EguiContexts,
    mut clays: Query<Shown>,
    mut state: ResMut<PanelState>,
    folder: Res<ExportFolder>,
    mut notice: ResMut<ClayNotice>,
    mut commands: Commands,
) {
    let Ok(ctx) = contexts.ctx_mut() else { return };
    let mut names: Vec<(Entity, String)> =
        clays.iter().map(|(e, name, ..)| (e, name.map_or_else(|| e.to_string(), ToString::to_string))).collect();
    names.sort();
    let Some(entity) = state.selected.filter(|e| clays.contains(*e)).or_else(|| names.first().map(|n| n.0)) else { return };
    let Ok((_, _, history, doing, (mut clay_material, mut clay_settings, mut clay_clock))) = clays.get_mut(entity) else {
        return;
    };
    let room = ctx.content_rect().shrink(MARGIN);
    let window = egui::Window::new("Clay").default_pos(room.left_top()).constrain_to(room).resizable(false);
    let shown = |ui: &mut egui::Ui| {
        ui.spacing_mut().slider_width = 110.0;
        if names.len() > 1 {
            for (other, name) in &names {
                ui.selectable_value(&mut state.selected, Some(*other), name);
            }
        }
        egui::Grid::new("clay rows").num_columns(2).show(ui, |ui| {
            let mut material = *clay_material;
            material::rows(ui, &mut material);
            clay_material.set_if_neq(material);
            if let Some(width) = grid_row(ui, &mut state, doing) {
                commands.trigger(ResampleClay { entity, cell_width: width });
            }
            let mut settings = clay_settings.clone();
            choices(ui, &mut settings);
            clay_settings.set_if_neq(settings);
        });
        ui.separator();
        let mut clock = *clay_clock;
        buttons(ui, entity, &mut clock, history, &mut commands);
        clay_clock.set_if_neq(clock);
        if let Some(options) = export_row(ui, &mut state) {
            match free_file(&folder.0, state.format) {
                Ok(path) => commands.trigger(ExportClay { entity, path, options }),
                Err(error) => notice.warn(error.to_string()),
            }
        }
        if !notice.text.is_empty() {
            let colour = if notice.is_error { ui.visuals().error_fg_color } else { ui.visuals().text_color() };
            ui.set_max_width(310.0);
            ui.add(egui::Label::new(egui::RichText::new(&notice.text).color(colour)).wrap());
        }
    };
    window.show(ctx, |ui| scrolled(ui, room, shown));
}

/// The cell width; some when the user has let go of another one.
fn grid_row(ui: &mut egui::Ui, state: &mut PanelState, (status, metrics): (&ClayStatus, &ClayMetrics)) -> Option<f64> {
    let now = status.cell_width;
    if now <= 0.0 {
        return None;
    }
    let row = Row::logarithmic(
        "cell width",
        "Spacing of the grid, with 8 particles per cell. Taken when you let go: the shape is filled anew. Half the width shows half as small a detail, with 8 times the particles and 16 times the work.",
        (1e-3, " mm"),
        now * 1e3 / GRID_RANGE..=now * 1e3 * GRID_RANGE,
        2,
    );
    let mut width = state.cell_width.unwrap_or(now);
    let response = row.show(ui, &mut width);
    let ratio = now / width;
    let (particles, work) = (status.particle_count as f64 * ratio.powi(3), metrics.frame_ms * ratio.powi(4));
    ui.label("");
    ui.label(format!("{} particles, about {work:.0} ms a frame", thousands(particles)));
    ui.end_row();
    if response.changed() {
        state.cell_width = Some(width);
    }
    // Dragged and let go, or typed and left.
    let is_done = response.drag_stopped() || (state.cell_width.is_some() && !response.dragged() && !response.has_focus());
    (is_done && !response.dragged()).then(|| state.cell_width.take()).flatten().filter(|w| (w / now - 1.0).abs() > 1e-3)
}

/// A whole number with its thousands apart.
fn thousands(number: f64) -> String {
    let digits = format!("{number:.0}");
    let mut text = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(c);
    }
    text
}

/// Engine, inertia, surface.
fn choices(ui: &mut egui::Ui, settings: &mut ClaySettings) {
    let engines = [(EngineChoice::Auto, "best there is"), (EngineChoice::Native, "CPU"), (EngineChoice::Gpu, "GPU")];
    let hover = "What runs the clay. The best there is: with explicit steps the GPU where the app draws with one, else the CPU. The clay moves over as it stands.";
    choice(ui, "engine", hover, &mut settings.engine, &engines);
    let integrators = [
        (IntegratorChoice::Explicit, "explicit"),
        (IntegratorChoice::Auto, "by what it does"),
        (IntegratorChoice::Implicit, "implicit"),
    ];
    let hover = "How the clay's time goes on. Implicit steps follow how far tools go, explicit ones how fast sound is: many more, and exact in flight. By what it does: implicit under tools and at rest.";
    choice(ui, "steps", hover, &mut settings.integrator, &integrators);
    let accuracies = [(StepAccuracy::Interactive, "fast"), (StepAccuracy::Fine, "fine")];
    let hover = "How finely implicit steps follow a tool: fine ones take twice the time for half the error.";
    choice(ui, "accuracy", hover, &mut settings.accuracy, &accuracies);
    let inertia = [(InertiaScaling::Off, "as it is"), (InertiaScaling::Accurate, "accurate"), (InertiaScaling::Fast, "fast")];
    let hover = "Heavier clay in explicit steps while a tool presses clay that lies on something: fewer of them, forces off by 1.5 % (accurate) or 3 % (fast).";
    choice(ui, "inertia", hover, &mut settings.inertia, &inertia);
    let surfaces = [(MeshQuality::Off, "none"), (MeshQuality::Coarse, "coarse"), (MeshQuality::Fine, "fine")];
    let hover = "The surface that is drawn: coarse has a quarter of the triangles of fine.";
    choice(ui, "surface", hover, &mut settings.mesh, &surfaces);
    let makers = [(SurfaceBackend::Auto, "best there is"), (SurfaceBackend::Cpu, "CPU"), (SurfaceBackend::Gpu, "GPU")];
    let hover = "Where the surface is made. On the GPU the frame drawn is the frame simulated.";
    choice(ui, "made on", hover, &mut settings.surface, &makers);
}

fn choice<T: Copy + PartialEq>(ui: &mut egui::Ui, name: &str, hover: &str, value: &mut T, choices: &[(T, &str)]) {
    ui.label(name).on_hover_text(hover);
    ui.horizontal(|ui| {
        for (choice, text) in choices {
            ui.selectable_value(value, *choice, *text).on_hover_text(hover);
        }
    });
    ui.end_row();
}

/// Pause, reset, offcuts, undo and redo.
fn buttons(ui: &mut egui::Ui, entity: Entity, clock: &mut ClayClock, history: Option<&ClayHistory>, commands: &mut Commands) {
    ui.horizontal(|ui| {
        ui.toggle_value(&mut clock.paused, "pause").on_hover_text("Stops the clay's time. Tools then move without touching it.");
        if ui.button("reset").on_hover_text("Back to the shape at the start. Grid and material stay as they are.").clicked() {
            commands.trigger(ResetClay { entity });
        }
        let hover = "Removes every piece but the largest: what a cut has parted from it.";
        if ui.button("drop offcuts").on_hover_text(hover).clicked() {
            commands.trigger(DropOffcuts { entity });
        }
        let Some(history) = history else { return };
        let button = |ui: &mut egui::Ui, name, count: usize, hover: &str| {
            ui.add_enabled(count > 0, egui::Button::new(name)).on_hover_text(format!("{hover} {count} are left.")).clicked()
        };
        if button(ui, "undo", history.undo_count(), "Takes the last stroke or change back.") {
            commands.trigger(UndoClay { entity });
        }
        if button(ui, "redo", history.redo_count(), "Does again what was taken back last.") {
            commands.trigger(RedoClay { entity });
        }
    });
}

/// What is to be exported, and how; some when the button is pressed.
fn export_row(ui: &mut egui::Ui, state: &mut PanelState) -> Option<ExportOptions> {
    let row = ui.horizontal(|ui| {
        let is_asked = ui.button("export").on_hover_text("Writes the surface, closed, into a new file.").clicked();
        for format in ExportFormat::ALL {
            let name = format.extension().to_uppercase();
            ui.selectable_value(&mut state.format, format, name)
                .on_hover_text("Format of the exported surface: in mm, GLB in m.");
        }
        ui.checkbox(&mut state.is_apart, "a file per piece")
            .on_hover_text("Each piece into a file of its own, the largest first.");
        is_asked
    });
    let bodies = if state.is_apart { BodyFiles::Apart } else { BodyFiles::Together };
    row.inner.then(|| ExportOptions { bodies, ..ExportOptions::default() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_stand_apart() {
        assert_eq!([0.0, 999.4, 1000.0, 123_456.0, 1e7].map(thousands), ["0", "999", "1,000", "123,456", "10,000,000"]);
    }
}
