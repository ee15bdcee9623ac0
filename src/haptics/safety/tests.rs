use super::age::{GONE, ModelClock, YOUNG};
use super::*;
use crate::haptics::model::ContactModel;
use glam::DQuat;

/// A tick of 1 kHz \[s\].
const TICK: f64 = 1e-3;

fn info() -> DeviceInfo {
    DeviceInfo {
        name: "bench".into(),
        serial: String::new(),
        freedoms: [6, 3],
        force_max: 3.3,
        continuous_force_max: 0.88,
        stiffness_max: 500.0,
        damping_max: 4.0,
        workspace: [DVec3::splat(-0.1), DVec3::splat(0.1)],
        resolution: 55e-6,
        rate: 1000.0,
        buttons: 2,
    }
}

fn state() -> DeviceState {
    DeviceState {
        time: 0.0,
        position: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        buttons: 0,
        motor_temperature: 0.0,
        is_muted: false,
    }
}

fn chain() -> SafetyChain {
    SafetyChain::new(SafetySettings::default(), &info())
}

/// A chain whose ramp is over, and that lets `force` through.
fn ready(force: DVec3) -> SafetyChain {
    let mut chain = chain();
    for _ in 0..800 {
        chain.apply(force, 0.0, &state(), TICK);
    }
    assert_eq!(chain.report().active, 0, "{:?}", chain.report());
    chain
}

fn x(force: f64) -> DVec3 {
    DVec3::X * force
}

#[test]
fn a_fair_force_comes_through_unchanged() {
    let mut chain = ready(x(0.5));
    assert_eq!(chain.apply(x(0.5), 0.0, &state(), TICK), x(0.5));
}

/// The hand may be deep in the clay when force is switched on: it does not kick, and the force takes its
/// time.
#[test]
fn start_within_clay_does_not_kick() {
    let mut chain = chain();
    let first = chain.apply(x(3.0), 0.0, &state(), TICK);
    assert!(first.length() < 0.1, "{first}");
    let forces: Vec<f64> = (0..700).map(|_| chain.apply(x(3.0), 0.0, &state(), TICK).length()).collect();
    assert!(forces.is_sorted() && forces[350] < 1.01 && forces[699] > 1.8, "{} {}", forces[350], forces[699]);
}

/// Whatever is no number gives nothing at once, and comes back by the ramp.
#[test]
fn what_is_no_number_gives_nothing() {
    let broken = |position: DVec3, velocity: DVec3| DeviceState { position, velocity, ..state() };
    let cases = [
        (DVec3::new(0.0, f64::NAN, 0.0), state()),
        (DVec3::splat(f64::INFINITY), state()),
        (x(0.5), broken(DVec3::NAN, DVec3::ZERO)),
        (x(0.5), broken(DVec3::ZERO, DVec3::splat(f64::INFINITY))),
    ];
    for (force, state) in cases {
        let mut chain = ready(x(0.5));
        assert_eq!(chain.apply(force, 0.0, &state, TICK), DVec3::ZERO, "{force} {state:?}");
        assert_eq!(chain.report().episodes(Stage::Finite), 1);
        let after = chain.apply(x(0.5), 0.0, &self::state(), TICK).length();
        assert!(after > 0.0 && after < 0.01, "{after}");
    }
}

#[test]
fn an_age_or_a_tick_that_is_no_number_gives_nothing_wild() {
    let mut chain = ready(x(0.5));
    let gone: Vec<DVec3> = (0..20).map(|_| chain.apply(x(0.5), f64::NAN, &state(), TICK)).collect();
    assert!(gone[0].x >= 0.2 - 1e-12 && gone[2..] == [DVec3::ZERO; 18], "as fast as a force may go: {gone:?}");
    let mut chain = ready(x(0.5));
    for dt in [f64::NAN, f64::INFINITY, -1.0, 0.0] {
        let force = chain.apply(x(2.0), 0.0, &state(), dt).length();
        assert!(force <= 0.5 + 0.6 + 1e-9, "{dt}: {force}");
    }
}

#[test]
fn an_old_model_fades_and_latches_until_the_tool_is_free() {
    let mut chain = ready(x(0.8));
    assert_eq!(chain.apply(x(0.8), YOUNG, &state(), TICK), x(0.8));
    let mut last = 0.8;
    for ms in 34..133 {
        let age = f64::from(ms) * TICK;
        let force = chain.apply(x(0.8), age, &state(), TICK).x;
        assert!((force - 0.8 * (1.0 - (age - 0.033) / 0.1)).abs() < 1e-12 && force < last, "{ms} ms: {force}");
        last = force;
    }
    assert_eq!(chain.apply(x(0.8), GONE, &state(), TICK), DVec3::ZERO);
    for _ in 0..1000 {
        assert_eq!(chain.apply(x(0.8), 0.0, &state(), TICK), DVec3::ZERO, "young again, but within the clay");
    }
    chain.apply(x(0.0), 0.0, &state(), TICK);
    assert!(chain.apply(x(0.8), 0.0, &state(), TICK).x < 0.01, "it comes by the ramp");
    for _ in 0..800 {
        chain.apply(x(0.8), 0.0, &state(), TICK);
    }
    assert_eq!(chain.apply(x(0.8), 0.0, &state(), TICK), x(0.8));
    assert_eq!(chain.report().episodes(Stage::Age), 1);
}

/// Before the first model there is nothing to latch for: a hand that starts within clay gets its force by
/// the ramp.
#[test]
fn a_start_before_the_first_model_is_no_loss() {
    let mut chain = chain();
    for _ in 0..1000 {
        assert_eq!(chain.apply(x(0.8), f64::INFINITY, &state(), TICK), DVec3::ZERO);
    }
    let forces: Vec<f64> = (0..800).map(|_| chain.apply(x(0.8), 0.0, &state(), TICK).x).collect();
    assert!(forces[0] < 0.01 && forces.is_sorted() && forces[799] == 0.8, "{} {}", forces[0], forces[799]);
}

#[test]
fn paused_and_lost_clay_ages_and_resting_clay_does_not() {
    let at = |stamp: f64, rate: f64, is_resting: bool| ContactModel { stamp, rate, is_resting, ..ContactModel::NONE };
    let mut clock = ModelClock::default();
    assert_eq!(clock.age(&ContactModel::NONE, 5.0), f64::INFINITY);
    assert_eq!(clock.age(&at(1.0, 1.0, false), 1.01), 1.01 - 1.0);
    // Published on and on while it is paused: as old as the last frame that ran.
    assert_eq!(clock.age(&at(2.0, 0.0, false), 2.0), 1.0);
    assert_eq!(clock.age(&at(3.0, 0.0, true), 3.01), 3.01 - 3.0);
    assert_eq!(clock.age(&at(3.0, 0.0, true), 4.0), 1.0, "no longer renewed");
    assert_eq!(clock.age(&at(f64::NAN, 1.0, false), 4.0), f64::INFINITY);
    assert_eq!(clock.age(&at(9.0, 0.3, false), 4.0), 0.0, "slow clay is not old; stamps ahead are new");
}

/// The most that a mass, thrown at a spring that is 7 ms late, got from it \[J\]; a passive one gives nothing.
fn made_energy(is_damped: bool) -> f64 {
    let mut chain = ready(x(0.0));
    let (mut place, mut speed, mut made, mut most) = (0.0, 0.3, 0.0, 0.0);
    let mut late = [0.0; 8];
    for i in 0..400 {
        late[i % 8] = -300.0 * place;
        let asked = x(late[(i + 1) % 8]);
        let state = DeviceState { position: x(place), velocity: x(speed), ..state() };
        let force = if is_damped { chain.apply(asked, 0.0, &state, TICK).x } else { asked.x.clamp(-2.0, 2.0) };
        speed += force / 0.05 * TICK;
        place += speed * TICK;
        made += force * speed * TICK;
        most = f64::max(most, made);
    }
    most
}

#[test]
fn energy_that_the_loop_makes_is_damped_out() {
    let (free, damped) = (made_energy(false), made_energy(true));
    assert!(free > 0.02 && damped < 0.05 * free, "{free} J free, {damped} J damped");
}

/// A spring in clay that keeps most of what it gets: the observer has nothing to say, in, out and in again.
#[test]
fn a_passive_loop_is_left_alone() {
    let mut passivity = Passivity::new(2.0, 100.0, 4.0, 1e-6);
    let (mut held, mut rest) = (DVec3::ZERO, 0.0);
    for i in 0..20_000 {
        let place = 0.01 * (f64::from(i) * 2e-3).sin().max(-0.1);
        let damping = passivity.damping(held, x(-place), x(0.1), TICK);
        assert!(damping == DVec3::ZERO, "tick {i}: {damping}");
        rest = f64::clamp(rest, place - 0.005, place.max(0.0));
        // Rounded to the side of the hand's loss, as a spring of clay is by its own drag.
        held = x(200.0 * (place - rest) * 0.99);
    }
    assert!(passivity.energy() <= 0.5 * 4.0 / 100.0);
}

#[test]
fn damping_is_capped_and_against_the_way() {
    let mut passivity = Passivity::new(2.0, 100.0, 4.0, 1e-6);
    passivity.damping(DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, TICK);
    // The loop pushed by 2 N over 1 mm: 2 mJ from nowhere, 1 m/s.
    let damping = passivity.damping(x(2.0), x(1e-3), DVec3::new(1.0, 0.0, 0.0), TICK);
    assert!((damping.x + 2.0).abs() < 4e-3 && damping.y == 0.0, "{damping}");
    let damping = passivity.damping(x(2.0), x(1.1e-3), x(0.1), TICK);
    assert!((damping.x + 0.4).abs() < 1e-9, "4 N s/m and no more: {damping}");
}

/// A hand that stands between two steps of its encoder, on a spring: it seems to give energy and does not.
/// With three steps it does.
#[test]
fn a_step_of_the_encoder_is_no_energy() {
    let acts = |steps: f64| {
        let mut passivity = Passivity::new(2.0, 100.0, 4.0, 55e-6);
        let mut held = DVec3::ZERO;
        let mut tick = |i: i32| {
            let place = 1.7e-3 + steps * 55e-6 * f64::from(i % 2);
            let damping = passivity.damping(held, x(place), x(0.01), TICK);
            held = x(-400.0 * place);
            damping != DVec3::ZERO
        };
        (0..2000).filter(|i| tick(*i)).count()
    };
    assert_eq!(acts(1.0), 0);
    assert!(acts(3.0) > 1000);
}

#[test]
fn force_that_is_held_ends_at_what_motors_bear() {
    let mut chain = chain();
    let mut square = 0.0;
    for _ in 0..60_000 {
        let force = chain.apply(x(5.0), 0.0, &state(), TICK);
        square += force.length_squared() * TICK / 10.0 - square * TICK / 10.0;
        assert!(square.sqrt() <= 0.88, "{square}");
    }
    let last = chain.apply(x(5.0), 0.0, &state(), TICK).length();
    assert!((last - 0.88).abs() < 0.01 && chain.report().is_active(Stage::Budget), "{last}");
    assert!(chain.report().load <= 1.0 && chain.report().episodes(Stage::Budget) == 1);
}

#[test]
fn warm_motors_get_less_and_hot_ones_nothing() {
    let mut chain = ready(x(0.8));
    let mut at = |motor_temperature: f64| {
        let state = DeviceState { motor_temperature, ..state() };
        (0..50).map(|_| chain.apply(x(0.8), 0.0, &state, TICK).length()).last().expect("ticks")
    };
    assert_eq!((at(0.8), at(1.0), at(2.0), at(f64::NAN)), (0.8, 0.0, 0.0, 0.8));
    assert!((at(0.9) - 0.8).abs() < 1e-12 && (at(0.95) - 0.5).abs() < 1e-9);
}

#[test]
fn no_force_above_the_users_or_the_devices() {
    let mut chain = ready(x(0.0));
    let reach = |chain: &mut SafetyChain| {
        (0..60).map(|_| chain.apply(DVec3::splat(9.0), 0.0, &state(), TICK).length()).fold(0.0, f64::max)
    };
    assert!((reach(&mut chain) - 2.0).abs() < 1e-9 && chain.report().is_active(Stage::Clamp));
    let mut weak = SafetyChain::new(SafetySettings::default(), &DeviceInfo { force_max: 1.0, ..info() });
    (0..800).for_each(|_| _ = weak.apply(x(0.0), 0.0, &state(), TICK));
    assert!((reach(&mut weak) - 0.9).abs() < 1e-9);
}

/// A step of force, forth and back, and everything that a user may ask for meanwhile: never more than .3
/// N/ms.
#[test]
fn force_never_changes_faster_than_it_may() {
    let mut chain = chain();
    let mut last = DVec3::ZERO;
    for i in 0..6000 {
        match i {
            1500 | 4200 => chain.restart(),
            2200 => chain.switch(false),
            2500 => chain.switch(true),
            _ => {}
        }
        let asked = if i / 7 % 2 == 0 { DVec3::new(2.0, 1.0, -4.0) } else { DVec3::new(-2.0, 3.0, 0.0) };
        let force = chain.apply(asked, 0.0, &state(), TICK);
        assert!(force.distance(last) <= 0.3 + 1e-12, "tick {i}: {last} to {force}");
        last = force;
    }
    assert!(chain.report().ticks(Stage::Slew) > 1000);
    // After a pause of the thread the force does not jump either.
    let force = chain.apply(-last, 0.0, &state(), 0.4);
    assert!(force.distance(last) <= 0.6 + 1e-12);
}

#[test]
fn force_goes_within_20_ms_when_asked_and_comes_back_by_the_ramp() {
    for ask in [|chain: &mut SafetyChain| chain.switch(false), SafetyChain::restart] {
        let mut chain = ready(x(0.5));
        ask(&mut chain);
        let forces: Vec<f64> = (0..21).map(|_| chain.apply(x(0.5), 0.0, &state(), TICK).length()).collect();
        assert!(forces.is_sorted_by(|a, b| a >= b) || forces[20] < 0.01, "{forces:?}");
        assert!(forces[19] < 1e-12 || forces[20] < 1e-12, "{forces:?}");
        assert!(chain.report().is_active(Stage::Ramp));
        for _ in 0..700 {
            let force = chain.apply(x(0.5), 0.0, &state(), TICK).length();
            assert!(force < 0.48, "{force}");
        }
        chain.switch(true);
        for _ in 0..800 {
            chain.apply(x(0.5), 0.0, &state(), TICK);
        }
        assert_eq!(chain.apply(x(0.5), 0.0, &state(), TICK), x(0.5));
    }
}

/// Thrown by the driver's speed, or by the places alone.
#[test]
fn a_flying_hand_gets_nothing_until_it_is_slow() {
    for is_told in [true, false] {
        let mut chain = ready(x(0.5));
        let mut position = DVec3::ZERO;
        let mut fly = |speed: f64, ticks: usize| {
            let velocity = if is_told { DVec3::Y * speed } else { DVec3::ZERO };
            let tick = |_| {
                position.y += speed * TICK;
                chain.apply(x(0.5), 0.0, &DeviceState { position, velocity, ..state() }, TICK).length()
            };
            (0..ticks).map(tick).last().expect("ticks")
        };
        assert_eq!(fly(0.9, 20), 0.5);
        assert_eq!(fly(1.1, 10), 0.0, "{is_told}");
        assert_eq!(fly(0.6, 100), 0.0, "slower, and not slow");
        assert_eq!(fly(0.1, 900), 0.5);
        assert_eq!(chain.report().episodes(Stage::Speed), 1);
    }
}

/// Share of the force that is left of a hand that swings with `frequency` \[Hz\] and `swing` \[m\] to either
/// side.
fn share_after(frequency: f64, swing: f64, seconds: f64) -> f64 {
    let mut chain = ready(x(0.5));
    let ticks = (seconds / TICK) as usize;
    for i in 0..ticks {
        let position = x(swing * (std::f64::consts::TAU * frequency * i as f64 * TICK).sin());
        chain.apply(x(0.5), 0.0, &DeviceState { position, ..state() }, TICK);
    }
    chain.report().gain
}

#[test]
fn a_shaken_hand_gets_half_of_the_force_and_a_trembling_one_all() {
    assert_eq!(share_after(40.0, 5e-4, 0.3), 0.5);
    assert_eq!(share_after(40.0, 5e-4, 3.0), 0.125, "again and again, to an eighth");
    assert_eq!(share_after(12.0, 1e-3, 3.0), 1.0);
    assert_eq!(share_after(60.0, 1e-4, 3.0), 1.0, "too small to be told from noise");
}

#[test]
fn a_buzz_is_kept_until_force_is_switched_off_and_on() {
    let mut chain = ready(x(0.5));
    let hold = |chain: &mut SafetyChain, frequency: f64| {
        for i in 0..900 {
            let position = x(5e-4 * (std::f64::consts::TAU * frequency * f64::from(i) * TICK).sin());
            chain.apply(x(0.5), 0.0, &DeviceState { position, ..state() }, TICK);
        }
        chain.report().gain
    };
    assert!(hold(&mut chain, 40.0) < 0.2);
    assert!(hold(&mut chain, 0.0) < 0.2);
    chain.switch(false);
    chain.switch(true);
    assert_eq!(hold(&mut chain, 0.0), 1.0);
}

#[test]
fn other_limits_hold_from_the_next_tick_on() {
    let mut chain = ready(x(0.8));
    chain.configure(SafetySettings { force_max: 0.4, ..SafetySettings::default() });
    let forces: Vec<f64> = (0..10).map(|_| chain.apply(x(0.8), 0.0, &state(), TICK).x).collect();
    assert!((forces[0] - 0.5).abs() < 1e-12 && (forces[9] - 0.4).abs() < 1e-12, "{forces:?}");
    chain.configure(SafetySettings { force_max: 9.0, ..SafetySettings::default() });
    let most = (0..60).map(|_| chain.apply(x(9.0), 0.0, &state(), TICK).x).fold(0.0, f64::max);
    assert!((most - 0.9 * 3.3).abs() < 1e-9, "the device's own limit stays: {most}");
}

#[test]
fn limits_are_held_within_bounds() {
    let nan = f64::NAN;
    let wrong = SafetySettings { force_max: nan, slew_max: nan, speed_max: nan, ramp: nan, damping_max: nan, stiffness_min: nan };
    assert_eq!(wrong.within_bounds(), SafetySettings::default());
    let wild = SafetySettings { slew_max: 9e9, ramp: 0.0, force_max: -1.0, stiffness_min: 0.0, ..SafetySettings::default() };
    let held = wild.within_bounds();
    assert_eq!((held.slew_max, held.ramp, held.force_max, held.stiffness_min), (300.0, 0.5, 0.0, 10.0));
    assert_eq!(SafetySettings::default().within_bounds(), SafetySettings::default());
}

#[test]
fn a_muted_device_gets_nothing_and_the_ramp_after() {
    let mut chain = ready(x(0.5));
    let muted = DeviceState { is_muted: true, ..state() };
    assert_eq!(chain.apply(x(0.5), 0.0, &muted, TICK), DVec3::ZERO);
    assert!(chain.report().is_active(Stage::Device));
    assert!(chain.apply(x(0.5), 0.0, &state(), TICK).length() < 0.01);
}

#[test]
fn another_device_begins_with_nothing_and_keeps_what_is_switched_off() {
    let mut chain = ready(x(0.5));
    chain.switch(false);
    chain.begin(&info());
    assert!((0..900).all(|_| chain.apply(x(0.5), 0.0, &state(), TICK) == DVec3::ZERO));
    chain.switch(true);
    chain.begin(&info());
    assert!(chain.apply(x(0.5), 0.0, &state(), TICK).length() < 0.01);
}

/// What a stage leaves is what the next one sees.
#[test]
fn stages_act_in_their_order() {
    // Age before clamp: half of 100 N is clamped to 2, not 2 N halved.
    let mut chain = ready(x(0.0));
    let old = YOUNG + 0.05;
    let force = (0..40).map(|_| chain.apply(x(100.0), old, &state(), TICK).x).last().expect("ticks");
    assert!((force - 2.0).abs() < 1e-9, "{force}");
    // Passivity before clamp: 3 N of damping on 2 N of push in the same direction are clamped.
    let mut chain = ready(x(0.0));
    for i in 0..40 {
        // Asked along its way, the hand is given energy in each tick.
        let (position, velocity) = (x(0.5e-3 * f64::from(i)), x(0.5));
        let force = chain.apply(x(9.0), 0.0, &DeviceState { position, velocity, ..state() }, TICK);
        assert!(force.length() <= 2.0 + 1e-12);
    }
    assert!(chain.report().ticks(Stage::Passivity) > 10);
    // Budget before slew: what the motors bear no longer goes slowly.
    let mut chain = ready(x(0.8));
    let warm = DeviceState { motor_temperature: 1.0, ..state() };
    assert!((chain.apply(x(0.8), 0.0, &warm, TICK).x - 0.5).abs() < 1e-12);
    // Slew before ramp: the first tick has .3 N of the ramp's first step.
    let first = self::chain().apply(x(2.0), 0.0, &state(), TICK).x;
    assert!((first - 0.3 * TICK / 0.75).abs() < 1e-12, "{first}");
    // The first stage ends the tick: nothing after it is asked.
    let mut chain = ready(x(0.5));
    chain.apply(DVec3::NAN, 9.0, &DeviceState { is_muted: true, ..state() }, TICK);
    assert_eq!(chain.report().active, Stage::Finite.bit());
    // Speed and device trip after the ramp, and both are told.
    let mut chain = ready(x(0.5));
    chain.apply(x(0.5), 0.0, &DeviceState { is_muted: true, velocity: x(2.0), ..state() }, TICK);
    assert_eq!(chain.report().active, Stage::Speed.bit() | Stage::Device.bit());
}

#[test]
fn bits_and_names_follow_the_order() {
    for (i, stage) in Stage::ALL.into_iter().enumerate() {
        assert_eq!((stage.bit(), stage as usize), (1 << i, i));
        assert!(!stage.name().is_empty() && !stage.message().is_empty());
    }
}
