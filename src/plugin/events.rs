//! What an app asks of a piece of clay, and what it is told: entity events.
//!
//! `commands.trigger(UndoClay { entity })` asks; an observer, of the entity or of the app, hears the answer.
//! Each question has one: what was asked for, or a [`ClayTrouble`]. What changes the clay waits in line until
//! what was asked for before is done.

use super::status::ClayError;
use crate::scene::export::ExportOptions;
use bevy::prelude::*;
use std::path::PathBuf;

/// Asks for the shape that the clay started from, on the grid it has now. Its material stays. Answered by
/// [`ClayChanged`].
#[derive(EntityEvent, Clone, Copy, Debug)]
pub struct ResetClay {
    /// The clay.
    pub entity: Entity,
}

/// Asks for the same shape on another grid, filled anew. Answered by [`ClayChanged`].
#[derive(EntityEvent, Clone, Copy, Debug)]
pub struct ResampleClay {
    /// The clay.
    pub entity: Entity,
    /// Cell width \[m\].
    pub cell_width: f64,
}

/// Asks for all pieces but the largest to be gone. Answered by [`ClayChanged`].
#[derive(EntityEvent, Clone, Copy, Debug)]
pub struct DropOffcuts {
    /// The clay.
    pub entity: Entity,
}

/// Asks for the clay as it stood before the last stroke or change, material and grid included: needs a
/// [`ClayHistory`](super::undo::ClayHistory) beside the clay. Answered by [`ClayChanged`].
#[derive(EntityEvent, Clone, Copy, Debug)]
pub struct UndoClay {
    /// The clay.
    pub entity: Entity,
}

/// Asks for what was undone last. Answered by [`ClayChanged`].
#[derive(EntityEvent, Clone, Copy, Debug)]
pub struct RedoClay {
    /// The clay.
    pub entity: Entity,
}

/// Asks for the surface as it is now in a file; one of that name is replaced. Answered by [`ClayExported`].
#[derive(EntityEvent, Clone, Debug)]
pub struct ExportClay {
    /// The clay.
    pub entity: Entity,
    /// The file; its ending names the format: `.stl`, `.ply`, `.obj` and `.3mf` in mm, `.glb` in metres.
    pub path: PathBuf,
    /// Bodies together or apart, small ones left out, fewer triangles.
    pub options: ExportOptions,
}

/// The clay runs: its first engine, or another one that took it over.
#[derive(EntityEvent, Clone, Copy, Debug)]
pub struct ClayReady {
    /// The clay.
    pub entity: Entity,
}

/// What was asked for is done, and the clay runs again.
#[derive(EntityEvent, Clone, Copy, Debug)]
pub struct ClayChanged {
    /// The clay.
    pub entity: Entity,
    /// What was done.
    pub change: ClayChange,
}

/// What was done to a piece of clay.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ClayChange {
    /// It is back at its start.
    Reset,
    /// It is on a grid of this cell width \[m\].
    Resampled(f64),
    /// Its offcuts are gone.
    OffcutsDropped,
    /// A stroke or change is undone; so many are left to undo.
    Undone(usize),
    /// A stroke or change is redone; so many are left to redo.
    Redone(usize),
}

/// The surface is in these files.
#[derive(EntityEvent, Clone, Debug)]
pub struct ClayExported {
    /// The clay.
    pub entity: Entity,
    /// The files, the largest body first.
    pub files: Vec<PathBuf>,
}

/// Something is wrong, or was asked for in vain.
#[derive(EntityEvent, Clone, Debug)]
pub struct ClayTrouble {
    /// The clay.
    pub entity: Entity,
    /// What.
    pub error: ClayError,
}

/// The clay's engine has stopped. Another one goes on from the last state kept, if one can be started: then
/// comes a [`ClayReady`].
#[derive(EntityEvent, Clone, Debug)]
pub struct ClayEngineLost {
    /// The clay.
    pub entity: Entity,
    /// Why.
    pub reason: String,
}
