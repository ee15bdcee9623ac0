//! Engines: which one runs a piece of clay, started away from the main thread, moved over and recovered
//! without losing the clay.

use super::base::{self, Base};
use super::bridge::{AppDevice, Bridge, SharedDevice};
use super::clay::{Clay, ClaySettings, EngineChoice};
use super::entity;
use super::events::ClayReady;
use super::held::HeldTime;
use super::pace::Pace;
use super::plans::Plans;
use super::record::{self, ClayRecording};
use super::run::SharedRun;
use super::schedule::{ClaySystems, schedule};
use super::status::{ClayError, ClayMetrics, ClayStatus};
use crate::scene::recording::engine::SharedRecorder;
use crate::sim::engine::{Deferred, Engine, EngineError, StateLost, StateTicket};
use crate::sim::frame::SurfaceSource;
use crate::sim::native::NativeEngine;
use crate::sim::params::Domain;
use crate::sim::planner::IntegratorChoice;
use crate::sim::snapshot::Snapshot;
use crate::sim::tool::Pose;
use bevy::prelude::*;
use bevy::tasks::futures::check_ready;
use bevy::tasks::{AsyncComputeTaskPool, Task};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Why clay does not run where it should.
const ARMED: &str = "a haptic arm touches the clay: it runs on the CPU engine, which alone says what a hand feels";

/// An engine that stops again so soon after it was started anew is left alone.
const RESTART_AFTER: Duration = Duration::from_secs(10);
/// A device that was lost is replaced within this time, or not at all.
const DEVICE_WITHIN: Duration = Duration::from_secs(2);

/// The running engine of a [`Clay`], inserted by the plugin when it is ready and replaced when it is changed.
#[derive(Component)]
pub struct ClayEngine {
    /// The engine and what is planned for it.
    pub(super) run: SharedRun,
    /// Its way into the render world, if it runs there.
    pub(super) bridge: Option<Bridge>,
    pub(super) want: Want,
    pub(super) pace: Pace,
    /// What [`Self::describe`] says.
    pub(super) name: String,
    /// Counts the engines of the app: no two have the same, whatever becomes of their clay.
    pub(super) generation: u64,
    /// Counts the states of this engine.
    pub(super) revision: u64,
    /// Why there will be no next frame.
    pub(super) stopped: Option<EngineError>,
    /// Whether the app was told.
    pub(super) is_loss_said: bool,
    kept: Kept,
}

impl ClayEngine {
    /// Loads `snapshot` into an engine of the wanted kind, recorded if there is a recorder. Takes its time.
    fn launch(want: Want, snapshot: Arc<Snapshot>, recorder: Option<SharedRecorder>) -> Result<Self, EngineError> {
        let (mut engine, bridge): (Box<dyn Engine>, _) = match &want.device {
            None => (Box::new(NativeEngine::new()), None),
            Some(device) => {
                let (engine, bridge) = device.engine()?;
                (Box::new(engine), Some(bridge))
            }
        };
        if let Some(recorder) = recorder {
            engine = Box::new(recorder.record(engine));
        }
        engine.load(&snapshot)?;
        Ok(Self {
            name: engine.describe(),
            run: SharedRun::new(engine, Plans::new(&snapshot)),
            bridge,
            want,
            pace: Pace::default(),
            generation: 0,
            revision: 0,
            stopped: None,
            is_loss_said: false,
            kept: Kept { snapshot, revision: 0, at: Instant::now(), copying: None },
        })
    }

    /// One line that names the engine and what it runs on.
    pub fn describe(&self) -> String {
        self.name.clone()
    }

    /// The room of the clay.
    pub(super) fn domain(&self) -> Option<Domain> {
        Some(self.kept.snapshot.domain)
    }

    /// The surface particles at the end of the last reported frame; nothing if they went with their device.
    /// Converts every particle: see [`Self::surface_deferred`].
    pub fn surface(&self) -> Option<SurfaceSource> {
        self.surface_deferred()?().ok()
    }

    /// [`Self::surface`] as of now, to be made on another thread.
    pub fn surface_deferred(&self) -> Option<Deferred<SurfaceSource>> {
        self.run.lock().engine().surface_deferred()
    }

    /// Asks for the whole state, paused or not: see [`Engine::request_state`]. The ticket is a future for a
    /// task, and may be looked at now and then.
    ///
    /// # Errors
    /// Nothing is loaded.
    pub fn request_state(&self) -> Result<StateTicket, EngineError> {
        self.run.lock().engine().request_state()
    }

    /// Where the clay has the tool of an entity, in the clay's own frame, at the end of the last frame
    /// reported: in slow motion it is behind the hand. Nothing if the tool was not in that frame.
    pub fn tool_pose(&self, tool: Entity) -> Option<Pose> {
        self.run.lock().plans.planner.tool_pose(tool.to_bits())
    }

    /// Counts the states of the clay, as [`ClaySurface::revision`](super::show::ClaySurface::revision) does:
    /// a surface of the same one shows the last reported frame.
    pub fn revision(&self) -> (u64, u64) {
        (self.generation, self.revision)
    }

    /// Frames under way.
    pub fn pending(&self) -> usize {
        self.run.lock().engine().pending()
    }

    /// Whether another engine is about to take over: no more frames are planned.
    pub(super) fn is_leaving(&self) -> bool {
        self.run.lock().is_leaving
    }

    /// Plans no more frames, or goes on.
    fn set_leaving(&self, is_leaving: bool) {
        self.run.lock().is_leaving = is_leaving;
    }

    /// Stops the clay if its engine has.
    pub(super) fn heed(&mut self, entity: Entity) {
        let fault = self.run.lock().fault().cloned();
        if let Some(error) = fault.filter(|_| self.stopped.is_none()) {
            error!("clay {entity} lost its engine: {error}");
            self.stopped = Some(error);
        }
    }

    /// Whether this is the engine of the clay that starts from `base`, and runs it.
    pub(super) fn runs(&self, base: &Arc<Snapshot>) -> bool {
        Arc::ptr_eq(&self.want.source, base) && !self.is_leaving() && self.stopped.is_none()
    }

    /// Whether its clay can be read: where the graphics device stopped the engine there may be none, and each
    /// try would write wgpu's message to standard error.
    pub(super) fn is_readable(&self) -> bool {
        self.stopped.is_none() || self.bridge.is_none()
    }

    /// Whether it runs on the app's graphics device.
    pub(super) fn runs_on_device(&self) -> bool {
        self.want.device.is_some()
    }

    /// What the clay that it runs started from.
    pub(super) fn start(&self) -> Arc<Snapshot> {
        self.want.source.clone()
    }

    /// Whether the engine is gone, or the device it ran on is no longer the app's.
    fn is_lost(&self, want: &Want) -> bool {
        let moved = self.want.device.is_some() && want.device.is_some() && self.want.device != want.device;
        self.stopped.is_some() || moved
    }

    /// Copies the state away from the main thread, every `interval` \[s\] if it changed.
    fn keep(&mut self, interval: f32) {
        if let Some(copied) = self.kept.copying.as_mut().and_then(check_ready) {
            // An engine that went leaves the copy before.
            if let Ok(snapshot) = copied {
                self.kept.snapshot = Arc::new(snapshot);
            }
            self.kept.copying = None;
        }
        let is_due = interval > 0.0 && self.kept.at.elapsed().as_secs_f32() >= interval;
        if is_due
            && self.kept.copying.is_none()
            && self.kept.revision != self.revision
            && let Ok(ticket) = self.request_state()
        {
            self.kept.copying = Some(AsyncComputeTaskPool::get().spawn(async move { ticket.await?() }));
            self.kept.at = Instant::now();
            self.kept.revision = self.revision;
        }
    }
}

/// The state that the clay goes on from when its engine is lost.
struct Kept {
    snapshot: Arc<Snapshot>,
    /// Which state that is, or will be when it is copied.
    revision: u64,
    at: Instant,
    copying: Option<Task<Result<Snapshot, StateLost>>>,
}

/// What an engine is started for.
#[derive(Clone)]
pub(super) struct Want {
    source: Arc<Snapshot>,
    /// The device of the GPU engine; nothing for the CPU engine.
    device: Option<SharedDevice>,
}

impl PartialEq for Want {
    /// By the snapshot's identity: comparing particles takes longer than a frame.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.source, &other.source) && self.device == other.device
    }
}

/// The next engine of a clay.
#[derive(Component, Default)]
pub(super) struct EngineStart {
    under_way: Option<(Want, Task<Result<ClayEngine, EngineError>>)>,
    refused: Option<Want>,
    restarted: Option<Instant>,
    /// A device that the GPU engine does not run on, since when, and why.
    declined: Option<(SharedDevice, Instant, String)>,
    /// Why the clay has no engine.
    error: Option<String>,
    /// Whether it was said that an arm keeps the clay from the engine that it should have.
    is_arm_said: bool,
    /// Why it has not the one it should have.
    fallback: Option<String>,
    /// What engines are recorded into.
    recorder: Option<SharedRecorder>,
}

impl EngineStart {
    /// Whether one is starting on the app's device.
    pub(super) fn is_on_device(&self) -> bool {
        self.under_way.as_ref().is_some_and(|(want, _)| want.device.is_some())
    }

    /// What there is to say about it.
    pub(super) fn error(&self) -> Option<ClayError> {
        let fallback = || self.fallback.clone().map(ClayError::Fallback);
        self.error.clone().map(ClayError::Start).or_else(fallback)
    }

    /// Why no engine takes `base`, if that is so; it is not said again.
    pub(super) fn take_refusal(&mut self, base: &Arc<Snapshot>) -> Option<String> {
        self.refused.take_if(|want| Arc::ptr_eq(&want.source, base)).and_then(|_| self.error.take())
    }

    /// The device that the settings come to: nothing for the CPU engine. An error while a lost device may
    /// still be replaced.
    fn device(
        &mut self,
        settings: &ClaySettings,
        app: Option<SharedDevice>,
        is_armed: bool,
    ) -> Result<Option<SharedDevice>, Awaiting> {
        self.fallback = None;
        if is_armed {
            self.fallback = (settings.engine == EngineChoice::Gpu).then(|| ARMED.into());
            return Ok(None);
        }
        let device = match settings.engine {
            EngineChoice::Native => return Ok(None),
            EngineChoice::Auto if settings.integrator != IntegratorChoice::Explicit => return Ok(None),
            EngineChoice::Auto => app.filter(SharedDevice::is_hardware),
            EngineChoice::Gpu => {
                if app.is_none() {
                    self.fallback = Some("the app renders on no graphics device; the clay runs on the CPU engine".into());
                }
                app
            }
        };
        let Some(device) = device else { return Ok(None) };
        match &self.declined {
            Some((declined, since, _)) if *declined == device && since.elapsed() < DEVICE_WITHIN => Err(Awaiting),
            Some((declined, _, reason)) if *declined == device => {
                self.fallback = Some(format!("the GPU engine does not run: {reason}; the clay runs on the CPU engine"));
                Ok(None)
            }
            _ => Ok(Some(device)),
        }
    }

    fn spawn(&mut self, want: Want, snapshot: impl Future<Output = Result<Arc<Snapshot>, EngineError>> + Send + 'static) {
        let (wanted, recorder) = (want.clone(), self.recorder.clone());
        let task = AsyncComputeTaskPool::get().spawn(async move { ClayEngine::launch(wanted, snapshot.await?, recorder) });
        self.under_way = Some((want, task));
    }

    /// Starts the engine that the clay should have, if it is not running or starting.
    fn pursue(&mut self, want: Want, engine: Option<&mut ClayEngine>) -> Result<(), EngineError> {
        let engine = engine.filter(|e| Arc::ptr_eq(&e.want.source, &want.source));
        if self.under_way.as_ref().is_some_and(|(under_way, _)| *under_way == want) {
            // What it did now would be lost: the next one's state is taken already.
            engine.into_iter().for_each(|engine| engine.set_leaving(true));
            return Ok(());
        }
        self.under_way = None;
        if self.refused.as_ref() == Some(&want) {
            return Ok(());
        }
        let Some(engine) = engine else {
            let source = want.source.clone();
            self.spawn(want, async { Ok(source) });
            return Ok(());
        };
        if engine.want == want && engine.stopped.is_none() {
            engine.set_leaving(false);
        } else if engine.is_lost(&want) {
            let is_hopeless = engine.want == want && self.restarted.is_some_and(|at| at.elapsed() < RESTART_AFTER);
            if !is_hopeless {
                self.restarted = Some(Instant::now());
                engine.set_leaving(true);
                let kept = engine.kept.snapshot.clone();
                self.spawn(want, async { Ok(go_on_from(kept)) });
            }
        } else {
            // The state moves over when the frames under way have ended.
            engine.set_leaving(true);
            if engine.pending() == 0 {
                let (ticket, kept) = (engine.request_state()?, engine.kept.snapshot.clone());
                let state = async { ticket.await?() };
                self.spawn(want, async { Ok(state.await.map_or_else(|StateLost| go_on_from(kept), Arc::new)) });
            }
        }
        Ok(())
    }
}

/// The state that was kept of an engine that is lost.
fn go_on_from(kept: Arc<Snapshot>) -> Arc<Snapshot> {
    warn!("clay goes on from its state at {:.3} s", kept.time);
    kept
}

/// A lost device may still be replaced.
struct Awaiting;

/// Starts, replaces and recovers engines. Without it clay stands as it was started, unseen: it is for apps
/// that only read and write scenes with clay.
#[derive(Clone, Copy, Debug, Default)]
pub struct EnginePlugin;

impl Plugin for EnginePlugin {
    fn build(&self, app: &mut App) {
        app.register_required_components::<Clay, EngineStart>();
        let schedule = schedule(app);
        app.add_observer(end)
            .add_systems(schedule, (start, admit, keep, record::say).chain().in_set(ClaySystems::Report).after(base::build));
    }
}

/// Ends what runs for a [`Clay`] that goes.
fn end(gone: On<Remove, Clay>, mut commands: Commands) {
    commands.entity(gone.entity).try_remove::<(ClayEngine, EngineStart, ClayStatus, ClayMetrics)>();
}

/// Clay that an arm touches: it runs on the processor.
#[derive(Component)]
pub(super) struct Armed;

/// Clay that should have an engine.
type Wanted<'a> = (
    Entity,
    &'a Base,
    &'a ClaySettings,
    &'a mut EngineStart,
    (Option<&'a mut ClayEngine>, Option<&'a ClayRecording>),
    Has<Armed>,
);

/// Starts the engine of each clay that has none, or not the one it should have.
pub(super) fn start(mut clays: Query<Wanted>, app: AppDevice, held: Res<HeldTime>) {
    let _watch = held.watch();
    for (entity, base, settings, mut start, (engine, recording), is_armed) in &mut clays {
        let Some(source) = base.snapshot.clone() else { continue };
        let start = start.bypass_change_detection();
        start.recorder = recording.map(|recording| recording.recorder.clone());
        let mut engine = engine.map(Mut::into_inner);
        if let Some(ClayEngine { stopped: Some(reason), want: Want { device: Some(device), .. }, .. }) = engine.as_deref()
            && start.declined.as_ref().is_none_or(|(declined, ..)| declined != device)
        {
            start.declined = Some((device.clone(), Instant::now(), reason.to_string()));
        }
        let Ok(device) = start.device(settings, app.get(), is_armed) else { continue };
        let is_kept_off = start.fallback.is_some() || engine.as_ref().is_some_and(|engine| engine.runs_on_device());
        if is_armed && is_kept_off && !start.is_arm_said {
            info!("clay {entity}: {ARMED}");
        }
        start.is_arm_said = is_armed && (is_kept_off || start.is_arm_said);
        let want = Want { source, device };
        if let Some(engine) = engine.as_deref_mut() {
            // A clay that was replaced stands still until the next is ready, unless that was refused.
            engine.set_leaving(!Arc::ptr_eq(&engine.want.source, &want.source) && start.refused.as_ref() != Some(&want));
        }
        if let Err(error) = start.pursue(want.clone(), engine) {
            refuse(entity, start, want, &error);
        }
    }
}

/// Clay whose engine may be ready.
type Starting<'a> = (Entity, &'a mut EngineStart, (&'a mut ClayStatus, &'a mut ClayMetrics), Option<&'a mut ClayEngine>);

/// Puts engines that are ready in the place of those before.
pub(super) fn admit(mut clays: Query<Starting>, mut generation: Local<u64>, mut commands: Commands, held: Res<HeldTime>) {
    let _watch = held.watch();
    for (entity, mut start, (mut status, mut metrics), old) in &mut clays {
        let start = start.bypass_change_detection();
        let Some((want, task)) = &mut start.under_way else { continue };
        let Some(result) = check_ready(task) else { continue };
        let want = want.clone();
        start.under_way = None;
        match result {
            Ok(mut engine) => {
                // A new start has no frame to report yet.
                metrics.time = engine.kept.snapshot.time;
                status.particle_count = engine.kept.snapshot.particles.len();
                *generation += 1;
                engine.generation = *generation;
                if let Some(old) = old.filter(|old| Arc::ptr_eq(&old.want.source, &want.source)) {
                    let plans = std::mem::take(&mut old.run.lock().plans);
                    engine.run.lock().plans.take_over(plans);
                }
                start.refused = None;
                start.error = None;
                info!("clay {entity} runs on the {}", engine.name);
                commands.entity(entity).queue_silenced(entity::put(engine));
                commands.trigger(ClayReady { entity });
            }
            Err(error) => refuse(entity, start, want, &error),
        }
    }
}

/// Leaves the clay as it is and says why.
fn refuse(entity: Entity, start: &mut EngineStart, want: Want, error: &EngineError) {
    match want.device {
        // What is wrong with the clay itself, the CPU engine will say.
        Some(device) => {
            warn!("clay {entity}: the GPU engine does not start: {error}");
            let since = Instant::now().checked_sub(DEVICE_WITHIN).unwrap_or_else(Instant::now);
            start.declined = Some((device, since, error.to_string()));
        }
        None => {
            error!("clay {entity}: the engine does not start: {error}");
            start.error = Some(error.to_string());
            start.refused = Some(want);
        }
    }
}

/// Keeps a copy of each clay's state.
pub(super) fn keep(mut clays: Query<(&ClaySettings, &mut ClayEngine)>, held: Res<HeldTime>) {
    let _watch = held.watch();
    for (settings, mut engine) in &mut clays {
        engine.bypass_change_detection().keep(settings.snapshot_interval);
    }
}
