//! What stands between a computed force and a hand: a chain of stages, in this order, each counted.
//!
//! | stage     | what it does                                                          | file         |
//! |-----------|-----------------------------------------------------------------------|--------------|
//! | finite    | a force or a state that is no number: nothing, at once                | `mod`        |
//! | age       | an old model of the clay fades, and is gone until the tool is free    | [`age`]      |
//! | passivity | energy that the loop made is damped out                               | [`passivity`]|
//! | budget    | the mean square of the force stays what motors bear, and so their heat| `budget`     |
//! | clamp     | no force above the device's and the user's greatest                   | `mod`        |
//! | slew      | no force changes faster than a hand takes for a push                  | `mod`        |
//! | ramp      | force comes slowly after a start and every trip, and goes when asked  | `gain`       |
//! | speed     | a hand that flies: nothing, at once                                   | `motion`     |
//! | buzz      | a hand that is shaken: half of the force, from then on                | `motion`     |
//! | device    | a device that asks for nothing, or is lost: nothing, at once          | `mod`        |
//!
//! Each stage sees what the one before leaves. Where a stage says *nothing, at once* (a *trip*), the force
//! jumps to zero; everywhere else it keeps to the slew limit. After a trip it comes back by the ramp.

pub mod age;
mod budget;
mod gain;
mod motion;
pub mod passivity;
#[cfg(test)]
mod tests;

use super::device::{DeviceInfo, DeviceState};
use age::AgeGate;
use budget::Budget;
use gain::Gain;
use glam::DVec3;
use motion::{Buzz, Speed};
use passivity::Passivity;

/// A stage of the chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Stage {
    /// A force or a state that is no number.
    Finite,
    /// The model of the clay is old.
    Age,
    /// The loop made energy.
    Passivity,
    /// The motors bear no more for long.
    Budget,
    /// More than the greatest force.
    Clamp,
    /// A force that changes too fast.
    Slew,
    /// The force comes, or goes as asked.
    Ramp,
    /// The hand is too fast.
    Speed,
    /// The hand is shaken.
    Buzz,
    /// The device asks for nothing.
    Device,
}

impl Stage {
    /// Every stage, in order.
    pub const ALL: [Self; 10] = [
        Self::Finite,
        Self::Age,
        Self::Passivity,
        Self::Budget,
        Self::Clamp,
        Self::Slew,
        Self::Ramp,
        Self::Speed,
        Self::Buzz,
        Self::Device,
    ];

    /// A word for plots and tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Finite => "finite",
            Self::Age => "age",
            Self::Passivity => "passivity",
            Self::Budget => "budget",
            Self::Clamp => "clamp",
            Self::Slew => "slew",
            Self::Ramp => "ramp",
            Self::Speed => "speed",
            Self::Buzz => "buzz",
            Self::Device => "device",
        }
    }

    /// What it means to whoever holds the device.
    pub const fn message(self) -> &'static str {
        match self {
            Self::Finite => "a force or a place that is no number: no force until it is one",
            Self::Age => "the clay is late: its force fades, and comes back once the tool is free of it",
            Self::Passivity => "the loop made energy, which is damped out",
            Self::Budget => "the motors bear this force no longer: it is lowered",
            Self::Clamp => "the force is at its greatest",
            Self::Slew => "the force changes as fast as it may",
            Self::Ramp => "the force comes back, or goes as asked",
            Self::Speed => "the hand is too fast: no force until it is slow",
            Self::Buzz => "the hand is shaken: the force is halved until it is switched off and on",
            Self::Device => "the device asks for no force",
        }
    }

    /// Its bit in [`SafetyReport::active`].
    pub const fn bit(self) -> u32 {
        1 << self as u32
    }
}

/// Limits of the chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SafetySettings {
    /// Greatest force \[N\], where the device's own share of it is not less.
    pub force_max: f64,
    /// Greatest change of the force \[N/s\].
    pub slew_max: f64,
    /// Greatest speed of the hand \[m/s\].
    pub speed_max: f64,
    /// How long the whole force takes to come \[s\].
    pub ramp: f64,
    /// Greatest damping with which energy is taken out \[N s/m\].
    pub damping_max: f64,
    /// Least stiffness that stores energy and gives it back \[N/m\].
    pub stiffness_min: f64,
}

impl Default for SafetySettings {
    /// Two newtons are felt as firm clay and stopped by two fingers; clay met at 200 mm/s through a local
    /// model asks for .16 N/ms, held forces for 1.25, and a user notices no limit at .3; a stroke is slower
    /// than .5 m/s, a device let go faster than 1; the damping is what a Touch renders (CHAI3D,
    /// `CPhantomDevices.cpp`), the stiffness what clay of 20 kPa has under a tip of 2.5 mm (2 E* a).
    fn default() -> Self {
        Self { force_max: 2.0, slew_max: 300.0, speed_max: 1.0, ramp: 0.75, damping_max: 4.0, stiffness_min: 100.0 }
    }
}

impl SafetySettings {
    /// The same within what the chain can answer for; what is no number is as by default. No change of force
    /// is faster than by default, and none comes within less than half a second.
    #[must_use]
    pub fn within_bounds(self) -> Self {
        let usual = Self::default();
        let fair = |value: f64, usual: f64, least: f64, most: f64| if value.is_nan() { usual } else { value.clamp(least, most) };
        Self {
            force_max: fair(self.force_max, usual.force_max, 0.0, 20.0),
            slew_max: fair(self.slew_max, usual.slew_max, 10.0, usual.slew_max),
            speed_max: fair(self.speed_max, usual.speed_max, 0.1, 2.0),
            ramp: fair(self.ramp, usual.ramp, 0.5, 10.0),
            damping_max: fair(self.damping_max, usual.damping_max, 0.0, 10.0),
            stiffness_min: fair(self.stiffness_min, usual.stiffness_min, 10.0, 5e3),
        }
    }
}

/// Share of a device's greatest force that is asked of it: what is left is for its own control.
const FORCE_SHARE: f64 = 0.9;
/// Greatest part of a tick's time in which a force may change \[s\]: after a pause of the device's thread the
/// force goes on as after two ticks.
const STEP_MAX: f64 = 2e-3;
/// A stage that did nothing for this long \[s\] and acts again has a new episode: ten of a second, which a plot
/// shows apart.
const QUIET: f64 = 0.1;

/// What the chain did: small, to be handed out in every tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SafetyReport {
    /// Stages that acted in the latest tick: bit i is `Stage::ALL[i]`.
    pub active: u32,
    /// Ticks in which each acted.
    pub ticks: [u64; Stage::ALL.len()],
    /// How often each began to act.
    pub episodes: [u32; Stage::ALL.len()],
    /// Share of the force that comes through \[-\]: below 1 while it comes or goes, and after a buzz.
    pub gain: f64,
    /// Energy that the hand gave and did not get back \[J\], as far as it is counted.
    pub energy: f64,
    /// Share of what motors bear for long that is used \[-\].
    pub load: f64,
}

impl SafetyReport {
    /// Whether a stage acted in the latest tick.
    pub fn is_active(&self, stage: Stage) -> bool {
        self.active & stage.bit() != 0
    }

    /// Ticks in which a stage acted.
    pub fn ticks(&self, stage: Stage) -> u64 {
        self.ticks[stage as usize]
    }

    /// How often a stage began to act.
    pub fn episodes(&self, stage: Stage) -> u32 {
        self.episodes[stage as usize]
    }
}

/// The chain. It neither allocates, waits nor logs.
#[derive(Clone, Debug)]
pub struct SafetyChain {
    settings: SafetySettings,
    age: AgeGate,
    passivity: Passivity,
    budget: Budget,
    gain: Gain,
    speed: Speed,
    buzz: Buzz,
    /// Greatest force that is asked of the device \[N\].
    device_force_max: f64,
    /// Greatest force of settings and device \[N\].
    force_max: f64,
    /// After the slew limit, in the tick before \[N\].
    slewed: DVec3,
    /// What the hand got in the tick before \[N\].
    output: DVec3,
    report: SafetyReport,
    /// How long each stage did nothing \[s\].
    quiet: [f64; Stage::ALL.len()],
}

impl SafetyChain {
    /// A chain for a device, with no force yet.
    pub fn new(settings: SafetySettings, info: &DeviceInfo) -> Self {
        let settings = settings.within_bounds();
        let device_force_max = FORCE_SHARE * info.force_max;
        let force_max = settings.force_max.min(device_force_max).max(0.0);
        Self {
            settings,
            age: AgeGate::default(),
            passivity: Passivity::new(force_max, settings.stiffness_min, settings.damping_max, info.resolution),
            budget: Budget::new(info.continuous_force_max),
            gain: Gain::new(settings.ramp),
            speed: Speed::default(),
            buzz: Buzz::default(),
            device_force_max,
            force_max,
            slewed: DVec3::ZERO,
            output: DVec3::ZERO,
            report: SafetyReport::default(),
            quiet: [f64::INFINITY; Stage::ALL.len()],
        }
    }

    /// Another device, or the same anew: no force, counts go on.
    pub fn begin(&mut self, info: &DeviceInfo) {
        let (report, is_on) = (self.report, self.gain.is_on());
        *self = Self { report, ..Self::new(self.settings, info) };
        self.gain.switch(is_on);
    }

    /// Other limits, from the next tick on; the force goes there as fast as it may.
    pub fn configure(&mut self, settings: SafetySettings) {
        self.settings = settings.within_bounds();
        self.force_max = self.settings.force_max.min(self.device_force_max).max(0.0);
        self.gain.set_rise(self.settings.ramp);
        self.passivity.limit(self.force_max, self.settings.stiffness_min, self.settings.damping_max);
    }

    /// Switches force on or off. Off, it is gone within 20 ms; on, it comes by the ramp, and a buzz is
    /// forgotten.
    pub fn switch(&mut self, is_on: bool) {
        if is_on && !self.gain.is_on() {
            self.buzz = Buzz::default();
        }
        self.gain.switch(is_on);
    }

    /// The clay is about to be another (undone, rebuilt, paged by a menu): no force within 20 ms, then the
    /// ramp.
    pub fn restart(&mut self) {
        self.gain.restart();
    }

    /// What it did.
    pub fn report(&self) -> &SafetyReport {
        &self.report
    }

    /// The force on the hand \[N\] of the one asked for, in a tick of `dt` \[s\]. `model_age` is that of the
    /// clay's model \[s\]: see [`age::ModelClock`].
    pub fn apply(&mut self, force: DVec3, model_age: f64, state: &DeviceState, dt: f64) -> DVec3 {
        self.report.active = 0;
        // A `dt` that is no number is none.
        let dt = dt.clamp(0.0, 1.0).max(0.0);
        let output = if force.is_finite() && state.position.is_finite() && state.velocity.is_finite() {
            self.stages(force, model_age, state, dt)
        } else {
            self.act(Stage::Finite);
            self.passivity.forget();
            self.trip()
        };
        self.output = output;
        self.budget.take(output, dt);
        self.close(dt);
        output
    }

    /// All stages after the first.
    fn stages(&mut self, asked: DVec3, model_age: f64, state: &DeviceState, dt: f64) -> DVec3 {
        let aged = self.age.pass(asked, model_age);
        self.act_if(Stage::Age, self.age.is_closing());
        if self.age.is_shut() {
            self.gain.restart();
        }
        if self.gain.is_moving() {
            self.passivity.forgive();
        }
        let passive = aged + self.passivity.damping(self.output, state.position, state.velocity, dt);
        self.act_if(Stage::Passivity, passive != aged);
        let most = self.budget.force_max(self.force_max, state.motor_temperature);
        let borne = if most < self.force_max { passive.clamp_length_max(most) } else { passive };
        self.act_if(Stage::Budget, borne != passive);
        let clamped = borne.clamp_length_max(self.force_max);
        self.act_if(Stage::Clamp, clamped != borne);

        // The ramp's own change of the force is part of what the slew limit allows:
        // |g' s' - g s| <= |s' - s| + |g' - g| |s|.
        let step = dt.min(STEP_MAX);
        self.gain.limit(self.buzz.share());
        let gain_step = self.gain.advance(step);
        let room = (self.settings.slew_max * step - gain_step.abs() * self.slewed.length()).max(0.0);
        let slewed = self.slewed + (clamped - self.slewed).clamp_length_max(room);
        // Rounding apart: lengths are rounded, and so is what is clamped to them.
        self.act_if(Stage::Slew, slewed.distance(clamped) > 1e-9);
        self.slewed = slewed;
        let ramped = slewed * self.gain.value();
        self.act_if(Stage::Ramp, self.gain.is_moving());

        let is_fast = self.speed.is_tripped(state, self.settings.speed_max, dt);
        self.act_if(Stage::Speed, is_fast);
        let is_shaken = self.buzz.watch(state.position, self.output, dt);
        self.act_if(Stage::Buzz, is_shaken);
        self.act_if(Stage::Device, state.is_muted);
        if is_fast || state.is_muted { self.trip() } else { ramped }
    }

    /// Nothing, at once; what follows comes by the ramp.
    fn trip(&mut self) -> DVec3 {
        self.gain.trip();
        self.slewed = DVec3::ZERO;
        DVec3::ZERO
    }

    fn act(&mut self, stage: Stage) {
        self.report.active |= stage.bit();
    }

    fn act_if(&mut self, stage: Stage, has_acted: bool) {
        if has_acted {
            self.act(stage);
        }
    }

    /// Counts what acted.
    fn close(&mut self, dt: f64) {
        for (i, stage) in Stage::ALL.into_iter().enumerate() {
            if self.report.is_active(stage) {
                self.report.ticks[i] += 1;
                self.report.episodes[i] += u32::from(self.quiet[i] > QUIET);
                self.quiet[i] = 0.0;
            } else {
                self.quiet[i] += dt;
            }
        }
        self.report.gain = self.gain.value();
        self.report.energy = self.passivity.energy();
        self.report.load = self.budget.load();
    }
}
