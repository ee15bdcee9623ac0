//! From a scene to what an engine runs: snapshot and frame plans.

use super::error::{SceneError, bytes_text};
use super::file::{Body, ClayScene, MeshBody, Room};
use super::fill::{Fill, FillReport, FilledPoint};
use super::import::ImportedMesh;
use super::line::{named, short};
use super::solid::{MeshSolid, Solid};
use super::stamp::FileStamp;
use crate::sim::cut::SheetSet;
use crate::sim::frame::FrameOutputs;
use crate::sim::params::{CELLS_MAX, Domain, LENGTH, PADDING, ParamsError};
use crate::sim::penalty::{EJECTION_SPEED, FOUND_DEPTH, reach};
use crate::sim::planner::{Decision, Planner, Policy, StepLimits};
use crate::sim::snapshot::{Particle, Snapshot};
use crate::sim::tool::{Pose, Tool, ToolPath};
use glam::DVec3;
use std::path::Path;

/// Least margin about the clay [cells]: two blocks, so that a stencil's reach and some bulging stay clear of
/// the walls.
const MARGIN_CELLS: f64 = 8.0;
/// Margin about the clay over its greatest extent: pressed or slumping clay spreads by less in the scenes at
/// hand.
const MARGIN_EXTENT: f64 = 0.25;
/// Copies of the particles that a run holds: snapshot, an engine's two sorted buffers and its copy of the
/// frame's start.
const PARTICLE_COPIES: f64 = 4.0;
/// Bytes per cell of the whole box: an engine's table of blocks, 4 bytes per 4^3 cells.
const CELL_BYTES: f64 = 1.0 / 16.0;
/// Bytes per point of the fill's lattice over the clay's box: the marks of the shell and of cubes with clay.
const LATTICE_BYTES: f64 = 2.0;
/// Part of the available memory that clay may take.
const MEMORY_PART: f64 = 0.75;
/// Memory \[bytes\] taken as available where the system does not say.
const MEMORY_UNKNOWN: f64 = 4.0 * (1u64 << 30) as f64;

/// A scene made ready to run.
#[derive(Clone, Debug)]
pub struct BuiltScene {
    /// The clay at time 0.
    pub snapshot: Snapshot,
    /// What is odd about the scene but does not stop it, one line each.
    pub warnings: Vec<String>,
    /// What filling the clay found.
    pub fill: FillReport,
    /// Every file that was read for it or looked for, but the scene's own, as it was before: meshes, the
    /// buffers beside them, clays and those that they extend.
    pub inputs: Vec<FileStamp>,
    /// The scene.
    pub scene: ClayScene,
}

impl BuiltScene {
    /// Number of frames that cover the duration.
    pub fn frame_count(&self) -> u64 {
        // A whole number of frames must not gain one by rounding.
        (self.scene.duration / self.scene.frame_time - 1e-6).ceil().max(1.0) as u64
    }

    /// The tools in the frame from `frame_start` to `frame_end` \[s\], with times from the frame's start. Ids
    /// are indices in the scene's list, plus 1.
    pub fn tool_paths(&self, frame_start: f64, frame_end: f64) -> Vec<ToolPath> {
        (1..).zip(&self.scene.tools).filter_map(|(id, track)| track.path(id, frame_start, frame_end)).collect()
    }

    /// Plans the scene's frames.
    pub fn planner(&self) -> Planner {
        let ClayScene { integrator, accuracy, inertia, gravity, time_step, .. } = self.scene;
        let mut planner = Planner::new(&self.snapshot);
        let outputs = FrameOutputs { touch: self.scene.hand().is_some(), ..FrameOutputs::default() };
        planner.policy = Policy { gravity, integrator, accuracy, inertia, time_step, outputs, ..Policy::default() };
        planner
    }

    /// When frame `index`, from 0, begins and ends \[s\].
    pub fn frame_span(&self, index: u64) -> [f64; 2] {
        [index, index + 1].map(|index| index as f64 * self.scene.frame_time)
    }

    /// The next step of frame `index`, from 0.
    pub fn next(&self, index: u64, planner: &mut Planner) -> Decision {
        let [start, end] = self.frame_span(index);
        planner.frame(&self.snapshot.material, self.scene.frame_time, &self.tool_paths(start, end))
    }

    /// Refuses frames that would need more substeps than one may have, as far as that is known before the
    /// run: for the clay's stiffness, gravity and the time step, or for a tool's speed.
    fn check_steps(&self) -> Result<(), SceneError> {
        let ClayScene { frame_time, gravity, time_step, .. } = self.scene;
        let Snapshot { material, domain, .. } = &self.snapshot;
        let limits = StepLimits { gravity, time_step, ..StepLimits::default() };
        let plan = |tools: &[ToolPath]| limits.frame(material, domain.cell_width, frame_time, tools);
        // Long frames and fast tools make the step of a plan bad; whatever else is wrong has its own name.
        let refused = |error: ParamsError, name, value: String, reason: String| {
            let is_step = matches!(error.name, "dt" | "steps");
            let error = if is_step { ParamsError::new(name, value, format!("{reason}: {error}")) } else { error };
            SceneError::Params { file: self.scene.file.clone(), error }
        };
        plan(&[]).validate().map_err(|error| {
            let reason = format!("is too long a frame for cells of {} m, this clay and this gravity", domain.cell_width);
            refused(error, "frame_time", frame_time.to_string(), reason)
        })?;
        for (index, track) in self.scene.tools.iter().enumerate() {
            plan(&[track.whole(index as u32 + 1)]).validate().map_err(|error| {
                let value = format!("{:.3e} m/s of {}", track.speed_max(), track.title(index));
                refused(error, "keyframes.speed", value, format!("is too fast for frames of {frame_time} s"))
            })?;
        }
        Ok(())
    }
}

/// Memory that may be used \[bytes\]: three quarters of what the system says is available.
pub fn memory_limit() -> f64 {
    let available = |text: String| {
        let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
        line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok()
    };
    let kib = std::fs::read_to_string("/proc/meminfo").ok().and_then(available);
    MEMORY_PART * kib.map_or(MEMORY_UNKNOWN, |kib| kib * 1024.0)
}

/// Particles along a cell's edge: the cube nearest to `particles_per_cell`.
fn particles_per_edge(particles_per_cell: u32) -> u32 {
    f64::from(particles_per_cell).cbrt().round().clamp(1.0, 4.0) as u32
}

/// What a resolution costs.
pub(super) struct Cost {
    pub particles: f64,
    pub cells: f64,
    pub lattice: f64,
    pub edge: f64,
}

impl Cost {
    pub(super) fn bytes(&self) -> f64 {
        self.particles * PARTICLE_COPIES * size_of::<Particle>() as f64 + self.cells * CELL_BYTES + self.lattice * LATTICE_BYTES
    }
}

/// The clay of a scene in place, and what it takes to size the rest.
struct Clay {
    solids: Vec<Solid>,
    low: DVec3,
    high: DVec3,
    warnings: Vec<String>,
    inputs: Vec<FileStamp>,
    /// In the place of every mesh file.
    mesh: Option<ImportedMesh>,
}

impl ClayScene {
    /// Fills the clay. Mesh paths are relative to `base_dir`, the scene file's folder.
    ///
    /// # Errors
    /// A value out of its range, a mesh that cannot be read, clay that is outside the room or too thin for a
    /// particle, more memory than there is.
    pub fn build(&self, base_dir: &Path) -> Result<BuiltScene, SceneError> {
        self.build_within(base_dir, memory_limit())
    }

    /// [`Self::build`], with `mesh` in the place of every mesh file: for meshes that a program has.
    ///
    /// # Errors
    /// As [`Self::build`].
    pub fn build_with_mesh(&self, mesh: ImportedMesh) -> Result<BuiltScene, SceneError> {
        self.build_of(Path::new("."), Some(mesh), memory_limit())
    }

    /// [`Self::build`] with a limit of memory \[bytes\] of one's own.
    ///
    /// # Errors
    /// As [`Self::build`].
    pub fn build_within(&self, base_dir: &Path, memory_limit: f64) -> Result<BuiltScene, SceneError> {
        self.build_of(base_dir, None, memory_limit)
    }

    fn build_of(&self, base_dir: &Path, mesh: Option<ImportedMesh>, memory_limit: f64) -> Result<BuiltScene, SceneError> {
        self.validate()?;
        let mut inputs = vec![];
        let (material, odd) = self.clay_material(base_dir, &mut inputs)?;
        let Clay { solids, low, high, mut warnings, inputs: meshes, .. } = self.clay_solids(base_dir, mesh)?;
        warnings.extend(odd);
        inputs.extend(meshes);
        self.check_memory(&solids, (low, high), memory_limit)?;
        let room = self.domain.unwrap_or_else(|| self.room_about(low, high, self.cell_width));
        let params = |error| SceneError::Params { file: self.file.clone(), error };
        let domain = Domain::new(room.low, room.high, self.cell_width, self.walls).map_err(|error| {
            // The name that is to blame: cells that would do about the clay are none too small.
            let about = self.room_about(low, high, self.cell_width);
            let would_do = Domain::new(about.low, about.high, self.cell_width, self.walls).is_ok();
            params(if self.domain.is_some() && would_do { room.fault(error.reason) } else { error })
        })?;
        self.check_inside(&solids, &domain)?;
        let edge = particles_per_edge(self.particles_per_cell);
        if edge.pow(3) != self.particles_per_cell {
            warnings.push(format!("particles_per_cell = {} is made {}, a cube", self.particles_per_cell, edge.pow(3)));
        }
        let fill = Fill { spacing: self.cell_width / f64::from(edge), jitter: self.jitter, seed: self.seed };
        let (points, report) = fill.fill(&solids);
        if let Some(body) = report.particles_per_solid.iter().position(|count| *count == 0) {
            let (file, name, cell_width) = (self.file.clone(), self.clay[body].name(), self.cell_width);
            return Err(SceneError::NoParticles { file, body, name, cell_width });
        }
        warnings.extend(self.tools_outside());
        for &body in &report.self_overlapping {
            let name = self.clay[body].name();
            warnings.push(format!(
                "clay[{body}] ({name}) passes through itself or is partly inside out; its volume is the sampled one"
            ));
        }
        let particle = |(id, point): (u32, &FilledPoint)| Particle::at(domain.to_grid(point.position), point.volume as f32, id);
        warnings.extend(self.tools_in_clay(&points));
        let particles = (0..).zip(&points).map(particle).collect();
        let mut snapshot = Snapshot::new(domain, material, particles);
        snapshot.find_bodies(SheetSet::default());
        let built = BuiltScene { snapshot, warnings, fill: report, inputs, scene: self.clone() };
        built.check_steps()?;
        Ok(built)
    }

    /// What is to be said of tools whose keyframes are all before the scene or after its end.
    fn tools_outside(&self) -> impl Iterator<Item = String> {
        self.tools.iter().enumerate().filter_map(|(index, track)| {
            let ((from, to), end) = (track.span()?, self.duration);
            let until = if to.is_finite() { format!("to {to} s") } else { "on".into() };
            let is_outside = from >= end || to <= 0.0;
            let title = track.title(index);
            is_outside.then(|| format!("{title} is there from {from} s {until}, never in a scene from 0 s to {end} s"))
        })
    }

    /// What is to be said of solid tools that begin in the clay, as it is filled.
    fn tools_in_clay(&self, points: &[FilledPoint]) -> impl Iterator<Item = String> {
        let cell_width = self.cell_width;
        let depth = move |tool: &Tool, pose: Pose| {
            let depth = |point: &FilledPoint| {
                let volume = point.volume / cell_width.powi(3);
                reach(volume) * cell_width - tool.shape.distance(pose.to_local(point.position))
            };
            points.iter().map(depth).fold(0.0, f64::max)
        };
        self.tools.iter().enumerate().filter_map(move |(index, track)| {
            let start = track.span()?.0.max(0.0);
            let path = track.path(0, start, start + self.frame_time).filter(|path| !path.tool.shape.is_blade())?;
            let (depth, title) = (depth(&path.tool, path.samples.first()?.pose), track.title(index));
            (depth > FOUND_DEPTH * cell_width).then(|| {
                format!("{title} begins {depth:.1e} m deep in the clay, which then gives way by {EJECTION_SPEED} cells a step")
            })
        })
    }

    fn clay_solids(&self, base_dir: &Path, mesh: Option<ImportedMesh>) -> Result<Clay, SceneError> {
        let (low, high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let mut clay = Clay { solids: vec![], low, high, warnings: vec![], inputs: vec![], mesh };
        for (index, body) in self.clay.iter().enumerate() {
            let solid = body.solid(base_dir, &mut clay)?;
            let (low, high) = solid.bounds();
            (clay.low, clay.high) = (clay.low.min(low), clay.high.max(high));
            let thickness = solid.thickness();
            if thickness < self.cell_width {
                let (name, cell_width) = (body.name(), self.cell_width);
                clay.warnings.push(format!(
                    "clay[{index}] ({name}) is {thickness:.2e} m thick, less than a cell of {cell_width} m: it will act stiffer and tear sooner"
                ));
            }
            clay.solids.push(solid);
        }
        Ok(clay)
    }

    /// The automatic room: whole cells about the clay, so that a box of whole cells stands on nodes; the
    /// floor under the clay; wide enough for the tools' ways, but no farther than the clay's own extent.
    fn room_about(&self, low: DVec3, high: DVec3, cell_width: f64) -> Room {
        let extent = (high - low).max_element();
        let margin = (MARGIN_EXTENT * extent).max(MARGIN_CELLS * cell_width);
        let reach = self.tools.iter().map(super::track::ToolTrack::bounds);
        let (tools_low, tools_high) = reach.fold((low, high), |a, b| (a.0.min(b.0), a.1.max(b.1)));
        let below = (low - tools_low).min(DVec3::splat(extent)).max(DVec3::splat(margin));
        let above = (tools_high - high).min(DVec3::splat(extent)).max(DVec3::splat(margin));
        let mut cells_below = (below / cell_width).ceil();
        cells_below.y = 0.0;
        // Meshes put on the ground come to stand within rounding of it.
        let floor = if low.y.abs() < 1e-9 * extent { 0.0 } else { low.y };
        let low = DVec3::new(low.x, floor, low.z) - cells_below * cell_width;
        Room { low, high: high + above }
    }

    fn cost(&self, volume: f64, clay: (DVec3, DVec3), cell_width: f64) -> Cost {
        self.cost_in(self.domain.unwrap_or_else(|| self.room_about(clay.0, clay.1, cell_width)), volume, clay, cell_width)
    }

    fn cost_in(&self, room: Room, volume: f64, clay: (DVec3, DVec3), cell_width: f64) -> Cost {
        let edge = f64::from(particles_per_edge(self.particles_per_cell));
        let cells = (room.high - room.low) / cell_width + f64::from(PADDING);
        let lattice = ((clay.1 - clay.0) * edge / cell_width).ceil().max(DVec3::ONE).element_product();
        Cost {
            particles: volume * (edge / cell_width).powi(3),
            cells: cells.element_product(),
            lattice,
            edge: cells.max_element(),
        }
    }

    /// Refuses a resolution before anything of its size is allocated.
    fn check_memory(&self, solids: &[Solid], clay: (DVec3, DVec3), limit: f64) -> Result<(), SceneError> {
        // Ids are u32.
        let limit = limit.min(PARTICLE_COPIES * size_of::<Particle>() as f64 * f64::from(u32::MAX));
        let in_box = |solid: &Solid| {
            let (low, high) = solid.bounds();
            (high - low).element_product()
        };
        let volume: f64 = solids.iter().map(|solid| solid.volume().unwrap_or_else(|| in_box(solid))).sum();
        let fits = |cell_width: f64| {
            let cost = self.cost(volume, clay, cell_width);
            cost.bytes() <= limit && cost.edge <= f64::from(CELLS_MAX)
        };
        let cost = self.cost(volume, clay, self.cell_width);
        // A grid that is only too long is the domain's to refuse.
        if cost.bytes() <= limit {
            return Ok(());
        }
        if let Some(room) = self.domain {
            let about = self.room_about(clay.0, clay.1, self.cell_width);
            if self.cost_in(about, volume, clay, self.cell_width).bytes() <= limit {
                let (bytes, limit) = (bytes_text(cost.bytes()), bytes_text(limit));
                let reason = format!("takes {bytes} on cells of cell_width = {} m, over the limit of {limit}", self.cell_width);
                return Err(SceneError::Params { file: self.file.clone(), error: room.fault(reason) });
            }
        }
        // Halving in the logarithm between the width asked for and one cell for all: 60 times reach any
        // precision shown.
        let room = self.domain.map_or((clay.1 - clay.0).max_element(), |room| (room.high - room.low).max_element());
        let (mut low, mut high) = (self.cell_width, room.max(self.cell_width));
        for _ in 0..60 {
            let middle = (low * high).sqrt();
            (low, high) = if fits(middle) { (low, middle) } else { (middle, high) };
        }
        // Rounded up to the digits shown, so that the width named does fit.
        Err(SceneError::Memory {
            file: self.file.clone(),
            cell_width: self.cell_width,
            particles: cost.particles,
            cells: cost.cells,
            bytes: cost.bytes(),
            limit,
            fits: high * 1.001,
        })
    }

    fn check_inside(&self, solids: &[Solid], domain: &Domain) -> Result<(), SceneError> {
        let (wall_low, wall_high) = domain.corners();
        let slack = 1e-6 * domain.cell_width;
        for (body, solid) in solids.iter().enumerate() {
            let (low, high) = solid.bounds();
            if let Some(i) = (0..3).find(|i| low[*i] < wall_low[*i] - slack || high[*i] > wall_high[*i] + slack) {
                return Err(SceneError::OutsideDomain {
                    file: self.file.clone(),
                    body,
                    name: self.clay[body].name(),
                    axis: ['x', 'y', 'z'][i],
                    low: low[i],
                    high: high[i],
                    wall_low: wall_low[i],
                    wall_high: wall_high[i],
                });
            }
        }
        Ok(())
    }
}

impl Body {
    /// The piece in a word: its kind or its file.
    pub fn name(&self) -> String {
        match self {
            Self::Box { .. } => "box".into(),
            Self::Sphere { .. } => "sphere".into(),
            Self::Cylinder { .. } => "cylinder".into(),
            Self::Mesh(mesh) => short(&mesh.path),
        }
    }

    fn solid(&self, base_dir: &Path, clay: &mut Clay) -> Result<Solid, SceneError> {
        Ok(match *self {
            Self::Box { size, center } => Solid::Box { low: center - size / 2.0, high: center + size / 2.0 },
            Self::Sphere { radius, center } => Solid::Sphere { center, radius },
            Self::Cylinder { radius, height, center } => Solid::Cylinder { center, radius, height },
            Self::Mesh(ref mesh) => Solid::Mesh(Box::new(mesh.solid(base_dir, clay)?)),
        })
    }
}

impl MeshBody {
    /// The solid; `clay` gains what is odd about it and the files it is read from.
    fn solid(&self, base_dir: &Path, clay: &mut Clay) -> Result<MeshSolid, SceneError> {
        let path = &self.path;
        let file = base_dir.join(path);
        let path = short(path);
        let mut mesh = match &clay.mesh {
            Some(mesh) => mesh.clone(),
            None => ImportedMesh::load_stamped(&file, &mut clay.inputs)?,
        };
        let warnings = &mut clay.warnings;
        mesh.place(self.rotation.quaternion(), 1.0, DVec3::ZERO);
        let (low, high) = mesh.bounds();
        let extent = high - low;
        let scale = match (self.height, self.scale) {
            (Some(_), _) if extent.y <= 0.0 => {
                let reason = "the mesh has no height along y to scale".into();
                return Err(SceneError::Mesh { file: named(&file), line: None, reason });
            }
            (Some(height), _) => height / extent.y,
            (None, scale) => scale.unwrap_or(1.0),
        };
        let (middle, underside) = ((low + high) / 2.0, DVec3::new((low.x + high.x) / 2.0, low.y, (low.z + high.z) / 2.0));
        let offset = match (self.position, self.center) {
            (_, Some(center)) => center - middle * scale,
            (position, None) => position.unwrap_or_default() - underside * scale,
        };
        mesh.place(glam::DQuat::IDENTITY, scale, offset);
        let (low, high) = mesh.bounds();
        for corner in [low, high] {
            LENGTH.check_vector("mesh", corner).map_err(|error| SceneError::Mesh {
                file: named(&file),
                line: None,
                reason: format!("scaled and in place reaches to {}: {}", error.value, error.reason),
            })?;
        }
        if mesh.doubled > 0 {
            warnings.push(format!("{path}: {} triangle(s) are given more than once; each counts once", mesh.doubled));
        }
        if mesh.volume() < 0.0 {
            warnings.push(format!("{path}: the mesh is inside out; filled as if turned"));
        }
        let open = mesh.open_edges();
        if open.count > 0 {
            let cancelled = match mesh.cancelled() {
                0 => String::new(),
                count => format!("{count} triangle(s) are given again facing the other way, and the two cancel; "),
            };
            warnings.push(format!(
                "{path}: the mesh is open: {} open edges around {} hole(s), the largest {:.2e} m across; {cancelled}filled where the winding number exceeds 1/2",
                open.count, open.holes, open.largest
            ));
        }
        Ok(MeshSolid::new(mesh))
    }
}

#[cfg(test)]
mod tests;
