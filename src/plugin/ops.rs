//! What is asked of clay, done away from the main thread, one after the other, all or nothing.

use super::base::Base;
use super::clay::Clay;
use super::engine::{self, ClayEngine, EngineStart};
use super::events::{
    ClayChange, ClayChanged, ClayExported, ClayTrouble, DropOffcuts, ExportClay, RedoClay, ResampleClay, ResetClay, UndoClay,
};
use super::held::HeldTime;
use super::report;
use super::schedule::{ClaySystems, schedule};
use super::status::ClayError;
use super::undo::{ClayHistory, Extent, Kept};
use crate::scene::export::{ExportOptions, write_bodies};
use crate::scene::pieces::Pieces;
use crate::scene::resample::resample;
use crate::sim::engine::StateTicket;
use crate::sim::material::ClayMaterial;
use crate::sim::snapshot::Snapshot;
use crate::surface::field::SurfaceSettings;
use crate::surface::grains::extract_with_grains;
use bevy::prelude::*;
use bevy::tasks::futures::check_ready;
use bevy::tasks::{AsyncComputeTaskPool, Task};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Something to be done to a piece of clay.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Op {
    /// Its state is to be kept.
    Record,
    Reset,
    Resample(f64),
    DropOffcuts,
    Undo,
    Redo,
}

/// What came of it.
struct Done {
    /// The clay as it is to be, and what was done to it; nothing if it stays.
    new: Option<(Snapshot, ClayChange)>,
    extent: Option<Extent>,
}

/// Something that is being done.
type Doing = Task<Result<Done, String>>;

/// What is to be done to a piece of clay, and under way.
#[derive(Component, Default)]
pub(super) struct Ops {
    waiting: VecDeque<Op>,
    /// With the start of the clay that it is done to.
    under_way: Option<(Arc<Snapshot>, Doing)>,
    /// What will be done when an engine runs the new clay.
    change: Option<ClayChange>,
    exports: Vec<Task<Result<Vec<PathBuf>, String>>>,
    /// The start that the history begins with.
    start: Option<Arc<Snapshot>>,
}

/// Answers what apps ask of clay. Without it [`ResetClay`] and its like have no answer.
#[derive(Clone, Copy, Debug, Default)]
pub struct OpsPlugin;

impl Plugin for OpsPlugin {
    fn build(&self, app: &mut App) {
        let schedule = schedule(app);
        let systems = (mark_strokes, finish, begin).chain().after(report::feel).before(engine::keep);
        app.register_required_components::<Clay, Ops>()
            .register_type::<ClayHistory>()
            .add_observer(|asked: On<ResetClay>, asking: Asking| queue(asked.entity, Op::Reset, asking))
            .add_observer(|asked: On<ResampleClay>, asking: Asking| queue(asked.entity, Op::Resample(asked.cell_width), asking))
            .add_observer(|asked: On<DropOffcuts>, asking: Asking| queue(asked.entity, Op::DropOffcuts, asking))
            .add_observer(|asked: On<UndoClay>, asking: Asking| queue(asked.entity, Op::Undo, asking))
            .add_observer(|asked: On<RedoClay>, asking: Asking| queue(asked.entity, Op::Redo, asking))
            .add_observer(export)
            .add_observer(|gone: On<Remove, Clay>, mut commands: Commands| {
                commands.entity(gone.entity).try_remove::<Ops>();
            })
            .add_systems(schedule, systems.in_set(ClaySystems::Report));
    }
}

/// What a question is asked of.
type Asking<'w, 's> = (Query<'w, 's, &'static mut Ops>, Commands<'w, 's>);

/// Puts what is asked for in line.
fn queue(entity: Entity, op: Op, (mut clays, mut commands): Asking) {
    if let Ok(mut ops) = clays.get_mut(entity) {
        ops.waiting.push_back(op);
    } else {
        let error = ClayError::Operation(format!("nothing to {}: it is no clay", name(op)));
        commands.trigger(ClayTrouble { entity, error });
    }
}

fn name(op: Op) -> &'static str {
    match op {
        Op::Record => "keep",
        Op::Reset => "reset",
        Op::Resample(_) => "resample",
        Op::DropOffcuts => "drop",
        Op::Undo => "undo",
        Op::Redo => "redo",
    }
}

/// Asks for the state after each stroke.
fn mark_strokes(mut clays: Query<(&mut ClayHistory, &mut Ops, &ClayEngine)>, real: Res<Time<Real>>) {
    for (mut history, mut ops, engine) in &mut clays {
        let is_touched = engine.run.lock().plans.felt.iter().any(|(_, tool)| tool.contacts + tool.tagged > 0);
        if history.bypass_change_detection().touch(is_touched, real.elapsed_secs_f64()) {
            ops.waiting.push_back(Op::Record);
        }
    }
}

/// A clay of which something is asked.
type Asked<'a> = (Entity, &'a mut Ops, &'a Base, &'a ClayEngine, Option<&'a mut ClayHistory>);

/// Begins what is next in line, where nothing is under way and the engine runs the clay as it is to be.
fn begin(mut clays: Query<Asked, With<Clay>>, mut commands: Commands, held: Res<HeldTime>) {
    let _watch = held.watch();
    for (entity, mut ops, base, engine, history) in &mut clays {
        let runs = base.snapshot.as_ref().is_some_and(|now| engine.runs(now));
        let Some(start) = base.start.as_ref().filter(|_| runs) else { continue };
        if ops.under_way.is_some() || ops.change.is_some() {
            continue;
        }
        let mut history = history;
        // A history begins with the clay as it stands when it comes, and anew with another clay.
        if let Some(history) = &history
            && (history.bytes() == 0 || ops.start.as_ref().is_none_or(|kept| !Arc::ptr_eq(kept, start)))
            && let Ok(state) = engine.request_state()
        {
            ops.start = Some(start.clone());
            let kept = history.shared();
            let task = AsyncComputeTaskPool::get().spawn(async move {
                kept.begin(state.await.and_then(|make| make()).map_err(|e| e.to_string())?);
                Ok(Done { new: None, extent: Some(kept.extent()) })
            });
            ops.under_way = Some((start.clone(), task));
            continue;
        }
        let Some(op) = ops.waiting.pop_front() else { continue };
        let is_mid_stroke = history.as_mut().is_some_and(|history| history.bypass_change_detection().end_stroke());
        match engine.request_state() {
            Ok(state) => {
                let work = Work { op, state, is_mid_stroke, start: start.clone(), kept: history.map(|h| h.shared()) };
                ops.under_way = Some((start.clone(), AsyncComputeTaskPool::get().spawn(work.run())));
            }
            Err(error) => commands.trigger(ClayTrouble { entity, error: ClayError::Operation(error.to_string()) }),
        }
    }
}

/// What is done on another thread.
struct Work {
    op: Op,
    state: StateTicket,
    /// Whether the clay has been touched since its state was last kept.
    is_mid_stroke: bool,
    start: Arc<Snapshot>,
    kept: Option<Kept>,
}

impl Work {
    async fn run(self) -> Result<Done, String> {
        let Self { op, state, is_mid_stroke, start, kept } = self;
        let now = state.await.and_then(|make| make()).map_err(|e| e.to_string())?;
        let cell_width = now.domain.cell_width;
        // A stroke that is cut off by what is asked for is one all the same, whatever comes of that.
        let is_kept = is_mid_stroke && op != Op::Record;
        if let Some(kept) = kept.as_ref().filter(|_| is_kept) {
            kept.states().record(now.clone());
        }
        let new = match op {
            Op::Record => {
                kept.iter().for_each(|kept| kept.states().record(now.clone()));
                None
            }
            Op::Undo | Op::Redo => {
                let kept = kept.as_ref().ok_or("it has no ClayHistory")?;
                let mut states = kept.states();
                if op == Op::Undo && !is_kept {
                    states.amend(now);
                }
                let there = if op == Op::Undo { states.undo() } else { states.redo() };
                let there = there.map_err(|e| e.to_string())?.ok_or_else(|| format!("nothing to {}", name(op)))?;
                let change = match op {
                    Op::Undo => ClayChange::Undone(states.undo_count()),
                    _ => ClayChange::Redone(states.redo_count()),
                };
                Some((there, change))
            }
            Op::Reset | Op::Resample(_) | Op::DropOffcuts => {
                let (new, change) = match op {
                    Op::Reset => (on_grid(&start, cell_width)?, ClayChange::Reset),
                    Op::Resample(width) => (resample(&now, width).map_err(|e| e.to_string())?, ClayChange::Resampled(width)),
                    _ => (without_offcuts(&now)?, ClayChange::OffcutsDropped),
                };
                if let Some(kept) = &kept {
                    let mut states = kept.states();
                    if !is_kept {
                        states.amend(now);
                    }
                    states.record(new.clone());
                }
                Some((new, change))
            }
        };
        Ok(Done { new, extent: kept.map(|kept| kept.extent()) })
    }
}

/// A clay for which something is under way.
type UnderWay<'a> = (
    Entity,
    (&'a mut Ops, &'a mut Base, &'a mut EngineStart),
    (Option<&'a ClayEngine>, Option<&'a mut ClayHistory>, Option<&'a mut ClayMaterial>),
);

/// Takes in what is done, and says so when the clay runs as it is to be.
fn finish(mut clays: Query<UnderWay, With<Clay>>, mut commands: Commands, held: Res<HeldTime>) {
    let _watch = held.watch();
    for (entity, (mut ops, mut base, mut start), (engine, history, material)) in &mut clays {
        if let Some(change) = ops.change.filter(|_| base.snapshot.as_ref().is_some_and(|b| engine.is_some_and(|e| e.runs(b)))) {
            ops.change = None;
            commands.trigger(ClayChanged { entity, change });
        }
        // What no engine takes is not to be: the clay goes on as it was.
        if ops.change.is_some()
            && let Some(error) = base.snapshot.as_ref().and_then(|base| start.take_refusal(base))
        {
            ops.change = None;
            base.snapshot = engine.map(|engine| engine.start());
            let error = ClayError::Operation(format!("the clay stays as it is: {error}"));
            commands.trigger(ClayTrouble { entity, error });
        }
        ops.exports.retain_mut(|export| {
            let Some(result) = check_ready(export) else { return true };
            match result {
                Ok(files) => commands.trigger(ClayExported { entity, files }),
                Err(error) => {
                    let error = ClayError::Operation(format!("not exported: {error}"));
                    commands.trigger(ClayTrouble { entity, error });
                }
            }
            false
        });
        let Some((of, task)) = &mut ops.under_way else { continue };
        let Some(result) = check_ready(task) else { continue };
        // Of a clay that was replaced meanwhile nothing is left to be changed.
        let is_of_now = base.start.as_ref().is_some_and(|start| Arc::ptr_eq(start, of));
        ops.under_way = None;
        match result {
            _ if !is_of_now => {
                let error = ClayError::Operation("the clay was replaced meanwhile".into());
                commands.trigger(ClayTrouble { entity, error });
            }
            Ok(Done { new, extent }) => {
                if let Some((mut history, extent)) = history.zip(extent).filter(|(h, extent)| h.extent != *extent) {
                    history.extent = extent;
                }
                let Some((snapshot, change)) = new else { continue };
                // What is undone had a material of its own; what is changed keeps what it is made of.
                if let (ClayChange::Undone(_) | ClayChange::Redone(_), Some(mut material)) = (change, material) {
                    material.set_if_neq(snapshot.material);
                }
                base.snapshot = Some(Arc::new(snapshot));
                ops.change = Some(change);
            }
            Err(error) => {
                let error = ClayError::Operation(format!("the clay stays as it is: {error}"));
                commands.trigger(ClayTrouble { entity, error });
            }
        }
    }
}

/// Writes the surface as it is now, away from the main thread.
fn export(asked: On<ExportClay>, mut clays: Query<(&mut Ops, Option<&ClayEngine>)>, mut commands: Commands) {
    let ExportClay { entity, path, options } = asked.event().clone();
    let surface = clays.get_mut(entity).ok().and_then(|(ops, engine)| Some((ops, engine?.surface_deferred()?)));
    let Some((mut ops, surface)) = surface else {
        let error = ClayError::Operation("not exported: the clay has no surface yet".into());
        commands.trigger(ClayTrouble { entity, error });
        return;
    };
    ops.exports.push(AsyncComputeTaskPool::get().spawn(async move {
        // Grains are left out: they are no solid.
        let surface = surface().map_err(|e| e.to_string())?;
        let mesh = extract_with_grains(&surface, &SurfaceSettings::default()).mesh;
        written(&path, &mesh, &options)
    }));
}

fn written(path: &Path, mesh: &crate::surface::mesh::Mesh, options: &ExportOptions) -> Result<Vec<PathBuf>, String> {
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    }
    write_bodies(path, mesh, options).map(|report| report.files).map_err(|e| e.to_string())
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
