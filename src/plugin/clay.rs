//! What an app gives and gets: the clay, its settings, its status.

use super::clock::ClayClock;
use super::source::{ClaySource, SavedClay};
use super::status::{ClayMetrics, ClayStatus};
use crate::scene::file::ClayScene;
use crate::sim::frame::{FrameReport, ToolReport};
use crate::sim::material::ClayMaterial;
use crate::sim::planner::{Backlog, InertiaScaling, IntegratorChoice, StepAccuracy};
use crate::sim::snapshot::Snapshot;
use bevy::ecs::component::{Mutable, StorageType};
use bevy::prelude::*;
use glam::DVec3;
use std::path::PathBuf;
use std::sync::Arc;

impl Component for ClayMaterial {
    const STORAGE_TYPE: StorageType = StorageType::Table;
    type Mutability = Mutable;
}

/// A piece of clay. What it starts from is made, and its engine started, away from the main thread; a clay
/// that is replaced stands until the next one is ready.
///
/// Beside it belongs a [`ClayMaterial`], which the clay is made of from the next frame on; the source's is
/// put there, and replaced with it, unless the app has put another one there. The entity's [`Transform`]
/// places, turns and uniformly scales the clay; particles and walls are in the entity's own frame, which
/// [`ClaySpace`](super::space::ClaySpace) goes between and the world.
///
/// The default is a cube of 4 cm of soft clay with cells of 2 mm, standing on a floor.
#[derive(Component, Clone, Debug, PartialEq, Reflect)]
#[reflect(Component, Clone, Debug, Default, PartialEq)]
#[require(ClaySettings, ClayClock, ClayStatus, ClayMetrics, Transform, Visibility)]
pub struct Clay {
    /// What it starts from.
    pub source: ClaySource,
    /// Cell width \[m\], half the spacing of the particles, for sources that do not say it themselves; without
    /// it the longest edge has 20 cells.
    pub cell_width: Option<f64>,
}

impl Clay {
    /// Clay that starts from `source`.
    pub fn new(source: ClaySource) -> Self {
        Self { source, cell_width: None }
    }

    /// A block with edges of these lengths \[m\], standing on its floor at the entity.
    pub fn block(size: Vec3) -> Self {
        Self::new(ClaySource::Block { size: shortest(size) })
    }

    /// A ball of this radius \[m\], lying on its floor at the entity.
    pub fn ball(radius: f32) -> Self {
        Self::new(ClaySource::Ball { radius: shortest(Vec3::splat(radius)).x })
    }

    /// The inside of a mesh, where it is; its lowest point is on the floor. The mesh has to be kept in the
    /// main world.
    pub fn mesh(mesh: Handle<Mesh>) -> Self {
        Self::new(ClaySource::Mesh(mesh))
    }

    /// The clay of a scene, without its tools.
    pub fn scene(scene: ClayScene) -> Self {
        Self::new(ClaySource::Scene(scene))
    }

    /// The clay of a scene file, without its tools.
    pub fn scene_file(path: impl Into<PathBuf>) -> Self {
        Self::new(ClaySource::SceneFile(path.into()))
    }

    /// Clay as it stood.
    pub fn snapshot(snapshot: Snapshot) -> Self {
        Self::new(ClaySource::Snapshot(SavedClay(Arc::new(snapshot))))
    }

    /// Clay as it stood at the end of a recorded run, which is run again.
    pub fn recording(path: impl Into<PathBuf>) -> Self {
        Self::new(ClaySource::Recording(path.into()))
    }

    /// On cells of this width \[m\].
    #[must_use]
    pub fn with_cell_width(self, cell_width: f32) -> Self {
        Self { cell_width: Some(shortest(Vec3::splat(cell_width)).x), ..self }
    }
}

/// The number that was written: 0.04 and not 0.03999999910593033, so that blocks of whole cells are.
fn shortest(size: Vec3) -> DVec3 {
    DVec3::from_array(size.to_array().map(|x| x.to_string().parse().unwrap_or(f64::from(x))))
}

impl Default for Clay {
    fn default() -> Self {
        Self::block(Vec3::splat(0.04))
    }
}

/// Which engine runs the clay.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Reflect)]
#[reflect(Default)]
#[non_exhaustive]
pub enum EngineChoice {
    /// The CPU engine, which alone has implicit steps; where [`ClaySettings::integrator`] asks for explicit
    /// ones, the GPU engine if the app renders on a hardware adapter.
    #[default]
    Auto,
    /// The CPU engine.
    Native,
    /// The GPU engine on the app's own device, software adapters included, in explicit steps; the CPU engine
    /// where that cannot be, with a line that says so.
    Gpu,
}

/// How the clay is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Reflect)]
#[reflect(Default)]
#[non_exhaustive]
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
#[non_exhaustive]
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
    /// Gravity [m/s^2] in the frame of the world, in the place of [`ClayGravity`](super::clock::ClayGravity).
    pub gravity: Option<DVec3>,
    /// Which integrator frames have: implicit steps are slower the further tools go, explicit ones the
    /// stiffer the clay is. The GPU engine has explicit ones, whatever this says.
    pub integrator: IntegratorChoice,
    /// How finely implicit steps follow a tool.
    pub accuracy: StepAccuracy,
    /// How far explicit steps may scale inertia while a tool engages supported clay.
    pub inertia: InertiaScaling,
    /// Whether frames are no longer than what the engine runs in the time of one of the app's, so that clay
    /// that is too much for the machine still answers a tool at once. Without it frames follow the clock
    /// alone, and a run repeats if the clock does.
    pub is_responsive: bool,
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
            gravity: None,
            integrator: IntegratorChoice::default(),
            accuracy: StepAccuracy::default(),
            inertia: InertiaScaling::Off,
            is_responsive: true,
            mesh: MeshQuality::Fine,
            surface: SurfaceBackend::Auto,
            backlog: Backlog::default(),
            snapshot_interval: 1.0,
        }
    }
}

/// A frame of clay has ended.
#[derive(Message, Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ClayReport {
    /// The entity with the [`Clay`].
    pub clay: Entity,
    /// What came of the frame, in the clay's own frame: forces on tools, energies, health, timings.
    pub report: FrameReport,
    /// The entities of the tools that the report has, in its order.
    pub tools: Vec<Entity>,
}

impl ClayReport {
    /// What the tool of this entity felt; nothing if it was not in the frame.
    pub fn tool(&self, tool: Entity) -> Option<&ToolReport> {
        self.report.tools.get(self.tools.iter().position(|t| *t == tool)?)
    }
}
