//! The run on file, for `--replay`. A recording that cannot be written any more is a fault, and the run goes
//! on.

use bevy_clay::scene::recording::engine::SharedRecorder;
use bevy_clay::sim::prelude::*;
use std::path::{Path, PathBuf};

/// The recording of a run, if there is to be one.
#[derive(Default)]
pub(crate) struct Record {
    recorder: Option<SharedRecorder>,
    /// Its file, if there was none before.
    made: Option<PathBuf>,
}

impl Record {
    /// `engine`, on file at `path`, if there is one, from when it loads its clay to when it is dropped.
    pub(crate) fn of(path: Option<&Path>, engine: NativeEngine) -> (Self, Box<dyn Engine>) {
        let Some(path) = path else { return (Self::default(), Box::new(engine)) };
        let recorder = SharedRecorder::new(path);
        let engine = recorder.record(Box::new(engine));
        let made = (!path.exists()).then(|| path.to_path_buf());
        (Self { recorder: Some(recorder), made }, Box::new(engine))
    }

    /// What was wrong with the recording since the last call, in a line that names its file.
    pub(crate) fn fault(&self) -> Option<String> {
        Some(self.recorder.as_ref()?.take_fault()?.to_string())
    }

    /// There is no run after all, and no engine: removes the file, unless another was there before.
    pub(crate) fn withdraw(&mut self) {
        self.recorder = None;
        if let Some(path) = self.made.take() {
            // If it cannot be removed, the refusal is what matters.
            let _ = std::fs::remove_file(path);
        }
    }
}
