//! The seam: plans go in, reports come out, nothing blocks.
//!
//! A plan is data, so a run can be recorded and replayed bit for bit. An engine runs plans in the order given; `poll` hands back one
//! report per plan. `surface` and `save` speak of the state at the end of the frame that the last report was about.

use super::cut::SheetSet;
use super::cutting::CuttingMethod;
use super::gpu::GpuError;
use super::health::Health;
use super::material::ClayMaterial;
use super::params::{Domain, ParamsError};
use super::plan::AVERAGING_INTERVAL;
use super::snapshot::Snapshot;
use super::tool::ToolPath;
#[doc(hidden)]
pub use super::validation::Validation;
use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::time::Duration;

/// One frame to run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FramePlan {
    /// Names the frame in its report.
    pub id: u64,
    /// Substep [s].
    pub dt: f64,
    /// Number of substeps; the frame lasts `dt * steps`.
    pub steps: u32,
    /// The clay's parameters in this frame.
    pub material: ClayMaterial,
    /// Inertial density over the material's density: 1, or more while a tool engages supported clay. Weight is not scaled.
    pub density_scale: f64,
    /// Gravity [m/s^2].
    pub gravity: DVec3,
    /// The tools and their ways through the frame.
    pub tools: Vec<ToolPath>,
    /// Anti-locking [-] in [0, 1): the share per substep by which the ln J of flowing particles relaxes to their cell's mean; 0 is plain MPM.
    #[serde(default)]
    pub volume_averaging: f64,
    /// How tools act on the clay: other methods than the first are there to be compared with it.
    #[serde(default)]
    pub cutting: CuttingMethod,
    /// Seed of anything random in the frame.
    pub seed: u64,
    /// For validation cases only.
    #[doc(hidden)]
    pub validation: Validation,
}

impl FramePlan {
    /// Duration of the frame [s].
    pub fn duration(&self) -> f64 {
        self.dt * f64::from(self.steps)
    }

    /// Inertial density [kg/m^3].
    pub fn inertial_density(&self) -> f64 {
        self.material.density * self.density_scale
    }

    /// Share [-] of its difference to the mean that a flowing particle's ln J loses before substep `step` of `steps`: what
    /// [`Self::volume_averaging`] in each substep up to the next averaging amounts to, or 0 where none is due.
    pub(super) fn averaging_share(&self, step: u32, steps: u32) -> f64 {
        let is_due = step.is_multiple_of(AVERAGING_INTERVAL) && self.material.yield_stress.is_finite();
        if !is_due || self.material.law.is_as_published() {
            return 0.0;
        }
        let substeps = AVERAGING_INTERVAL.min(steps - step);
        1.0 - (1.0 - self.volume_averaging).powf(f64::from(substeps))
    }

    /// Checks every number.
    ///
    /// # Errors
    /// The first parameter that is out of its range, by name.
    pub fn validate(&self) -> Result<(), ParamsError> {
        // First: a bad material makes a senseless time step.
        self.material.validate()?;
        if !(self.dt.is_finite() && self.dt > 0.0) {
            return Err(ParamsError::new("dt", self.dt, "must be a positive time step in seconds"));
        }
        // 1e-15 s keeps 1 / dt an f32; more than 1e7 substeps are hours for a handful of particles.
        if self.dt < 1e-15 {
            return Err(ParamsError::new("dt", self.dt, "must be at least 1e-15 s"));
        }
        if !(1..=10_000_000).contains(&self.steps) {
            return Err(ParamsError::new(
                "steps",
                self.steps,
                "must be 1 to 10,000,000; a longer frame or a finer step needs more frames",
            ));
        }
        if !(self.density_scale.is_finite() && self.density_scale >= 1.0) {
            return Err(ParamsError::new("density_scale", self.density_scale, "must be 1 or more"));
        }
        if !(0.0..1.0).contains(&self.volume_averaging) {
            return Err(ParamsError::new("volume_averaging", self.volume_averaging, "must lie in [0, 1)"));
        }
        if !self.gravity.is_finite() {
            return Err(ParamsError::new("gravity", self.gravity, "must be finite"));
        }
        for path in &self.tools {
            path.tool.validate()?;
            if path.samples.is_empty() || !path.is_finite() {
                let reason = "needs at least one sample, finite numbers and times in order";
                return Err(ParamsError::new("tool path", format!("tool {}", path.id), reason));
            }
            if !path.samples.iter().all(|s| s.pose.rotation.is_normalized()) {
                return Err(ParamsError::new("tool path", format!("tool {}", path.id), "needs rotations of length 1"));
            }
            let is_rival = |p: &&ToolPath| {
                p.id == path.id || (p.tool.shape.is_blade() && path.tool.shape.is_blade() && p.sheet_id() == path.sheet_id())
            };
            if self.tools.iter().filter(is_rival).count() > 1 {
                let reason = "must be another than every other tool's, and each blade needs a sheet of its own (by default the id's low byte)";
                return Err(ParamsError::new("tool id", path.id, reason));
            }
        }
        self.cutting.validate(self)
    }
}

/// What a tool felt in one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ToolReport {
    /// The path's id.
    pub id: u32,
    /// Impulse of the clay on the tool [N s].
    pub impulse: DVec3,
    /// Angular impulse of the clay on the tool about its origin [N m s].
    pub angular_impulse: DVec3,
    /// Mean force on the tool over the frame [N].
    pub force: DVec3,
    /// Mean torque on the tool about its origin [N m].
    pub torque: DVec3,
    /// Node contacts, summed over the substeps.
    pub contacts: u64,
    /// Particles that took a side of the blade.
    pub tagged: u64,
    /// Those among them that stood at two other cuts already and gave up the older one: there that cut has grown together.
    #[serde(default)]
    pub displaced: u64,
    /// Particles found on the wrong side of the blade and put back on its surface, summed over the substeps.
    pub pushed_back: u64,
    /// Greatest depth of such a particle behind the blade [cells].
    pub depth_max: f64,
}

/// Energies at the end of a frame [J]; kinetic with the inertial density.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energies {
    /// Kinetic, with the affine part.
    pub kinetic: f64,
    /// Elastic.
    pub elastic: f64,
}

/// Wall-clock time [s] per part of the frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Timings {
    /// The whole frame.
    pub total: f64,
    /// Sorting particles into blocks.
    pub rebin: f64,
    /// Node sums and grid update.
    pub grid: f64,
    /// Gather, clay law and scatter.
    pub particles: f64,
    /// Copies and statistics at the frame's end.
    pub report: f64,
}

/// What came of one plan.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FrameReport {
    /// The plan's id.
    pub plan_id: u64,
    /// What went wrong.
    pub health: Health,
    /// How often the frame was redone with half the time step.
    pub redone: u32,
    /// Substep used [s].
    pub dt: f64,
    /// Substeps run.
    pub steps: u32,
    /// Inertial density over the material's density, as planned.
    pub density_scale: f64,
    /// Simulated time at the frame's end [s].
    pub time: f64,
    /// Particles in motion.
    pub particle_count: usize,
    /// Ids of particles that are not finite, frozen out when loaded.
    pub quarantined: Vec<u32>,
    /// Sum of inertial particle masses [kg].
    pub particle_mass: f64,
    /// Sum of node masses at the last substep [kg].
    pub grid_mass: f64,
    /// Momentum of the clay when the frame started [kg m/s].
    pub momentum_before: DVec3,
    /// Momentum of the clay when it ended [kg m/s].
    pub momentum: DVec3,
    /// Angular momentum about the world's origin at the end, with the affine part [kg m^2/s].
    pub angular_momentum: DVec3,
    /// Impulse of gravity on the clay [N s].
    pub gravity_impulse: DVec3,
    /// Impulse of the walls on the clay [N s].
    pub wall_impulse: DVec3,
    /// Impulse taken by validation damping [N s].
    pub damping_impulse: DVec3,
    /// Sum over substeps and nodes of |wall impulse| + |tool impulse| [N s].
    pub impulse_scale: f64,
    /// Sum of m |v| at the end [kg m/s].
    pub momentum_scale: f64,
    /// Energies at the end.
    pub energies: Energies,
    /// Least and greatest volume ratio J.
    pub volume_ratio: (f64, f64),
    /// Sum of V_p J_p [m^3].
    pub volume: f64,
    /// Greatest node speed [cells per substep].
    pub speed_max: f64,
    /// Particles whose strain was clamped.
    pub clamped: u64,
    /// The sheets that particles have a side of.
    #[serde(default)]
    pub sheets: SheetSet,
    /// Sides of cuts that grew together with the other side and are gone.
    #[serde(default)]
    pub welded: u64,
    /// Each tool of the plan.
    pub tools: Vec<ToolReport>,
    /// Where the time went.
    pub timings: Timings,
}

impl FrameReport {
    /// Whether a tool engaged supported clay: it touched clay while a wall held clay up. Only then may inertia be scaled in a later frame; a body that
    /// flies or falls keeps its own.
    pub fn is_engaged(&self) -> bool {
        self.tools.iter().any(|t| t.contacts > 0) && self.wall_impulse != DVec3::ZERO
    }

    /// Greatest speed in the clay [m/s] at the nodes of a grid of `cell_width` [m]; 0 for a frame that did not run.
    pub fn speed(&self, cell_width: f64) -> f64 {
        if self.dt > 0.0 { self.speed_max * cell_width / self.dt } else { 0.0 }
    }

    /// Kinetic over elastic energy [-]: the check on inertia scaling, which counts as harmless up to 1 or 2 % of the internal energy. The energy
    /// that flow has dissipated is internal too and not counted, so this is on the safe side. 0 for clay without strain that does not move.
    pub fn kinetic_ratio(&self) -> f64 {
        let Energies { kinetic, elastic } = self.energies;
        if kinetic > 0.0 { kinetic / elastic } else { 0.0 }
    }

    /// Simulated time over wall time [-]; 0 for a frame that did not run.
    pub fn real_time_factor(&self) -> f64 {
        if self.timings.total > 0.0 { self.dt * f64::from(self.steps) / self.timings.total } else { 0.0 }
    }

    /// |clay momentum change + tool and wall impulses| over (sum of |impulses| + sum of m |v|): Newton's third law, kept to rounding.
    pub fn balance_error(&self) -> f64 {
        let on_tools: DVec3 = self.tools.iter().map(|t| t.impulse).sum();
        let change = self.momentum - self.momentum_before;
        let error = change + on_tools - self.wall_impulse - self.gravity_impulse - self.damping_impulse;
        let scale = self.impulse_scale + self.momentum_scale;
        if scale > 0.0 { error.length() / scale } else { error.length() }
    }
}

/// One particle as the surface sees it, 24 bytes: what an engine uploads or aliases.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SurfaceParticle {
    /// Position in grid coordinates [cells].
    pub position: [f32; 3],
    /// Volume ratio J [-].
    pub volume_ratio: f32,
    /// Rest volume over cell volume [-]: 1/8 at 8 particles per cell.
    pub density_weight: f32,
    /// Tags packed: bytes (sheet, side) of the first and the second cut, as in the particle.
    pub tags: u32,
}

/// What any extractor reads, whichever engine made it.
#[derive(Clone, Debug)]
pub struct SurfaceSource {
    /// The grid the positions refer to.
    pub domain: Domain,
    /// The particles, in an order that is the same in every run.
    pub particles: Arc<Vec<SurfaceParticle>>,
}

/// A result whose making is left to the thread that calls it.
pub type Deferred<T> = Box<dyn FnOnce() -> T + Send>;

/// Why an engine refused a call.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EngineError {
    /// A parameter of the snapshot or plan.
    #[error(transparent)]
    Params(#[from] ParamsError),
    /// Nothing is loaded yet.
    #[error("no clay is loaded")]
    NotLoaded,
    /// As many plans are under way as the engine takes.
    #[error("{0} frames are under way already; poll first")]
    Busy(usize),
    /// The graphics device cannot run this clay.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The engine's thread ended, or its device is lost.
    #[error("the engine stopped: {0}")]
    Stopped(String),
}

/// An engine: runs frames of clay somewhere else than in the caller's time.
pub trait Engine: Send {
    /// One line that names the engine and what it runs on.
    fn describe(&self) -> String;

    /// Replaces the clay. Frames under way are dropped with their reports.
    ///
    /// # Errors
    /// A domain or material that cannot be used, or more memory than there is.
    fn load(&mut self, snapshot: &Snapshot) -> Result<(), EngineError>;

    /// Queues a frame. At most two frames are under way: the plan of frame n is made from the report of frame n - 2. A frame queued before the
    /// report of a frame that was given up has been handed out is given up with it: it was planned for a state that never came.
    ///
    /// # Errors
    /// A plan that cannot be run, two frames under way, or nothing loaded.
    fn submit(&mut self, plan: FramePlan) -> Result<(), EngineError>;

    /// The next report, if a frame has ended since.
    ///
    /// # Errors
    /// The engine stopped.
    fn poll(&mut self) -> Result<Option<FrameReport>, EngineError>;

    /// The surface particles at the end of the last reported frame, or as loaded.
    fn surface(&self) -> Option<SurfaceSource>;

    /// The whole state at the end of the last reported frame, or as loaded.
    ///
    /// # Errors
    /// Nothing is loaded.
    fn save(&self) -> Result<Snapshot, EngineError>;

    /// [`Self::surface`] as of now, with what costs time left to the thread that calls it: for frame loops.
    fn surface_deferred(&self) -> Option<Deferred<SurfaceSource>> {
        let source = self.surface()?;
        Some(Box::new(move || source))
    }

    /// [`Self::save`] as of now, with what costs time left to the thread that calls it: for frame loops.
    ///
    /// # Errors
    /// As [`Self::save`].
    fn save_deferred(&self) -> Result<Deferred<Snapshot>, EngineError> {
        let snapshot = self.save()?;
        Ok(Box::new(move || snapshot))
    }

    /// Frames under way.
    fn pending(&self) -> usize;

    /// Waits for the next report: for programs without a frame loop.
    ///
    /// # Errors
    /// Nothing is under way, or the engine stopped.
    fn wait(&mut self) -> Result<FrameReport, EngineError> {
        if self.pending() == 0 {
            return Err(EngineError::Stopped("no frame is under way".into()));
        }
        loop {
            if let Some(report) = self.poll()? {
                return Ok(report);
            }
            std::thread::sleep(Duration::from_micros(200));
        }
    }
}
