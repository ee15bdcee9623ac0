//! The scene file: RON, every field checked where it stands, so that an error names its line.
//!
//! ```ron
//! (
//!     clay: [Mesh(path: "bunny.obj", height: 0.08), Sphere(radius: 0.01, center: (0.05, 0.01, 0.0))],
//!     cell_width: 0.002,
//!     material: Preset(SoftClay),
//!     softening: 0.5,
//!     tools: [(shape: Sphere(radius: 0.01), keyframes: [(time: 0.0, position: (0.1, 0.03, 0.0)), (time: 1.0, position: (0.02, 0.03, 0.0))])],
//!     inertia: Accurate,
//!     duration: 1.5,
//! )
//! ```
//!
//! Options are written without `Some`. Lengths are in metres, times in seconds, angles in degrees.

use super::check::{
    Check, cell_width, check_number, check_place, checked, checked_list, checked_option, duration, frame_time, gravity, jitter,
    particles_per_cell, seed, softening, time_step,
};
use super::clay;
use super::error::SceneError;
use super::export::{ExportFormat, ExportOptions, PARTICLES};
use super::line::named;
use super::stamp::FileStamp;
use super::text::{from_ron, read_text};
use super::track::{AxisAngle, Grip, ToolTrack};
use crate::sim::cut::JOINT_SHEET;
use crate::sim::material::{ClayMaterial, Preset};
use crate::sim::params::{GRAVITY, ParamsError, Wall, Walls};
use crate::sim::planner::{InertiaScaling, IntegratorChoice, StepAccuracy};
use crate::surface::field::Tier;
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The longest scene file [bytes]: keyframes at 1 kHz for a minute take 6 MB.
const BYTES_MAX: u64 = 16 << 20;
/// Most frames of a scene: 4.6 hours at 60 a second; their table is kept in memory and takes 200 MB.
const FRAMES_MAX: f64 = 1e6;

/// A piece of clay. Pieces may overlap: what they share counts once.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub enum Body {
    /// A block.
    Box {
        /// Edge lengths \[m\].
        size: DVec3,
        /// Its middle \[m\].
        #[serde(default)]
        center: DVec3,
    },
    /// A ball.
    Sphere {
        /// Radius \[m\].
        radius: f64,
        /// Its middle \[m\].
        #[serde(default)]
        center: DVec3,
    },
    /// A cylinder along Y.
    Cylinder {
        /// Radius \[m\].
        radius: f64,
        /// Height \[m\].
        height: f64,
        /// Its middle \[m\].
        #[serde(default)]
        center: DVec3,
    },
    /// The inside of a mesh file, written as `Mesh(path: "bunny.obj", height: 0.08)`.
    Mesh(MeshBody),
}

/// The inside of a mesh file, turned, then scaled, then put in place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshBody {
    /// OBJ, STL, PLY or glTF file (.glb, .gltf), from the scene file's folder.
    pub path: String,
    /// Height along Y after turning \[m\]; not together with `scale`.
    #[serde(default)]
    pub height: Option<f64>,
    /// Metres per unit of the file; 1 if neither this nor `height` is given.
    #[serde(default)]
    pub scale: Option<f64>,
    /// Where the middle of its box's underside goes \[m\]; the world's origin if neither this nor `center` is
    /// given.
    #[serde(default)]
    pub position: Option<DVec3>,
    /// Where the middle of its box goes \[m\].
    #[serde(default)]
    pub center: Option<DVec3>,
    /// The turn.
    #[serde(default)]
    pub rotation: AxisAngle,
}

/// Where material parameters come from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum MaterialChoice {
    /// A named clay.
    Preset(Preset),
    /// Values, as in `Values(density: 1700, young_modulus: 4.4e5, poisson_ratio: 0.45, yield_stress: 8e3)`.
    Values(#[serde(deserialize_with = "checked")] ClayMaterial),
    /// A clay file, as in `File("wax.clay.ron")`: in the scene file's folder, else in `assets/clays` or of
    /// this crate ([`super::clay`]).
    File(String),
}

impl Default for MaterialChoice {
    fn default() -> Self {
        Self::Preset(Preset::SoftClay)
    }
}

/// A room given by its corners.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Room {
    /// Low corner \[m\].
    pub low: DVec3,
    /// High corner \[m\]; the walls there stand at or beyond it, a whole number of 4 cells from the low ones.
    pub high: DVec3,
}

/// What a run writes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Outputs {
    /// File name of the last surface, of a format of [`ExportFormat`]; `None` for no surface.
    pub surface: Option<String>,
    /// How the surface is written, as in `(bodies: Apart, volume_min: 1e-9, simplify: 5e-5)`.
    pub export: ExportOptions,
    /// Spacing of the surface's grid.
    pub tier: Tier,
    /// Whether to write the last particles.
    pub particles: bool,
    /// Whether to write a table with a line per frame.
    pub metrics: bool,
}

impl Default for Outputs {
    fn default() -> Self {
        Self {
            surface: Some("surface.stl".into()),
            export: ExportOptions::default(),
            tier: Tier::Fine,
            particles: true,
            metrics: true,
        }
    }
}

/// A scene as its file says it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClayScene {
    /// Name of the file in errors.
    #[serde(skip, default = "ClayScene::unnamed")]
    pub file: String,
    /// The clay.
    #[serde(deserialize_with = "checked_list")]
    pub clay: Vec<Body>,
    /// Cell width dx \[m\].
    #[serde(deserialize_with = "cell_width")]
    pub cell_width: f64,
    /// Particles per cell, 1 to 64, made the nearest cube of a whole number: 1, 8, 27 or 64.
    #[serde(default = "ClayScene::particles_per_cell_default", deserialize_with = "particles_per_cell")]
    pub particles_per_cell: u32,
    /// Greatest displacement of particles from their lattice along each axis, over the lattice spacing [-],
    /// in [0, 0.5).
    #[serde(default = "ClayScene::jitter_default", deserialize_with = "jitter")]
    pub jitter: f64,
    /// Seed of all that is random.
    #[serde(default, deserialize_with = "seed")]
    pub seed: u64,
    /// What the clay is made of.
    #[serde(default)]
    pub material: MaterialChoice,
    /// In place of the material's softening [-], in [0, 1).
    #[serde(default, deserialize_with = "softening")]
    pub softening: Option<f64>,
    /// In place of the material's softening length \[m\].
    #[serde(default)]
    pub softening_length: Option<f64>,
    /// Gravity [m/s^2].
    #[serde(default = "ClayScene::gravity_default", deserialize_with = "gravity")]
    pub gravity: DVec3,
    /// The room; left out, one about the clay and the tools' ways, with its floor at the clay's lowest point.
    #[serde(default, deserialize_with = "checked_option")]
    pub domain: Option<Room>,
    /// The walls; left out, clay sticks to the floor and can leave the others. Walls left out of a list given
    /// are `Separate`.
    #[serde(default = "ClayScene::walls_default")]
    pub walls: Walls,
    /// The tools; the first has id 1.
    #[serde(default, deserialize_with = "checked_list")]
    pub tools: Vec<ToolTrack>,
    /// Which integrator the frames have.
    #[serde(default)]
    pub integrator: IntegratorChoice,
    /// How finely implicit steps follow a tool.
    #[serde(default)]
    pub accuracy: StepAccuracy,
    /// How far explicit steps may scale inertia up while tools move.
    #[serde(default)]
    pub inertia: InertiaScaling,
    /// Duration of a frame \[s\].
    #[serde(default = "ClayScene::frame_time_default", deserialize_with = "frame_time")]
    pub frame_time: f64,
    /// Duration of the scene \[s\].
    #[serde(default = "ClayScene::duration_default", deserialize_with = "duration")]
    pub duration: f64,
    /// Greatest time step \[s\]; left out, the stability limits choose it.
    #[serde(default, deserialize_with = "time_step")]
    pub time_step: Option<f64>,
    /// What a run writes.
    #[serde(default, deserialize_with = "checked")]
    pub outputs: Outputs,
}

impl ClayScene {
    /// The tool that a hand leads: its index, itself, how the arm is held.
    pub fn hand(&self) -> Option<(usize, &ToolTrack, Grip)> {
        self.tools.iter().enumerate().find_map(|(index, track)| Some((index, track, track.hand?)))
    }

    fn unnamed() -> String {
        "scene".into()
    }

    fn particles_per_cell_default() -> u32 {
        8
    }

    fn jitter_default() -> f64 {
        0.25
    }

    fn gravity_default() -> DVec3 {
        DVec3::new(0.0, -9.81, 0.0)
    }

    fn walls_default() -> Walls {
        Walls { low: [Wall::Separate, Wall::Stick, Wall::Separate], high: [Wall::Separate; 3] }
    }

    fn frame_time_default() -> f64 {
        1.0 / 60.0
    }

    fn duration_default() -> f64 {
        1.0
    }

    /// Clay of these pieces on cells of `cell_width` \[m\]; all else as in a file that does not name it.
    pub fn new(clay: Vec<Body>, cell_width: f64) -> Self {
        Self {
            file: Self::unnamed(),
            clay,
            cell_width,
            particles_per_cell: Self::particles_per_cell_default(),
            jitter: Self::jitter_default(),
            seed: 0,
            material: MaterialChoice::default(),
            softening: None,
            softening_length: None,
            gravity: Self::gravity_default(),
            domain: None,
            walls: Self::walls_default(),
            tools: vec![],
            integrator: IntegratorChoice::default(),
            accuracy: StepAccuracy::default(),
            inertia: InertiaScaling::default(),
            frame_time: Self::frame_time_default(),
            duration: Self::duration_default(),
            time_step: None,
            outputs: Outputs::default(),
        }
    }

    /// Reads a scene from the text of a file.
    ///
    /// # Errors
    /// Text that is not a scene, or a value out of its range, with line and column.
    pub fn from_ron(text: &str) -> Result<Self, SceneError> {
        Self::from_text(text, Self::unnamed())
    }

    /// Reads the scene file at `path`. Mesh paths in it are relative to its folder, which is what
    /// [`Self::build`] wants to be given.
    ///
    /// # Errors
    /// A file that cannot be read, and what [`Self::from_ron`] finds.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        let file = named(path);
        Self::from_text(&read_text(path, BYTES_MAX, "scene")?, file)
    }

    fn from_text(text: &str, file: String) -> Result<Self, SceneError> {
        let mut scene: Self = from_ron(text, &file)?;
        scene.file = file;
        scene.validate()?;
        Ok(scene)
    }

    /// The clay's parameters, with the scene's softening in place of the material's, and what is odd about
    /// its file. `base_dir` is the scene file's folder; `stamps` gains what
    /// [`clay::ClayFile::load_stamped`] adds.
    ///
    /// # Errors
    /// A clay file that is not there or bad, a softening out of its range.
    pub fn clay_material(&self, base_dir: &Path, stamps: &mut Vec<FileStamp>) -> Result<(ClayMaterial, Vec<String>), SceneError> {
        let (material, warnings) = match &self.material {
            MaterialChoice::File(name) => {
                let clay = clay::load_from(name, &self.file, base_dir, stamps)?;
                (self.softened(clay.material), clay.warnings)
            }
            _ => (self.known_material(), vec![]),
        };
        material.validate().map_err(|error| SceneError::Params { file: self.file.clone(), error })?;
        Ok((material, warnings))
    }

    /// `material` with the scene's softening.
    fn softened(&self, material: ClayMaterial) -> ClayMaterial {
        ClayMaterial {
            softening: self.softening.unwrap_or(material.softening),
            softening_length: self.softening_length.unwrap_or(material.softening_length),
            ..material
        }
    }

    /// The material as far as it is known without reading another file.
    fn known_material(&self) -> ClayMaterial {
        self.softened(match &self.material {
            MaterialChoice::Preset(preset) => preset.material(),
            MaterialChoice::Values(values) => *values,
            MaterialChoice::File(_) => ClayMaterial::default(),
        })
    }

    /// Checks every value but those of a clay file, which are checked when it is read: for scenes made by a
    /// program.
    ///
    /// # Errors
    /// The first value that is out of its range, by name.
    pub fn validate(&self) -> Result<(), SceneError> {
        self.first_fault().map_err(|error| SceneError::Params { file: self.file.clone(), error })
    }

    fn first_fault(&self) -> Result<(), ParamsError> {
        if self.clay.is_empty() {
            return Err(ParamsError::new("clay", "[]", "must hold at least one piece"));
        }
        self.clay.iter().try_for_each(Check::check)?;
        check_number("cell_width", self.cell_width)?;
        check_number("particles_per_cell", f64::from(self.particles_per_cell))?;
        check_number("jitter", self.jitter)?;
        self.known_material().validate()?;
        GRAVITY.check_vector("gravity", self.gravity)?;
        self.domain.as_ref().map_or(Ok(()), Check::check)?;
        // Each may be a blade, with a sheet of its own; 0 is none.
        if self.tools.len() >= JOINT_SHEET.into() {
            return Err(ParamsError::new("tools", self.tools.len(), "must be at most 238"));
        }
        self.tools.iter().try_for_each(Check::check)?;
        let hands = self.tools.iter().filter(|track| track.hand.is_some()).count();
        if hands > 1 {
            return Err(ParamsError::new("tools.hand", hands, "must be that of one tool at most: there is one arm"));
        }
        check_number("frame_time", self.frame_time)?;
        check_number("duration", self.duration)?;
        self.time_step.map_or(Ok(()), |step| check_number("time_step", step))?;
        let frames = self.duration / self.frame_time;
        if frames > FRAMES_MAX {
            let reason = format!("gives {frames:.3e} frames of {:e} s; at most {FRAMES_MAX:e} are run", self.frame_time);
            return Err(ParamsError::new("duration", self.duration, reason));
        }
        self.outputs.check()
    }
}

impl Check for ClayMaterial {
    fn check(&self) -> Result<(), ParamsError> {
        self.validate()
    }
}

impl Room {
    pub(super) fn fault(&self, reason: impl Into<String>) -> ParamsError {
        ParamsError::new("domain", format!("{} .. {}", self.low, self.high), reason)
    }
}

impl Check for Room {
    fn check(&self) -> Result<(), ParamsError> {
        let Self { low, high } = *self;
        check_place("domain.low", low)?;
        check_place("domain.high", high)?;
        if (high - low).min_element() > 0.0 {
            return Ok(());
        }
        Err(self.fault("must be a box with low < high"))
    }
}

impl Check for Outputs {
    fn check(&self) -> Result<(), ParamsError> {
        self.export.validate()?;
        let Some(name) = self.surface.as_deref() else { return Ok(()) };
        let fault = |reason: String| Err(ParamsError::new("outputs.surface", name, reason));
        if Path::new(name).file_name().is_none_or(|file| file != name) {
            return fault("must be a file name without folders".into());
        }
        if name.contains(char::is_control) {
            return fault("must hold no control characters".into());
        }
        if ExportFormat::from_path(Path::new(name)).is_err() {
            return fault(format!("must end in {}", ExportFormat::KNOWN));
        }
        // File systems of some machines do not know upper from lower case.
        if self.particles && name.eq_ignore_ascii_case(PARTICLES) {
            return fault(format!("must be another file than the particles', {PARTICLES}"));
        }
        Ok(())
    }
}

impl Check for Body {
    fn check(&self) -> Result<(), ParamsError> {
        match self {
            Self::Box { size, center } => {
                size.to_array().into_iter().try_for_each(|length| check_number("size", length))?;
                check_place("center", *center)
            }
            Self::Sphere { radius, center } => check_number("radius", *radius).and(check_place("center", *center)),
            Self::Cylinder { radius, height, center } => {
                check_number("radius", *radius)?;
                check_number("height", *height)?;
                check_place("center", *center)
            }
            Self::Mesh(mesh) => mesh.check(),
        }
    }
}

impl Check for MeshBody {
    fn check(&self) -> Result<(), ParamsError> {
        let both = |name, other| Err(ParamsError::new(name, &self.path, format!("not together with `{other}`")));
        match (self.height, self.scale) {
            (Some(_), Some(_)) => both("height", "scale")?,
            (Some(height), None) => check_number("height", height)?,
            (None, Some(scale)) => check_number("scale", scale)?,
            (None, None) => {}
        }
        match (self.position, self.center) {
            (Some(_), Some(_)) => both("position", "center")?,
            (Some(position), None) => check_place("position", position)?,
            (None, Some(center)) => check_place("center", center)?,
            (None, None) => {}
        }
        self.rotation.check()
    }
}

#[cfg(test)]
mod tests;
