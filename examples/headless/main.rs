//! Runs a scene without a window: `cargo run --no-default-features --example headless -- SCENE.ron --out DIR
//! [--frames N]`.
//!
//! What it writes into DIR, what its exit codes mean and in which units it writes: `--help`, which is
//! `args::AFTER_HELP`. From the command line to the files:
//!
//! | file        | takes                    | makes                                                   |
//! |-------------|--------------------------|---------------------------------------------------------|
//! | `args`      | command line             | scene file, folder, frames, pictures                    |
//! | `places`    | scene, folder            | the files of this run, each known to be writable        |
//! | `run`       | built scene              | engine at the run's end, why it ended, what a hand felt |
//! | `record`    | the engine               | the same, recorded (`--record`)                         |
//! | `replay`    | a recording (`--replay`) | the run again, without scene and files                  |
//! | `tally`     | frame reports            | `metrics.csv`, sums and extremes, checks                |
//! | `write`     | all of these             | the files, the summary, faults                          |
//! | `pictures`  | surfaces of some frames  | PNG files; in a build without Bevy `no_pictures`        |
//! | `say`       | lines                    | standard output and standard error, which may be closed |
//! | `interrupt` | Ctrl+C                   | a question that the frame loop asks                     |

mod args;
mod interrupt;
#[cfg(not(feature = "demo"))]
#[path = "no_pictures.rs"]
mod pictures;
#[cfg(feature = "demo")]
mod pictures;
mod places;
mod progress;
mod record;
mod replay;
mod run;
mod say;
mod tally;
mod write;

use args::Args;
use bevy_clay::prelude::*;
use bevy_clay::scene::prelude::*;
use bevy_clay::sim::prelude::*;
use places::Places;
use record::Record;
use run::Run;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;
use write::Results;

/// How the program ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Exit {
    /// All is well.
    Well = 0,
    /// A check failed, the run stopped early, or a file could not be written.
    Fault = 1,
    /// Bad input: nothing was run or written.
    Input = 2,
    /// Interrupted: what there was is written. 128 and the number of SIGINT, as shells have it.
    Interrupted = 130,
}

fn main() -> ExitCode {
    let exit = Args::read().and_then(|args| answer(&args)).unwrap_or_else(|error| {
        say::error(&error);
        Exit::Input
    });
    ExitCode::from(exit as u8)
}

/// Does what the command line asks for.
fn answer(args: &Args) -> Result<Exit, String> {
    match &args.replay {
        Some(recording) => replay::replay(recording),
        None => prepare(args).map(|ready| finish(args, ready)),
    }
}

/// Everything that can be refused before the first frame, done.
struct Ready {
    built: BuiltScene,
    engine: Box<dyn Engine>,
    places: Places,
    record: Record,
    began: Instant,
}

/// Reads the scene, loads the clay and finds out whether the results can be written.
fn prepare(args: &Args) -> Result<Ready, String> {
    let began = Instant::now();
    let scene = ClayScene::load(args.scene()).map_err(|e| e.to_string())?;
    let built = scene.build(args.scene().parent().unwrap_or(Path::new("."))).map_err(|e| e.to_string())?;
    let places = Places::prepare(args, &built)?;
    let (mut record, mut engine) = Record::of(args.record.as_deref(), NativeEngine::new());
    let loaded = interrupt::watch()
        .and_then(|()| engine.load(&built.snapshot).map_err(|e| format!("{}: {e}", built.scene.file)))
        .and_then(|()| record.fault().map_or(Ok(()), Err));
    if let Err(error) = loaded {
        drop(engine);
        record.withdraw();
        places.withdraw();
        return Err(error);
    }
    built.warnings.iter().for_each(|warning| say::warning(warning));
    Ok(Ready { built, engine, places, record, began })
}

/// Runs the scene and writes what came of it.
fn finish(args: &Args, ready: Ready) -> Exit {
    let Ready { built, mut engine, places, record, began } = ready;
    let mut run = Run::new(&built, args, record);
    let mut results = Results::new(&built, &places, engine.describe(), began);
    // In place of an earlier run's, which would pass for this one's if this one is killed; and where it
    // cannot be written nothing can.
    if !results.write_summary(&run) {
        drop(engine);
        run.record.withdraw();
        places.withdraw();
        return Exit::Input;
    }
    let Domain { cell_width, .. } = built.snapshot.domain;
    say::line(&format!(
        "{}: {} particles, {:.2} mm cells, {} frames on the {}",
        built.scene.file,
        built.snapshot.particles.len(),
        cell_width * 1e3,
        run.frames,
        engine.describe()
    ));
    run.run(&built, engine.as_mut());
    results.write(engine, &run);
    results.write_pictures(&mut run, args);
    results.conclude(&run)
}
