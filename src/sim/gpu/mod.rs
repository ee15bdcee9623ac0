//! The GPU engine: wgpu compute passes over particles and 4^3 blocks of nodes, fixed-point node sums; the
//! same bits in every run.
//!
//! | file       | does                                                                     |
//! |------------|--------------------------------------------------------------------------|
//! | `encode`   | the order of the passes, once                                            |
//! | `pass`     | the passes: one WGSL text each, composed by `wgsl` with the shared texts |
//! | `layout`   | the structs that host and device share, declared once                    |
//! | `params`   | a submission's numbers; `tool`: its tools                                |
//! | `buffers`  | buffers, what is bound where, limits                                     |
//! | `kernels`  | pipelines, each a `kernel`                                               |
//! | `scales`   | fixed-point scales, how often particles are re-binned                    |
//! | `solver`   | frames under way, redo, growth                                           |
//! | `found`    | bodies told apart at a frame's end                                       |
//! | `handed`   | surfaces and states that frames have handed out; `handout`: when                |
//! | `readback` | what comes back, without waiting; `stamps`: device times                 |
//! | `report`   | sums -> a frame's report                                                 |
//! | `device`   | a device without a window, limits, `CLAY_GPU`; `label`: names on it      |
//!
//! A frame starts from the records of the frame before and writes records of its own: whatever goes wrong on
//! the device sets a bit in the status word, every later pass returns at once, and the host runs the frame
//! again from records that nothing touched.

mod buffers;
mod device;
mod encode;
mod found;
mod handed;
mod handout;
pub(crate) mod kernel;
mod kernels;
pub(crate) mod label;
pub(crate) mod layout;
mod params;
mod part;
mod pass;

mod readback;
mod report;
mod scales;
mod solver;
mod stamps;
mod tool;
#[cfg(feature = "reference")]
mod trace;
mod wgsl;

pub use device::{GpuDevice, GpuError, GpuMode};
pub(crate) use device::{check, guarded, read_mapped};
pub use layout::{PROFILES_MAX, TOOLS_MAX};

use super::admit::admit;
use super::engine::{Deferred, Engine, EngineError, StatePromise, StateTicket};
use super::frame::{FramePlan, FrameReport, SurfaceSource};
use super::limits::PENDING_MAX;
use super::params::ParamsError;
use super::snapshot::Snapshot;
use handed::Handed;
use kernels::KernelSets;
use solver::{Share, Solver};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};

/// Submissions that may wait on the device: one runs, one is ready.
const SUBMISSIONS_MAX: usize = 2;

/// The engine of compute passes, on a device of its own or of an app.
pub struct GpuEngine {
    link: GpuLink,
    is_linked: bool,
    submissions: Arc<AtomicUsize>,
    pending: usize,
    /// Failures among the reports handed out.
    failures: u64,
    handed: Option<Handed>,
}

/// The device's side of an engine: whoever owns the frame's encoder records the passes through it.
#[derive(Clone)]
pub struct GpuLink {
    shared: Arc<Shared>,
    share: Share,
}

struct Shared {
    device: GpuDevice,
    /// The passes for each number of classes.
    kernels: Arc<KernelSets>,
    /// Never held for long; whoever needs the solver too takes that first.
    inbox: Mutex<Inbox>,
    /// Held while passes are recorded.
    solver: Mutex<Option<Solver>>,
}

/// What has come since the last encoding.
#[derive(Default)]
struct Inbox {
    /// Plans, and how many failures were known when each was made.
    plans: Vec<(FramePlan, u64)>,
    /// Requests for the state.
    requests: Vec<StatePromise>,
    /// Why nothing runs any more, until other clay is loaded.
    stopped: Option<EngineError>,
}

impl Shared {
    fn new(device: GpuDevice, kernels: Arc<KernelSets>) -> Arc<Self> {
        Arc::new(Self { device, kernels, inbox: Mutex::default(), solver: Mutex::default() })
    }

    /// Ends it, for the first reason given. `solver` is what the caller has locked. Who waits for a state
    /// learns at once that it will not come.
    fn stop(&self, solver: Option<&mut Solver>, reason: EngineError) -> EngineError {
        let mut inbox = lock(&self.inbox);
        inbox.requests.clear();
        if let Some(solver) = solver {
            solver.drop_requests();
        }
        inbox.stopped.get_or_insert(reason).clone()
    }
}

/// A panic elsewhere does not make what is locked worse.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl GpuLink {
    /// Records the passes of a frame that waits, at most one submission's worth. Records nothing if there is
    /// none.
    pub fn encode(&self, encoder: &mut wgpu::CommandEncoder) -> bool {
        let mut guard = lock(&self.shared.solver);
        let Some(solver) = guard.as_mut() else { return false };
        {
            let mut inbox = lock(&self.shared.inbox);
            if inbox.stopped.is_some() {
                return false;
            }
            inbox.plans.drain(..).for_each(|(plan, failures)| solver.push(plan, failures));
            inbox.requests.drain(..).for_each(|promise| solver.request(promise));
        }
        let device = &self.shared.device.device;
        let encoded = guarded(device, "a frame's passes", || solver.encode(encoder, self.share)).and_then(|result| result);
        encoded.unwrap_or_else(|error| {
            self.shared.stop(Some(solver), error.into());
            false
        })
    }

    /// The surface particles on the device ([`SurfaceParticle`](super::frame::SurfaceParticle), 28 bytes
    /// each), and how many: as they were loaded, and from then on at the end of the last frame that the
    /// device has run. Passes that are recorded after this engine's in a frame see what these make of them.
    pub fn surface_particles(&self) -> Option<(wgpu::Buffer, u32)> {
        let guard = lock(&self.shared.solver);
        let buffers = guard.as_ref()?.buffers();
        Some((buffers.surface.clone(), buffers.particle_count))
    }

    /// To be called after the encoder's commands were submitted.
    pub fn submitted(&self) {
        if let Some(solver) = lock(&self.shared.solver).as_mut()
            && let Err(error) = guarded(&self.shared.device.device, "reading back", || solver.submitted())
        {
            self.shared.stop(Some(solver), error.into());
        }
    }

    /// Stops the engine: what was recorded could not be submitted, or the device is lost. Its next poll says
    /// so; who waits for a state learns at once that it will not come.
    pub fn fail(&self, reason: EngineError) {
        self.shared.stop(lock(&self.shared.solver).as_mut(), reason);
    }
}

impl GpuEngine {
    /// An engine that records and submits by itself. Compiles its shaders: seconds on software adapters.
    ///
    /// # Errors
    /// A device that refuses the shaders.
    pub fn new(device: GpuDevice) -> Result<Self, GpuError> {
        let kernels = Arc::new(KernelSets::new(&device.device)?);
        Ok(Self {
            link: GpuLink { shared: Shared::new(device, kernels), share: Share::All },
            is_linked: false,
            submissions: Arc::default(),
            pending: 0,
            failures: 0,
            handed: None,
        })
    }

    /// An engine whose passes are recorded by whoever holds the link: an app's render graph.
    ///
    /// # Errors
    /// A device that refuses the shaders.
    pub fn linked(device: GpuDevice) -> Result<(Self, GpuLink), GpuError> {
        let mut engine = Self { is_linked: true, ..Self::new(device)? };
        engine.link.share = Share::Frame;
        let link = engine.link.clone();
        Ok((engine, link))
    }

    /// Another engine on the same device, with the shaders compiled already.
    #[must_use]
    pub fn sibling(&self) -> Self {
        let from = &self.link.shared;
        let shared = Shared::new(from.device.clone(), from.kernels.clone());
        Self {
            link: GpuLink { shared, share: self.link.share },
            is_linked: self.is_linked,
            submissions: Arc::default(),
            pending: 0,
            failures: 0,
            handed: None,
        }
    }

    /// How often frames of this clay were run again, for whatever reason: room for blocks, headroom of fixed
    /// point, speed.
    #[doc(hidden)]
    pub fn reruns(&self) -> u64 {
        lock(&self.link.shared.solver).as_ref().map_or(0, Solver::reruns)
    }

    /// The device's side of this engine.
    #[must_use]
    pub fn link(&self) -> GpuLink {
        self.link.clone()
    }

    /// Records and submits while there is something to run and the device is not busy enough.
    fn pump(&self) {
        let GpuDevice { device, queue, .. } = &self.link.shared.device;
        while !self.is_linked && self.submissions.load(Ordering::Acquire) < SUBMISSIONS_MAX {
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("bevy_clay:frame") });
            if !self.link.encode(&mut encoder) {
                return;
            }
            if let Err(error) = guarded(device, "a frame's commands", || queue.submit([encoder.finish()])) {
                return self.link.fail(error.into());
            }
            self.submissions.fetch_add(1, Ordering::AcqRel);
            let submissions = self.submissions.clone();
            queue.on_submitted_work_done(move || {
                submissions.fetch_sub(1, Ordering::AcqRel);
            });
            self.link.submitted();
        }
    }

    fn handed(&self) -> Result<&Handed, EngineError> {
        self.handed.as_ref().ok_or(EngineError::NotLoaded)
    }
}

impl Engine for GpuEngine {
    fn describe(&self) -> String {
        format!("GPU engine on {}", self.link.shared.device.describe())
    }

    fn identity(&self) -> String {
        self.describe()
    }

    fn load(&mut self, snapshot: &Snapshot) -> Result<(), EngineError> {
        let (particles, quarantined) = admit(snapshot)?;
        let shared = &self.link.shared;
        let GpuDevice { device, queue, .. } = &shared.device;
        let solver = Solver::new(device, queue, shared.kernels.clone(), snapshot, particles, quarantined)?;
        self.handed = Some(solver.handed());
        self.pending = 0;
        self.failures = 0;
        let mut guard = lock(&shared.solver);
        *lock(&shared.inbox) = Inbox::default();
        *guard = Some(solver);
        Ok(())
    }

    fn submit(&mut self, plan: FramePlan) -> Result<(), EngineError> {
        plan.validate()?;
        params::refuse_unknown(&plan)?;
        self.handed()?;
        if plan.tools.len() > TOOLS_MAX as usize {
            let reason = format!("must be at most {TOOLS_MAX} on this engine");
            return Err(ParamsError::new("tools", plan.tools.len(), reason).into());
        }
        let bent = params::bent_blades(&plan.tools).count();
        if bent > PROFILES_MAX as usize {
            let reason = format!("must have at most {PROFILES_MAX} bent blades on this engine");
            return Err(ParamsError::new("tools", format!("{bent} bent blades"), reason).into());
        }
        if self.pending >= PENDING_MAX {
            return Err(EngineError::Busy(self.pending));
        }
        let mut inbox = lock(&self.link.shared.inbox);
        if let Some(reason) = &inbox.stopped {
            return Err(reason.clone());
        }
        inbox.plans.push((plan, self.failures));
        drop(inbox);
        self.pending += 1;
        self.pump();
        Ok(())
    }

    fn poll(&mut self) -> Result<Option<FrameReport>, EngineError> {
        self.handed()?;
        let shared = &self.link.shared;
        if let Some(reason) = &lock(&shared.inbox).stopped {
            return Err(reason.clone());
        }
        // An app's own submissions tell what has ended; asking here would wait for one under way.
        let asked = if self.is_linked { Ok(()) } else { shared.device.device.poll(wgpu::PollType::Poll).map(drop) };
        let mut guard = match shared.solver.try_lock() {
            Ok(guard) => guard,
            // Passes are being recorded: nobody waits for that here.
            Err(TryLockError::WouldBlock) => return Ok(None),
            Err(TryLockError::Poisoned(poisoned)) => {
                let reason = EngineError::Stopped("recording its passes failed".into());
                return Err(shared.stop(poisoned.into_inner().as_mut(), reason));
            }
        };
        let Some(solver) = guard.as_mut() else { return Ok(None) };
        if let Err(error) = asked {
            let reason = EngineError::Stopped(format!("the graphics device does not answer: {error}"));
            return Err(shared.stop(Some(solver), reason));
        }
        // Let go of first, so that a staging that nobody reads any more serves again.
        self.handed = None;
        let polled = solver.poll();
        self.handed = Some(solver.handed());
        self.failures = solver.failures();
        let report = polled.map_err(|reason| shared.stop(Some(solver), reason))?;
        drop(guard);
        self.pending -= usize::from(report.is_some());
        self.pump();
        Ok(report)
    }

    fn surface_deferred(&self) -> Option<Deferred<SurfaceSource>> {
        Some(self.handed.as_ref()?.surface_deferred())
    }

    fn state_deferred(&self) -> Result<Deferred<Snapshot>, EngineError> {
        Ok(self.handed()?.state_deferred())
    }

    fn request_state(&mut self) -> Result<StateTicket, EngineError> {
        self.handed()?;
        let (promise, ticket) = StateTicket::new();
        let mut inbox = lock(&self.link.shared.inbox);
        // The ticket of an engine that has stopped says so.
        if inbox.stopped.is_none() {
            inbox.requests.push(promise);
        }
        drop(inbox);
        self.pump();
        Ok(ticket)
    }

    fn pending(&self) -> usize {
        self.pending
    }
}
