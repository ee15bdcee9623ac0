//! What the cases share: rooms, blocks of clay, and a bench that runs frames of it.

use crate::report::Row;
use bevy_clay::sim::params::WALL_NODE;
use bevy_clay::sim::prelude::*;
use clap::ValueEnum;
use glam::{DQuat, DVec3, IVec3};
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

/// Cell width of the cases \[m\]: not 1, so that a missing factor shows.
pub const DX: f64 = 0.004;

/// How large the cases are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Size {
    /// `cargo test`: a second or two a case.
    Test,
    /// `--quick`.
    Quick,
    /// The acceptance figures.
    Full,
}

impl Size {
    /// Its name on record.
    pub fn name(self) -> &'static str {
        self.pick("test", "quick", "full")
    }

    /// The value for this size.
    pub fn pick<T>(self, test: T, quick: T, full: T) -> T {
        match self {
            Self::Test => test,
            Self::Quick => quick,
            Self::Full => full,
        }
    }
}

/// Elastic clay.
pub fn elastic(poisson_ratio: f64) -> ClayMaterial {
    ClayMaterial { yield_stress: f64::INFINITY, poisson_ratio, ..Preset::SoftClay.material() }
}

/// Time step \[s\] of CFL number `cfl` = c dt / dx.
pub fn wave_step(material: &ClayMaterial, cfl: f64) -> f64 {
    cfl * DX / material.wave_speed(material.density)
}

/// Time step \[s\] at the default fraction of the stability limit.
pub fn stable_step(material: &ClayMaterial) -> f64 {
    bevy_clay::sim::planner::STEP_FRACTION * material.time_step_limit(DX, material.density)
}

/// A room of `cells` between walls all of one kind, away from the world's origin.
pub fn room(cells: [i32; 3], wall: Wall) -> Domain {
    room_with(cells, Walls { low: [wall; 3], high: [wall; 3] })
}

/// A room of `cells` between `walls`.
pub fn room_with(cells: [i32; 3], walls: Walls) -> Domain {
    let low = DVec3::new(0.1, -0.05, 0.2);
    Domain::new(low, low + IVec3::from_array(cells).as_dvec3() * DX, DX, walls).expect("a sound room")
}

/// World position \[m\] of a point given in cells from the room's low corner.
pub fn world(domain: &Domain, cells: DVec3) -> DVec3 {
    domain.to_world(cells + f64::from(WALL_NODE))
}

/// A particle's place in cells from the room's low corner.
pub fn place(particle: &Particle) -> DVec3 {
    particle.grid() - f64::from(WALL_NODE)
}

/// A block of clay with 8 particles per cell on a regular lattice; `low` and `size` in cells from the room's
/// low corner.
pub fn block(low: DVec3, size: IVec3) -> Vec<Particle> {
    lattice(low, size, 2)
}

/// A block of clay with `per_axis` particles along each axis of a cell; `low` and `size` in cells from the
/// room's low corner.
pub fn lattice(low: DVec3, size: IVec3, per_axis: i32) -> Vec<Particle> {
    let spacing = 1.0 / f64::from(per_axis);
    let volume = (DX * spacing).powi(3) as f32;
    let n = size * per_axis;
    let at = |i: i32| IVec3::new(i / (n.y * n.z), i / n.z % n.y, i % n.z).as_dvec3();
    let particle = |i: i32| Particle::at(low + (at(i) + 0.5) * spacing + f64::from(WALL_NODE), volume, i.cast_unsigned());
    (0..n.x * n.y * n.z).map(particle).collect()
}

/// The clay of a body in the block of `size` cells at the room's low corner: what of each eighth of a cell is
/// inside, at its centroid. Bodies with round faces have no steps.
pub fn carved(size: IVec3, is_inside: &dyn Fn(DVec3) -> bool) -> Vec<Particle> {
    const POINTS: i32 = 6;
    let mut particles = block(DVec3::ZERO, size);
    particles.retain_mut(|p| {
        let centre = place(p);
        let (mut count, mut sum) = (0.0, DVec3::ZERO);
        for i in 0..POINTS.pow(3) {
            let at = IVec3::new(i / (POINTS * POINTS), i / POINTS % POINTS, i % POINTS).as_dvec3();
            let shift = (at + 0.5) / (2.0 * f64::from(POINTS)) - 0.25;
            if is_inside(centre + shift) {
                count += 1.0;
                sum += shift;
            }
        }
        if count > 0.0 {
            p.rest_volume *= (count / f64::from(POINTS.pow(3))) as f32;
            p.set_grid(p.grid() + sum / count);
        }
        count > 0.0
    });
    particles
}

/// Random numbers in [-1, 1).
pub struct Random(u64);

impl Random {
    /// Numbers of `seed`.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678_9abc_def1)
    }

    /// The next number, uniform in [-1, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1u32 << 30) - 1.0
    }
}

/// Moves each particle by up to `amount` cells along each axis.
pub fn jitter(particles: &mut [Particle], amount: f64, seed: u64) {
    let mut random = Random::new(seed);
    for p in particles {
        let shift = DVec3::new(random.uniform(), random.uniform(), random.uniform()) * amount;
        p.set_grid(p.grid() + shift);
    }
}

/// Clay within half a cell of a wall that holds it has arrived there: of clay that is a part of more, by
/// symmetry, or that the case moved about in a room which it fills.
pub fn at_walls(domain: &Domain, particles: &mut [Particle]) {
    let (low, high) = domain.wall_nodes();
    let kinds = [domain.walls.low, domain.walls.high];
    for p in particles {
        let at = p.grid();
        let distance =
            |wall: usize| if wall < 3 { at[wall] - f64::from(low[wall]) } else { f64::from(high[wall % 3]) - at[wall % 3] };
        let has_arrived = |wall: usize| kinds[wall / 3][wall % 3] != Wall::Separate && distance(wall) < 0.5;
        p.walls = (0..6).map(|wall| u32::from(has_arrived(wall)) << wall).sum();
    }
}

/// Gives a particle a velocity [m/s].
pub fn set_velocity(particle: &mut Particle, velocity: DVec3) {
    particle.velocity = velocity.as_vec3().to_array();
}

/// A particle's velocity [m/s].
pub fn velocity(particle: &Particle) -> DVec3 {
    DVec3::from_array(particle.velocity.map(f64::from))
}

/// Elastic clay or other, at rest at time 0.
pub fn snapshot(domain: Domain, material: ClayMaterial, particles: Vec<Particle>) -> Snapshot {
    Snapshot::new(domain, material, particles)
}

/// A tool on a straight way, seen frame by frame.
#[derive(Clone, Copy, Debug)]
pub struct Mover {
    /// Names the tool.
    pub id: u32,
    /// The tool.
    pub tool: Tool,
    /// Where it is \[m\].
    pub pose: Pose,
    /// How it moves [m/s].
    pub velocity: DVec3,
}

impl Mover {
    /// A tool whose shape is given in cells, at `at` cells from the room's low corner.
    pub fn new(domain: &Domain, shape: ToolShape, contact: Contact, at: DVec3, rotation: DQuat) -> Self {
        let tool = Tool { shape: shape.scaled(DX), contact };
        Self { id: 1, tool, pose: Pose { position: world(domain, at), rotation }, velocity: DVec3::ZERO }
    }

    /// The tool's way over the next `duration` \[s\]; moves it there.
    pub fn path(&mut self, duration: f64) -> ToolPath {
        let start = self.pose;
        self.pose.position += self.velocity * duration;
        let sample = |time, pose| PoseSample { time, pose };
        ToolPath { id: self.id, tool: self.tool, sheet: 0, samples: vec![sample(0.0, start), sample(duration, self.pose)] }
    }
}

/// An engine that cases run on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum EngineKind {
    /// On the processor.
    Native,
    /// Compute passes on the default graphics adapter.
    Gpu,
}

impl EngineKind {
    /// Its name on record.
    pub fn name(self) -> &'static str {
        match self {
            Self::Native => "native",
            Self::Gpu => "gpu",
        }
    }

    /// Opens the graphics device, once for all cases, if the engine needs one.
    ///
    /// # Errors
    /// No adapter, or one that lacks what the passes need.
    pub fn prepare(self) -> Result<(), String> {
        if self == Self::Gpu {
            let engine = GpuDevice::headless().and_then(GpuEngine::new).map_err(|e| format!("--engine gpu: {e}"))?;
            GPU.get_or_init(|| Mutex::new(engine));
        }
        Ok(())
    }

    /// What it runs on.
    pub fn adapter(self) -> String {
        match self {
            Self::Native => crate::machine::processor(),
            Self::Gpu => engine(0).describe(),
        }
    }
}

/// The GPU engine that the cases run on, if it is not the native one.
static GPU: OnceLock<Mutex<GpuEngine>> = OnceLock::new();

/// Whether the cases run on the GPU engine, which refuses the inputs of validation cases beyond damping.
pub fn is_gpu() -> bool {
    GPU.get().is_some()
}

/// Whether [`Lab`]s run their frames in implicit steps.
static IS_IMPLICIT: AtomicBool = AtomicBool::new(false);

/// Whether the case runs [in implicit steps](in_implicit_steps).
pub fn is_implicit() -> bool {
    IS_IMPLICIT.load(Ordering::Relaxed)
}

/// Runs a case with the frames of its [`Lab`]s as long as they are, in the implicit steps that the planner
/// makes of them; its rows say so. For a process that runs one case at a time.
pub fn in_implicit_steps(case: fn(Size) -> Vec<Row>, size: Size) -> Vec<Row> {
    IS_IMPLICIT.store(true, Ordering::Relaxed);
    let rows = case(size);
    IS_IMPLICIT.store(false, Ordering::Relaxed);
    rows.into_iter().map(|row| Row { case: format!("in implicit steps, {}", row.case), ..row }).collect()
}

/// An engine without clay; the native one on `threads` cores, 0 for all.
pub fn engine(threads: usize) -> Box<dyn Engine> {
    match GPU.get() {
        Some(first) => Box::new(first.lock().unwrap_or_else(PoisonError::into_inner).sibling()),
        None => Box::new(NativeEngine::with_threads(threads)),
    }
}

/// An engine with clay in it and the plan of its next frame: the case dictates step and method, the planner
/// numbers the frames, deals sheets to blades and takes the reports in, as it does for apps and scenes.
pub struct Lab {
    /// The engine.
    pub engine: Box<dyn Engine>,
    /// What the next frame is made from; `id`, `steps` and `tools` are filled in.
    pub plan: FramePlan,
    planner: Planner,
}

impl Lab {
    /// Loads `snapshot` into an engine on all cores; no gravity.
    pub fn new(snapshot: &Snapshot, dt: f64) -> Self {
        Self::with_threads(snapshot, dt, 0)
    }

    /// Loads `snapshot` into an engine on `threads` cores, 0 for all.
    pub fn with_threads(snapshot: &Snapshot, dt: f64, threads: usize) -> Self {
        let mut engine = engine(threads);
        engine.load(snapshot).expect("the clay loads");
        let plan = FramePlan { outputs: FrameOutputs::ALL, ..FramePlan::new(snapshot.material, dt, 1) };
        Self { engine, plan, planner: Planner::new(snapshot) }
    }

    /// Runs a frame of `steps` substeps with `tools`.
    pub fn frame_with(&mut self, steps: u32, tools: &[ToolPath]) -> FrameReport {
        let duration = self.plan.dt * f64::from(steps);
        let integrator = if is_implicit() { IntegratorChoice::Implicit } else { IntegratorChoice::Explicit };
        self.planner.policy = Policy { integrator, gravity: self.plan.gravity, ..self.planner.policy };
        let Decision::Run(planned) = self.planner.frame(&self.plan.material, duration, tools) else {
            unreachable!("no frame is under way");
        };
        (self.plan.id, self.plan.steps, self.plan.tools) = (planned.id, steps, planned.tools);
        let mut plan = FramePlan { finds_bodies: planned.finds_bodies, ..self.plan.clone() };
        if is_implicit() {
            (plan.integrator, plan.dt, plan.steps) = (planned.integrator, planned.dt, planned.steps);
            // They damp by themselves what is faster than they are.
            plan.validation.damping = 0.0;
        }
        self.engine.submit(plan).expect("a sound plan");
        self.planner.sent();
        let mut report = self.engine.wait().expect("the engine runs");
        self.planner.note(&mut report);
        report
    }

    /// Runs a frame of `steps` substeps without tools.
    pub fn frame(&mut self, steps: u32) -> FrameReport {
        self.frame_with(steps, &[])
    }

    /// Runs a frame of `steps` substeps with one tool that moves on.
    pub fn frame_moving(&mut self, steps: u32, mover: &mut Mover) -> FrameReport {
        let path = mover.path(self.plan.dt * f64::from(steps));
        self.frame_with(steps, &[path])
    }

    /// The clay now, particles by id.
    pub fn particles(&self) -> Vec<Particle> {
        let mut particles = self.engine.state_deferred().expect("clay is loaded")().expect("a state").particles;
        particles.sort_by_key(|p| p.id);
        particles
    }
}

/// Whether every particle is finite, with its volume ratio in (0.05, 20).
pub fn is_sound(particles: &[Particle]) -> bool {
    particles.iter().all(|p| p.is_finite() && (0.05..20.0).contains(&p.volume_ratio()))
}
