//! The device: what is open, its frame, its errors, its motors.

use crate::abi::{
    BAD_HANDLE, COMM_ERROR, DEVICE, DEVICE_ALREADY_INITIATED, DEVICE_FAULT, EXCEEDED_MAX_FORCE, EXCEEDED_MAX_FORCE_IMPULSE,
    EXCEEDED_MAX_VELOCITY, ErrorInfo, ILLEGAL_BEGIN, ILLEGAL_END, NO_DEVICE, WARM_MOTORS,
};
use crate::arm::Arm;
use crate::plan::Plan;
use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{LazyLock, Mutex};

/// Greatest force \[N\], force for ever \[N\], stiffness \[N/mm\], damping \[N s/mm\] of the arm.
pub(crate) const FORCE_MAX: f64 = 3.3;
pub(crate) const FORCE_CONTINUOUS: f64 = 0.88;
pub(crate) const STIFFNESS: f64 = 0.5;
pub(crate) const DAMPING: f64 = 0.004;
/// What it reaches \[mm\].
pub(crate) const WORKSPACE: [f64; 6] = [-210.0, -110.0, -85.0, 210.0, 205.0, 130.0];
/// Ticks a second \[Hz\].
pub(crate) const RATE: f64 = 1000.0;
/// Time in which motors warm \[s\].
const WARMING: f64 = 10.0;
/// Temperature at which warm motors are cool again.
const COOL: f64 = 0.9;

pub(crate) const FORCE_OUTPUT: u32 = 0x4000;
pub(crate) const MAX_FORCE_CLAMPING: u32 = 0x4001;
pub(crate) const FORCE_RAMPING: u32 = 0x4002;
pub(crate) const ONE_FRAME_LIMIT: u32 = 0x4004;

thread_local! {
    /// The device that a thread's calls are about.
    pub(crate) static CURRENT: Cell<u32> = const { Cell::new(NO_DEVICE) };
}

pub(crate) static WORLD: LazyLock<Mutex<World>> = LazyLock::new(|| {
    let text = std::env::var("FAKEHD_PLAN").unwrap_or_default();
    let mut world = World::new(Plan::read(&text).unwrap_or_default());
    // A plan that cannot be read must not pass for one without faults.
    world.is_plan_wrong = Plan::read(&text).is_err();
    Mutex::new(world)
});

pub(crate) struct World {
    pub(crate) plan: Plan,
    is_plan_wrong: bool,
    pub(crate) time: f64,
    pub(crate) arm: Arm,
    errors: Vec<ErrorInfo>,
    is_open: bool,
    /// Whether the cable was out since it was opened.
    was_unplugged: bool,
    pub(crate) is_calibrated: bool,
    /// Capabilities that are on.
    pub(crate) enabled: BTreeSet<u32>,
    /// Limits that can be set, by number.
    pub(crate) limits: BTreeMap<u32, f64>,
    is_in_frame: bool,
    frames_in_tick: u32,
    /// Set in this frame \[N\].
    pub(crate) asked: [f64; 3],
    /// On the motors \[N\].
    pub(crate) motors: [f64; 3],
    /// Greatest force that the driver's ramp lets through \[N\].
    ramp: f64,
    /// Temperature of the motors, 1 at the limit.
    pub(crate) temperature: f64,
    is_too_warm: bool,
    pub(crate) counts: BTreeMap<&'static str, u64>,
}

impl World {
    pub(crate) fn new(plan: Plan) -> Self {
        let max_speed = plan.value("max_speed", 0.0).unwrap_or(1e4);
        Self {
            is_calibrated: !plan.has("uncalibrated", 0.0),
            plan,
            is_plan_wrong: false,
            time: 0.0,
            arm: Arm::default(),
            errors: vec![],
            is_open: false,
            was_unplugged: false,
            enabled: BTreeSet::from([FORCE_RAMPING, ONE_FRAME_LIMIT]),
            // Speed \[mm/s\], change of force \[N/ms\], ramp \[N/s\].
            limits: BTreeMap::from([(0x2606, max_speed), (0x2607, 1.0), (0x2608, 100.0)]),
            is_in_frame: false,
            frames_in_tick: 0,
            asked: [0.0; 3],
            motors: [0.0; 3],
            ramp: 0.0,
            temperature: 0.0,
            is_too_warm: false,
            counts: BTreeMap::new(),
        }
    }

    pub(crate) fn count(&mut self, what: &'static str) {
        *self.counts.entry(what).or_default() += 1;
    }

    pub(crate) fn has(&self, item: &str) -> bool {
        self.plan.has(item, self.time)
    }

    pub(crate) fn is_on(&self, capability: u32) -> bool {
        self.enabled.contains(&capability)
    }

    pub(crate) fn error(&mut self, code: u32) {
        self.errors.push(ErrorInfo { code, internal: -7, handle: CURRENT.get() });
    }

    pub(crate) fn take_error(&mut self) -> ErrorInfo {
        self.errors.pop().unwrap_or(ErrorInfo { code: 0, internal: 0, handle: NO_DEVICE })
    }

    /// Whether the thread's device is open; if not, an error.
    pub(crate) fn has_device(&mut self) -> bool {
        let has = self.is_open && CURRENT.get() == DEVICE;
        if !has {
            self.error(BAD_HANDLE);
        }
        has
    }

    pub(crate) fn open(&mut self) -> u32 {
        self.count("open");
        let refusal = if self.is_open || self.has("busy") {
            Some(DEVICE_ALREADY_INITIATED)
        } else if self.has("no_device") || self.has("unplug") || self.is_plan_wrong {
            Some(DEVICE_FAULT)
        } else {
            None
        };
        if let Some(code) = refusal {
            self.error(code);
            return NO_DEVICE;
        }
        (self.is_open, self.was_unplugged, self.is_in_frame) = (true, false, false);
        CURRENT.set(DEVICE);
        DEVICE
    }

    pub(crate) fn close(&mut self, handle: u32) {
        if handle != DEVICE || !self.is_open {
            return self.error(BAD_HANDLE);
        }
        self.count("close");
        self.is_open = false;
        self.enabled.remove(&FORCE_OUTPUT);
        self.motors = [0.0; 3];
    }

    /// The clock goes on by a tick: the arm moves, what is planned happens.
    pub(crate) fn tick(&mut self) {
        let span = 1.0 / RATE;
        self.time += span;
        self.frames_in_tick = 0;
        self.arm.goal_velocity = [self.plan.value("speed", self.time).unwrap_or(0.0), 0.0, 0.0];
        self.arm.advance(self.motors, span);
        let square: f64 = self.motors.iter().map(|f| f * f).sum();
        let heat = if self.has("warm") { 1.5 } else { square / (FORCE_CONTINUOUS * FORCE_CONTINUOUS) };
        let share = if self.has("warm") || self.is_too_warm { 0.05 } else { span / WARMING };
        self.temperature += (heat - self.temperature) * share;
        self.is_too_warm = self.temperature > if self.is_too_warm { COOL } else { 1.0 };
        if self.has("uncalibrated") && !self.counts.contains_key("lost_calibration") {
            self.count("lost_calibration");
            self.is_calibrated = false;
        }
        if self.has("unplug") {
            self.was_unplugged = true;
        }
        if self.was_unplugged {
            self.motors = [0.0; 3];
        }
        self.ramp += self.limits[&0x2608] * span;
    }

    pub(crate) fn begin(&mut self, handle: u32) {
        CURRENT.set(handle);
        if !self.has_device() {
            return;
        }
        if self.is_in_frame || (self.is_on(ONE_FRAME_LIMIT) && self.frames_in_tick > 0) {
            return self.error(ILLEGAL_BEGIN);
        }
        (self.is_in_frame, self.asked) = (true, [0.0; 3]);
        self.frames_in_tick += 1;
        self.count("frames");
        if self.was_unplugged {
            self.error(COMM_ERROR);
        }
        if let Some(code) = self.plan.value("error", self.time) {
            self.error(code as u32);
        }
        if self.is_too_warm {
            self.error(WARM_MOTORS);
        }
        let speed = self.arm.seen_velocity.iter().map(|v| v * v).sum::<f64>().sqrt() * 1e3;
        if speed > self.limits[&0x2606] {
            self.error(EXCEEDED_MAX_VELOCITY);
        }
    }

    /// The force of the frame goes to the motors, if it may.
    pub(crate) fn end(&mut self, handle: u32) {
        if handle != DEVICE || !self.is_in_frame {
            return self.error(ILLEGAL_END);
        }
        self.is_in_frame = false;
        let length = |force: [f64; 3]| force.iter().map(|f| f * f).sum::<f64>().sqrt();
        let mut force = self.asked;
        if !self.is_on(FORCE_OUTPUT) || !self.is_calibrated || self.was_unplugged {
            self.ramp = 0.0;
            self.motors = [0.0; 3];
            return;
        }
        // A driver that is handed a force that is no number may do anything: here it pushes with all it has,
        // for a test to see.
        if force.iter().any(|f| !f.is_finite()) {
            self.count("force_no_number");
            force = [FORCE_MAX, 0.0, 0.0];
        }
        if length(force) > FORCE_MAX {
            if self.is_on(MAX_FORCE_CLAMPING) {
                let scale = FORCE_MAX / length(force);
                force = force.map(|f| f * scale);
            } else {
                self.error(EXCEEDED_MAX_FORCE);
                force = [0.0; 3];
            }
        }
        if self.is_on(FORCE_RAMPING) && length(force) > self.ramp {
            let scale = self.ramp / length(force);
            force = force.map(|f| f * scale);
        }
        let change: [f64; 3] = std::array::from_fn(|i| force[i] - self.motors[i]);
        // To let go is never too fast.
        if length(change) > self.limits[&0x2607] && length(force) > 0.0 {
            self.error(EXCEEDED_MAX_FORCE_IMPULSE);
            (force, self.ramp) = ([0.0; 3], 0.0);
        }
        self.motors = force;
    }

    /// The scheduler stands: so do the motors.
    pub(crate) fn stop(&mut self) {
        (self.motors, self.is_in_frame, self.ramp) = ([0.0; 3], false, 0.0);
    }

    /// What is known of the arm's place.
    pub(crate) fn calibration(&self) -> u32 {
        match (self.is_calibrated, self.has("auto") || self.has("inkwell")) {
            (true, _) => 0x5000,
            (false, true) => 0x5001,
            (false, false) => 0x5002,
        }
    }

    /// The arm's place is to be found.
    pub(crate) fn calibrate(&mut self, style: u32) {
        if !self.has_device() {
            return;
        }
        self.count("calibrate");
        let is_pushed = self.is_on(FORCE_OUTPUT) || self.motors != [0.0; 3];
        if is_pushed {
            self.count("calibrate_while_on");
        }
        let can = if self.has("auto") { style == 2 } else { style == 4 && self.has("inkwell") };
        self.is_calibrated |= can;
    }
}
