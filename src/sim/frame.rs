//! A frame as data: the plan that goes into an engine, the report and the surface particles that come out.

mod validate;

use super::cut::SheetSet;
use super::cutting::CuttingMethod;
use super::health::Health;
use super::integrator::Integrator;
use super::material::ClayMaterial;
use super::params::Domain;
use super::tool::ToolPath;
use super::touch::ToolTouch;
use super::validation::Validation;
use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// One frame to run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FramePlan {
    /// Names the frame in its report.
    pub id: u64,
    /// Substep \[s\].
    pub dt: f64,
    /// Number of substeps; the frame lasts `dt * steps`.
    pub steps: u32,
    /// The clay's parameters in this frame.
    pub material: ClayMaterial,
    /// How the substeps are integrated, with the numbers of the method.
    #[serde(default)]
    pub integrator: Integrator,
    /// Whether implicit steps are left out where clay stands and no tool is near it: nothing that could wake
    /// it has changed since the frame before.
    #[serde(default)]
    pub may_rest: bool,
    /// Whether [bodies](super::body) are found anew at the frame's end: a cut may have gone through, or
    /// sides of one grown together.
    #[serde(default)]
    pub finds_bodies: bool,
    /// Gravity [m/s^2].
    pub gravity: DVec3,
    /// The tools and their ways through the frame.
    pub tools: Vec<ToolPath>,
    /// Anti-locking: the plastic strain [-] in which the ln J of particles that flow come to their cell's
    /// mean by all but 1/e of the difference, however long it takes; 0 is plain MPM.
    #[serde(default)]
    pub volume_averaging: f64,
    /// How tools act on the clay: other methods than the first are there to be compared with it.
    #[serde(default)]
    pub cutting: CuttingMethod,
    /// What the frame hands out beside its report.
    #[serde(default)]
    pub outputs: FrameOutputs,
    /// Inputs of validation cases, which an application must not use.
    #[cfg(feature = "reference")]
    #[serde(default)]
    pub validation: Validation,
    #[cfg(not(feature = "reference"))]
    #[serde(skip)]
    pub(crate) validation: Validation,
}

/// What a frame hands out at its end beside its report. What is not asked for is not copied back from a
/// device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameOutputs {
    /// The surface particles, 28 bytes each, for [`Engine::surface`](super::engine::Engine::surface).
    pub surface: bool,
    /// The whole state, 156 bytes a particle, for
    /// [`Engine::request_state`](super::engine::Engine::request_state).
    pub state: bool,
    /// Whether there is loose clay, for the report: a planner asks where inertia may be scaled or steps may
    /// be implicit.
    #[serde(default)]
    pub support: bool,
    /// What each tool meets, for the report's [`touches`](FrameReport::touches). Engines of the processor
    /// only: the device's gives none.
    #[serde(default)]
    pub touch: bool,
}

impl FrameOutputs {
    /// The report alone.
    pub const NOTHING: Self = Self { surface: false, state: false, support: false, touch: false };
    /// All there is.
    pub const ALL: Self = Self { surface: true, state: true, support: true, touch: true };
}

impl Default for FrameOutputs {
    /// The surface, not the state.
    fn default() -> Self {
        Self { surface: true, ..Self::NOTHING }
    }
}

/// Substeps between two averagings of volume: it needs the particles sorted by cell, which costs about a
/// substep.
pub const AVERAGING_INTERVAL: u32 = 8;

/// How far shear waves go \[cells\], or the fastest tool if it is faster, while particles forget all but 1/e
/// of what nodes do not see of their velocities. At once, as plain APIC has it, makes a force that grows
/// without end as the step shrinks; never leaves noise.
pub const TRANSFER_MEMORY: f64 = 1.2;

impl FramePlan {
    /// A frame of `steps` substeps of `dt` \[s\] of clay made of `material`, explicit with its own inertia: no
    /// tools, no gravity, no averaging.
    pub fn new(material: ClayMaterial, dt: f64, steps: u32) -> Self {
        Self {
            id: 0,
            dt,
            steps,
            integrator: Integrator::default(),
            may_rest: false,
            finds_bodies: false,
            material,
            gravity: DVec3::ZERO,
            tools: vec![],
            volume_averaging: 0.0,
            cutting: CuttingMethod::default(),
            outputs: FrameOutputs::default(),
            validation: Validation::default(),
        }
    }

    /// Duration of the frame \[s\].
    pub fn duration(&self) -> f64 {
        self.dt * f64::from(self.steps)
    }

    /// Inertial density over the material's density [-].
    pub fn density_scale(&self) -> f64 {
        match self.integrator {
            Integrator::Explicit { density_scale } => density_scale,
            Integrator::Implicit { .. } => 1.0,
        }
    }

    /// Inertial density [kg/m^3].
    pub fn inertial_density(&self) -> f64 {
        self.material.density * self.density_scale()
    }

    /// Whether volumes are averaged at all.
    pub(super) fn averages(&self) -> bool {
        self.volume_averaging > 0.0 && self.material.yield_stress.is_finite() && !self.material.law.is_as_published()
    }

    /// Whether volumes are averaged before substep `step` of the frame. At its end they are in any case.
    pub(super) fn averages_before(&self, step: u32) -> bool {
        self.averages() && step > 0 && step.is_multiple_of(AVERAGING_INTERVAL)
    }

    /// Share [-] that substeps of `dt` \[s\] leave of what nodes do not see of the particles' velocities:
    /// `exp(-h c / (1.2 dx))` with the shear waves' speed or the fastest tool's ([`TRANSFER_MEMORY`]): clay
    /// that a tool overtakes would be flung about. None is left by the methods of others and under the laws
    /// as published, which have the transfers of their papers.
    pub(super) fn velocity_kept(&self, cell_width: f64, dt: f64) -> f64 {
        if !self.cutting.keeps_cuts() || self.material.law.is_as_published() {
            return 0.0;
        }
        let shear_speed = (self.material.lame_mu() / self.inertial_density()).sqrt();
        let speed = self.tools.iter().map(ToolPath::speed_max).fold(shear_speed, f64::max);
        (-dt * speed / (TRANSFER_MEMORY * cell_width)).exp()
    }

    /// Whether a tool of the plan parts clay.
    pub(super) fn divides(&self) -> bool {
        self.tools.iter().any(ToolPath::divides)
    }

    /// The sheets of the tools that part clay.
    pub(super) fn dividers(&self) -> SheetSet {
        self.tools.iter().filter(|path| path.divides()).map(ToolPath::sheet_id).collect()
    }
}

/// What a tool felt in one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct ToolReport {
    /// The path's id.
    pub id: u32,
    /// Impulse of the clay on the tool \[N s\]; in implicit steps that of its springs, and along its way what
    /// makes its work that which the clay takes; scaled by the like where it has stopped.
    pub impulse: DVec3,
    /// Angular impulse of the clay on the tool about its origin \[N m s\].
    pub angular_impulse: DVec3,
    /// Mean force on the tool over the frame \[N\].
    pub force: DVec3,
    /// Mean torque on the tool about its origin \[N m\].
    pub torque: DVec3,
    /// Contacts, summed over the substeps: of solid tools with particles, of blades with fields at nodes, in
    /// implicit steps with particles.
    pub contacts: u64,
    /// Particles that took a side of the blade.
    pub tagged: u64,
    /// Those among them that stood at two other cuts already and gave up the older one: there that cut has
    /// grown together.
    #[serde(default)]
    pub displaced: u64,
    /// Particles found on the wrong side of the blade and put back on its surface, summed over the substeps.
    pub pushed_back: u64,
    /// Greatest depth of such a particle behind the blade \[cells\].
    pub depth_max: f64,
}

/// Energies at the end of a frame \[J\]; kinetic with the inertial density.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energies {
    /// Kinetic, with the affine part.
    pub kinetic: f64,
    /// Elastic.
    pub elastic: f64,
}

/// Wall-clock time \[s\] per part of the frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Timings {
    /// The whole frame.
    pub total: f64,
    /// Sorting particles into blocks.
    pub rebin: f64,
    /// Node sums and grid update; of implicit steps the preconditioner and L-BFGS.
    pub grid: f64,
    /// Gather, clay law and scatter; of implicit steps with the sums at the nodes.
    pub particles: f64,
    /// Copies and statistics at the frame's end.
    pub report: f64,
}

/// What came of one plan.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct FrameReport {
    /// The plan's id.
    pub plan_id: u64,
    /// What went wrong.
    pub health: Health,
    /// How often the frame was redone with half the time step.
    pub redone: u32,
    /// Substep used \[s\].
    pub dt: f64,
    /// Substeps run.
    pub steps: u32,
    /// Inertial density over the material's density, as planned.
    pub density_scale: f64,
    /// Simulated time at the frame's end \[s\].
    pub time: f64,
    /// Particles in motion.
    pub particle_count: usize,
    /// Ids of particles that are not finite, frozen out when loaded.
    pub quarantined: Vec<u32>,
    /// Sum of inertial particle masses \[kg\].
    pub particle_mass: f64,
    /// Sum of node masses at the last substep \[kg\].
    pub grid_mass: f64,
    /// Momentum of the clay when the frame started [kg m/s].
    pub momentum_before: DVec3,
    /// Momentum of the clay when it ended [kg m/s].
    pub momentum: DVec3,
    /// Angular momentum about the world's origin at the end, with the affine part [kg m^2/s].
    pub angular_momentum: DVec3,
    /// Impulse of gravity on the clay \[N s\].
    pub gravity_impulse: DVec3,
    /// Impulse of the walls on the clay \[N s\].
    pub wall_impulse: DVec3,
    /// Impulse of the forces that implicit steps left out of balance \[N s\], with what springs gave the
    /// clay beyond what is reported of tools.
    #[serde(default)]
    pub unbalanced_impulse: DVec3,
    /// Passes over the particles that implicit steps took, each an evaluation of forces, with those of tries
    /// that left the clay lost; 0 of explicit ones.
    #[serde(default)]
    pub passes: u32,
    /// Steps towards the potential's least that were cut.
    #[serde(default)]
    pub rejected: u32,
    /// Greatest force left out of balance at an implicit step's end over what clay bears of contact, inertia
    /// and weight (of half the Earth's at least) [-], both as norms over the nodes.
    #[serde(default)]
    pub residual: f64,
    /// Whether the clay stands at the end of implicit steps: nothing moved but what they leave sways, no
    /// tool was near. Then its velocities are 0, and frames that may rest take no steps.
    #[serde(default)]
    pub is_standing: bool,
    /// Impulse taken by validation damping \[N s\].
    pub damping_impulse: DVec3,
    /// Sum over substeps and nodes of |wall impulse| + |tool impulse| \[N s\].
    pub impulse_scale: f64,
    /// Sum of m |v| at the end [kg m/s].
    pub momentum_scale: f64,
    /// Energies at the end.
    pub energies: Energies,
    /// Least and greatest volume ratio J.
    pub volume_ratio: (f64, f64),
    /// Sum of V_p J_p [m^3].
    pub volume: f64,
    /// Greatest node speed \[cells per substep\].
    pub speed_max: f64,
    /// Particles whose strain was clamped.
    pub clamped: u64,
    /// The sheets that particles have a side of.
    #[serde(default)]
    pub sheets: SheetSet,
    /// Whether there is clay at the end that no wall bears, nor any clay that it hangs together with: it
    /// falls. Clay hangs together up to a gap of two cells, at most four. None where the plan did not ask.
    #[serde(default)]
    pub has_loose_clay: Option<bool>,
    /// Momentum [kg m/s] that the clay had at once, without any force, because inertia is scaled otherwise
    /// than in the frame before: velocities go on. A planner fills it in.
    #[serde(default)]
    pub rescaled_momentum: DVec3,
    /// Sides of cuts that grew together with the other side and are gone.
    #[serde(default)]
    pub welded: u64,
    /// Particles among them that grew together with another body: both are one as soon as bodies are found.
    #[serde(default)]
    pub joined: u64,
    /// Sides of cuts that clay took from the clay about it: the tagged layer had become too thin to keep the
    /// cut.
    #[serde(default)]
    pub carried: u64,
    /// The greatest number of a body: 0 while all clay is one.
    #[serde(default)]
    pub body_max: u32,
    /// Each tool of the plan.
    pub tools: Vec<ToolReport>,
    /// What each of them meets at the frame's end; empty where the plan did not ask, of a frame that was
    /// given up, and of the device's engine.
    #[serde(default)]
    pub touches: Vec<ToolTouch>,
    /// Where the time went.
    pub timings: Timings,
    /// Bytes copied back from a device for this frame; 0 where clay lives in the processor's memory.
    #[serde(default)]
    pub bytes_read_back: u64,
}

impl FrameReport {
    /// The report of `plan` before anything is known of it: its id and step.
    pub fn new(plan: &FramePlan) -> Self {
        Self { plan_id: plan.id, dt: plan.dt, density_scale: plan.density_scale(), ..Self::default() }
    }

    /// Simulated time that the frame covered \[s\].
    pub fn duration(&self) -> f64 {
        self.dt * f64::from(self.steps)
    }

    /// Whether the clay stood and no step was taken: time has passed, and nothing else but what rest itself
    /// does to clay.
    pub fn is_resting(&self) -> bool {
        self.is_standing && self.passes == 0
    }

    /// Implicit steps that were taken: what a tool feels of each is at its end. 0 of explicit ones.
    pub fn implicit_steps(&self) -> u32 {
        if self.passes > 0 { self.steps } else { 0 }
    }

    /// Whether a tool engaged supported clay, and it alone: a tool touched clay while walls bore all of it,
    /// and less energy was in its motion than in its strain. Only then may inertia be scaled in a later
    /// frame: the step is one for all clay, and what flies, falls or lands keeps its own inertia.
    pub fn is_engaged(&self) -> bool {
        let touches = self.tools.iter().any(|t| t.contacts > 0) && self.wall_impulse != DVec3::ZERO;
        touches && self.has_loose_clay == Some(false) && self.kinetic_ratio() <= 1.0
    }

    /// Greatest speed in the clay [m/s] at the nodes of a grid of `cell_width` \[m\]; 0 for a frame that did
    /// not run.
    pub fn speed(&self, cell_width: f64) -> f64 {
        if self.dt > 0.0 { self.speed_max * cell_width / self.dt } else { 0.0 }
    }

    /// Kinetic over elastic energy [-]: the check on inertia scaling, which counts as harmless up to 1 or 2 %
    /// of the internal energy. The energy that flow has dissipated is internal too and not counted, so this
    /// is on the safe side. 0 for clay without strain that does not move.
    pub fn kinetic_ratio(&self) -> f64 {
        let Energies { kinetic, elastic } = self.energies;
        if kinetic > 0.0 { kinetic / elastic } else { 0.0 }
    }

    /// Simulated time over wall time [-]; 0 for a frame that did not run.
    pub fn real_time_factor(&self) -> f64 {
        if self.timings.total > 0.0 { self.duration() / self.timings.total } else { 0.0 }
    }

    /// Newton's third law, kept to rounding: |clay momentum change + tool and wall impulses| over (sum of
    /// |impulses| + sum of m |v|).
    pub fn balance_error(&self) -> f64 {
        let on_tools: DVec3 = self.tools.iter().map(|t| t.impulse).sum();
        let change = self.momentum - self.momentum_before;
        let given = self.wall_impulse + self.gravity_impulse + self.damping_impulse + self.unbalanced_impulse;
        let error = change + on_tools - given;
        let scale = self.impulse_scale + self.momentum_scale;
        if scale > 0.0 { error.length() / scale } else { error.length() }
    }
}

/// One particle as the surface sees it, 28 bytes: what an engine uploads or aliases.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SurfaceParticle {
    /// Position in grid coordinates \[cells\].
    pub position: [f32; 3],
    /// Volume ratio J [-].
    pub volume_ratio: f32,
    /// Rest volume over cell volume [-]: 1/8 at 8 particles per cell.
    pub density_weight: f32,
    /// Tags packed: bytes (sheet, side) of the first and the second cut, as in the particle.
    pub tags: u32,
    /// The body that it is of, by number.
    pub body: u32,
}

/// What any extractor reads, whichever engine made it.
#[derive(Clone, Debug)]
pub struct SurfaceSource {
    /// The grid the positions refer to.
    pub domain: Domain,
    /// The particles, in an order that is the same in every run.
    pub particles: Arc<Vec<SurfaceParticle>>,
}
