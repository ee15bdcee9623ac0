//! What an app gives and gets: the clay, its settings, its status.

use crate::sim::frame::FrameReport;
use crate::sim::material::{ClayMaterial, Preset};
use crate::sim::params::{Domain, WALL_NODE, Walls};
use crate::sim::planner::{Backlog, InertiaScaling};
use crate::sim::snapshot::{Particle, Snapshot};
use bevy::ecs::component::{Mutable, StorageType};
use bevy::ecs::lifecycle::HookContext;
use bevy::ecs::world::DeferredWorld;
use bevy::prelude::*;
use glam::{DVec3, IVec3};
use std::sync::{Arc, OnceLock};

impl Component for ClayMaterial {
    const STORAGE_TYPE: StorageType = StorageType::Table;
    type Mutability = Mutable;
}

/// What a piece of clay starts from. The plugin starts an engine for each new or replaced `Clay`, away from
/// the main thread; a replaced one stands until the next is ready.
///
/// Beside it belongs a [`ClayMaterial`], which the clay is made of from the next frame on; without one the
/// snapshot's is inserted. The entity's [`Transform`] places, turns and uniformly scales the clay; particles,
/// walls, gravity and forces are in the entity's own frame.
///
/// The default is a cube of 4 cm of soft clay with cells of 2 mm, standing on a floor.
#[derive(Component, Clone, Debug, Reflect)]
#[reflect(Component, Default)]
#[require(ClaySettings, ClayStatus, Transform, Visibility)]
#[component(on_insert = insert_material)]
pub struct Clay {
    #[reflect(ignore, default = "cube")]
    snapshot: Arc<Snapshot>,
}

impl Clay {
    /// Clay that starts from `snapshot`.
    pub fn new(snapshot: Snapshot) -> Self {
        Self { snapshot: Arc::new(snapshot) }
    }

    /// What the clay started from.
    pub fn snapshot(&self) -> &Snapshot {
        &self.snapshot
    }

    /// The snapshot itself, shared: its address tells one start from another.
    pub(super) fn shared(&self) -> &Arc<Snapshot> {
        &self.snapshot
    }
}

impl Default for Clay {
    fn default() -> Self {
        Self { snapshot: cube() }
    }
}

/// The cube of [`Clay::default`]; made once, as reflection asks for it often.
fn cube() -> Arc<Snapshot> {
    const CELL: f64 = 0.002;
    const PER_EDGE: u32 = 40;
    static CUBE: OnceLock<Arc<Snapshot>> = OnceLock::new();
    let make = || {
        let cells = IVec3::new(60, 40, 60);
        let low = DVec3::new(-0.06, 0.0, -0.06);
        let origin = low - CELL * f64::from(WALL_NODE);
        let domain = Domain { origin, cell_width: CELL, cells, walls: Walls::default() };
        let corner = domain.to_grid(DVec3::new(-0.02, 0.0, -0.02));
        let particle = |id: u32| {
            let (x, y, z) = (id % PER_EDGE, id / PER_EDGE % PER_EDGE, id / (PER_EDGE * PER_EDGE));
            let place = DVec3::new(f64::from(x), f64::from(y), f64::from(z)) * 0.5 + 0.25;
            #[expect(clippy::cast_possible_truncation, reason = "particles are f32")]
            Particle::at(corner + place, (CELL.powi(3) / 8.0) as f32, id)
        };
        let particles = (0..PER_EDGE.pow(3)).map(particle).collect();
        Arc::new(Snapshot::new(domain, Preset::SoftClay.material(), particles))
    };
    CUBE.get_or_init(make).clone()
}

/// Puts the snapshot's material beside a [`Clay`] that has none.
fn insert_material(mut world: DeferredWorld, context: HookContext) {
    if world.get::<ClayMaterial>(context.entity).is_none()
        && let Some(clay) = world.get::<Clay>(context.entity)
    {
        let material = clay.snapshot.material;
        world.commands().entity(context.entity).insert(material);
    }
}

/// Which engine runs the clay.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Reflect)]
#[reflect(Default)]
pub enum EngineChoice {
    /// The GPU engine where the app renders on a hardware adapter, the CPU engine elsewhere.
    #[default]
    Auto,
    /// The CPU engine.
    Native,
    /// The GPU engine on the app's own device, software adapters included; the CPU engine where that cannot
    /// be, with a line that says so.
    Gpu,
}

/// How the clay is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Reflect)]
#[reflect(Default)]
pub enum MeshQuality {
    /// Not at all: for apps that draw it themselves.
    Off,
    /// Surface nodes every cell: about a quarter of the triangles.
    Coarse,
    /// Surface nodes every half cell.
    #[default]
    Fine,
}

/// Where the surface that is shown is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Reflect)]
#[reflect(Default)]
pub enum SurfaceBackend {
    /// On the graphics device where the app renders on a hardware adapter, on the processor elsewhere.
    #[default]
    Auto,
    /// On the processor, away from the main thread: a frame or more behind the clay.
    Cpu,
    /// On the graphics device, software adapters included, straight into the mesh that is drawn: the frame
    /// drawn is the frame simulated. On the processor where the app renders nothing.
    Gpu,
}

/// How the clay is run and shown; may change at any time.
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Default)]
pub struct ClaySettings {
    /// The engine. A change moves the clay over as it stands.
    pub engine: EngineChoice,
    /// Gravity [m/s^2] in the clay's own frame.
    pub gravity: DVec3,
    /// How far inertia may be scaled while a tool engages supported clay.
    pub inertia: InertiaScaling,
    /// Whether frames are no longer than what the engine runs in the time of one of the app's, so that clay
    /// that is too much for the machine still answers a tool at once. Without it frames follow the clock
    /// alone, and a run repeats if the clock does.
    pub is_responsive: bool,
    /// Whether the clay's time stands still. Tools then move without touching it.
    pub is_paused: bool,
    /// How the clay is shown.
    pub mesh: MeshQuality,
    /// Where its surface is made.
    pub surface: SurfaceBackend,
    /// What the tools do with the hand's way that the clay had no time for.
    pub backlog: Backlog,
    /// Seconds between the copies of the state that the clay goes on from when its engine is lost; 0 or less
    /// keeps only the start.
    pub snapshot_interval: f32,
}

impl Default for ClaySettings {
    fn default() -> Self {
        Self {
            engine: EngineChoice::Auto,
            gravity: DVec3::new(0.0, -9.81, 0.0),
            inertia: InertiaScaling::Off,
            is_responsive: true,
            is_paused: false,
            mesh: MeshQuality::Fine,
            surface: SurfaceBackend::Auto,
            backlog: Backlog::default(),
            snapshot_interval: 1.0,
        }
    }
}

/// Milliseconds per part of the last frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Reflect)]
#[reflect(Default)]
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

/// How the clay is doing. Written by the plugin, for apps to read.
#[derive(Component, Clone, Debug, Default, Reflect)]
#[reflect(Component, Default)]
pub struct ClayStatus {
    /// The engine and what it runs on; empty until the first one has started.
    pub engine: String,
    /// What is wrong, by name: a parameter the engine refused (the clay stands until that is mended), what
    /// became of an engine, or a [`MaterialFile`](super::follow::MaterialFile) that is bad (the clay stays as
    /// it is).
    pub error: Option<String>,
    /// What is odd about its [`MaterialFile`](super::follow::MaterialFile), one line each.
    pub warnings: Vec<String>,
    /// Particles in motion.
    pub particle_count: usize,
    /// Cell width \[m\].
    pub cell_width: f64,
    /// Simulated time \[s\].
    pub time: f64,
    /// Simulated time per wall time over the last second or so.
    pub rate: f64,
    /// Time of the app's clock \[s\] that the clay did not follow: the engine was busy, or refused a frame.
    pub given_up: f64,
    /// Time \[s\] by which the tools, as the clay has them, lag behind the hand.
    pub lag: f64,
    /// Substeps of the last frame.
    pub substeps: u32,
    /// Wall time of the last frame \[ms\].
    pub frame_ms: f64,
    /// Its parts.
    pub pass_ms: PassTimes,
    /// Wall time \[ms\] of the last surface, on another thread.
    pub mesh_ms: f64,
    /// Triangles shown: of the surface, and of the balls that stand for particles outside of it.
    pub triangle_count: usize,
    /// Longest time \[ms\] that a system of the plugin held the main thread in the last second.
    pub main_thread_ms: f64,
    /// Volume of the clay [m^3].
    pub volume: f64,
    /// What went wrong in the last frame; `ok` if nothing did.
    pub health: String,
}

impl ClayStatus {
    /// Takes what a report says.
    pub(super) fn note(&mut self, report: &FrameReport) {
        let ms = |seconds: f64| seconds * 1e3;
        let t = &report.timings;
        self.particle_count = report.particle_count;
        self.time = report.time;
        self.substeps = report.steps;
        self.frame_ms = ms(t.total);
        self.pass_ms = PassTimes { rebin: ms(t.rebin), grid: ms(t.grid), particles: ms(t.particles), report: ms(t.report) };
        self.volume = report.volume;
        self.health = report.health.to_string();
    }
}

/// A frame of clay has ended.
#[derive(Message, Clone, Debug, PartialEq)]
pub struct ClayReport {
    /// The entity with the [`Clay`].
    pub clay: Entity,
    /// What came of the frame, in the clay's own frame: forces on tools, energies, health, timings.
    pub report: FrameReport,
}
