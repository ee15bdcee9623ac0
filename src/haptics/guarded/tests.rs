use super::super::safety::Stage;
use super::*;
use assert_no_alloc::assert_no_alloc;
use glam::DMat3;

const PERIOD: f64 = 1e-3;

fn info() -> DeviceInfo {
    DeviceInfo {
        name: "bench".into(),
        serial: String::new(),
        freedoms: [6, 3],
        force_max: 3.3,
        continuous_force_max: 0.88,
        stiffness_max: 400.0,
        damping_max: 4.0,
        workspace: [DVec3::splat(-0.1), DVec3::splat(0.1)],
        resolution: 55e-6,
        rate: 1000.0,
        buttons: 2,
    }
}

/// Elastic clay below the origin.
fn clay(frame: u64, stamp: f64) -> ContactModel {
    ContactModel {
        frame,
        stamp,
        rate: 1.0,
        normal: DVec3::Y,
        stiffness: DMat3::from_diagonal(DVec3::splat(500.0)),
        ..ContactModel::NONE
    }
}

/// A servo in a device's hand, and the tick that it is at.
struct Bench {
    servo: GuardedServo,
    ends: GuardedEnds,
    orders: HandOrders,
    tick: u32,
    buttons: u32,
}

impl Bench {
    fn new(settings: ServoSettings) -> Self {
        let orders = HandOrders { clutch: Some(1), ..HandOrders::default() };
        let (mut servo, ends) = GuardedServo::new(settings, orders, 4000);
        servo.begin(&info());
        Self { servo, ends, orders, tick: 0, buttons: 0 }
    }

    fn order(&mut self, orders: HandOrders) {
        self.orders = orders;
        self.ends.orders.write(orders);
    }

    /// So many ticks at a place with a clay that has a frame in every eleventh; the last force.
    fn hold(&mut self, position: DVec3, ticks: u32) -> DVec3 {
        let mut force = DVec3::ZERO;
        for _ in 0..ticks {
            self.tick += 1;
            let time = f64::from(self.tick) * PERIOD;
            if self.tick.is_multiple_of(11) {
                self.ends.clay.models.write(clay(u64::from(self.tick), time));
            }
            let (velocity, motor_temperature, is_muted) = (DVec3::ZERO, 0.0, false);
            let (rotation, buttons) = (glam::DQuat::IDENTITY, self.buttons);
            let state = DeviceState { time, position, rotation, velocity, buttons, motor_temperature, is_muted };
            force = assert_no_alloc(|| self.servo.tick(&state, PERIOD));
        }
        force
    }

    fn pulse(&mut self) -> HandPulse {
        self.ends.pulses.read().expect("a tick")
    }
}

const DEEP: DVec3 = DVec3::new(0.0, -2e-3, 0.0);

/// Servo and stages in one tick, without allocation; samples have the force that the hand got, in the world.
#[test]
fn hand_gets_what_the_stages_leave_and_samples_say_so() {
    let turn = glam::DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
    let placement = super::super::servo::Placement { rotation: turn, ..Default::default() };
    let mut bench = Bench::new(ServoSettings { placement, ..ServoSettings::default() });
    // The device's own x axis is the world's y.
    let above = turn.conjugate() * (DVec3::Y * 1e-3);
    assert_eq!(bench.hold(above, 100), DVec3::ZERO);
    let mut greatest: f64 = 0.0;
    for step in 0..20 {
        let force = bench.hold(above.lerp(turn.conjugate() * DEEP, f64::from(step) / 19.0), 1);
        greatest = greatest.max(force.length());
        let told = bench.pulse().sample.hand_force;
        assert!((told - turn * force).length() < 1e-12, "{told} is not {force} in the world");
    }
    assert!(greatest < 0.2, "it comes by the ramp: {greatest} N");
    let force = bench.hold(turn.conjugate() * DEEP, 900);
    assert!(force.x > 0.3 && force.y.abs() < 1e-6, "{force}");
    let pulse = bench.pulse();
    assert!((pulse.safety.gain - 1.0).abs() < 1e-9 && pulse.safety.ticks(Stage::Ramp) > 500);
    assert_eq!((pulse.timing.ticks, pulse.devices, pulse.lost), (1020, 1, 0));
    let mut samples = 0;
    while bench.ends.clay.samples.pop().is_ok() {
        samples += 1;
    }
    assert_eq!(samples, 1020);
}

/// Off, force is gone within 20 ms and stays so; on, it comes back; after a restart it goes and comes by
/// itself.
#[test]
fn force_goes_when_asked_and_comes_back_slowly() {
    let mut bench = Bench::new(ServoSettings::default());
    bench.hold(DVec3::Y * 1e-3, 20);
    let full = bench.hold(DEEP, 1000).y;
    assert!(full > 0.3, "{full} N");
    bench.order(HandOrders { has_force: false, ..bench.orders });
    assert!(bench.hold(DEEP, 10).y > 0.0, "no step");
    assert_eq!(bench.hold(DEEP, 11), DVec3::ZERO);
    assert_eq!(bench.hold(DEEP, 500), DVec3::ZERO);
    bench.order(HandOrders { has_force: true, ..bench.orders });
    assert!(bench.hold(DEEP, 50).y < 0.1 * full);
    assert!((bench.hold(DEEP, 900).y - full).abs() < 0.02 * full);
    bench.order(HandOrders { restarts: 1, ..bench.orders });
    assert!(bench.hold(DEEP, 21).y < 0.01 * full);
    assert!((bench.hold(DEEP, 900).y - full).abs() < 0.02 * full);
}

/// While the clutch is held the tool stands and the hand feels nothing; let go of, the tool goes on from
/// where it stood, without a jump.
#[test]
fn clutch_lets_the_hand_go_without_the_tool() {
    let mut bench = Bench::new(ServoSettings::default());
    bench.hold(DVec3::Y * 1e-3, 20);
    assert!(bench.hold(DEEP, 1000).y > 0.3);
    let stood = bench.pulse().sample.hand;
    bench.buttons = 2;
    bench.hold(DEEP, 25);
    for step in 0..50 {
        let force = bench.hold(DEEP + DVec3::X * 1e-4 * f64::from(step), 1);
        assert_eq!((force, bench.pulse().sample.hand, bench.pulse().is_clutched), (DVec3::ZERO, stood, true));
    }
    bench.buttons = 0;
    let there = DEEP + DVec3::X * 49e-4;
    bench.hold(there, 1);
    assert!(bench.pulse().sample.hand.distance(stood) < 1e-15 && !bench.pulse().is_clutched);
    assert!(bench.hold(there + DVec3::Z * 1e-3, 900).y > 0.3);
    assert!(bench.pulse().sample.hand.distance(stood + DVec3::Z * 1e-3) < 1e-15);
    // The other button is no clutch.
    bench.buttons = 1;
    bench.hold(there, 1);
    assert!(!bench.pulse().is_clutched);
}

/// A pose that is no number is no sample and gives no force; what comes after it is as if it had not been.
#[test]
fn poses_that_are_no_numbers_leave_no_trace() {
    let mut bench = Bench::new(ServoSettings::default());
    bench.hold(DVec3::Y * 1e-3, 20);
    let full = bench.hold(DEEP, 1000).y;
    assert_eq!(bench.hold(DVec3::NAN, 3), DVec3::ZERO);
    assert!(bench.hold(DEEP, 1).y < 2e-3, "it comes by the ramp");
    assert_eq!(bench.pulse().safety.ticks(Stage::Finite), 3);
    assert!((bench.hold(DEEP, 1000).y - full).abs() < 0.02 * full);
}

/// Another device begins without force and without what was known of the hand; counts and the switch stay.
#[test]
fn another_device_begins_anew() {
    let mut bench = Bench::new(ServoSettings::default());
    bench.hold(DVec3::Y * 1e-3, 20);
    assert!(bench.hold(DEEP, 1000).y > 0.3);
    bench.servo.begin(&info());
    assert_eq!(bench.hold(DVec3::new(0.05, 0.05, 0.0), 1), DVec3::ZERO);
    let pulse = bench.pulse();
    assert_eq!((pulse.devices, pulse.sample.clay_force, pulse.sample.age), (2, DVec3::ZERO, f64::INFINITY));
    assert!(pulse.safety.ticks(Stage::Ramp) > 500 && pulse.timing.ticks == 1021, "{pulse:?}");
}

/// Ticks a millisecond apart, every tenth two, are told as such.
#[test]
fn timing_is_that_of_the_last_spell() {
    let mut meter = Meter::default();
    let (mut at, mut told) = (0.0, TickTiming::default());
    for i in 0..1200 {
        told = meter.tick(at, at + 2e-5);
        at += if i % 10 == 0 { 2e-3 } else { 1e-3 };
    }
    assert!((told.rate - 1000.0 / 1.1).abs() < 2.0 && (told.jitter - 3e-4).abs() < 1e-5, "{told:?}");
    assert!((told.interval_max - 2e-3).abs() < 1e-9 && (told.compute_mean - 2e-5).abs() < 1e-9, "{told:?}");
    assert_eq!(told.ticks, 1200);
}
