//! A recording run again: `--replay`.

use crate::progress::Progress;
use crate::{Exit, interrupt, say};
use bevy_clay::prelude::*;
use bevy_clay::scene::line::named;
use bevy_clay::scene::prelude::*;
use bevy_clay::scene::recording::{Event, Origin};
use std::path::Path;

/// What a recording holds, known before it is replayed.
struct Survey {
    frames: u64,
    /// Checksum of the clay at its end, if the run got there.
    end: Option<u32>,
    events: u64,
    is_cut_short: bool,
    origin: Origin,
}

/// Reads the recording at `path` through, without running it.
fn survey(path: &Path) -> Result<Survey, String> {
    let mut recording = Recording::open(path).map_err(|e| e.to_string())?;
    let (mut frames, mut end) = (0, None);
    for event in recording.by_ref() {
        match event.map_err(|e| e.to_string())? {
            Event::Plan(_) => frames += 1,
            Event::Ended(checksum) => end = Some(checksum),
            Event::Load(_) | Event::Report(_) | Event::StrokeBegan | Event::StrokeEnded => {}
        }
    }
    if recording.events() == 0 {
        return Err(format!("{}: holds no event: there is nothing to replay", named(path)));
    }
    let (events, is_cut_short, origin) = (recording.events(), recording.is_cut_short(), recording.origin().clone());
    Ok(Survey { frames, end, events, is_cut_short, origin })
}

/// Runs the recording at `path` on the native engine and compares its end.
///
/// # Errors
/// One line that says what is wrong with the recording.
pub(crate) fn replay(path: &Path) -> Result<Exit, String> {
    let Survey { frames, end, events, is_cut_short, origin } = survey(path)?;
    interrupt::watch()?;
    let mut engine = NativeEngine::new();
    let here = Origin::of(&engine);
    let file = named(path);
    let is_comparable = origin == here;
    if !is_comparable {
        let of = |origin: &Origin| format!("version {} on the {}", origin.version, origin.engine);
        say::warning(&format!("{file}: was made by {}; this is {}: other bits are no fault", of(&origin), of(&here)));
    }
    let cut = if is_cut_short { ", the last of them cut" } else { "" };
    if end.is_none() {
        let read = format!("{events} events, {frames} frames");
        say::warning(&format!("{file}: its run was killed{cut}: {read} can be read, and there is no end to compare with"));
    }
    say::line(&format!("{file}: {frames} frames on the {}", engine.describe()));
    let mut progress = Progress::new(frames);
    for event in Recording::open(path).map_err(|e| e.to_string())? {
        if interrupt::is_requested() {
            progress.finish();
            return Ok(Exit::Interrupted);
        }
        let event = event.map_err(|e| e.to_string())?;
        if let Some(report) = event.apply(&mut engine).map_err(|e| format!("{file}: {e}"))? {
            progress.step(&format!("{} steps, J {:.2}..{:.2}", report.steps, report.volume_ratio.0, report.volume_ratio.1));
        }
    }
    progress.finish();
    // A run that was killed may have left frames under way.
    while engine.pending() > 0 {
        engine.wait().map_err(|e| format!("{file}: {e}"))?;
    }
    let clay = engine.save().map_err(|e| format!("{file}: {e}"))?;
    let sum = clay.checksum();
    let ended = format!("{file}: {frames} frames replayed, {:.3} s of clay, checksum {sum:08x}", clay.time);
    match end {
        None => say::line(&ended),
        Some(end) if end == sum => say::line(&format!("{ended}: the same bits")),
        Some(end) if is_comparable => {
            say::error(&format!("{ended}: other bits than the run's, {end:08x}, on the same engine"));
            return Ok(Exit::Fault);
        }
        Some(end) => say::line(&format!("{ended}: other bits than the run's, {end:08x}")),
    }
    Ok(Exit::Well)
}
