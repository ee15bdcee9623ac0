//! The seam: plans go in, reports come out, nothing blocks.
//!
//! A plan is data, so a run can be recorded and replayed bit for bit. An engine runs plans in the order
//! given; `poll` hands back one report per plan. What a frame hands out beside its report stands in its plan
//! ([`FrameOutputs`](super::frame::FrameOutputs)); nothing else is copied back from a device.

use super::frame::{FramePlan, FrameReport, SurfaceSource};
use super::params::ParamsError;
use super::snapshot::Snapshot;
use futures_channel::oneshot;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

/// A result whose making is left to the thread that calls it: fails if the device that has the numbers is
/// lost before they are read.
pub type Deferred<T> = Box<dyn FnOnce() -> Result<T, StateLost> + Send>;

/// Why an engine refused a call.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EngineError {
    /// A parameter of the snapshot or plan.
    #[error(transparent)]
    Params(#[from] ParamsError),
    /// Nothing is loaded yet.
    #[error("no clay is loaded")]
    NotLoaded,
    /// As many plans are under way as the engine takes, or a call has to wait until there is none.
    #[error("{0} frames are under way already; poll first")]
    Busy(usize),
    /// The device that the engine runs on cannot run this clay.
    #[error(transparent)]
    Device(Arc<dyn std::error::Error + Send + Sync>),
    /// The engine's thread ended, or its device is lost.
    #[error("the engine stopped: {0}")]
    Stopped(String),
}

/// A state that was asked for by [`Engine::request_state`]: look for it now and then with [`Self::take`], or
/// await it on another thread.
#[derive(Debug)]
pub struct StateTicket(oneshot::Receiver<Deferred<Snapshot>>);

/// The engine's end of a [`StateTicket`].
#[derive(Debug)]
pub struct StatePromise(oneshot::Sender<Deferred<Snapshot>>);

/// The engine stopped, went, took other clay, or lost its device, before it had handed out the state that was
/// asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the engine went before it had handed out its state")]
pub struct StateLost;

impl From<StateLost> for EngineError {
    fn from(lost: StateLost) -> Self {
        Self::Stopped(lost.to_string())
    }
}

impl StateTicket {
    /// A ticket and what answers it.
    pub fn new() -> (StatePromise, Self) {
        let (sender, receiver) = oneshot::channel();
        (StatePromise(sender), Self(receiver))
    }

    /// The state, once, when it is there. Making the snapshot takes time: any thread may.
    ///
    /// # Errors
    /// It will never be.
    pub fn take(&mut self) -> Result<Option<Deferred<Snapshot>>, StateLost> {
        self.0.try_recv().map_err(|_| StateLost)
    }
}

impl Future for StateTicket {
    type Output = Result<Deferred<Snapshot>, StateLost>;

    fn poll(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Self::Output> {
        Pin::new(&mut self.0).poll(context).map_err(|_| StateLost)
    }
}

impl StatePromise {
    /// Hands the state to whoever holds the ticket, if anybody still does.
    pub fn keep(self, state: Deferred<Snapshot>) {
        // Nobody waits any more: then nobody misses it.
        let _ = self.0.send(state);
    }
}

/// An engine: runs frames of clay somewhere else than in the caller's time.
pub trait Engine: Send {
    /// One line that names the engine and what it runs on.
    fn describe(&self) -> String;

    /// Engine and device in a line, as far as the bits of a run depend on them: equal where the same plans
    /// make the same bits.
    fn identity(&self) -> String;

    /// Replaces the clay. Frames under way are dropped with their reports, requests for a state with them.
    ///
    /// # Errors
    /// A domain or material that cannot be used, or more memory than there is.
    fn load(&mut self, snapshot: &Snapshot) -> Result<(), EngineError>;

    /// Queues a frame. At most two frames are under way: the plan of frame n is made from the report of frame
    /// n - 2. A frame queued before the report of a frame that was given up has been handed out is given up
    /// with it: it was planned for a state that never came.
    ///
    /// # Errors
    /// A plan that cannot be run, two frames under way, nothing loaded, or an engine that has stopped.
    fn submit(&mut self, plan: FramePlan) -> Result<(), EngineError>;

    /// The next report, if a frame has ended since.
    ///
    /// # Errors
    /// The engine stopped: until other clay is loaded it runs nothing, and no ticket waits for its state.
    fn poll(&mut self) -> Result<Option<FrameReport>, EngineError>;

    /// The surface particles at the end of the last reported frame that hands them out, or as loaded. Making
    /// the source takes time: any thread may.
    fn surface_deferred(&self) -> Option<Deferred<SurfaceSource>>;

    /// The whole state at the end of the last reported frame that hands it out, or as loaded;
    /// [`Self::request_state`] asks for a newer one.
    ///
    /// # Errors
    /// Nothing is loaded.
    fn state_deferred(&self) -> Result<Deferred<Snapshot>, EngineError>;

    /// Asks for the state, without a frame where none is under way (a pause, rest, an export). It is that at
    /// the end of the last reported frame or of one that is under way now, and there within the next polls.
    ///
    /// # Errors
    /// Nothing is loaded.
    fn request_state(&mut self) -> Result<StateTicket, EngineError>;

    /// Frames under way.
    fn pending(&self) -> usize;

    /// [`Self::surface_deferred`], made here and now; nothing if it is lost.
    fn surface(&self) -> Option<SurfaceSource> {
        self.surface_deferred()?().ok()
    }

    /// Waits for the next report: for programs without a frame loop.
    ///
    /// # Errors
    /// Nothing is under way, or the engine stopped.
    fn wait(&mut self) -> Result<FrameReport, EngineError> {
        if self.pending() == 0 {
            return Err(EngineError::Stopped("no frame is under way".into()));
        }
        loop {
            if let Some(report) = self.poll()? {
                return Ok(report);
            }
            std::thread::sleep(POLL_EVERY);
        }
    }

    /// Waits for the whole state: for programs without a frame loop.
    ///
    /// # Errors
    /// Nothing is loaded, a frame is under way whose report would be lost, or the engine stopped.
    fn save(&mut self) -> Result<Snapshot, EngineError> {
        if self.pending() > 0 {
            return Err(EngineError::Busy(self.pending()));
        }
        let mut ticket = self.request_state()?;
        loop {
            let taken = ticket.take();
            if let Ok(Some(make)) = taken {
                return Ok(make()?);
            }
            // An engine that has stopped says why.
            self.poll()?;
            taken?;
            std::thread::sleep(POLL_EVERY);
        }
    }
}

/// Pause between two polls of a program that waits: a hundredth of a short frame.
const POLL_EVERY: Duration = Duration::from_micros(200);
