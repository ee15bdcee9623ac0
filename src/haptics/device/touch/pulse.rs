//! A tick: called by the library's scheduler, a thousand times a second, from a thread of its own.

use super::super::fault::{DeviceEvent, Episodes, Fault};
use super::super::hd::sys::{CALLBACK_CONTINUE, CALLBACK_DONE, CallbackCode, ErrorInfo, error};
use super::super::{DeviceInfo, DeviceState, Servo};
use super::edge::{Calibration, ERRORS_MAX, Edge};
use super::options::TouchOptions;
use glam::{DQuat, DVec3};
use std::ffi::c_void;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

/// Ticks between two looks at the calibration and at whether the motors are on: ten a second.
const CARE_TICKS: u32 = 100;
/// Events that wait for the app to read them: faults begin and end, so that even a second of stall has some
/// tens. What does not fit is not told; the device's phase and its mute are.
const EVENT_ROOM: usize = 256;
/// Longest tick that a servo is told of \[s\].
const TICK_MAX: f64 = 0.1;

/// What both sides see.
#[derive(Debug)]
pub(super) struct Shared {
    is_to_end: AtomicBool,
    has_ended: AtomicBool,
    /// Bits of the time of the latest tick \[s\].
    last_tick: AtomicU64,
}

impl Shared {
    pub(super) fn ask_to_end(&self) {
        self.is_to_end.store(true, Ordering::Release);
    }

    /// Whether the loop is over, whoever ended it.
    pub(super) fn has_ended(&self) -> bool {
        self.has_ended.load(Ordering::Acquire)
    }

    /// When it ticked last \[s\].
    pub(super) fn last_tick(&self) -> f64 {
        f64::from_bits(self.last_tick.load(Ordering::Relaxed))
    }
}

/// The app's ends of what leaves the loop.
#[derive(Debug)]
pub(super) struct Ends {
    pub(super) shared: Arc<Shared>,
    pub(super) events: rtrb::Consumer<DeviceEvent>,
    pub(super) states: triple_buffer::Output<Option<DeviceState>>,
}

/// The loop.
pub(super) struct Pulse {
    edge: Edge,
    servo: Box<dyn Servo>,
    clock: fn() -> f64,
    has_force: bool,
    force_max: f64,
    shared: Arc<Shared>,
    events: rtrb::Producer<DeviceEvent>,
    states: triple_buffer::Input<Option<DeviceState>>,
    episodes: Episodes,
    is_calibrated: bool,
    /// Whether the motors were off for a whole pause between two looks.
    is_off: bool,
    care_in: u32,
    /// The latest state that was one.
    state: DeviceState,
    /// When the latest tick was, or the period of one where there was none \[s\].
    last: Result<f64, f64>,
    has_panicked: bool,
}

impl fmt::Debug for Pulse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Pulse").field("edge", &self.edge).finish_non_exhaustive()
    }
}

/// The scheduler's callback.
///
/// # Safety
/// `context` is a [`Pulse`] that nothing else touches meanwhile.
pub(super) unsafe extern "system" fn tick(context: *mut c_void) -> CallbackCode {
    // SAFETY: the caller's promise.
    let pulse = unsafe { &mut *context.cast::<Pulse>() };
    // A panic that left this function would end the process.
    let goes_on = catch_unwind(AssertUnwindSafe(|| pulse.tick())).unwrap_or_else(|panic| {
        // Whatever it holds is not to be dropped here, where its own drop may panic.
        std::mem::forget(panic);
        pulse.fail();
        false
    });
    if goes_on { CALLBACK_CONTINUE } else { CALLBACK_DONE }
}

impl Pulse {
    pub(super) fn new(edge: Edge, info: &DeviceInfo, options: &TouchOptions, servo: Box<dyn Servo>) -> (Self, Ends) {
        let now = (options.clock)();
        edge.make_current();
        let is_calibrated = edge.calibration() == Calibration::Known;
        let shared = Arc::new(Shared {
            is_to_end: AtomicBool::new(false),
            has_ended: AtomicBool::new(false),
            last_tick: AtomicU64::new(now.to_bits()),
        });
        let (events, events_out) = rtrb::RingBuffer::new(EVENT_ROOM);
        let (states, states_out) = triple_buffer::triple_buffer(&None);
        let state = DeviceState {
            time: now,
            position: DVec3::ZERO,
            rotation: DQuat::IDENTITY,
            velocity: DVec3::ZERO,
            buttons: 0,
            motor_temperature: 0.0,
            is_muted: true,
        };
        let pulse = Self {
            edge,
            servo,
            clock: options.clock,
            has_force: options.has_force,
            force_max: info.force_max,
            shared: shared.clone(),
            events,
            states,
            episodes: Episodes::default(),
            is_calibrated,
            is_off: !(is_calibrated && options.has_force),
            care_in: 0,
            state,
            last: Err(1.0 / info.rate),
            has_panicked: false,
        };
        (pulse, Ends { shared, events: events_out, states: states_out })
    }

    /// Whether the motors are on from the first tick.
    pub(super) fn is_to_push(&self) -> bool {
        !self.is_off
    }

    /// The servo, if it did not fail.
    pub(super) fn into_servo(self) -> Option<Box<dyn Servo>> {
        (!self.has_panicked).then_some(self.servo)
    }

    /// A tick; whether there is to be another.
    fn tick(&mut self) -> bool {
        let time = (self.clock)();
        self.shared.last_tick.store(time.to_bits(), Ordering::Relaxed);
        if self.care_in == 0 {
            self.care_in = CARE_TICKS;
            self.take_care();
        }
        self.care_in -= 1;
        self.edge.begin();
        let dt = self.sense(time);
        let goes_on = self.judge(time);
        let force = if goes_on { self.force(time, dt) } else { DVec3::ZERO };
        self.states.write(Some(self.state));
        self.edge.push(force);
        self.edge.end();
        if !goes_on {
            self.shared.has_ended.store(true, Ordering::Release);
        }
        goes_on
    }

    /// Reads the state; the time since the tick before \[s\].
    fn sense(&mut self, time: f64) -> f64 {
        let sensed = self.edge.sense();
        let dt = self.last.map_or_else(|period| period, |last| time - last).clamp(1e-6, TICK_MAX);
        self.last = Ok(time);
        self.state.time = time;
        if sensed.is_finite() {
            self.state = DeviceState {
                time,
                position: sensed.position,
                rotation: sensed.rotation,
                velocity: sensed.velocity,
                buttons: sensed.buttons,
                motor_temperature: sensed.motor_temperature,
                is_muted: false,
            };
        } else {
            self.report(Fault::Pose, time, ErrorInfo::default());
        }
        if !self.is_calibrated {
            self.report(Fault::Uncalibrated, time, ErrorInfo::default());
        }
        dt
    }

    /// Looks through the library's errors; whether the loop goes on.
    fn judge(&mut self, time: f64) -> bool {
        for _ in 0..ERRORS_MAX {
            let Some(error) = self.edge.take_error() else { break };
            let fault = match error.code {
                error::WARM_MOTORS => Fault::WarmMotors,
                error::EXCEEDED_MAX_FORCE..=error::FORCE_ERROR => Fault::Force,
                error::DEVICE_FAULT | error::COMM_ERROR | error::COMM_CONFIG_ERROR | error::TIMER_ERROR => Fault::Lost,
                _ => Fault::Other,
            };
            self.report(fault, time, error);
        }
        let is_lost = self.episodes.active() & Fault::Lost.bit() != 0;
        !is_lost && !self.shared.is_to_end.load(Ordering::Acquire)
    }

    /// The force of the tick.
    fn force(&mut self, time: f64, dt: f64) -> DVec3 {
        let over = self.episodes.end(time);
        for fault in Fault::ALL.into_iter().filter(|fault| over & fault.bit() != 0) {
            self.tell(DeviceEvent { time, fault, has_begun: false, code: 0, internal: 0 });
        }
        let is_muted = |faults: u32| Fault::ALL.iter().any(|fault| fault.is_muting() && faults & fault.bit() != 0);
        self.state.is_muted = !self.is_calibrated || is_muted(self.episodes.active());
        let asked = self.servo.tick(&self.state, dt);
        if !asked.is_finite() {
            self.report(Fault::Command, time, ErrorInfo::default());
        }
        if self.state.is_muted || !asked.is_finite() { DVec3::ZERO } else { asked.clamp_length_max(self.force_max) }
    }

    /// Looks at the calibration, which is changed with the motors off alone: the arm's place jumps with it.
    fn take_care(&mut self) {
        self.edge.make_current();
        let calibration = self.edge.calibration();
        self.is_calibrated = calibration == Calibration::Known;
        if self.is_calibrated {
            self.edge.switch_force(self.has_force);
            self.is_off = !self.has_force;
            return;
        }
        if self.is_off {
            self.edge.calibrate(calibration);
        }
        self.edge.switch_force(false);
        self.is_off = true;
    }

    /// A servo that panicked, in the midst of a frame.
    fn fail(&mut self) {
        self.has_panicked = true;
        self.edge.push(DVec3::ZERO);
        self.edge.end();
        self.report(Fault::Servo, self.state.time, ErrorInfo::default());
        self.shared.has_ended.store(true, Ordering::Release);
    }

    /// Takes a fault in; it is told where it begins.
    fn report(&mut self, fault: Fault, time: f64, error: ErrorInfo) {
        if self.episodes.report(fault, time) {
            self.tell(DeviceEvent { time, fault, has_begun: true, code: error.code, internal: error.internal });
        }
    }

    fn tell(&mut self, event: DeviceEvent) {
        // See `EVENT_ROOM`.
        _ = self.events.push(event);
    }
}
