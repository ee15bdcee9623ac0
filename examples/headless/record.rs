//! The run on file, for `--replay`. A recording that cannot be written any more is a fault, and the run goes
//! on.

use bevy_clay::prelude::*;
use bevy_clay::scene::prelude::*;
use bevy_clay::scene::recording::Event;
use bevy_clay::sim::prelude::*;
use std::path::{Path, PathBuf};

/// The recording of a run, if there is to be one.
#[derive(Default)]
pub(crate) struct Record {
    recorder: Option<Recorder>,
    /// Whether a tool was there in the last frame.
    is_in_stroke: bool,
    /// Why it could not be written.
    fault: Option<String>,
    /// Its file, if there was none before.
    made: Option<PathBuf>,
}

impl Record {
    /// Begins at `path`, if there is one, with the clay that `engine` has loaded.
    ///
    /// # Errors
    /// One line that names the file that cannot be written.
    pub(crate) fn begin(path: Option<&Path>, engine: &NativeEngine, clay: &Snapshot) -> Result<Self, String> {
        let Some(path) = path else { return Ok(Self::default()) };
        let made = (!path.exists()).then(|| path.to_path_buf());
        let mut record = Self { made, ..Self::default() };
        match Recorder::create(path, engine) {
            Ok(recorder) => record.recorder = Some(recorder),
            Err(error) => record.fault = Some(error.to_string()),
        }
        record.write(&Event::Load(clay.clone()));
        match record.fault.take() {
            None => Ok(record),
            Some(fault) => {
                record.withdraw();
                Err(fault)
            }
        }
    }

    /// There is no run after all: removes the file, unless another was there before.
    pub(crate) fn withdraw(&mut self) {
        self.recorder = None;
        if let Some(path) = self.made.take() {
            // If it cannot be removed, the refusal is what matters.
            let _ = std::fs::remove_file(path);
        }
    }

    /// Submits a plan: one that the engine refuses is no part of the run. A stroke is what tools do from
    /// where one appears to where none is left.
    ///
    /// # Errors
    /// What the engine refuses.
    pub(crate) fn submit(&mut self, engine: &mut NativeEngine, plan: &FramePlan) -> Result<(), EngineError> {
        engine.submit(plan.clone())?;
        let is_in_stroke = !plan.tools.is_empty();
        match (std::mem::replace(&mut self.is_in_stroke, is_in_stroke), is_in_stroke) {
            (false, true) => self.write(&Event::StrokeBegan),
            (true, false) => self.write(&Event::StrokeEnded),
            (false, false) | (true, true) => {}
        }
        self.write(&Event::Plan(plan.clone()));
        Ok(())
    }

    /// A report has been handed out.
    pub(crate) fn report(&mut self, report: &FrameReport) {
        self.write(&Event::Report(report.plan_id));
    }

    /// The run is over and left this clay, if the engine still has it; says what was wrong with the
    /// recording.
    pub(crate) fn end(&mut self, clay: Option<&Snapshot>) -> Option<String> {
        if std::mem::take(&mut self.is_in_stroke) {
            self.write(&Event::StrokeEnded);
        }
        if let Some(clay) = clay {
            self.write(&Event::Ended(clay.checksum()));
        }
        self.recorder = None;
        self.fault.take()
    }

    fn write(&mut self, event: &Event) {
        let Some(recorder) = &mut self.recorder else { return };
        if let Err(error) = recorder.write(event) {
            self.fault = Some(format!("the recording ends early: {error}"));
            self.recorder = None;
        }
    }
}
