//! A run on file: the clay as loaded, every plan in its place among the reports, and where strokes began and
//! ended. The same engine on the same device makes the same bits of it.
//!
//! A recording is 8 letters, a version, and a packet for each event, the first of which says what made it.
//! Each event is handed to the system when [`Recorder::write`] returns: of a run that was killed the events
//! up to there can be read.
//!
//! ```
//! use bevy_clay::scene::recording::{Event, Recorder, Recording};
//! # use bevy_clay::sim::prelude::*;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = std::env::temp_dir().join(format!("bevy_clay-doc-{}", std::process::id()));
//! # std::fs::create_dir_all(&folder)?;
//! # let file = folder.join("run.clayrun");
//! # let domain = Domain::new(glam::DVec3::ZERO, glam::DVec3::splat(0.1), 0.005, Walls::default())?;
//! # let place = domain.to_grid(glam::DVec3::splat(0.05));
//! # let clay = Snapshot::new(domain, Preset::SoftClay.material(), vec![Particle::at(place, 1e-8, 0)]);
//! let mut engine = NativeEngine::new();
//! let mut recorder = Recorder::create(&file, &engine)?;
//! engine.load(&clay)?;
//! recorder.write(&Event::Load(clay.clone()))?;
//! let plan = StepLimits::default().plan(&clay, 0.01, &[]);
//! recorder.write(&Event::Plan(plan.clone()))?;
//! engine.submit(plan)?;
//! recorder.write(&Event::Report(engine.wait()?.plan_id))?;
//! recorder.write(&Event::Ended(engine.save()?.checksum()))?;
//!
//! for event in Recording::open(&file)? {
//!     event?.apply(&mut engine)?;
//! }
//! # std::fs::remove_dir_all(&folder)?;
//! # Ok(())
//! # }
//! ```

pub mod engine;

use super::line::{named, one_line};
use crate::sim::engine::{Engine, EngineError};
use crate::sim::frame::{FramePlan, FrameReport};
use crate::sim::packet::{self, PacketError};
use crate::sim::snapshot::Snapshot;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::path::Path;

const MAGIC: &[u8; 8] = b"clay-run";
const VERSION: u32 = 1;

/// What made a recording: what the bits of a run depend on beside its events.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Origin {
    /// Version of this crate.
    pub version: String,
    /// Engine and device, as [`Engine::identity`] has them.
    pub engine: String,
}

impl Origin {
    /// What a run of this program on `engine` has.
    pub fn of(engine: &dyn Engine) -> Self {
        Self { version: env!("CARGO_PKG_VERSION").into(), engine: engine.identity() }
    }
}

/// What happened in a run, in this order.
#[expect(clippy::large_enum_variant, reason = "events are written and applied one at a time")]
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Event {
    /// This clay was loaded.
    Load(Snapshot),
    /// This plan was submitted.
    Plan(FramePlan),
    /// The report of the plan of this id was handed out: what is submitted after a report of a failure runs,
    /// what was submitted before does not.
    Report(u64),
    /// A stroke of a tool began: a mark, for whoever looks for it.
    StrokeBegan,
    /// It ended.
    StrokeEnded,
    /// The run ended, with clay of this [`Snapshot::checksum`].
    Ended(u32),
}

impl Event {
    /// Lets it happen on `engine`; waits for the report where one was handed out.
    ///
    /// # Errors
    /// What the engine refuses.
    pub fn apply(self, engine: &mut dyn Engine) -> Result<Option<FrameReport>, EngineError> {
        match self {
            Self::Load(clay) => engine.load(&clay).map(|()| None),
            Self::Plan(plan) => engine.submit(plan).map(|()| None),
            Self::Report(_) => engine.wait().map(Some),
            Self::StrokeBegan | Self::StrokeEnded | Self::Ended(_) => Ok(None),
        }
    }
}

/// What is wrong with a recording.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// A file that cannot be read or written.
    #[error("{file}: {error}")]
    Io {
        /// The file as named.
        file: String,
        /// What the system said.
        error: io::Error,
    },
    /// Not a recording.
    #[error("{file}: is no recording of a run: the first 8 bytes are not `clay-run`")]
    NotARecording {
        /// The file as named.
        file: String,
    },
    /// A version this program does not know.
    #[error("{file}: is a recording of version {version}; this program reads version {VERSION}")]
    Version {
        /// The file as named.
        file: String,
        /// Its version.
        version: u32,
    },
    /// An event that cannot be read, or has no place where it stands.
    #[error("{file}: event {event}: {reason}")]
    Event {
        /// The file as named.
        file: String,
        /// Which one, from 1; 0 is what made the recording.
        event: u64,
        /// What is wrong with it.
        reason: String,
    },
}

/// Writes a recording, event by event.
#[derive(Debug)]
pub struct Recorder {
    file: String,
    out: BufWriter<File>,
}

impl Recorder {
    /// Begins a recording of a run on `engine` at `path`, in place of what is there.
    ///
    /// # Errors
    /// What the system says against it.
    pub fn create(path: &Path, engine: &dyn Engine) -> Result<Self, RecordingError> {
        let file = named(path);
        let begin = || {
            let mut out = BufWriter::new(File::create(path)?);
            out.write_all(MAGIC)?;
            out.write_all(&VERSION.to_le_bytes())?;
            packet::write(&mut out, &Origin::of(engine), &[])?;
            out.flush()?;
            Ok(out)
        };
        match begin() {
            Ok(out) => Ok(Self { file, out }),
            Err(error) => Err(RecordingError::Io { file, error }),
        }
    }

    /// Adds an event.
    ///
    /// # Errors
    /// What the system says against it.
    pub fn write(&mut self, event: &Event) -> Result<(), RecordingError> {
        let body = match event {
            Event::Load(clay) => bytemuck::cast_slice(&clay.particles),
            Event::Plan(_) | Event::Report(_) | Event::StrokeBegan | Event::StrokeEnded | Event::Ended(_) => &[],
        };
        let written = packet::write(&mut self.out, event, body).and_then(|()| self.out.flush());
        written.map_err(|error| RecordingError::Io { file: self.file.clone(), error })
    }
}

/// Reads a recording, event by event; ends at the first error.
#[derive(Debug)]
pub struct Recording {
    file: String,
    input: BufReader<File>,
    origin: Origin,
    /// Events read.
    events: u64,
    /// Plans among them whose reports have not been handed out.
    under_way: u64,
    is_cut_short: bool,
    is_over: bool,
}

impl Recording {
    /// Opens the recording at `path`.
    ///
    /// # Errors
    /// A file that cannot be read, is no recording or one of another version.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        let file = named(path);
        let io = |error| RecordingError::Io { file: named(path), error };
        let mut input = BufReader::new(File::open(path).map_err(io)?);
        let mut start = vec![];
        (&mut input).take(12).read_to_end(&mut start).map_err(io)?;
        let Some(version) = start.strip_prefix(MAGIC) else { return Err(RecordingError::NotARecording { file }) };
        let no_origin = || RecordingError::Event { file: named(path), event: 0, reason: "the file is cut short".into() };
        match <[u8; 4]>::try_from(version).map(u32::from_le_bytes) {
            Ok(VERSION) => {}
            Ok(version) => return Err(RecordingError::Version { file, version }),
            Err(_) => return Err(no_origin()),
        }
        let (origin, _) = packet::read(&mut input).map_err(|error| fault(&file, 0, error))?.ok_or_else(no_origin)?;
        Ok(Self { file, input, origin, events: 0, under_way: 0, is_cut_short: false, is_over: false })
    }

    /// What made it.
    pub fn origin(&self) -> &Origin {
        &self.origin
    }

    /// Events read.
    pub fn events(&self) -> u64 {
        self.events
    }

    /// Whether the file was found to end within an event, which is left out, as that of a run that was killed
    /// may.
    pub fn is_cut_short(&self) -> bool {
        self.is_cut_short
    }

    fn read(&mut self) -> Result<Option<Event>, RecordingError> {
        let number = self.events + 1;
        let packet = match packet::read(&mut self.input) {
            Err(PacketError::CutShort) => {
                self.is_cut_short = true;
                None
            }
            packet => packet.map_err(|error| fault(&self.file, number, error))?,
        };
        let Some((head, body)) = packet else { return Ok(None) };
        let event = self.place(head, &body).map_err(|reason| RecordingError::Event {
            file: self.file.clone(),
            event: number,
            reason: reason.into(),
        })?;
        self.events = number;
        Ok(Some(event))
    }

    /// The event of `head` and `body`, if it has a place here.
    fn place(&mut self, head: Event, body: &[u8]) -> Result<Event, &'static str> {
        match head {
            Event::Load(head) => {
                self.under_way = 0;
                return head.with_particles(body).map(Event::Load).ok_or("it holds a part of a particle");
            }
            _ if !body.is_empty() => return Err("it holds more than an event of its kind"),
            _ if self.events == 0 => return Err("no clay has been loaded before it"),
            Event::Plan(_) => self.under_way += 1,
            Event::Report(_) if self.under_way == 0 => return Err("it is a report where no frame is under way"),
            Event::Report(_) => self.under_way -= 1,
            Event::StrokeBegan | Event::StrokeEnded | Event::Ended(_) => {}
        }
        Ok(head)
    }
}

impl Iterator for Recording {
    type Item = Result<Event, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.is_over {
            return None;
        }
        let event = self.read().transpose();
        self.is_over = !matches!(event, Some(Ok(_)));
        event
    }
}

fn fault(file: &str, event: u64, error: PacketError) -> RecordingError {
    let file = file.to_string();
    match error {
        PacketError::Io(error) => RecordingError::Io { file, error },
        PacketError::CutShort => RecordingError::Event { file, event, reason: "the file is cut short".into() },
        PacketError::Damaged(reason) => RecordingError::Event { file, event, reason: one_line(&reason) },
    }
}

#[cfg(test)]
mod tests;
