use super::*;
use crate::haptics::model::NearParticle;
use crate::haptics::reference::bed::{Bed, square_tool};
use crate::haptics::reference::clay::{Law, ReferenceClay, flat_tool};
use assert_no_alloc::assert_no_alloc;
use glam::DMat3;

const PERIOD: f64 = 1e-3;
/// A coupling that is none.
const RIGID: Coupling = Coupling { stiffness: f64::INFINITY, damping: 0.0, stiffness_max: f64::INFINITY };
const SPRING: Coupling = Coupling { stiffness: 400.0, damping: 0.0, stiffness_max: 500.0 };

fn settings(coupling: Coupling) -> ServoSettings {
    ServoSettings { coupling, ..ServoSettings::default() }
}

/// A level surface at y = 0, read by a tool on it.
fn level(stiffness: f64, yield_force: f64, friction: f64) -> ContactModel {
    ContactModel {
        frame: 1,
        rate: 1.0,
        normal: DVec3::Y,
        stiffness: DMat3::from_diagonal(DVec3::splat(stiffness)),
        yield_force,
        friction,
        density: 1.0,
        ..ContactModel::NONE
    }
}

/// A loop of force and the tick that it is at.
struct Bench {
    force: ForceLoop,
    tick: u32,
}

impl Bench {
    fn new(settings: ServoSettings) -> Self {
        Self { force: ForceLoop::new(settings), tick: 0 }
    }

    fn time(&self) -> f64 {
        f64::from(self.tick) * PERIOD
    }

    fn at(&mut self, position: DVec3) -> ServoSample {
        self.tick += 1;
        let rotation = DQuat::IDENTITY;
        let (velocity, buttons, motor_temperature, is_muted) = (DVec3::ZERO, 0, 0.0, false);
        let state = DeviceState { time: self.time(), position, rotation, velocity, buttons, motor_temperature, is_muted };
        self.force.step(&state, PERIOD)
    }

    /// Straight to a place in some ticks, and the sample there.
    fn go(&mut self, from: DVec3, to: DVec3, ticks: u32) -> ServoSample {
        for i in 1..ticks {
            self.at(from.lerp(to, f64::from(i) / f64::from(ticks)));
        }
        self.at(to)
    }
}

const ABOVE: DVec3 = DVec3::new(0.0, 1e-3, 0.0);

fn deep(depth: f64) -> DVec3 {
    DVec3::NEG_Y * depth
}

#[track_caller]
fn near(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value} is not {expected}");
}

/// Two springs in series, and the tool where both press alike.
#[test]
fn coupling_and_clay_are_in_series() {
    let mut bench = Bench::new(settings(SPRING));
    bench.at(ABOVE);
    bench.force.receive(&level(1000.0, f64::INFINITY, 0.0));
    let sample = bench.go(ABOVE, deep(2e-3), 40);
    near(sample.clay_force.y, 2e-3 / (1.0 / 400.0 + 1.0 / 1000.0), 1e-12);
    near(-sample.tool.y * 1000.0, sample.clay_force.y, 1e-12);
    let open = bench.go(deep(2e-3), ABOVE, 40);
    assert_eq!((open.clay_force, open.tool, open.is_touching), (DVec3::ZERO, ABOVE, false));
}

/// Clay that yields presses with its yield force at the tool's depth, and is left with a dent.
#[test]
fn yielding_clay_leaves_a_dent() {
    let mut bench = Bench::new(settings(RIGID));
    bench.at(ABOVE);
    bench.force.receive(&ContactModel { yield_slope: 50.0, ..level(1000.0, 0.2, 0.0) });
    let bottom = bench.go(ABOVE, deep(2e-3), 40);
    near(bottom.clay_force.y, 0.2 + 50.0 * 2e-3, 1e-12);
    // The spring of 1000 N/m is stretched by 0.3 mm: it is free at 1.7 mm.
    let way_out = bench.go(deep(2e-3), deep(1.8e-3), 10);
    near(way_out.clay_force.y, 0.1, 1e-12);
    assert_eq!(bench.go(deep(1.8e-3), deep(1.6e-3), 10).clay_force, DVec3::ZERO);
    near(bench.go(deep(1.6e-3), deep(1.75e-3), 10).clay_force.y, 0.05, 1e-12);
    // Behind a spring the depth that counts is the tool's.
    let mut soft = Bench::new(settings(SPRING));
    soft.at(ABOVE);
    soft.force.receive(&ContactModel { yield_slope: 50.0, ..level(1000.0, 0.2, 0.0) });
    let bottom = soft.go(ABOVE, deep(4e-3), 40);
    near(bottom.clay_force.y, 0.2 - 50.0 * bottom.tool.y, 1e-12);
}

#[test]
fn friction_stays_in_its_cone() {
    let mut bench = Bench::new(settings(RIGID));
    bench.at(ABOVE);
    bench.force.receive(&level(1000.0, f64::INFINITY, 0.5));
    let pressed = bench.go(ABOVE, deep(1e-3), 40);
    let stuck = bench.go(deep(1e-3), deep(1e-3) + DVec3::X * 2e-4, 5);
    near(stuck.clay_force.x, -0.2, 1e-12);
    let slid = bench.go(deep(1e-3) + DVec3::X * 2e-4, deep(1e-3) + DVec3::X * 3e-3, 20);
    near(slid.clay_force.x, -0.5 * pressed.clay_force.y, 1e-12);
    let back = bench.go(deep(1e-3) + DVec3::X * 3e-3, deep(1e-3) + DVec3::X * 2.5e-3, 20);
    near(back.clay_force.x, 0.0, 1e-9);
}

/// A frame may change stiffness, yield force, friction and normal: at the same place no tick's force jumps.
#[test]
fn frames_change_no_force_at_once() {
    let mut bench = Bench::new(settings(SPRING));
    bench.at(ABOVE);
    bench.force.receive(&level(1000.0, 2.0, 0.5));
    let mut last = bench.go(ABOVE, deep(2e-3) + DVec3::X * 5e-4, 40);
    let tilted = DVec3::new(0.3, 1.0, 0.1).normalize();
    let frames =
        [(300.0, 2.0, 0.5, DVec3::Y), (300.0, 2.0, 0.5, tilted), (2000.0, 0.3, 0.1, DVec3::Y), (2000.0, 0.3, 0.1, DVec3::ZERO)];
    for ((stiffness, yield_force, friction, normal), frame) in frames.into_iter().zip(2..) {
        let span = [bench.time() - 5.0 * PERIOD, bench.time()];
        let force = if normal == DVec3::ZERO { DVec3::ZERO } else { last.clay_force };
        let model = level(stiffness, yield_force, friction);
        bench.force.receive(&ContactModel { frame, span, force, normal, position: last.tool, ..model });
        for _ in 0..11 {
            let next = bench.at(last.hand);
            let change = next.clay_force.distance(last.clay_force);
            // The yield force alone goes down by 0.155 N a tick.
            assert!(change < 0.16, "frame {frame}: {change} N in a tick");
            last = next;
        }
    }
    assert_eq!(last.clay_force, DVec3::ZERO, "no clay is near any more");
}

/// A force turns with its normal, and is as great as before.
#[test]
fn force_turns_with_the_normal() {
    let mut bench = Bench::new(settings(SPRING));
    bench.at(ABOVE);
    bench.force.receive(&level(1000.0, f64::INFINITY, 0.0));
    let before = bench.go(ABOVE, deep(2e-3), 60);
    let normal = DVec3::new(0.5, 1.0, 0.0).normalize();
    let span = [bench.time() - 10.0 * PERIOD, bench.time()];
    let force = before.clay_force.length() * normal;
    bench.force.receive(&ContactModel { frame: 2, span, normal, force, ..level(1000.0, f64::INFINITY, 0.0) });
    let turned = bench.go(before.hand, before.hand, 80).clay_force;
    // The ledger and the frame's own force, which is none along the old normal, are within a tenth.
    near(turned.length() / before.clay_force.length(), 1.0, 0.1);
    near(turned.normalize().dot(normal), 1.0, 2e-3);
}

/// Clay that stands higher than the servo holds for true is felt as it is, once: frames that say what was
/// 30 ms ago are not added up.
#[test]
fn late_frames_are_not_counted_twice() {
    const LATE: u32 = 30;
    let mut bench = Bench::new(settings(RIGID));
    bench.at(ABOVE);
    bench.force.receive(&level(500.0, f64::INFINITY, 0.0));
    let mut clay = ReferenceClay::new(Law::Spring { stiffness: 500.0, yield_force: 1e3, slope: 0.0 }, 0.0);
    let surface = DVec3::Y * 0.5e-3;
    let (mut forces, mut felt, mut frame) = (vec![], vec![], 1);
    for tick in 0..400u32 {
        let hand = ABOVE.lerp(deep(1e-3), (f64::from(tick) / 60.0).min(1.0));
        felt.push(bench.at(hand).clay_force.y);
        forces.push((bench.time(), clay.force(hand - surface)));
        if tick % 11 == 0 && tick > LATE + 11 {
            let part = &forces[(tick - LATE - 11) as usize..=(tick - LATE) as usize];
            let force = part.windows(2).map(|p| 0.5 * (p[0].1 + p[1].1)).sum::<DVec3>() / 11.0;
            frame += 1;
            let span = [part[0].0, part[11].0];
            bench.force.receive(&ContactModel { frame, span, force, ..level(500.0, f64::INFINITY, 0.0) });
        }
    }
    let greatest = felt.iter().copied().fold(0.0, f64::max);
    near(felt[399], 0.75, 0.02);
    // The ledger pays a twentieth at most.
    assert!(greatest < 0.75 * 1.055, "{greatest} N overshoots");
}

/// What implicit steps bear they bear at their ends: true frames of them move nothing under a hand that goes
/// on.
#[test]
fn forces_at_the_ends_of_steps_are_compared_there() {
    for (parts, frame_time) in [(1, 11), (2, 10), (11, 11)] {
        let mut bench = Bench::new(settings(RIGID));
        bench.at(ABOVE);
        bench.force.receive(&level(500.0, f64::INFINITY, 0.0));
        let (mut true_forces, mut frame) = (vec![], 1);
        for tick in 0..100usize {
            let depth = 2e-5 * tick as f64;
            let force = bench.at(deep(depth)).clay_force;
            near(force.y, 500.0 * depth, 1e-9);
            true_forces.push((bench.time(), DVec3::Y * 500.0 * depth));
            if tick % frame_time == 0 && tick > 0 {
                let ends = (1..=parts).map(|i| true_forces[tick - frame_time + i * frame_time / parts].1);
                let force = ends.sum::<DVec3>() / parts as f64;
                let span = [true_forces[tick - frame_time].0, true_forces[tick].0];
                frame += 1;
                let model = ContactModel { frame, span, parts: parts as u32, force, ..level(500.0, f64::INFINITY, 0.0) };
                bench.force.receive(&model);
            }
        }
    }
}

/// The damper acts between hand and tool: clay that flows away under a steady hand drags no more for it.
#[test]
fn damper_does_not_drag_in_steady_flow() {
    let mut bench = Bench::new(settings(Coupling { damping: 1.0, ..SPRING }));
    bench.at(ABOVE);
    bench.force.receive(&level(1000.0, 0.5, 0.0));
    let flowing = bench.go(ABOVE, deep(20e-3), 210);
    near(flowing.clay_force.y, 0.5, 1e-9);
    // A quick press on clay that does not yield meets it.
    let mut stiff = Bench::new(settings(Coupling { damping: 1.0, ..SPRING }));
    stiff.at(ABOVE);
    stiff.force.receive(&level(1000.0, f64::INFINITY, 0.0));
    let quick = stiff.go(ABOVE, deep(1e-3), 20).clay_force.y;
    let still = 1e-3 / (1.0 / 400.0 + 1.0 / 1000.0);
    assert!(quick > 1.1 * still, "{quick}");
    near(stiff.go(deep(1e-3), deep(1e-3), 300).clay_force.y, still, 1e-6);
}

/// A hand that is inside the clay when the servo starts is not kicked.
#[test]
fn start_inside_the_clay_does_not_kick() {
    let mut bench = Bench::new(settings(Coupling::default()));
    let place = deep(5e-3);
    bench.at(place);
    bench.force.receive(&ContactModel { position: place, force: DVec3::Y * 3.0, ..level(1000.0, 3.0, 0.0) });
    let first = bench.at(place).clay_force.length();
    assert!(first < 0.1, "{first}");
    let later = bench.go(place, place, 100).clay_force.y;
    assert!(later > 0.5, "the clay is felt in the end: {later}");
}

/// A paused clay is no news; clay at rest is, though its frame is the old one.
#[test]
fn paused_clay_ages_and_resting_clay_does_not() {
    let mut bench = Bench::new(settings(SPRING));
    bench.at(ABOVE);
    let model = level(1000.0, f64::INFINITY, 0.0);
    bench.force.receive(&model);
    let before = bench.go(ABOVE, deep(1e-3), 100);
    bench.force.receive(&ContactModel { rate: 0.0, ..model });
    assert!(bench.at(before.hand).age > 0.1);
    bench.force.receive(&ContactModel { rate: 0.0, is_resting: true, ..model });
    let after = bench.at(before.hand);
    near(after.age, PERIOD, 1e-9);
    assert_eq!(after.clay_force, before.clay_force);
}

/// A frame that was lost, of clay that rests since: its force is not what was felt since, and changes
/// nothing.
#[test]
fn rest_after_a_lost_frame_changes_no_force() {
    let mut bench = Bench::new(settings(SPRING));
    bench.at(ABOVE);
    let model = level(1000.0, f64::INFINITY, 0.0);
    bench.force.receive(&model);
    let before = bench.go(ABOVE, deep(1e-3), 100);
    let span = [bench.time(); 2];
    bench.force.receive(&ContactModel { frame: 9, is_resting: true, span, force: DVec3::Y * 5.0, ..model });
    assert_eq!(bench.go(before.hand, before.hand, 50).clay_force, before.clay_force);
}

/// Clay that yields says nothing of where its spring is free: the force goes down to its yield force and no
/// farther.
#[test]
fn frames_of_yielding_clay_leave_the_dent() {
    let mut bench = Bench::new(settings(RIGID));
    bench.at(ABOVE);
    bench.force.receive(&level(1000.0, 0.4, 0.0));
    let bottom = bench.go(ABOVE, deep(2e-3), 60);
    let span = [bench.time() - 10.0 * PERIOD, bench.time()];
    let model = ContactModel { frame: 2, span, position: bottom.tool, force: DVec3::Y * 0.3, ..level(1000.0, 0.3, 0.0) };
    bench.force.receive(&model);
    // The ledger takes back a twentieth of it for a while.
    near(bench.go(bottom.hand, bottom.hand, 400).clay_force.y, 0.3, 0.016);
}

/// Clay in slow motion presses as it does at full speed.
#[test]
fn force_does_not_depend_on_the_rate_of_the_clay() {
    let force = |rate: f64| {
        let mut bench = Bench::new(settings(RIGID));
        bench.at(ABOVE);
        let model = |frame: u64, place: DVec3, force: f64, span: [f64; 2]| ContactModel {
            frame,
            rate,
            position: place,
            force: DVec3::Y * force,
            span,
            ..level(800.0, f64::INFINITY, 0.0)
        };
        bench.force.receive(&model(1, DVec3::ZERO, 0.0, [0.0; 2]));
        bench.go(ABOVE, deep(1e-3), 30);
        let span = [bench.time(), bench.time() + 10.0 * PERIOD];
        bench.go(deep(1e-3), deep(1e-3), 10);
        bench.force.receive(&model(2, deep(1e-3), 0.8, span));
        bench.go(deep(1e-3), deep(1e-3), 30).clay_force.y
    };
    for rate in [1.0, 0.5, 0.1] {
        near(force(rate), 0.8, 1e-9);
    }
}

/// A mode that takes over starts from the force that the other one left.
#[test]
fn modes_take_over_without_a_step() {
    let mut bench = Bench::new(settings(SPRING));
    bench.at(ABOVE);
    bench.force.receive(&level(1000.0, f64::INFINITY, 0.0));
    let mut last = bench.go(ABOVE, deep(3e-3), 100);
    bench.force.set(ServoSettings { mode: Mode::ContactImpulse, ..settings(SPRING) });
    let mut changes = vec![];
    for _ in 0..150 {
        let next = bench.at(last.hand);
        changes.push(next.clay_force.distance(last.clay_force));
        last = next;
    }
    assert!(changes.iter().all(|change| *change < 0.02), "{changes:?}");
    assert_eq!(last.clay_force, DVec3::ZERO);
}

#[test]
fn force_scale_is_open_below_its_knee_and_bounded_above() {
    let scale = ForceScale { gain: 0.5, ..ForceScale::default() };
    assert_eq!(scale.of(DVec3::X * 3.0), DVec3::X * 1.5);
    let slope = (scale.of(DVec3::X * 3.002).x - scale.of(DVec3::X * 3.0).x) / 0.001;
    near(slope, 1.0, 1e-3);
    assert!(scale.of(DVec3::X * 100.0).x < scale.ceiling + 1e-12);
    near(scale.of(DVec3::new(4.0, 3.0, 0.0)).normalize().x, 0.8, 1e-12);
}

/// A way that is drawn out, and a frame that is turned: the stiffness at the hand stays.
#[test]
fn placement_keeps_the_stiffness_at_the_hand() {
    let placement = Placement { position: DVec3::X, rotation: DQuat::from_rotation_z(1.0), scale: 3.0 };
    near(placement.point(DVec3::ZERO).distance(DVec3::X), 0.0, 1e-12);
    let settings = ServoSettings { placement, ..settings(SPRING) };
    let mut bench = Bench::new(settings);
    let hand = |y: f64| placement.rotation.conjugate() * (DVec3::Y * y - DVec3::X) / placement.scale;
    bench.at(hand(1e-3));
    bench.force.receive(&level(1e9, f64::INFINITY, 0.0));
    let force = bench.go(hand(0.0), hand(-3e-3), 40).hand_force.y;
    // 3 mm in the world are 1 mm at the hand.
    near(force, 400.0 * 1e-3, 1e-6);
}

/// Clay of particles whose top is level at y = 0.
fn particles(friction: f64) -> ContactModel {
    let mut clay = ReferenceClay::new(Law::Spring { stiffness: 1000.0, yield_force: 0.3, slope: 0.0 }, friction).with_particles();
    clay.force(ABOVE);
    ContactModel { frame: 1, ..clay.model(DVec3::ZERO, ABOVE) }
}

fn spheres(mode: Mode) -> Bench {
    let mut bench = Bench::new(ServoSettings { mode, tool: flat_tool(), ..settings(SPRING) });
    bench.go(ABOVE, ABOVE, 200);
    bench
}

/// On a ball of 1 m, which is nearly level: a spring, and friction by its coefficient, as far as it sticks.
#[test]
fn god_object_presses_and_rubs() {
    let ball = |friction: f64| {
        let mut model = ContactModel { near_count: 1, ..particles(friction) };
        model.near[0] = NearParticle { id: 1, position: [0.0, -1.0, 0.0], radius: 1.0 };
        model
    };
    let rubbed = |friction: f64, aside: f64| {
        let mut bench = spheres(Mode::GodObject);
        bench.force.receive(&ball(friction));
        let pressed = bench.go(ABOVE, deep(2e-3), 60);
        near(pressed.clay_force.y, 400.0 * 2e-3, 1e-3);
        assert!(pressed.gap > -1e-6 && pressed.is_touching);
        let force = bench.go(deep(2e-3), deep(2e-3) + DVec3::X * aside, 100).clay_force;
        -force.x / force.y
    };
    near(rubbed(0.0, 4e-3), 0.0, 6e-3);
    near(rubbed(0.4, 4e-3), 0.4, 6e-3);
    // 0.4 mm aside at 2 mm depth, in the cone: the tool has not moved.
    near(rubbed(0.4, 0.4e-3), 0.2, 6e-3);
}

/// On a bed of balls no tool's force changes by more than a stated trip may, and none is inside.
#[test]
fn god_object_goes_over_bumps() {
    let mut bench = spheres(Mode::GodObject);
    bench.force.receive(&particles(0.4));
    let mut last = bench.go(ABOVE, deep(2e-3), 60);
    for tick in 1..=96 {
        let next = bench.at(deep(2e-3) + DVec3::X * 5e-5 * f64::from(tick));
        let change = next.clay_force.distance(last.clay_force);
        assert!(change < 0.3 && next.gap > -1e-6 && !next.is_caught, "{change} N, {} m", next.gap);
        last = next;
    }
    assert!(last.clay_force.x < 0.0);
}

/// Thin clay is soft: `omega(rho)` scales k_h.
#[test]
fn thin_clay_is_soft() {
    let force = |density: f64| {
        let mut bench = spheres(Mode::GodObject);
        bench.force.receive(&ContactModel { density, ..particles(0.0) });
        bench.go(ABOVE, deep(1e-3), 40).clay_force.y
    };
    near(force(0.25), 0.25 * force(1.0), 1e-9);
    near(force(1.0), 0.4, 1e-6);
}

/// A fixed anchor is a spring and gives all back; one that relaxes does not.
#[test]
fn relaxed_anchor_gives_back_less() {
    let returned = |relaxes: bool| {
        let mut bench = spheres(Mode::PaperAnchor { relaxes });
        let mut clay = ReferenceClay::new(Law::Spring { stiffness: 1000.0, yield_force: 0.3, slope: 0.0 }, 0.0).with_particles();
        let mut work = [0.0; 2];
        let mut last = bench.at(ABOVE);
        for tick in 0..1200u32 {
            let phase = (f64::from(tick) / 600.0 - 1.0).abs();
            let hand = deep(5e-3).lerp(ABOVE, phase);
            let force = clay.force(last.tool);
            if tick % 11 == 0 {
                let frame = 2 + u64::from(tick / 11);
                bench.force.receive(&ContactModel { frame, ..clay.model(force, last.tool) });
            }
            let next = bench.at(hand);
            let done = -0.5 * (next.clay_force + last.clay_force).dot(next.hand - last.hand);
            work[usize::from(done < 0.0)] += done.abs();
            last = next;
        }
        assert!(work[0] > 1e-3, "{work:?}");
        assert_eq!(last.clay_force, DVec3::ZERO);
        work[1] / work[0]
    };
    let (fixed, relaxed) = (returned(false), returned(true));
    assert!(fixed > 0.9 && relaxed < 0.3, "{fixed}, {relaxed}");
}

/// Neither a tick nor a frame that comes allocates, in any mode.
#[test]
fn ticks_do_not_allocate() {
    let modes = [
        Mode::Coupled,
        Mode::GodObject,
        Mode::PaperAnchor { relaxes: true },
        Mode::PaperAnchor { relaxes: false },
        Mode::ContactImpulse,
    ];
    for mode in modes {
        let settings = ServoSettings { mode, tool: square_tool(5, 1.5e-3, Bed::RADIUS), ..ServoSettings::default() };
        let (mut servo, mut ends) = ClayServo::new(settings, 8);
        let model = particles(0.3);
        let mut state = DeviceState {
            time: 0.0,
            position: ABOVE,
            rotation: DQuat::IDENTITY,
            velocity: DVec3::ZERO,
            buttons: 0,
            motor_temperature: 0.0,
            is_muted: false,
        };
        let mut felt = 0.0;
        // Where a mode comes from another one, too.
        let other = if mode == Mode::Coupled { Mode::GodObject } else { Mode::Coupled };
        ends.settings.write(ServoSettings { mode: other, ..settings });
        for tick in 0..60 {
            if tick == 5 {
                ends.settings.write(settings);
            }
            state.time = f64::from(tick) * PERIOD;
            state.position = ABOVE.lerp(deep(2e-3), f64::from(tick) / 60.0);
            if tick % 11 == 0 {
                ends.models.write(ContactModel { frame: u64::from(tick as u32) + 1, ..model });
            }
            felt += assert_no_alloc(|| servo.tick(&state, PERIOD)).length();
        }
        assert!(mode == Mode::ContactImpulse || felt > 0.1, "{mode:?} felt {felt}");
        assert_eq!(servo.lost(), 52, "the ring held 8 of 60 samples");
    }
}
