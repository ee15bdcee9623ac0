//! An engine whose run is on file: what it is told and what it hands out goes into a recording.

use super::{Event, Recorder, RecordingError};
use crate::sim::engine::{Deferred, Engine, EngineError, StateTicket};
use crate::sim::frame::{FramePlan, FrameReport, SurfaceSource};
use crate::sim::snapshot::Snapshot;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// One recording for the engines that run a piece of clay one after the other, each from where the one before
/// ended or from a state that was taken back: each of them begins with its [`Event::Load`].
///
/// The file is made when the first engine loads its clay. The recording ends with the checksum of the clay
/// when the last engine goes.
#[derive(Clone, Debug)]
pub struct SharedRecorder(Arc<Mutex<Shared>>);

#[derive(Debug)]
struct Shared {
    path: PathBuf,
    recorder: Option<Recorder>,
    /// Which engine is recorded: the one that loaded clay last.
    current: u64,
    fault: Option<RecordingError>,
}

impl SharedRecorder {
    /// A recording at `path`, in place of what is there.
    pub fn new(path: &Path) -> Self {
        let shared = Shared { path: path.to_path_buf(), recorder: None, current: 0, fault: None };
        Self(Arc::new(Mutex::new(shared)))
    }

    /// `engine`, recorded from its next load on.
    pub fn record(&self, engine: Box<dyn Engine>) -> RecordedEngine {
        RecordedEngine { engine, recorder: self.clone(), number: 0, is_in_stroke: false }
    }

    /// Why nothing more is written, once.
    pub fn take_fault(&self) -> Option<RecordingError> {
        self.lock().fault.take()
    }

    fn lock(&self) -> MutexGuard<'_, Shared> {
        // What a panic left is a packet that was written or was not.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Shared {
    /// Another engine's clay; its number.
    fn load(&mut self, engine: &dyn Engine, clay: &Snapshot) -> u64 {
        self.current += 1;
        if self.recorder.is_none() && self.current == 1 {
            match Recorder::create(&self.path, engine) {
                Ok(recorder) => self.recorder = Some(recorder),
                Err(error) => self.fault = Some(error),
            }
        }
        self.write(self.current, &Event::Load(clay.clone()));
        self.current
    }

    /// Adds an event of engine `number`: of one whose clay another has taken over nothing is kept.
    fn write(&mut self, number: u64, event: &Event) {
        let Some(recorder) = self.recorder.as_mut().filter(|_| number == self.current) else { return };
        if let Err(error) = recorder.write(event) {
            self.fault = Some(error);
            self.recorder = None;
        }
    }
}

/// See the [module](self). A stroke is what tools do from where one appears to where none is left.
pub struct RecordedEngine {
    engine: Box<dyn Engine>,
    recorder: SharedRecorder,
    number: u64,
    is_in_stroke: bool,
}

impl RecordedEngine {
    fn write(&self, event: &Event) {
        self.recorder.lock().write(self.number, event);
    }
}

impl Engine for RecordedEngine {
    fn describe(&self) -> String {
        self.engine.describe()
    }

    fn identity(&self) -> String {
        self.engine.identity()
    }

    fn load(&mut self, snapshot: &Snapshot) -> Result<(), EngineError> {
        self.engine.load(snapshot)?;
        self.number = self.recorder.lock().load(self.engine.as_ref(), snapshot);
        self.is_in_stroke = false;
        Ok(())
    }

    fn submit(&mut self, plan: FramePlan) -> Result<(), EngineError> {
        self.engine.submit(plan.clone())?;
        let is_in_stroke = !plan.tools.is_empty();
        match (std::mem::replace(&mut self.is_in_stroke, is_in_stroke), is_in_stroke) {
            (false, true) => self.write(&Event::StrokeBegan),
            (true, false) => self.write(&Event::StrokeEnded),
            (false, false) | (true, true) => {}
        }
        self.write(&Event::Plan(plan));
        Ok(())
    }

    fn poll(&mut self) -> Result<Option<FrameReport>, EngineError> {
        let report = self.engine.poll()?;
        if let Some(report) = &report {
            self.write(&Event::Report(report.plan_id));
        }
        Ok(report)
    }

    fn surface_deferred(&self) -> Option<Deferred<SurfaceSource>> {
        self.engine.surface_deferred()
    }

    fn state_deferred(&self) -> Result<Deferred<Snapshot>, EngineError> {
        self.engine.state_deferred()
    }

    fn request_state(&mut self) -> Result<StateTicket, EngineError> {
        self.engine.request_state()
    }

    fn pending(&self) -> usize {
        self.engine.pending()
    }
}

impl Drop for RecordedEngine {
    /// Lets the frames under way end and puts the clay's checksum at the end of the recording.
    fn drop(&mut self) {
        {
            let shared = self.recorder.lock();
            if shared.recorder.is_none() || shared.current != self.number {
                return;
            }
        }
        while self.engine.pending() > 0 {
            if self.wait().is_err() {
                return;
            }
        }
        if std::mem::take(&mut self.is_in_stroke) {
            self.write(&Event::StrokeEnded);
        }
        if let Ok(clay) = self.save() {
            self.write(&Event::Ended(clay.checksum()));
        }
    }
}
