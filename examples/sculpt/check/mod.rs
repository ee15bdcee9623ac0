//! For tests alone: a sculptor has none of this, and the other modules know nothing of it. It looks at the
//! app from outside, says in the terminal what it sees, and checks the run when it ends.
//!
//! | file      | does                                                                |
//! |-----------|---------------------------------------------------------------------|
//! | `run`     | counts, takes the picture, ends the run, checks it                  |
//! | `strokes` | measures how soon strokes are answered and what they leave behind   |
//! | `script`  | makes a stroke without a mouse                                      |
//! | `arm`     | says how an arm's hand was served                                   |
//! | `hands`   | moves hands in a headset, and looks at what they did                |

mod arm;
#[cfg(feature = "xr")]
mod hands;
mod run;
mod script;
mod strokes;

#[cfg(feature = "xr")]
pub(crate) use hands::HandsPlugin;

use crate::say;
use bevy::prelude::*;
use std::path::PathBuf;

/// What to check, and when to end.
#[derive(clap::Args, Resource, Clone, Debug)]
#[command(next_help_heading = "Checks, with --check")]
pub(crate) struct CheckArgs {
    /// Says in the terminal how soon each stroke is answered and what it leaves behind, and checks the run
    /// when it ends.
    #[arg(long = "check")]
    pub(crate) is_on: bool,
    /// Makes a stroke by itself, checks that it left a dent, and ends. In a headset of Monado's remote
    /// driver: moves its head and hands, and checks what they do. With an arm: ends when the simulated hand
    /// has gone its way, and says how it was served.
    #[arg(long, group = "end", requires = "is_on")]
    script: bool,
    /// With --xr and --script: makes FILE, to ask for the end of the runtime, and checks that the clay stays.
    #[cfg(feature = "xr")]
    #[arg(long, requires = "script", value_name = "FILE")]
    kill: Option<PathBuf>,
    /// Ends after N frames of the window.
    #[arg(long, group = "end", requires = "is_on", value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,
    /// Saves a picture of the window when the script or the frames end; of a headset what each eye sees, into
    /// a folder of that name.
    #[arg(long, requires_all = ["is_on", "end"], value_name = "FILE.png")]
    screenshot: Option<PathBuf>,
}

impl CheckArgs {
    /// Whether a script moves the hands.
    #[cfg(feature = "xr")]
    fn is_scripted(&self) -> bool {
        self.script
    }

    /// Where pictures of what the eyes see go.
    #[cfg(feature = "xr")]
    fn pictures(&self) -> Option<PathBuf> {
        self.screenshot.as_ref().map(|file| file.with_extension(""))
    }

    /// What asks for the runtime's end.
    #[cfg(feature = "xr")]
    fn kill(&self) -> Option<PathBuf> {
        self.kill.clone()
    }

    /// Whether the run ends by itself.
    fn ends(&self) -> bool {
        self.script || self.frames.is_some()
    }
}

/// Checks the run.
pub(crate) struct CheckPlugin {
    pub(crate) args: CheckArgs,
    /// Whether an arm has a tool: its hand is the script then.
    pub(crate) has_arm: bool,
}

impl Plugin for CheckPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(self.args.clone()).add_plugins((strokes::StrokesPlugin, run::RunPlugin));
        if self.has_arm {
            app.add_plugins(arm::ArmCheckPlugin);
        } else if self.args.script {
            app.add_plugins(script::ScriptPlugin);
        }
    }
}

/// A line for the terminal.
fn say(line: &str) {
    say::line(&format!("sculpt: {line}"));
}
