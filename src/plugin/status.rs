//! How the clay is doing.

use crate::sim::frame::FrameReport;
use crate::sim::health::Health;
use crate::sim::params::ParamsError;
use bevy::prelude::*;

/// What is wrong with a piece of clay. Whatever it is, the app goes on, and no clay that was made is lost.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ClayError {
    /// There is no clay to start from: what its source says is wrong.
    #[error("{0}")]
    Source(String),
    /// A parameter that no engine takes: the clay stands until it is mended.
    #[error("the clay stands still: {0}")]
    Parameter(ParamsError),
    /// No engine starts: what was there before goes on.
    #[error("the engine does not start: {0}")]
    Start(String),
    /// The engine has stopped; if another one could be started, that goes on from the last state kept.
    #[error("{0}")]
    Stopped(String),
    /// The clay does not run where it should, but on the CPU.
    #[error("{0}")]
    Fallback(String),
    /// The [`MaterialFile`](super::follow::MaterialFile) is bad: the clay stays as it is.
    #[error("the clay stays as it is: {0}")]
    MaterialFile(String),
    /// What was asked for cannot be: the clay stays as it is.
    #[error("{0}")]
    Operation(String),
    /// The surface is not made where it should, but on the processor.
    #[error("the surface is made on the processor: {0}")]
    Surface(String),
}

/// How a piece of clay is doing. Written by the plugin when it changes; [`ClayMetrics`] holds what changes
/// each frame.
#[derive(Component, Clone, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ClayStatus {
    /// The engine and what it runs on; empty until the first one has started.
    pub engine: String,
    /// What is wrong, the worst first; nothing if all is well.
    pub error: Option<ClayError>,
    /// What is odd about its [`MaterialFile`](super::follow::MaterialFile), one line each.
    pub warnings: Vec<String>,
    /// What went wrong in the last frame.
    pub health: Health,
    /// Particles in motion.
    pub particle_count: usize,
    /// Cell width \[m\].
    pub cell_width: f64,
    /// Volume of the unloaded clay that it started from \[m^3\].
    pub rest_volume: f64,
}

/// Milliseconds per part of the last frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Reflect)]
#[reflect(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct PassTimes {
    /// Sorting particles into blocks.
    pub rebin: f64,
    /// Node sums and grid update.
    pub grid: f64,
    /// Gather, clay law and scatter.
    pub particles: f64,
    /// Copies and statistics at the frame's end.
    pub report: f64,
}

/// Figures of a piece of clay that change with each frame. Written by the plugin.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ClayMetrics {
    /// Simulated time \[s\].
    pub time: f64,
    /// Simulated time per wall time over the last second or so.
    pub rate: f64,
    /// Time of the clay's clock \[s\] that the clay did not follow: the engine was busy, or refused a frame.
    pub given_up: f64,
    /// Time \[s\] by which the tools, as the clay has them, lag behind the hand.
    pub lag: f64,
    /// Volume of the clay \[m^3\].
    pub volume: f64,
    /// Steps of the last frame, explicit or implicit; none of clay at rest.
    pub substeps: u32,
    /// Passes over the particles that its implicit steps took; 0 of explicit ones, and of clay at rest.
    pub passes: u32,
    /// Forces that its implicit steps left out of balance, over those that the clay bears [-].
    pub residual: f64,
    /// Whether the clay is at rest, and takes no steps.
    pub is_resting: bool,
    /// Wall time of the last frame \[ms\].
    pub frame_ms: f64,
    /// Its parts.
    pub pass_ms: PassTimes,
    /// Wall time \[ms\] of the last surface, on another thread.
    pub mesh_ms: f64,
    /// Triangles shown: of the surface, and of the balls that stand for particles outside of it.
    pub triangle_count: usize,
    /// Most processor time \[ms\] that the plugin's systems together took of a frame of the app in the last
    /// second.
    pub main_thread_ms: f64,
}

impl ClayMetrics {
    /// Takes what a report says.
    pub(super) fn note(&mut self, report: &FrameReport) {
        let ms = |seconds: f64| seconds * 1e3;
        let t = &report.timings;
        self.time = report.time;
        self.is_resting = report.is_resting();
        self.substeps = if self.is_resting { 0 } else { report.steps };
        (self.passes, self.residual) = (report.passes, report.residual);
        self.frame_ms = ms(t.total);
        self.pass_ms = PassTimes { rebin: ms(t.rebin), grid: ms(t.grid), particles: ms(t.particles), report: ms(t.report) };
        self.volume = report.volume;
    }
}
