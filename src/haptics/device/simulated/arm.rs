//! The equations of motion of arm and hand, and what the arm's encoders see of them.

use super::super::{DeviceInfo, DeviceState, Servo};
use super::path::HandPath;
use glam::{DQuat, DVec3};

/// Step of the equations of motion \[s\]: 50 kHz.
const STEP: f64 = 2e-5;

/// Speed below which Coulomb friction holds \[m/s\].
const REST: f64 = 1e-4;

/// Greatest delay of the force, in ticks.
pub const DELAY_MAX: usize = 8;

/// Time constant of the velocity that the arm says \[s\]: 57 Hz.
const VELOCITY_TIME: f64 = 2.8e-3;

/// An operator's hand on the stylus: its mass goes with the arm's, a spring and a damper draw both along its
/// way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Operator {
    /// Mass that moves with the arm \[kg\].
    pub mass: f64,
    /// Damping \[N s/m\].
    pub damping: f64,
    /// Stiffness \[N/m\].
    pub stiffness: f64,
}

impl Operator {
    /// The device let go, but for a trace of an elastic band.
    pub const BARE: Self = Self { mass: 0.005, damping: 0.1, stiffness: 20.0 };
    /// Two finger tips (of the order that Hajian and Howe measured, 1997).
    pub const PINCH: Self = Self { mass: 0.006, damping: 2.0, stiffness: 200.0 };
    /// A pen's grip (of the order of Fu and Cavusoglu 2012).
    pub const STYLUS: Self = Self { mass: 0.05, damping: 4.5, stiffness: 300.0 };
    /// A fist.
    pub const FIRM: Self = Self { mass: 0.15, damping: 10.0, stiffness: 800.0 };
    /// All of them, with their names.
    pub const ALL: [(&'static str, Self); 4] =
        [("bare", Self::BARE), ("pinch", Self::PINCH), ("stylus", Self::STYLUS), ("firm", Self::FIRM)];
}

/// An arm of the size of a Touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArmSettings {
    /// Apparent mass at the tip \[kg\].
    pub mass: f64,
    /// Viscous friction \[N s/m\].
    pub damping: f64,
    /// Coulomb friction \[N\].
    pub friction: f64,
    /// Least motion that the encoders see \[m\].
    pub resolution: f64,
    /// Time of a tick \[s\].
    pub period: f64,
    /// How far a tick's time may be off, of its period [-].
    pub jitter: f64,
    /// Ticks that a force is late.
    pub delay: usize,
    /// Greatest force \[N\].
    pub force_max: f64,
    /// Whose hand holds it.
    pub operator: Operator,
}

impl Default for ArmSettings {
    /// 45 g, 55 um and 3.3 N are the Touch's; viscous friction is what such arms have, Coulomb friction
    /// (0.1 N) is left out: it would steady them.
    fn default() -> Self {
        Self {
            mass: 0.045,
            damping: 0.2,
            friction: 0.0,
            resolution: 55e-6,
            period: 1e-3,
            jitter: 0.05,
            delay: 1,
            force_max: 3.3,
            operator: Operator::PINCH,
        }
    }
}

/// An arm in a hand.
#[derive(Clone, Debug)]
pub struct SimulatedArm {
    settings: ArmSettings,
    path: HandPath,
    steps: u64,
    position: DVec3,
    velocity: DVec3,
    next_tick: f64,
    /// Forces on their way to the motors, the one at work first.
    forces: [DVec3; DELAY_MAX + 1],
    sensed: DVec3,
    sensed_velocity: DVec3,
    sensed_time: f64,
    random: u64,
    work: [f64; 2],
}

impl SimulatedArm {
    /// An arm at the start of the hand's way.
    pub fn new(settings: ArmSettings, path: HandPath) -> Self {
        let position = path.at(0.0)[0];
        Self {
            settings: ArmSettings { delay: settings.delay.min(DELAY_MAX), ..settings },
            path,
            steps: 0,
            position,
            velocity: DVec3::ZERO,
            next_tick: 0.0,
            forces: [DVec3::ZERO; DELAY_MAX + 1],
            sensed: position,
            sensed_velocity: DVec3::ZERO,
            sensed_time: 0.0,
            random: 88_172_645_463_325_252,
            work: [0.0; 2],
        }
    }

    /// What it says of itself.
    pub fn info(&self) -> DeviceInfo {
        DeviceInfo {
            name: "simulated arm".into(),
            serial: String::new(),
            freedoms: [6, 3],
            force_max: self.settings.force_max,
            continuous_force_max: 0.88,
            stiffness_max: 400.0,
            damping_max: 4.0,
            workspace: [DVec3::new(-0.08, -0.06, -0.035), DVec3::new(0.08, 0.06, 0.035)],
            resolution: self.settings.resolution,
            rate: 1.0 / self.settings.period,
            buttons: 2,
        }
    }

    /// Virtual time since the start \[s\].
    pub fn time(&self) -> f64 {
        self.steps as f64 * STEP
    }

    /// Where the tip is \[m\], as no encoder sees it.
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// The force that the motors make \[N\].
    pub fn force(&self) -> DVec3 {
        self.forces[0]
    }

    /// Work of the hand against the motors, and of the motors on the hand \[J\].
    pub fn work(&self) -> [f64; 2] {
        self.work
    }

    /// Ticks that are due until `time` \[s\], each with the motion up to it.
    pub fn run(&mut self, servo: &mut dyn Servo, time: f64) {
        while self.time() < time {
            self.advance(servo);
        }
    }

    /// One step of the motion, with the tick before it if one is due.
    pub fn advance(&mut self, servo: &mut dyn Servo) {
        if self.time() >= self.next_tick {
            let dt = self.time() - self.sensed_time;
            let state = self.sense();
            // A driver has the time of a tick from its own clock, and none before the first one.
            let force = servo.tick(&state, if self.steps == 0 { self.settings.period } else { dt });
            self.send(force);
            self.next_tick += self.settings.period * (1.0 + self.settings.jitter * (2.0 * self.unit() - 1.0));
        }
        self.step();
        self.steps += 1;
    }

    /// What the encoders see.
    fn sense(&mut self) -> DeviceState {
        let step = self.settings.resolution;
        let (time, before) = (self.time(), self.sensed);
        self.sensed = if step > 0.0 { (self.position / step).round() * step } else { self.position };
        let dt = time - self.sensed_time;
        if dt > 0.0 {
            let share = 1.0 - (-dt / VELOCITY_TIME).exp();
            self.sensed_velocity += share * ((self.sensed - before) / dt - self.sensed_velocity);
        }
        self.sensed_time = time;
        DeviceState {
            time,
            position: self.sensed,
            rotation: DQuat::IDENTITY,
            velocity: self.sensed_velocity,
            buttons: 0,
            motor_temperature: 0.0,
            is_muted: false,
        }
    }

    /// A force for the motors, `delay` ticks from now.
    fn send(&mut self, force: DVec3) {
        let delay = self.settings.delay;
        if delay > 0 {
            self.forces.copy_within(1..=delay, 0);
        }
        let force = if force.is_finite() { force } else { DVec3::ZERO };
        self.forces[delay] = force.clamp_length_max(self.settings.force_max);
    }

    /// Newton's law by the semi-implicit rule of Euler.
    fn step(&mut self) {
        let ArmSettings { mass, damping, friction, operator, .. } = self.settings;
        let [place, velocity] = self.path.at(self.time());
        let drawn = operator.stiffness * (place - self.position) + operator.damping * (velocity - self.velocity);
        let net = drawn + self.forces[0] - damping * self.velocity;
        let speed = self.velocity.length();
        let rubbed = if speed < REST { net.clamp_length_max(friction) } else { self.velocity * (friction / speed) };
        let next = self.velocity + (net - rubbed) * (STEP / (mass + operator.mass));
        // Friction ends a motion and turns none round.
        let is_stopped = speed > 0.0 && next.dot(self.velocity) < 0.0 && net.length() <= friction;
        self.velocity =
            if is_stopped || (speed < REST && net.length() <= friction && friction > 0.0) { DVec3::ZERO } else { next };
        self.position += self.velocity * STEP;
        let work = -self.forces[0].dot(self.velocity) * STEP;
        self.work[usize::from(work < 0.0)] += work.abs();
    }

    /// A number of [0, 1), by xorshift (Marsaglia 2003).
    fn unit(&mut self) -> f64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        (self.random >> 11) as f64 / (1u64 << 53) as f64
    }
}
