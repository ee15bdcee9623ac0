//! A whole loop in virtual time: operator, arm, servo and clay, through the channels that an app uses.

use super::super::device::simulated::{ArmSettings, HandPath, SimulatedArm};
use super::super::servo::{ClayServo, ClayServoEnds, ServoSample, ServoSettings};
use super::clay::ReferenceClay;
use super::frames::{ClockedClay, Frames};
use glam::DVec3;

/// A place beyond which an arm is lost \[m\].
const LOST: f64 = 0.2;

/// The parts of a loop.
#[derive(Clone, Debug)]
pub struct Rig {
    /// Arm and hand.
    pub arm: ArmSettings,
    /// Where the hand means to go.
    pub path: HandPath,
    /// The servo.
    pub servo: ServoSettings,
    /// The clay.
    pub clay: ReferenceClay,
    /// Its clock.
    pub frames: Frames,
}

/// A tick, and the clay's own force on its tool then.
#[derive(Clone, Copy, Debug)]
pub struct Tick {
    /// The servo's.
    pub sample: ServoSample,
    /// The clay's \[N\].
    pub truth: DVec3,
    /// Where the arm is \[m\].
    pub arm: DVec3,
}

/// What a run came to.
#[derive(Clone, Debug)]
pub struct Run {
    /// Its ticks.
    pub ticks: Vec<Tick>,
    /// Impulse of the clay on its tool over the run \[N s\].
    pub clay_impulse: DVec3,
    /// Whether the arm stayed where arms are.
    pub is_sound: bool,
}

/// How a force follows another, along y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fidelity {
    /// Pearson's correlation [-].
    pub correlation: f64,
    /// Root mean square of the difference over the range of the true force [-].
    pub error: f64,
    /// Slope of the least-squares line through the forces [-].
    pub slope: f64,
    /// Energy returned over energy put in on the tool's way, less the true one [-].
    pub returned: f64,
}

impl Rig {
    /// Runs for `duration` \[s\].
    pub fn run(&self, duration: f64) -> Run {
        let (mut servo, ends) = ClayServo::new(self.servo, 16);
        let ClayServoEnds { mut models, settings: _settings, mut samples } = ends;
        let mut arm = SimulatedArm::new(self.arm, self.path.clone());
        let mut clay = ClockedClay::new(self.clay, self.frames);
        let mut ticks = Vec::with_capacity((1.1 * duration / self.arm.period) as usize);
        let mut is_sound = true;
        while arm.time() < duration && is_sound {
            if let Some(model) = clay.arrived(arm.time()) {
                models.write(model);
            }
            arm.advance(&mut servo);
            while let Ok(sample) = samples.pop() {
                let truth = clay.follow(&sample);
                ticks.push(Tick { sample, truth, arm: arm.position() });
            }
            is_sound = arm.position().is_finite() && arm.position().length() < LOST;
        }
        Run { ticks, clay_impulse: clay.total, is_sound: is_sound && servo.lost() == 0 }
    }
}

impl Run {
    /// Root mean square of the arm's place about its mean from `from` on \[m\]; infinite for one that was lost.
    pub fn swing(&self, from: f64) -> f64 {
        let held: Vec<DVec3> = self.ticks.iter().filter(|t| t.sample.time >= from).map(|t| t.arm).collect();
        if !self.is_sound || held.is_empty() {
            return f64::INFINITY;
        }
        let count = held.len() as f64;
        let mean = held.iter().sum::<DVec3>() / count;
        (held.iter().map(|x| x.distance_squared(mean)).sum::<f64>() / count).sqrt()
    }

    /// The most energy that the servo had given more than it took \[J\]: the passivity observer of Hannaford
    /// and Ryu 2002, `E += f(n-1) . (x(n) - x(n-1))`.
    pub fn generated(&self) -> f64 {
        let (mut energy, mut least) = (0.0, 0.0f64);
        for pair in self.ticks.windows(2) {
            energy -= pair[0].sample.hand_force.dot(pair[1].sample.hand - pair[0].sample.hand);
            least = least.min(energy);
        }
        -least
    }

    /// Greatest change of the force from tick to tick, over a millisecond \[N/ms\].
    pub fn slew(&self) -> f64 {
        let slew = |pair: &[Tick]| {
            let [a, b] = [pair[0].sample, pair[1].sample];
            1e-3 * a.hand_force.distance(b.hand_force) / (b.time - a.time)
        };
        self.ticks.windows(2).map(slew).fold(0.0, f64::max)
    }

    /// Impulse that was felt \[N s\], each force held for its tick.
    pub fn felt_impulse(&self) -> DVec3 {
        self.ticks.windows(2).map(|p| p[0].sample.hand_force * (p[1].sample.time - p[0].sample.time)).sum()
    }

    /// How far the impulses of clay and hand are apart, of the clay's [-].
    pub fn imbalance(&self) -> f64 {
        (self.felt_impulse() - self.clay_impulse).length() / self.clay_impulse.length()
    }

    /// How the force felt follows the clay's own on its tool.
    pub fn fidelity(&self) -> Fidelity {
        let forces: Vec<[f64; 2]> = self.ticks.iter().map(|t| [t.truth.y, t.sample.hand_force.y]).collect();
        let count = forces.len() as f64;
        let mean = |i: usize| forces.iter().map(|f| f[i]).sum::<f64>() / count;
        let means = [mean(0), mean(1)];
        let product = |i: usize, j: usize| forces.iter().map(|f| (f[i] - means[i]) * (f[j] - means[j])).sum::<f64>();
        let (least, most) = forces.iter().fold((f64::MAX, f64::MIN), |(a, b), f| (a.min(f[0]), b.max(f[0])));
        let square = forces.iter().map(|f| (f[1] - f[0]).powi(2)).sum::<f64>() / count;
        Fidelity {
            correlation: product(0, 1) / (product(0, 0) * product(1, 1)).sqrt(),
            error: square.sqrt() / (most - least),
            slope: product(0, 1) / product(0, 0),
            returned: self.returned(|t| t.sample.hand_force, |t| t.sample.tool) - self.returned(|t| t.truth, |t| t.sample.tool),
        }
    }

    /// Energy that the hand gets back over what it put in [-]: the coupling's spring gives back all of its
    /// own.
    pub fn returned_to_hand(&self) -> f64 {
        self.returned(|t| t.sample.hand_force, |t| t.sample.hand)
    }

    /// Energy that a force gives back over what is put in [-].
    fn returned(&self, force: impl Fn(&Tick) -> DVec3, place: impl Fn(&Tick) -> DVec3) -> f64 {
        let mut work = [0.0; 2];
        for pair in self.ticks.windows(2) {
            let done = -0.5 * (force(&pair[0]) + force(&pair[1])).dot(place(&pair[1]) - place(&pair[0]));
            work[usize::from(done < 0.0)] += done.abs();
        }
        work[1] / work[0]
    }
}
