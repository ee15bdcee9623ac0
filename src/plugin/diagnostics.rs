//! Bevy diagnostics of all clay of the app together.

use super::report;
use super::schedule::ClaySystems;
use super::status::{ClayMetrics, ClayStatus, PassTimes};
use bevy::diagnostic::{Diagnostic, DiagnosticPath, Diagnostics, RegisterDiagnostic};
use bevy::prelude::*;

/// Wall time of the last frames \[ms\].
pub const FRAME: DiagnosticPath = DiagnosticPath::const_new("clay/frame");
/// Their sorting of particles \[ms\].
pub const REBIN: DiagnosticPath = DiagnosticPath::const_new("clay/pass/rebin");
/// Their node sums and grid updates \[ms\].
pub const GRID: DiagnosticPath = DiagnosticPath::const_new("clay/pass/grid");
/// Their gather, clay law and scatter \[ms\].
pub const PARTICLES: DiagnosticPath = DiagnosticPath::const_new("clay/pass/particles");
/// Their copies and statistics \[ms\].
pub const REPORT: DiagnosticPath = DiagnosticPath::const_new("clay/pass/report");
/// Particles in motion.
pub const PARTICLE_COUNT: DiagnosticPath = DiagnosticPath::const_new("clay/particle_count");
/// Substeps of the last frames.
pub const SUBSTEPS: DiagnosticPath = DiagnosticPath::const_new("clay/substeps");
/// Simulated time per wall time of the slowest clay.
pub const RATE: DiagnosticPath = DiagnosticPath::const_new("clay/rate");
/// Wall time of the last surfaces \[ms\], on other threads.
pub const MESH: DiagnosticPath = DiagnosticPath::const_new("clay/mesh");
/// Most processor time that the plugin's systems took of a frame of the app in the last second \[ms\].
pub const MAIN_THREAD: DiagnosticPath = DiagnosticPath::const_new("clay/main_thread");

/// Registers and measures. Without it there are no diagnostics of clay; [`ClayStatus`] has the same numbers.
#[derive(Clone, Copy, Debug, Default)]
pub struct DiagnosticsPlugin;

impl Plugin for DiagnosticsPlugin {
    fn build(&self, app: &mut App) {
        for path in [FRAME, REBIN, GRID, PARTICLES, REPORT, MESH, MAIN_THREAD] {
            app.register_diagnostic(Diagnostic::new(path).with_suffix("ms"));
        }
        for path in [PARTICLE_COUNT, SUBSTEPS, RATE] {
            app.register_diagnostic(Diagnostic::new(path));
        }
        app.add_systems(Update, measure.in_set(ClaySystems::Show).after(report::status));
    }
}

/// One measurement of each kind per frame of the app, while there is clay.
fn measure(clays: Query<(&ClayStatus, &ClayMetrics)>, mut diagnostics: Diagnostics) {
    if clays.is_empty() {
        return;
    }
    let sum = |value: fn(&ClayMetrics) -> f64| clays.iter().map(|c| value(c.1)).sum::<f64>();
    let pass = |value: fn(&PassTimes) -> f64| clays.iter().map(|(_, m)| value(&m.pass_ms)).sum::<f64>();
    diagnostics.add_measurement(&FRAME, || sum(|s| s.frame_ms));
    diagnostics.add_measurement(&REBIN, || pass(|p| p.rebin));
    diagnostics.add_measurement(&GRID, || pass(|p| p.grid));
    diagnostics.add_measurement(&PARTICLES, || pass(|p| p.particles));
    diagnostics.add_measurement(&REPORT, || pass(|p| p.report));
    diagnostics.add_measurement(&PARTICLE_COUNT, || clays.iter().map(|(s, _)| s.particle_count as f64).sum());
    diagnostics.add_measurement(&SUBSTEPS, || sum(|s| f64::from(s.substeps)));
    diagnostics.add_measurement(&RATE, || clays.iter().map(|(_, m)| m.rate).fold(f64::INFINITY, f64::min));
    diagnostics.add_measurement(&MESH, || sum(|s| s.mesh_ms));
    diagnostics.add_measurement(&MAIN_THREAD, || clays.iter().map(|(_, m)| m.main_thread_ms).fold(0.0, f64::max));
}
