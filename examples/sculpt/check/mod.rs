//! For tests alone: a sculptor has none of this, and the other modules know nothing of it. It looks at the
//! app from outside, says in the terminal what it sees, and checks the run when it ends.
//!
//! | file      | does                                                                |
//! |-----------|---------------------------------------------------------------------|
//! | `run`     | counts, takes the picture, ends the run, checks it                  |
//! | `strokes` | measures how soon strokes are answered and what they leave behind   |
//! | `script`  | makes a stroke without a mouse                                      |
//! | `arm`     | says how an arm's hand was served                                   |

mod arm;
mod run;
mod script;
mod strokes;

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
    /// Makes a stroke by itself, checks that it left a dent, and ends. With an arm: ends when the simulated
    /// hand has gone its way, and says how it was served.
    #[arg(long, group = "end", requires = "is_on")]
    script: bool,
    /// Ends after N frames of the window.
    #[arg(long, group = "end", requires = "is_on", value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,
    /// Saves a picture of the window when the script or the frames end.
    #[arg(long, requires_all = ["is_on", "end"], value_name = "FILE.png")]
    screenshot: Option<PathBuf>,
}

impl CheckArgs {
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
