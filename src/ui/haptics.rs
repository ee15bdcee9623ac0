//! The window of a tool in an arm's hand: device, force, loop, stages of safety, and the choices that go with
//! them.

use super::status::{MARGIN, row};
use crate::haptics::device::DeviceInfo;
use crate::haptics::guarded::HandPulse;
use crate::haptics::safety::Stage;
use crate::haptics::servo::{Mode, Placement, ServoSample};
use crate::plugin::feel::session::{HapticLatency, HapticPhase, HapticSession};
use crate::plugin::feel::settings::HapticSettings;
use bevy::prelude::*;
use bevy_egui::{EguiContexts, egui};
use egui_plot::{Legend, Line, Plot, PlotPoints};
use glam::{DQuat, DVec3};

/// How long the plot shows \[s\]: what a session keeps of a hand.
const SPAN: f64 = 2.0;
/// Samples of a plot's point: a pixel has three of them, and shows the greatest.
const SAMPLES_PER_POINT: usize = 4;
/// Jitter \[s\] and rate \[Hz\] from which on a hand notices that the loop is held up.
const JITTER_MAX: f64 = 5e-4;
const RATE_MIN: f64 = 900.0;

/// The ways to make a force, with their names.
const MODES: [(Mode, &str, &str); 5] = [
    (Mode::Coupled, "coupled", "The clay's contact at the hand's present place: what clay and hand give each other is the same."),
    (Mode::GodObject, "nearest place", "A spring to the nearest place outside the clay, with friction."),
    (Mode::PaperAnchor { relaxes: true }, "anchor", "A spring to where the tool came to the clay, which gives way with it."),
    (Mode::PaperAnchor { relaxes: false }, "anchor, as published", "The same, which gives all back on the way out."),
    (Mode::ContactImpulse, "clay frames", "The clay's own force, some frames late: to compare, no force for a firm hand."),
];

/// The window.
pub(super) fn window(mut contexts: EguiContexts, session: Res<HapticSession>, mut tools: Query<&mut HapticSettings>) {
    let Ok(ctx) = contexts.ctx_mut() else { return };
    let Some(mut settings) = session.tool().and_then(|tool| tools.get_mut(tool).ok()) else { return };
    let room = ctx.content_rect().shrink(MARGIN);
    let window = egui::Window::new("Haptics").default_pos(room.right_bottom()).pivot(egui::Align2::RIGHT_BOTTOM);
    window.constrain_to(room).resizable(false).show(ctx, |ui| {
        ui.set_max_width(280.0);
        ui.set_min_width(280.0);
        egui::Grid::new("haptics").num_columns(2).show(ui, |ui| {
            device(ui, &session);
            if let Some(pulse) = session.pulse() {
                hand_loop(ui, pulse, &session.latency());
            }
        });
        ui.separator();
        plot(ui, &session);
        let mut chosen = settings.clone();
        ui.checkbox(&mut chosen.has_force, "force").on_hover_text("Off, all force is gone within 20 ms.");
        ui.collapsing("choices", |ui| choices(ui, &mut chosen));
        settings.set_if_neq(chosen);
        if let Some(error) = session.refused() {
            ui.colored_label(ui.visuals().error_fg_color, error.to_string());
        }
        if let Some(pulse) = session.pulse() {
            ui.collapsing("safety", |ui| stages(ui, pulse));
        }
    });
}

/// What has the hand.
fn device(ui: &mut egui::Ui, session: &HapticSession) {
    let phase = match session.phase() {
        HapticPhase::Closed => "closed",
        HapticPhase::Changing => "opening",
        HapticPhase::Arm => "runs",
        HapticPhase::StandIn => "stands in",
        HapticPhase::Failed => "failed",
    };
    let buttons: String = (0..2).map(|bit| if session.buttons() >> bit & 1 == 1 { '●' } else { '○' }).collect();
    let (name, about) = session.device().map_or_else(Default::default, about);
    let hover = format!("The device that runs the loop of force, and its buttons. {about}");
    row(ui, "arm", hover.trim_end(), format!("{name}, {phase} {buttons}"));
    if let Some(message) = session.message() {
        let words = egui::RichText::new(message).color(ui.visuals().warn_fg_color);
        row(ui, "", "What the device says.", words);
    }
}

/// A device's name, and what it can do.
fn about(info: &DeviceInfo) -> (&str, String) {
    let DeviceInfo { name, serial, force_max, continuous_force_max, freedoms: [sensed, driven], .. } = info;
    let serial = if serial.is_empty() { String::new() } else { format!(" Serial number {serial}.") };
    let force = format!("{force_max:.2} N at most, {continuous_force_max:.2} N for long");
    (name, format!("{sensed} axes sensed, {driven} driven; {force}.{serial}"))
}

/// How the loop goes.
fn hand_loop(ui: &mut egui::Ui, pulse: &HandPulse, latency: &HapticLatency) {
    let timing = &pulse.timing;
    let late = timing.jitter > JITTER_MAX || (timing.rate > 0.0 && timing.rate < RATE_MIN);
    let text =
        format!("{:.0} Hz, jitter {:.0} us, at most {:.1} ms", timing.rate, timing.jitter * 1e6, timing.interval_max * 1e3);
    let text = egui::RichText::new(text);
    let text = if late { text.color(ui.visuals().warn_fg_color) } else { text };
    row(ui, "loop", "Ticks of the device in the last half second: rate, spread, and the longest time between two.", text);
    let ms = |time: f64| time * 1e3;
    let frames = latency.model_interval;
    let rate = if frames.mean > 0.0 { 1.0 / frames.mean } else { 0.0 };
    let (now, age) = (ms(pulse.sample.age.min(9.999)), ms(latency.model_age.mean));
    let models = format!("{rate:.0} Hz, {:.0} ms apart at most; {now:.0} ms old, on average {age:.0}", ms(frames.greatest));
    let hover = "Models of the clay a second, the longest time between two, and how old what is known of the clay is. From 33 ms on the force fades.";
    row(ui, "models", hover, models);
    let (model, picture) = (ms(latency.pose_to_model.mean), ms(latency.pose_to_picture.mean));
    let late = format!("force {:.0} us, model {model:.0} ms, picture {picture:.0} ms", latency.pose_to_force.mean * 1e6);
    let hover = "How late things are, on average since the arm was opened. Force: what a tick takes to make one of a pose. Model: from a pose to the first model of the clay that knows of it. Picture: from a pose to the end of the app's frame that draws the tool there.";
    row(ui, "from pose to", hover, late);
}

/// Force on the hand and of the clay, over the last seconds.
fn plot(ui: &mut egui::Ui, session: &HapticSession) {
    let samples: Vec<&ServoSample> = session.samples().collect();
    let now = samples.last().map_or(0.0, |sample| sample.time);
    let curve = |force: fn(&ServoSample) -> f64| -> Vec<[f64; 2]> {
        let point = |of: &[&ServoSample]| [of[0].time - now, of.iter().map(|s| force(s)).fold(0.0, f64::max)];
        samples.chunks(SAMPLES_PER_POINT).map(point).collect()
    };
    let (felt, clay) = (curve(|s| s.hand_force.length()), curve(|s| s.clay_force.length()));
    let (last, most) = (felt.last().map_or(0.0, |p| p[1]), felt.iter().map(|p| p[1]).fold(0.0, f64::max));
    let hover = "Force on the hand, behind the stages of safety, and of the clay, over the last 2 s at 1 kHz.";
    ui.label(format!("force on the hand: {last:.2} N, at most {most:.2} N")).on_hover_text(hover);
    Plot::new("force on the hand")
        .height(80.0)
        .legend(Legend::default())
        .include_x(-SPAN)
        .include_x(0.0)
        .include_y(0.0)
        .include_y(0.1)
        .show_x(false)
        .show_axes([true, true])
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .x_axis_formatter(|mark, _| format!("{:.1} s", mark.value))
        .y_axis_formatter(|mark, _| format!("{:.1} N", mark.value))
        .show(ui, |ui| {
            ui.line(Line::new("clay", PlotPoints::from(clay)));
            ui.line(Line::new("hand", PlotPoints::from(felt)));
        });
}

/// What a hand may choose.
fn choices(ui: &mut egui::Ui, settings: &mut HapticSettings) {
    egui::Grid::new("haptic choices").num_columns(2).show(ui, |ui| {
        ui.label("mode").on_hover_text("Where the force comes from.");
        let name = MODES.iter().find(|(mode, ..)| *mode == settings.mode).map_or("", |(_, name, _)| name);
        egui::ComboBox::from_id_salt("haptic mode").selected_text(name).show_ui(ui, |ui| {
            for (mode, name, hover) in MODES {
                ui.selectable_value(&mut settings.mode, mode, name).on_hover_text(hover);
            }
        });
        ui.end_row();
        let mut slide = |name: &str, hover: &str, value: &mut f64, range: std::ops::RangeInclusive<f64>, unit: &str| {
            ui.label(name).on_hover_text(hover);
            ui.add(egui::Slider::new(value, range).logarithmic(true).suffix(unit)).on_hover_text(hover);
            ui.end_row();
        };
        slide(
            "scale",
            "How much larger than the hand's the tool's ways are; 1 is one to one.",
            &mut settings.placement.scale,
            0.1..=10.0,
            "",
        );
        slide("stiffness", "Of the spring between hand and tool.", &mut settings.coupling.stiffness, 50.0..=500.0, " N/m");
        slide("gain", "Force felt over force of the clay.", &mut settings.force.gain, 0.05..=5.0, "");
        placement(ui, &mut settings.placement);
    });
}

/// Where the device stands: its origin, and how it is turned about the vertical, across and along.
fn placement(ui: &mut egui::Ui, placement: &mut Placement) {
    let axes = |ui: &mut egui::Ui, values: &mut [f64; 3], unit: &str| {
        let drag = |value| egui::DragValue::new(value).speed(0.5).max_decimals(1).suffix(unit);
        // Each is drawn, whichever has changed.
        ui.horizontal(|ui| values.each_mut().map(|value| ui.add(drag(value)).changed()).contains(&true)).inner
    };
    ui.label("origin").on_hover_text("Where the device's origin is in the world.");
    let mut millimetres = (placement.position * 1e3).to_array();
    if axes(ui, &mut millimetres, " mm") {
        placement.position = DVec3::from_array(millimetres) * 1e-3;
    }
    ui.end_row();
    ui.label("turn").on_hover_text("How the device is turned in the world: to the left, up, to its left side.");
    let (left, up, side) = placement.rotation.to_euler(EulerRot::YXZ);
    let mut degrees = [left, up, side].map(f64::to_degrees);
    if axes(ui, &mut degrees, "°") {
        let [left, up, side] = degrees.map(f64::to_radians);
        placement.rotation = DQuat::from_euler(EulerRot::YXZ, left, up, side);
    }
    ui.end_row();
}

/// Each stage of safety: whether it acts, how often it began to, and for how many ticks.
fn stages(ui: &mut egui::Ui, pulse: &HandPulse) {
    egui::Grid::new("haptic stages").num_columns(3).striped(true).show(ui, |ui| {
        for heading in ["stage", "times", "ticks"] {
            ui.strong(heading);
        }
        ui.end_row();
        for stage in Stage::ALL {
            let name = egui::RichText::new(stage.name());
            let acts = pulse.safety.is_active(stage);
            let name = if acts { name.color(ui.visuals().warn_fg_color) } else { name };
            ui.label(name).on_hover_text(stage.message());
            ui.label(pulse.safety.episodes(stage).to_string());
            ui.label(pulse.safety.ticks(stage).to_string());
            ui.end_row();
        }
    });
    let text =
        format!("{:.0} % of the force comes through, motors at {:.0} %", 100.0 * pulse.safety.gain, 100.0 * pulse.safety.load);
    ui.label(text);
}
