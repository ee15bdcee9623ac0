use super::super::{DeviceState, Servo};
use super::*;
use glam::DVec3;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A servo that is a function of place, and notes what it was told.
struct Wall {
    stiffness: f64,
    states: Vec<(DeviceState, f64)>,
}

impl Servo for Wall {
    fn tick(&mut self, state: &DeviceState, dt: f64) -> DVec3 {
        self.states.push((*state, dt));
        DVec3::Y * self.stiffness * (-state.position.y).max(0.0)
    }
}

fn run(settings: ArmSettings, path: HandPath, stiffness: f64, time: f64) -> (SimulatedArm, Vec<(DeviceState, f64)>) {
    let mut wall = Wall { stiffness, states: vec![] };
    let mut arm = SimulatedArm::new(settings, path);
    arm.run(&mut wall, time);
    (arm, wall.states)
}

#[test]
fn path_is_straight_between_its_points() {
    let path = HandPath::new([(1.0, DVec3::X), (0.5, DVec3::Z), (2.0, DVec3::Y)]);
    assert_eq!(path.at(0.0), [DVec3::X, DVec3::ZERO]);
    assert_eq!(path.at(1.5), [(DVec3::X + DVec3::Y) * 0.5, DVec3::Y - DVec3::X]);
    assert_eq!((path.at(9.0), path.duration()), ([DVec3::Y, DVec3::ZERO], 2.0));
    assert_eq!(HandPath::new([]).at(1.0), [DVec3::ZERO; 2]);
}

/// The hand's spring against the wall's, at rest: closed form.
#[test]
fn hand_and_wall_are_in_balance() {
    let path = HandPath::new([(0.0, DVec3::Y * 1e-3), (0.5, DVec3::Y * -6e-3)]);
    let fine = ArmSettings { resolution: 0.0, operator: Operator::STYLUS, ..ArmSettings::default() };
    let (arm, _) = run(fine, path, 600.0, 2.0);
    let expected = -6e-3 * 300.0 / (300.0 + 600.0);
    assert!((arm.position().y - expected).abs() < 1e-6, "{}", arm.position().y);
    assert!((arm.force().y + 600.0 * expected).abs() < 1e-3);
    let [put_in, returned] = arm.work();
    let stored = 0.5 * 600.0 * expected * expected;
    assert!((put_in - returned - stored).abs() < 0.05 * stored, "{put_in}, {returned}, {stored}");
}

/// Places on the encoders' grid, ticks at their period with their jitter.
#[test]
fn encoders_and_clock_are_as_set() {
    let path = HandPath::new([(0.0, DVec3::ZERO), (1.0, DVec3::new(0.05, 0.01, -0.03))]);
    let settings = ArmSettings { jitter: 0.2, ..ArmSettings::default() };
    let (arm, states) = run(settings, path, 0.0, 1.0);
    assert!((990..=1010).contains(&states.len()), "{}", states.len());
    let step = settings.resolution;
    assert!(states.iter().all(|(s, _)| (s.position / step - (s.position / step).round()).length() < 1e-6));
    let times: Vec<f64> = states.iter().skip(1).map(|(_, dt)| *dt).collect();
    let (least, most) = times.iter().fold((1.0f64, 0.0f64), |(a, b), t| (a.min(*t), b.max(*t)));
    assert!((0.78e-3..0.85e-3).contains(&least) && (1.15e-3..1.24e-3).contains(&most), "{least}, {most}");
    let told = states[900].0.velocity;
    assert!(told.distance(DVec3::new(0.05, 0.01, -0.03)) < 0.02, "{told}");
    assert!((arm.info().rate - 1000.0).abs() < 1e-9);
}

/// A force is late by the ticks that are set.
#[test]
fn forces_are_late() {
    struct Step(u32);
    impl Servo for Step {
        fn tick(&mut self, _: &DeviceState, _: f64) -> DVec3 {
            self.0 += 1;
            if self.0 > 10 { DVec3::X } else { DVec3::ZERO }
        }
    }
    for delay in 0..=3 {
        let settings = ArmSettings { delay, jitter: 0.0, ..ArmSettings::default() };
        let mut arm = SimulatedArm::new(settings, HandPath::new([]));
        let mut servo = Step(0);
        while arm.force() == DVec3::ZERO {
            arm.advance(&mut servo);
        }
        assert_eq!(servo.0, 11 + delay as u32);
    }
}

/// Coulomb friction holds a hand's light pull, and no more.
#[test]
fn friction_holds_what_it_can() {
    let end = |pull: f64| {
        let path = HandPath::new([(0.0, DVec3::ZERO), (1e-4, DVec3::X * pull / Operator::STYLUS.stiffness)]);
        let settings =
            ArmSettings { friction: 0.2, operator: Operator { damping: 0.0, ..Operator::STYLUS }, ..ArmSettings::default() };
        run(settings, path, 0.0, 1.0).0.position().x
    };
    assert_eq!(end(0.19), 0.0);
    assert!(end(0.4) > 2e-4, "{}", end(0.4));
}

/// A force that is none reaches no motor, and none is greater than the arm's.
#[test]
fn motors_are_kept_within_their_force() {
    struct Bad(f64);
    impl Servo for Bad {
        fn tick(&mut self, _: &DeviceState, _: f64) -> DVec3 {
            DVec3::splat(self.0)
        }
    }
    for (force, expected) in [(f64::NAN, 0.0), (f64::INFINITY, 0.0), (1e3, 3.3)] {
        let mut arm = SimulatedArm::new(ArmSettings::default(), HandPath::new([]));
        arm.run(&mut Bad(force), 5e-3);
        assert!((arm.force().length() - expected).abs() < 1e-9 && arm.position().is_finite());
    }
}

/// In real time the same arm ticks on a thread of its own, and comes back when it is stopped.
#[test]
fn running_arm_ticks_and_comes_back() {
    struct Count(Arc<AtomicU64>);
    impl Servo for Count {
        fn tick(&mut self, _: &DeviceState, _: f64) -> DVec3 {
            self.0.fetch_add(1, Ordering::Relaxed);
            DVec3::ZERO
        }
    }
    let count = Arc::new(AtomicU64::new(0));
    let arm = SimulatedArm::new(ArmSettings::default(), HandPath::new([]));
    let running = arm.start(Box::new(Count(Arc::clone(&count)))).expect("a thread");
    while count.load(Ordering::Relaxed) < 20 {
        std::thread::yield_now();
    }
    let timing = running.timing();
    assert!(timing.late_mean <= timing.late_max, "{timing:?}");
    let ticked = count.load(Ordering::Relaxed);
    assert!(timing.ticks <= ticked + 5, "a round of the thread is a tick: {timing:?}, {ticked}");
    let arm = running.stop().expect("the arm");
    assert!(arm.time() > 0.015, "virtual time is led by the clock: {}", arm.time());
    let ticks = count.load(Ordering::Relaxed);
    std::thread::yield_now();
    assert_eq!(count.load(Ordering::Relaxed), ticks);
}
