//! The command line.

use bevy_clay::scene::line::one_line;
use bevy_clay::scene::prelude::*;
use clap::Parser;
use std::path::{Path, PathBuf};

/// Pictures where none were asked for.
const PICTURES: u64 = 4;

/// Files, units and exit codes.
pub(crate) const AFTER_HELP: &str = "\
Files in DIR (lengths in a scene are metres, times seconds):
  summary.json   the run at a glance: version, frames, exit status, health, faults; units stand in the names
  metrics.csv    a line per frame; units stand in the header
  force.csv      of a scene whose tool a hand leads (`hand: Stylus`): the arm, a line per tick, to be played again on
                 an arm; metres, seconds, newtons
  surface.stl    the surface of the last frame, or what the scene's `outputs.surface` names:
                 .stl, .ply, .obj, .3mf in millimetres, .glb in metres
  particles.ply  the particles of the last frame: positions in millimetres, velocities in m/s
  frame_NNNN.png pictures after frame NNNN, with the default features

A recording (--record FILE) holds the clay, every frame's plan and a checksum of the end. --replay FILE runs
it again, without the scene, writes nothing and says whether the end has the same bits: it has on the same
version, engine and kind of processor. Of a run that was killed it replays what there is.

Exit codes:
  0    all is well
  1    a check failed, the run stopped early, or a file could not be written; the rest is written;
       a replay has other bits than the run, though version, engine and kind of processor are the same
  2    bad input: one line says what is wrong and where, nothing is written
  130  interrupted (Ctrl+C): the frame or picture under way was ended, what there was is written;
       a second Ctrl+C ends at once";

#[derive(Parser)]
#[command(name = "headless", about = "Runs a clay scene without a window", version, after_help = AFTER_HELP)]
pub(crate) struct Args {
    /// Scene file (RON).
    #[arg(required_unless_present = "replay")]
    scene: Option<PathBuf>,
    /// Folder for the results, made if missing.
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub(crate) out: PathBuf,
    /// Runs only the first N frames.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub(crate) frames: Option<u64>,
    /// Pictures of the run, evenly spread, the last of its end: 4 if not said. They need the default features
    /// and a graphics adapter.
    #[arg(long, value_name = "N")]
    pub(crate) pictures: Option<u64>,
    /// Records the run into FILE, in place of what is there, for `--replay`.
    #[arg(long, value_name = "FILE")]
    pub(crate) record: Option<PathBuf>,
    /// Replays the recording FILE in place of a scene.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["scene", "out", "frames", "pictures", "record"])]
    pub(crate) replay: Option<PathBuf>,
}

impl Args {
    /// The command line. Asked for help or version, it is printed and the program ends.
    ///
    /// # Errors
    /// One line that names the argument that is wrong.
    pub(crate) fn read() -> Result<Self, String> {
        Self::try_parse().map_err(|error| {
            if !error.use_stderr() {
                error.exit();
            }
            let text = error.to_string();
            // The usage follows after an empty line.
            let what = text.split("\n\n").next().unwrap_or_default().trim_start_matches("error: ");
            one_line(&what.split_whitespace().collect::<Vec<_>>().join(" "))
        })
    }

    /// The scene file; without a name where a recording is replayed.
    pub(crate) fn scene(&self) -> &Path {
        self.scene.as_deref().unwrap_or(Path::new(""))
    }

    /// Frames to run of `built`.
    pub(crate) fn frames_of(&self, built: &BuiltScene) -> u64 {
        built.frame_count().min(self.frames.unwrap_or(u64::MAX))
    }

    /// The frames of `built`, from 1, after which a picture is taken: the ends of equal parts of the run.
    pub(crate) fn pictured(&self, built: &BuiltScene) -> Vec<u64> {
        let frames = self.frames_of(built);
        let count = self.pictures.unwrap_or(PICTURES).min(frames);
        (1..=count).map(|picture| (picture * frames).div_ceil(count)).collect()
    }

    /// Whether pictures were asked for: then it is a fault if there are none.
    pub(crate) fn wants_pictures(&self) -> bool {
        self.pictures.is_some_and(|count| count > 0)
    }
}
