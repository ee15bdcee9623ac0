//! A hand's whole tick: force of the clay, the clutch, the stages of safety, and what is told of it.

use super::clock;
use super::device::{DeviceInfo, DeviceState, Servo};
use super::model::ContactModel;
use super::safety::{SafetyChain, SafetyReport, SafetySettings};
use super::servo::{ClayServo, ClayServoEnds, ServoSample, ServoSettings};
use glam::DVec3;

/// What an app asks of a hand's loop, beside [`ServoSettings`]. Of fixed size: it is handed over without
/// waiting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandOrders {
    /// Whether there is force. Off, it is gone within 20 ms.
    pub has_force: bool,
    /// Counts the times that force is to go and come back slowly.
    pub restarts: u32,
    /// The button that is the clutch; none without one.
    pub clutch: Option<u32>,
    /// Limits of the stages of safety.
    pub safety: SafetySettings,
}

impl Default for HandOrders {
    fn default() -> Self {
        Self { has_force: true, restarts: 0, clutch: None, safety: SafetySettings::default() }
    }
}

/// How well a device keeps time, by the host's clock, over the last half second or so.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TickTiming {
    /// Ticks so far.
    pub ticks: u64,
    /// Counts the spells of half a second that were measured: what follows is of the latest.
    pub spell: u64,
    /// Ticks of that spell.
    pub spell_ticks: u32,
    /// Ticks a second \[Hz\].
    pub rate: f64,
    /// Deviation of the time between two ticks from its mean, as root of its mean square \[s\].
    pub jitter: f64,
    /// Greatest time between two ticks \[s\].
    pub interval_max: f64,
    /// From the pose to its force, as far as it is the host's: what a tick takes, on average \[s\].
    pub compute_mean: f64,
    /// The same at most \[s\].
    pub compute_max: f64,
}

/// The latest tick, for who looks now and then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandPulse {
    /// What the device sensed.
    pub state: DeviceState,
    /// What came of it. Its force on the hand is that behind the stages of safety.
    pub sample: ServoSample,
    /// What the stages of safety did.
    pub safety: SafetyReport,
    /// How the device keeps time.
    pub timing: TickTiming,
    /// Whether the hand moves without the tool.
    pub is_clutched: bool,
    /// Counts the devices that took the loop up.
    pub devices: u32,
    /// Samples that found no room so far.
    pub lost: u64,
}

/// The ends of a [`GuardedServo`]'s channels.
pub struct GuardedEnds {
    /// Clay frames, settings, samples.
    pub clay: ClayServoEnds,
    /// Orders.
    pub orders: triple_buffer::Input<HandOrders>,
    /// The latest tick; none before the first.
    pub pulses: triple_buffer::Output<Option<HandPulse>>,
}

/// [`ClayServo`] behind a [`SafetyChain`]: what a device is to run.
pub struct GuardedServo {
    clay: ClayServo,
    /// None before a device has taken the servo up: no force.
    chain: Option<SafetyChain>,
    orders: triple_buffer::Output<HandOrders>,
    pulses: triple_buffer::Input<Option<HandPulse>>,
    obeyed: HandOrders,
    clutch: Clutch,
    meter: Meter,
    devices: u32,
}

impl GuardedServo {
    /// A servo whose ring holds `capacity` samples: 2000 are two seconds.
    pub fn new(settings: ServoSettings, orders: HandOrders, capacity: usize) -> (Self, GuardedEnds) {
        let (clay, clay_ends) = ClayServo::new(settings, capacity);
        let (orders_in, orders_out) = triple_buffer::triple_buffer(&orders);
        let (pulses_in, pulses) = triple_buffer::triple_buffer(&None);
        let servo = Self {
            clay,
            chain: None,
            orders: orders_out,
            pulses: pulses_in,
            obeyed: orders,
            clutch: Clutch::default(),
            meter: Meter::default(),
            devices: 0,
        };
        (servo, GuardedEnds { clay: clay_ends, orders: orders_in, pulses })
    }

    /// Hands the latest orders on, where they have changed.
    fn obey(&mut self) {
        if !self.orders.update() {
            return;
        }
        let now = *self.orders.output_buffer();
        let before = std::mem::replace(&mut self.obeyed, now);
        let Some(chain) = &mut self.chain else { return };
        if now.safety != before.safety {
            chain.configure(now.safety);
        }
        if now.has_force != before.has_force {
            chain.switch(now.has_force);
        }
        if now.restarts != before.restarts {
            chain.restart();
        }
    }

    /// The clay's part of a tick. A pose that is no number is none: nothing follows it, and the force is none
    /// either.
    fn feel(&mut self, state: &DeviceState, dt: f64) -> (Option<ServoSample>, DVec3) {
        if !(state.position.is_finite() && state.rotation.is_finite()) {
            return (None, DVec3::NAN);
        }
        let button = self.obeyed.clutch.is_some_and(|bit| state.buttons.checked_shr(bit).is_some_and(|b| b & 1 == 1));
        let (position, has_turned) = self.clutch.pass(state.position, button);
        if has_turned && let Some(chain) = &mut self.chain {
            chain.restart();
        }
        let sample = self.clay.step(&DeviceState { position, ..*state }, dt);
        let force = if self.clutch.is_held() { DVec3::ZERO } else { self.clay.to_device(sample.hand_force) };
        (Some(sample), force)
    }
}

impl Servo for GuardedServo {
    fn begin(&mut self, info: &DeviceInfo) {
        match &mut self.chain {
            Some(chain) => chain.begin(info),
            None => {
                let mut chain = SafetyChain::new(self.obeyed.safety, info);
                chain.switch(self.obeyed.has_force);
                self.chain = Some(chain);
            }
        }
        // Another hand, somewhere else.
        self.clay.forget();
        let told = TickTiming { spell: self.meter.told.spell, ..TickTiming::default() };
        (self.clutch, self.meter) = (Clutch::default(), Meter { ticks: self.meter.ticks, told, ..Meter::default() });
        self.devices += 1;
    }

    fn tick(&mut self, state: &DeviceState, dt: f64) -> DVec3 {
        let began = clock::now();
        self.obey();
        let (sample, asked) = self.feel(state, dt);
        let Some(chain) = &mut self.chain else { return DVec3::ZERO };
        let age = sample.map_or(f64::INFINITY, |sample| sample.age);
        let force = chain.apply(asked, age, state, dt);
        let safety = *chain.report();
        if let Some(mut sample) = sample {
            sample.hand_force = self.clay.to_world(force);
            self.clay.push(sample);
            let timing = self.meter.tick(began, clock::now());
            self.pulses.write(Some(HandPulse {
                state: *state,
                sample,
                safety,
                timing,
                is_clutched: self.clutch.is_held(),
                devices: self.devices,
                lost: self.clay.lost(),
            }));
        }
        force
    }
}

/// Lets a hand move on without its tool, as one lifts a mouse.
#[derive(Clone, Copy, Debug, Default)]
struct Clutch {
    /// What the tool's place is off the hand's, in the device's frame \[m\].
    offset: DVec3,
    /// Where the tool stands while the button is held \[m\].
    held: Option<DVec3>,
}

impl Clutch {
    /// Where the loop is to take the hand for, and whether the clutch was pressed or let go of in this tick.
    fn pass(&mut self, hand: DVec3, is_pressed: bool) -> (DVec3, bool) {
        match (self.held, is_pressed) {
            (None, false) => (hand + self.offset, false),
            (None, true) => {
                let here = hand + self.offset;
                self.held = Some(here);
                (here, true)
            }
            (Some(here), true) => (here, false),
            (Some(here), false) => {
                (self.offset, self.held) = (here - hand, None);
                (here, true)
            }
        }
    }

    fn is_held(&self) -> bool {
        self.held.is_some()
    }
}

/// How long ticks are counted together \[s\]: some hundreds.
const SPELL: f64 = 0.5;

/// Measures ticks.
#[derive(Clone, Copy, Debug, Default)]
struct Meter {
    ticks: u64,
    /// When the spell began, and the last tick \[s\].
    began: Option<f64>,
    last: f64,
    /// Of the spell: intervals, the sum of their squares, the greatest.
    count: u32,
    squares: f64,
    longest: f64,
    compute: f64,
    compute_max: f64,
    told: TickTiming,
}

impl Meter {
    /// Counts a tick that began and ended at these times \[s\].
    fn tick(&mut self, began: f64, ended: f64) -> TickTiming {
        self.ticks += 1;
        let compute = ended - began;
        let Some(start) = self.began else {
            (self.began, self.last) = (Some(began), began);
            return TickTiming { ticks: self.ticks, ..self.told };
        };
        let interval = began - std::mem::replace(&mut self.last, began);
        self.count += 1;
        self.squares += interval * interval;
        self.longest = self.longest.max(interval);
        self.compute += compute;
        self.compute_max = self.compute_max.max(compute);
        if began - start >= SPELL {
            let count = f64::from(self.count);
            let mean = (began - start) / count;
            self.told = TickTiming {
                ticks: self.ticks,
                spell: self.told.spell + 1,
                spell_ticks: self.count,
                rate: 1.0 / mean,
                jitter: (self.squares / count - mean * mean).max(0.0).sqrt(),
                interval_max: self.longest,
                compute_mean: self.compute / count,
                compute_max: self.compute_max,
            };
            *self = Self { ticks: self.ticks, began: Some(began), last: began, told: self.told, ..Self::default() };
        }
        TickTiming { ticks: self.ticks, ..self.told }
    }
}

/// A model that says that nothing is known any more of clay that was, at `stamp` \[s\]: what is felt of it
/// fades.
pub fn gone(stamp: f64) -> ContactModel {
    ContactModel { stamp, rate: 1.0, ..ContactModel::NONE }
}

#[cfg(test)]
mod tests;
