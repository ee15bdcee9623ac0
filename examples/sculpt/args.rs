//! The command line, and the clay it asks for.

use bevy::prelude::Resource;
use bevy_clay::prelude::*;
use bevy_clay::scene::prelude::*;
use clap::{Parser, ValueEnum};
use std::path::{Path, PathBuf};

/// Most particles to start with where no graphics processor helps.
const PARTICLES_WITHOUT_GPU: f64 = 5000.0;

/// A block of clay as it comes out of the packet.
const BLOCK: &str = "(
    clay: [Box(size: (0.052, 0.026, 0.040), center: (0, 0.013, 0))],
    cell_width: CELL_WIDTH,
    domain: (low: (-0.06, 0, -0.06), high: (0.06, 0.06, 0.06)),
)";
/// Cell width of the block [m]: 46,000 particles.
const BLOCK_CELL: f64 = 0.0021;

/// Which engine to ask for.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum EngineArg {
    /// The GPU where the window is drawn with one, else the CPU.
    Auto,
    /// The CPU.
    Native,
    /// The GPU, software drivers included.
    Gpu,
}

impl From<EngineArg> for EngineChoice {
    fn from(arg: EngineArg) -> Self {
        match arg {
            EngineArg::Auto => Self::Auto,
            EngineArg::Native => Self::Native,
            EngineArg::Gpu => Self::Gpu,
        }
    }
}

/// Where to make the surface that is shown.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum SurfaceArg {
    /// On the GPU where the window is drawn with one, else on the CPU.
    Auto,
    /// On the CPU.
    Cpu,
    /// On the GPU, software drivers included.
    Gpu,
}

impl From<SurfaceArg> for SurfaceBackend {
    fn from(arg: SurfaceArg) -> Self {
        match arg {
            SurfaceArg::Auto => Self::Auto,
            SurfaceArg::Cpu => Self::Cpu,
            SurfaceArg::Gpu => Self::Gpu,
        }
    }
}

/// Sculpts clay in a window.
#[derive(Parser, Resource, Clone, Debug)]
#[command(name = "sculpt")]
pub(crate) struct Args {
    /// Scene file (RON) whose clay to start with; its tools and its duration do not matter here.
    #[arg(long, value_name = "FILE")]
    pub(crate) scene: Option<PathBuf>,
    /// Clay file (RON) that says what the clay is made of, read again whenever it changes: a path, or a name
    /// such as wax.clay.ron.
    #[arg(long, value_name = "FILE")]
    pub(crate) clay: Option<PathBuf>,
    /// Engine of the clay.
    #[arg(long, value_enum, default_value = "auto")]
    pub(crate) engine: EngineArg,
    /// Where the surface that is shown is made.
    #[arg(long, value_enum, default_value = "auto")]
    pub(crate) surface: SurfaceArg,
    /// Ends after N frames of the window, with a check.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) frames: Option<u64>,
    /// Makes a stroke by itself, checks that it left a dent, and ends.
    #[arg(long)]
    pub(crate) script: bool,
    /// Saves a picture of the window when it ends.
    #[arg(long, value_name = "FILE.png")]
    pub(crate) screenshot: Option<PathBuf>,
    /// Folder for exported files.
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub(crate) out: PathBuf,
}

impl Args {
    /// The command line. Asked for help, it is printed and the program ends.
    ///
    /// # Errors
    /// One line that names the argument that is wrong.
    pub(crate) fn read() -> Result<Self, String> {
        Self::try_parse().map_err(|error| {
            if !error.use_stderr() {
                error.exit();
            }
            let text = error.to_string();
            text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_string()
        })
    }

    /// The scene that was asked for, built once to find out whether it can be.
    ///
    /// # Errors
    /// One line that names file, line and field.
    pub(crate) fn start(&self) -> Result<Start, String> {
        let (scene, base) = match &self.scene {
            Some(file) => {
                let scene = ClayScene::load(file).map_err(|e| e.to_string())?;
                (scene, file.parent().unwrap_or(Path::new(".")).to_path_buf())
            }
            None => {
                let text = BLOCK.replace("CELL_WIDTH", &BLOCK_CELL.to_string());
                (ClayScene::from_ron(&text).map_err(|e| e.to_string())?, PathBuf::from("."))
            }
        };
        let built = scene.build(&base).map_err(|e| e.to_string())?;
        let clay = self.clay.as_deref().map(ClayFile::load).transpose().map_err(|e| e.to_string())?;
        Ok(Start { built, base, clay })
    }
}

/// The clay to start with.
#[derive(Resource, Clone, Debug)]
pub(crate) struct Start {
    built: BuiltScene,
    base: PathBuf,
    clay: Option<ClayFile>,
}

impl Start {
    /// What is odd about the scene.
    pub(crate) fn warnings(&self) -> &[String] {
        &self.built.warnings
    }

    /// What the clay is made of: what the clay file says, else the scene's material with `softening` about
    /// tools.
    pub(crate) fn material(&self, softening: f64) -> ClayMaterial {
        let material = ClayMaterial { softening, ..self.built.snapshot.material };
        self.clay.as_ref().map_or(material, |clay| clay.in_place_of(&material))
    }

    /// The clay as it is for a graphics processor, or coarser if there is none.
    ///
    /// # Errors
    /// A scene that cannot be built so coarse.
    pub(crate) fn snapshot(&self, has_gpu: bool) -> Result<Snapshot, String> {
        // Filling gives a few particles more than volume over spacing cubed.
        const RESERVE: f64 = 0.94;
        let count = self.built.snapshot.particles.len() as f64;
        if has_gpu || count <= PARTICLES_WITHOUT_GPU {
            return Ok(self.built.snapshot.clone());
        }
        let cell_width = self.built.scene.cell_width * (count / (RESERVE * PARTICLES_WITHOUT_GPU)).cbrt();
        let scene = ClayScene { cell_width, ..self.built.scene.clone() };
        scene.build(&self.base).map(|built| built.snapshot).map_err(|e| e.to_string())
    }
}
