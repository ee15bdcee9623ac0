//! The window that shows how the clay is doing.

use super::plots::{RecentFrames, SPAN, Sample};
use crate::plugin::clay::Clay;
use crate::plugin::clock::ClayClock;
use crate::plugin::status::{ClayMetrics, ClayStatus};
use crate::sim::planner::RESIDUAL_MAX;
use bevy::prelude::*;
use bevy_egui::{EguiContexts, egui};
use egui_plot::{Line, Plot, PlotPoints};

/// Processor time \[ms\] that clay may take of a frame.
const MAIN_THREAD_MS_MAX: f64 = 2.0;
/// Room between the window and the edge of the screen \[points\].
pub(super) const MARGIN: f32 = 8.0;

/// Height of a window's title, at most, and of its frame [points].
const TITLE: f32 = 60.0;

/// What the window reads.
type Shown<'a> = (Entity, &'a ClayStatus, &'a ClayMetrics, &'a ClayClock);

/// The window.
pub(super) fn window(
    mut contexts: EguiContexts,
    clays: Query<Shown, With<Clay>>,
    history: Res<RecentFrames>,
    time: Res<Time<Real>>,
) {
    let Ok(ctx) = contexts.ctx_mut() else { return };
    if clays.is_empty() {
        return;
    }
    // In its first frame, which is not shown, the window is higher than the screen: unless it is kept off the
    // edge, it ends up there.
    let room = ctx.content_rect().shrink(MARGIN);
    let window = egui::Window::new("State").default_pos(room.right_top()).pivot(egui::Align2::RIGHT_TOP);
    let shown = |ui: &mut egui::Ui| {
        ui.set_max_width(280.0);
        // Rows of text alone are as high as that, however large what is pressed is.
        let height = ui.spacing().interact_size.y.min(1.3 * ui.text_style_height(&egui::TextStyle::Body));
        for shown @ (entity, status, ..) in &clays {
            let grid = egui::Grid::new(("state", entity)).num_columns(2).min_row_height(height);
            grid.show(ui, |ui| rows(ui, shown));
            trouble(ui, status);
        }
        let now = time.elapsed_secs_f64();
        ui.separator();
        plot(ui, ("tool force", "N"), "Greatest force of the clay on a tool, over the last 10 s.", now, &history, |s| s.force);
        plot(
            ui,
            ("engine frame", "ms"),
            "Wall time that the engine took for each frame, over the last 10 s.",
            now,
            &history,
            |s| s.frame_ms,
        );
    };
    window.constrain_to(room).resizable(false).show(ctx, |ui| scrolled(ui, room, shown));
}

/// Rows that have no room are scrolled.
pub(super) fn scrolled(ui: &mut egui::Ui, room: egui::Rect, rows: impl FnOnce(&mut egui::Ui)) {
    let height = room.height() - TITLE;
    // By itself what scrolls takes no more than a window's first height.
    egui::ScrollArea::vertical().max_height(height).min_scrolled_height(height).show(ui, rows);
}

/// A row of name and value.
pub(super) fn row(ui: &mut egui::Ui, name: &str, hover: &str, value: impl Into<egui::WidgetText>) {
    ui.label(name).on_hover_text(hover);
    ui.add(egui::Label::new(value).wrap()).on_hover_text(hover);
    ui.end_row();
}

/// The steps of the last frame in words.
fn steps(metrics: &ClayMetrics) -> String {
    let plural = if metrics.substeps == 1 { "" } else { "s" };
    match metrics {
        ClayMetrics { is_resting: true, .. } => "at rest".into(),
        ClayMetrics { passes: 0, substeps, .. } => format!("{substeps} explicit step{plural}"),
        ClayMetrics { passes, substeps, .. } => format!("{substeps} implicit step{plural}, {passes} passes"),
    }
}

fn rows(ui: &mut egui::Ui, (_, status, metrics, clock): (Entity, &ClayStatus, &ClayMetrics, &ClayClock)) {
    let engine = if status.engine.is_empty() { "starting" } else { &status.engine };
    row(ui, "engine", "What runs the clay, and on what.", engine);
    let clay = format!("{} particles, {:.2} mm cells", status.particle_count, status.cell_width * 1e3);
    row(ui, "clay", "Particles in motion, and the spacing of the grid.", clay);
    let pace = if clock.stands() { "paused".into() } else { format!("{:.2} x real time", metrics.rate) };
    row(ui, "clock", "The clay's own time, and how fast it goes.", format!("{:.2} s, {pace}", metrics.time));
    row(
        ui,
        "frame",
        "Wall time and steps of the engine's last frame.",
        format!("{:.1} ms, {}", metrics.frame_ms, steps(metrics)),
    );
    if metrics.passes > 0 {
        let poor = metrics.residual > RESIDUAL_MAX;
        let quality = egui::RichText::new(format!("{:.1} % out of balance", 100.0 * metrics.residual));
        let quality = if poor { quality.color(ui.visuals().warn_fg_color) } else { quality };
        row(
            ui,
            "quality",
            "Forces that implicit steps left out of balance, over those that the clay bears. Where it is much, the next frame has more steps.",
            quality,
        );
    }
    let t = &metrics.pass_ms;
    let passes = format!("{:.1} sort, {:.1} grid, {:.1} particles, {:.1} report", t.rebin, t.grid, t.particles, t.report);
    row(
        ui,
        "passes",
        "Parts of that frame in ms: sort into blocks; node sums and grid; gather and clay law; copies and sums.",
        passes,
    );
    let surface = format!("{:.1} ms, {} triangles", metrics.mesh_ms, metrics.triangle_count);
    row(ui, "surface", "Wall time of the last surface, on another thread.", surface);
    let held = egui::RichText::new(format!("{:.2} ms", metrics.main_thread_ms));
    let held = if metrics.main_thread_ms > MAIN_THREAD_MS_MAX { held.color(ui.visuals().warn_fg_color) } else { held };
    row(ui, "main thread", "Most processor time that the systems of all clay took of a frame in the last second.", held);
    let first = status.rest_volume;
    let change = if first > 0.0 && metrics.volume > 0.0 { 100.0 * (metrics.volume / first - 1.0) } else { 0.0 };
    let volume = format!("{:.2} cm³ ({change:+.2} %)", metrics.volume * 1e6);
    row(ui, "volume", "Volume of the clay now, against what it was unloaded at the start.", volume);
}

/// Health and errors in words.
fn trouble(ui: &mut egui::Ui, status: &ClayStatus) {
    let say = |ui: &mut egui::Ui, text: &str, colour| {
        ui.add(egui::Label::new(egui::RichText::new(text).color(colour)).wrap());
    };
    match &status.error {
        Some(error) => say(ui, &error.to_string(), ui.visuals().error_fg_color),
        None if status.health.is_ok() => say(ui, "healthy", ui.visuals().text_color()),
        None => say(ui, &status.health.to_string(), ui.visuals().warn_fg_color),
    }
    for warning in &status.warnings {
        say(ui, warning, ui.visuals().warn_fg_color);
    }
}

/// A curve of the last seconds under its name, with its last and its greatest value in numbers.
fn plot(
    ui: &mut egui::Ui,
    (name, unit): (&str, &str),
    hover: &str,
    now: f64,
    history: &RecentFrames,
    value: impl Fn(&Sample) -> f64,
) {
    let points: Vec<[f64; 2]> = history.samples().map(|s| [s.time - now, value(s)]).filter(|[age, _]| *age >= -SPAN).collect();
    let last = points.last().map_or(0.0, |p| p[1]);
    let greatest = points.iter().map(|p| p[1]).fold(0.0, f64::max);
    ui.label(format!("{name}: {last:.1} {unit}, at most {greatest:.1} {unit}")).on_hover_text(hover);
    Plot::new(name)
        .height(72.0)
        .include_x(-SPAN)
        .include_x(0.0)
        .include_y(0.0)
        // Nothing at all lies at the bottom, not in the middle.
        .include_y(0.1)
        .show_x(false)
        .show_axes([true, false])
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .x_axis_formatter(|mark, _| format!("{:.0} s", mark.value))
        .show(ui, |ui| ui.line(Line::new(name, PlotPoints::from(points))));
}
