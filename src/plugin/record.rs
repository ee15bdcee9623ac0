//! Runs of an app's clay on file.

use crate::scene::recording::engine::SharedRecorder;
use bevy::prelude::*;
use std::path::Path;

/// Records the run of the [`Clay`](super::clay::Clay) beside it: every plan that an engine is given and every
/// state that it starts from, so that `headless --replay` makes the same bits of it on the same engine. It is
/// put there with the clay: an engine that runs already is not recorded.
///
/// The recording ends with the entity or the app; of an app that was killed the frames up to there can be
/// replayed. A file that cannot be written is named in the log, and the clay goes on.
#[derive(Component, Clone, Debug)]
pub struct ClayRecording {
    pub(super) recorder: SharedRecorder,
}

impl ClayRecording {
    /// Into the file at `path`, in place of what is there.
    pub fn new(path: &Path) -> Self {
        Self { recorder: SharedRecorder::new(path) }
    }
}

/// Says why nothing more is recorded.
pub(super) fn say(recordings: Query<(Entity, &ClayRecording)>) {
    for (clay, recording) in &recordings {
        if let Some(fault) = recording.recorder.take_fault() {
            error!("clay {clay}: the recording ends early: {fault}");
        }
    }
}
