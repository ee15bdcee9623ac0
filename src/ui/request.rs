//! What buttons and keys ask for: done away from the main thread, answered in one line, and all or nothing.

use crate::plugin::clay::{Clay, ClayStatus};
use crate::plugin::engine::ClayEngine;
pub use crate::scene::export::{BodyFiles, ExportFormat};
use crate::scene::export::{ExportOptions, write_bodies};
use crate::scene::pieces::Pieces;
use crate::scene::resample::resample;
use crate::sim::engine::StateTicket;
use crate::sim::snapshot::Snapshot;
use crate::surface::field::SurfaceSettings;
use crate::surface::grains::extract_with_grains;
use bevy::prelude::*;
use bevy::tasks::futures::check_ready;
use bevy::tasks::{AsyncComputeTaskPool, Task};
use std::path::{Path, PathBuf};

/// Something to be done to a piece of clay.
#[derive(Message, Clone, Debug)]
pub enum ClayRequest {
    /// Back to the shape it started from, on the grid it has now. Its material stays.
    Reset(Entity),
    /// The same shape on a grid of this cell width \[m\].
    Resample(Entity, f64),
    /// All pieces but the largest are gone.
    DropOffcuts(Entity),
    /// Its surface into a new file, or each piece of it.
    Export(Entity, ExportFormat, BodyFiles),
}

/// What the clay of this entity first started from.
#[derive(Component, Clone, Debug)]
pub struct ClayStart(pub Clay);

/// The last thing worth saying to the user.
#[derive(Resource, Clone, Debug, Default)]
pub struct ClayNotice {
    /// One line; empty for nothing.
    pub text: String,
    /// Whether it is bad news.
    pub is_error: bool,
}

impl ClayNotice {
    /// Good news.
    pub fn say(&mut self, text: impl Into<String>) {
        *self = Self { text: text.into(), is_error: false };
        info!("{}", self.text);
    }

    /// Bad news.
    pub fn warn(&mut self, text: impl Into<String>) {
        *self = Self { text: text.into(), is_error: true };
        warn!("{}", self.text);
    }
}

/// Where exports go.
#[derive(Resource, Clone, Debug)]
pub(super) struct ExportFolder(pub PathBuf);

/// Clay on its way from another thread: takes the place of the entity's [`Clay`] when it is ready.
#[derive(Component)]
pub struct ClayChange {
    task: Task<Result<Snapshot, String>>,
    done: String,
}

impl ClayChange {
    /// Clay that `make` makes on another thread; `done` is said when it is there.
    pub fn new(done: impl Into<String>, make: impl FnOnce() -> Result<Snapshot, String> + Send + 'static) -> Self {
        Self::of_task(done, AsyncComputeTaskPool::get().spawn(async move { make() }))
    }

    /// Clay that `make` makes of a state on another thread, when the engine has handed it out.
    pub fn of_state(
        done: impl Into<String>,
        state: StateTicket,
        make: impl FnOnce(Snapshot) -> Result<Snapshot, String> + Send + 'static,
    ) -> Self {
        let made = async move { make(state.await.map_err(|e| e.to_string())?()) };
        Self::of_task(done, AsyncComputeTaskPool::get().spawn(made))
    }

    /// Clay that a task makes.
    pub fn of_task(done: impl Into<String>, task: Task<Result<Snapshot, String>>) -> Self {
        Self { task, done: done.into() }
    }
}

/// A file on its way.
#[derive(Component)]
pub(super) struct ClayExport(Task<Result<String, String>>);

/// Keeps what each clay first started from.
pub(super) fn remember_start(clays: Query<(Entity, &Clay), Without<ClayStart>>, mut commands: Commands) {
    for (entity, clay) in &clays {
        commands.entity(entity).insert(ClayStart(clay.clone()));
    }
}

/// What a request needs to know of its clay.
type Asked<'a> = (&'a ClayStart, &'a ClayStatus, Option<&'a ClayEngine>, Has<ClayChange>, Has<ClayExport>);

/// Begins what is asked for.
#[expect(clippy::needless_pass_by_value, reason = "Bevy hands parameters to systems by value")]
pub(super) fn answer(
    mut requests: MessageReader<ClayRequest>,
    clays: Query<Asked>,
    folder: Res<ExportFolder>,
    mut notice: ResMut<ClayNotice>,
    mut commands: Commands,
) {
    for request in requests.read() {
        let &(ClayRequest::Reset(entity)
        | ClayRequest::Resample(entity, _)
        | ClayRequest::DropOffcuts(entity)
        | ClayRequest::Export(entity, ..)) = request;
        let Ok((start, status, Some(engine), is_changing, is_exporting)) = clays.get(entity) else {
            notice.warn("the clay has no engine yet");
            continue;
        };
        let mut entity = commands.entity(entity);
        match *request {
            ClayRequest::Reset(_) => {
                let (start, now) = (start.0.clone(), status.cell_width);
                entity.insert(ClayChange::new("back at the start", move || on_grid(start.snapshot(), now)));
            }
            ClayRequest::Resample(..) | ClayRequest::DropOffcuts(_) if is_changing => {
                notice.warn("another change of the clay is under way");
            }
            ClayRequest::Resample(_, width) => match engine.request_state() {
                Ok(state) => {
                    let done = format!("the clay stands on cells of {:.2} mm", width * 1e3);
                    let make = move |clay: Snapshot| resample(&clay, width).map_err(|e| e.to_string());
                    entity.insert(ClayChange::of_state(done, state, make));
                }
                Err(error) => notice.warn(format!("no other grid: {error}")),
            },
            ClayRequest::DropOffcuts(_) => match engine.request_state() {
                Ok(state) => {
                    let done = "offcuts gone: the largest piece is left";
                    entity.insert(ClayChange::of_state(done, state, |clay| without_offcuts(&clay)));
                }
                Err(error) => notice.warn(format!("no piece to keep: {error}")),
            },
            ClayRequest::Export(..) if is_exporting => notice.warn("a file is being written already"),
            ClayRequest::Export(_, format, bodies) => {
                let Some(surface) = engine.surface_deferred() else {
                    notice.warn("nothing to export: the clay has no surface yet");
                    continue;
                };
                let folder = folder.0.clone();
                let write = async move {
                    // Grains are left out: they are no solid.
                    let mesh = extract_with_grains(&surface(), &SurfaceSettings::default()).mesh;
                    let path = free_file(&folder, format)?;
                    let options = ExportOptions { bodies, ..ExportOptions::default() };
                    let report = write_bodies(&path, &mesh, &options).map_err(|e| e.to_string())?;
                    let absolute = |path: &PathBuf| std::path::absolute(path).unwrap_or_else(|_| path.clone());
                    let first = report.files.first().map_or(path, absolute).display().to_string();
                    Ok(match report.files.len() {
                        0 | 1 => first,
                        count => format!("{first} and {} more files", count - 1),
                    })
                };
                entity.insert(ClayExport(AsyncComputeTaskPool::get().spawn(write)));
            }
        }
    }
}

/// Takes in what is ready and says so.
pub(super) fn take(
    mut changes: Query<(Entity, &mut ClayChange)>,
    mut exports: Query<(Entity, &mut ClayExport)>,
    mut notice: ResMut<ClayNotice>,
    mut commands: Commands,
) {
    for (entity, mut change) in &mut changes {
        let Some(result) = check_ready(&mut change.task) else { continue };
        let mut entity = commands.entity(entity);
        entity.remove::<ClayChange>();
        match result {
            Ok(snapshot) => {
                notice.say(change.done.clone());
                entity.insert(Clay::new(snapshot));
            }
            Err(error) => notice.warn(format!("the clay stays as it is: {error}")),
        }
    }
    for (entity, mut export) in &mut exports {
        let Some(result) = check_ready(&mut export.0) else { continue };
        commands.entity(entity).remove::<ClayExport>();
        match result {
            Ok(files) => notice.say(format!("wrote {files}")),
            Err(error) => notice.warn(format!("not exported: {error}")),
        }
    }
}

/// `start` on the grid in use.
fn on_grid(start: &Snapshot, cell_width: f64) -> Result<Snapshot, String> {
    const SAME: f64 = 1e-9;
    if (start.domain.cell_width / cell_width - 1.0).abs() < SAME {
        return Ok(start.clone());
    }
    resample(start, cell_width).map_err(|e| e.to_string())
}

/// The largest piece of the clay.
fn without_offcuts(clay: &Snapshot) -> Result<Snapshot, String> {
    let pieces = Pieces::of(clay);
    if pieces.count() < 2 {
        return Err("it is in one piece".into());
    }
    Ok(pieces.kept(clay, |piece| piece == 0))
}

/// A file of `folder`, which is made if missing, that is not there yet.
fn free_file(folder: &Path, format: ExportFormat) -> Result<PathBuf, String> {
    const FILES_MAX: u32 = 10_000;
    std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    // Neither the file nor that of its first piece.
    let name = |number: u32, piece: &str| folder.join(format!("clay-{number:03}{piece}.{}", format.extension()));
    (1..FILES_MAX)
        .find(|number| ["", "-1"].iter().all(|piece| !name(*number, piece).exists()))
        .map(|number| name(number, ""))
        .ok_or_else(|| format!("{}: no free name for another file", folder.display()))
}
