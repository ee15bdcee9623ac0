//! The command line.

use crate::arm::ArmArg;
use crate::check::CheckArgs;
use bevy_clay::prelude::*;
use clap::{ArgGroup, Parser, ValueEnum};
use std::path::PathBuf;

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
#[derive(Parser, Clone, Debug)]
#[command(name = "sculpt", group = ArgGroup::new("end").multiple(true))]
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
    /// A haptic arm that leads a tool of its own beside the mouse's, or those of the hands in a headset.
    #[arg(long, value_enum)]
    pub(crate) arm: Option<ArmArg>,
    /// Placement file (RON) that says where the arm stands, as (position: (0.1, 0.8, -0.4), scale: 2);
    /// without one it stands by the clay.
    #[arg(long, value_name = "FILE", requires = "arm")]
    pub(crate) placement: Option<PathBuf>,
    /// Sculpts in a headset, through an OpenXR runtime; in the window where there is none.
    #[arg(long)]
    pub(crate) xr: bool,
    /// Records the run of the clay into FILE, in place of what is there, for `headless --replay FILE`.
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,
    /// Folder for exported files.
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub(crate) out: PathBuf,
    /// Options of the checks.
    #[command(flatten)]
    pub(crate) check: CheckArgs,
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
            // What is wrong stands before the first empty line, advice after it.
            let text = error.to_string();
            let lines: Vec<&str> = text.lines().map(str::trim).take_while(|line| !line.is_empty()).collect();
            lines.join(" ").trim_start_matches("error: ").to_string()
        })
    }
}

/// Whether a window can be opened at all.
///
/// # Errors
/// One line that says that there is no display.
pub(crate) fn display() -> Result<(), String> {
    let is_set = std::env::var_os("DISPLAY").is_some_and(|value| !value.is_empty());
    if cfg!(target_os = "linux") && !is_set {
        return Err("there is no display (DISPLAY is not set); `xvfb-run` makes one, the example `headless` needs none".into());
    }
    Ok(())
}
