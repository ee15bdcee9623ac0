//! 3D Systems Touch (and what else libHD drives) by HDAPI.
//!
//! libHD owns the thread: its scheduler calls the loop once a tick. In it: frame, state, errors, the servo's
//! force, frame. Everything there is wait-free; what happened goes out by a ring, the state by a triple
//! buffer.
//!
//! | what can be wrong               | what is done                                                       |
//! |---------------------------------|--------------------------------------------------------------------|
//! | error of force, warm motors     | no force while it is reported and .1 s longer; the servo is told   |
//! | not calibrated                  | no force, output off; calibrated when the stylus is in the inkwell |
//! | pose or force that is no number | no force in that tick                                              |
//! | no answer                       | no force, the loop ends, [`DevicePhase::Lost`]                     |
//! | a servo that panics             | as no answer; the servo is not used again                          |
//!
//! One device a process: libHD has one scheduler, and its newer drivers open the default device alone.

mod edge;
mod options;
mod pulse;

use super::fault::{DeviceError, DeviceEvent, Fault};
use super::hd::library::{HdLibrary, load};
use super::hd::sys::{self, error, name};
use super::{DeviceInfo, DevicePhase, DeviceState, HapticDevice, NotStarted, RunningDevice, Servo};
pub use edge::Calibration;
use edge::{ERRORS_MAX, Open};
pub use options::TouchOptions;
use pulse::{Ends, Pulse};
use std::ffi::{c_ulong, c_void};
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether this process has a device open.
static IS_OPEN: AtomicBool = AtomicBool::new(false);

/// The right to have a device open.
#[derive(Debug)]
struct Claim;

impl Claim {
    fn take() -> Result<Self, DeviceError> {
        if IS_OPEN.swap(true, Ordering::AcqRel) { Err(DeviceError::Busy) } else { Ok(Self) }
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        IS_OPEN.store(false, Ordering::Release);
    }
}

/// A Touch that was opened. Closed when it is dropped.
#[derive(Debug)]
pub struct Touch {
    /// Dropped before the claim: another may open the device once it is closed.
    open: Open,
    claim: Claim,
    info: DeviceInfo,
    options: TouchOptions,
    library: HdLibrary,
}

impl Touch {
    /// Loads the library and opens the device. Nothing moves.
    ///
    /// # Errors
    /// No library, another library, no device, or one that is open already.
    pub fn open(options: TouchOptions) -> Result<Self, DeviceError> {
        let library = load(options.library.as_deref()).map_err(|error| DeviceError::Library(error.to_string()))?;
        let claim = Claim::take()?;
        let open = Open::new(library.api, options.name.as_deref())?;
        let info = open.edge.info();
        Ok(Self { open, claim, info, options, library })
    }

    /// The library that drives it.
    pub fn library(&self) -> HdLibrary {
        self.library
    }

    /// What the library says of itself, its driver and the device: names and values.
    pub fn words(&self) -> Vec<(&'static str, String)> {
        let names = [
            ("library", name::VERSION),
            ("driver", name::DEVICE_DRIVER_VERSION),
            ("maker", name::DEVICE_VENDOR),
            ("model", name::DEVICE_MODEL_TYPE),
            ("serial number", name::DEVICE_SERIAL_NUMBER),
        ];
        names.map(|(word, name)| (word, self.open.edge.string(name))).into()
    }

    /// Whether it knows where its arm is.
    pub fn calibration(&self) -> Calibration {
        self.open.edge.calibration()
    }
}

impl HapticDevice for Touch {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn run(self: Box<Self>, mut servo: Box<dyn Servo>) -> Result<Box<dyn RunningDevice>, NotStarted> {
        let Self { open, claim, info, options, .. } = *self;
        let edge = open.edge;
        servo.begin(&info);
        let (pulse, ends) = Pulse::new(edge, &info, &options, servo);
        edge.prepare(pulse.is_to_push());
        let context = Context(Box::into_raw(Box::new(pulse)));
        // SAFETY: `tick` is a callback, and its context lives until the scheduler has stopped: see
        // `RunningTouch::end`.
        let job = unsafe { (edge.api.schedule_asynchronous)(pulse::tick, context.0.cast::<c_void>(), sys::MAX_PRIORITY) };
        let mut running =
            Box::new(RunningTouch { open, _claim: claim, info, job, context, ends, clock: options.clock, was_told: false });
        // The scheduler stands still yet, so that these errors are of this thread.
        let errors: Vec<_> = std::iter::from_fn(|| edge.take_error()).take(ERRORS_MAX).collect();
        if let Some(error) = errors.into_iter().find(|error| REFUSALS.contains(&error.code)) {
            return Err(NotStarted { error: edge.refusal(error), servo: running.end() });
        }
        // SAFETY: a device is open and a callback scheduled.
        unsafe { (edge.api.start_scheduler)() };
        Ok(running)
    }
}

/// Errors for which the callback is not called: of the scheduler, of the licence.
const REFUSALS: std::ops::RangeInclusive<u32> = error::INVALID_PRIORITY..=error::INVALID_LICENSE;
/// A scheduler that was silent for this long \[s\] is dead: hundreds of ticks.
const SILENCE: f64 = 0.5;
/// How long the loop is given to end by itself, with a last tick of no force \[ms\].
const LAST_TICK: u64 = 20;

/// What the scheduler calls the loop with.
#[derive(Debug)]
struct Context(*mut Pulse);

// SAFETY: a `Pulse` is `Send`, and this is the only owner of it beside the scheduler, whose thread alone
// touches it between the scheduler's start and its stop.
unsafe impl Send for Context {}

/// A Touch that ticks.
#[derive(Debug)]
struct RunningTouch {
    open: Open,
    _claim: Claim,
    info: DeviceInfo,
    job: c_ulong,
    /// Null once it was ended.
    context: Context,
    ends: Ends,
    clock: fn() -> f64,
    /// Whether a dead scheduler was told of.
    was_told: bool,
}

impl RunningTouch {
    fn is_silent(&self) -> bool {
        (self.clock)() - self.ends.shared.last_tick() > SILENCE
    }

    /// Ends the loop; the servo, the first time, if it did not fail.
    fn end(&mut self) -> Option<Box<dyn Servo>> {
        if self.context.0.is_null() {
            return None;
        }
        self.ends.shared.ask_to_end();
        for _ in 0..LAST_TICK {
            if self.ends.shared.has_ended() || self.is_silent() {
                break;
            }
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        let edge = self.open.edge;
        edge.stop(self.job);
        // SAFETY: from `Box::into_raw` in `run`, taken once; the scheduler has stopped, so nothing else has
        // it.
        let pulse = unsafe { Box::from_raw(std::mem::replace(&mut self.context.0, std::ptr::null_mut())) };
        pulse.into_servo()
    }
}

impl Drop for RunningTouch {
    fn drop(&mut self) {
        drop(self.end());
    }
}

impl RunningDevice for RunningTouch {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn phase(&self) -> DevicePhase {
        if self.ends.shared.has_ended() || self.is_silent() { DevicePhase::Lost } else { DevicePhase::Running }
    }

    fn state(&mut self) -> Option<DeviceState> {
        *self.ends.states.read()
    }

    fn event(&mut self) -> Option<DeviceEvent> {
        if let Ok(event) = self.ends.events.pop() {
            self.was_told |= event.fault.is_final();
            return Some(event);
        }
        let is_news = self.is_silent() && !std::mem::replace(&mut self.was_told, true);
        is_news.then(|| DeviceEvent { time: (self.clock)(), fault: Fault::Lost, has_begun: true, code: 0, internal: 0 })
    }

    fn stop(mut self: Box<Self>) -> Option<Box<dyn Servo>> {
        self.end()
    }
}
