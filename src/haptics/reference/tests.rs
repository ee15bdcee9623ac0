//! The whole loop in virtual time, small: what the acceptance cases judge at length.

use super::clay::{Law, ReferenceClay, flat_tool};
use super::frames::{Frames, ModelErrors};
use super::rig::{Rig, Run};
use crate::haptics::device::simulated::{ArmSettings, HandPath, Operator};
use crate::haptics::servo::{Mode, ServoSettings};
use glam::DVec3;

const PLASTIC: Law = Law::Spring { stiffness: 1000.0, yield_force: 0.2, slope: 100.0 };

/// Down at `speed` \[m/s\] to 8 mm, there for `hold` \[s\], and up again.
fn stroke(speed: f64, hold: f64, frames: Frames, mode: Mode) -> Run {
    let [start, end] = [DVec3::Y * 2e-3, DVec3::NEG_Y * 8e-3];
    let down = 0.1 + 10e-3 / speed;
    let points = [(0.1, start), (down, end), (down + hold, end), (2.0 * down + hold - 0.1, start)];
    let path = HandPath::new(points);
    let arm = ArmSettings { operator: Operator::STYLUS, ..ArmSettings::default() };
    let servo = ServoSettings { mode, tool: flat_tool(), ..ServoSettings::default() };
    let clay = ReferenceClay::new(PLASTIC, 0.3).with_particles();
    let duration = path.duration() + 0.1;
    Rig { arm, path, servo, clay, frames }.run(duration)
}

/// A fast stroke among late and lost frames: force and impulse are the clay's.
#[test]
fn loop_follows_the_clay() {
    let late = Frames { latency: 0.033, ..Frames::default() };
    for frames in [late, Frames { lost: 0.3, ..late }, Frames { rate: 30.0, ..late }, Frames { jitter: 0.5, ..late }] {
        for speed in [0.05, 0.2] {
            let run = stroke(speed, 0.2, frames, Mode::Coupled);
            let found = run.fidelity();
            assert!(run.is_sound && found.error < 2e-3 && (found.slope - 1.0).abs() < 1e-3, "{frames:?}, {speed}: {found:?}");
            assert!(run.imbalance() < 1e-3, "{frames:?}, {speed}: {}", run.imbalance());
            assert!(run.slew() < 0.1 && run.generated() < 1e-6);
        }
    }
}

/// Models that err by a third make the loop err by less, and the hand's impulse is the clay's all the same.
#[test]
fn frames_make_good_what_models_say_wrong() {
    let errors = ModelErrors { stiffness: 0.7, yield_slope: 0.0, noise: 0.0 };
    let frames = Frames { errors, ..Frames::default() };
    let found = stroke(0.02, 0.5, frames, Mode::Coupled);
    assert!(found.fidelity().error < 0.03, "{:?}", found.fidelity());
    assert!(found.imbalance() < 0.02, "{}", found.imbalance());
    // Clay that is held to be softer than it is gives way in the servo: its frames say how hard it presses.
    let yielding = ModelErrors { stiffness: 1.6, yield_slope: 1.0, noise: 0.0 };
    let found = stroke(0.02, 0.5, Frames { errors: yielding, ..Frames::default() }, Mode::Coupled);
    assert!(found.fidelity().error < 0.03, "{:?}", found.fidelity());
}

/// A hand that holds still feels the clay's force and no other, however frames of clay at rest are lost.
#[test]
fn held_force_stays_the_clays() {
    let run = stroke(0.05, 3.0, Frames { lost: 0.4, latency: 0.022, ..Frames::default() }, Mode::Coupled);
    let held: Vec<_> = run.ticks.iter().filter(|t| (1.0..3.0).contains(&t.sample.time)).collect();
    let off = held.iter().map(|t| (t.sample.clay_force.y - t.truth.y).abs() / t.truth.y).fold(0.0, f64::max);
    let age = held.iter().map(|t| t.sample.age).fold(0.0, f64::max);
    assert!(off < 2e-3, "{off}");
    assert!(age < 0.15, "models of clay at rest are renewed: {age}");
}

/// The god-object's tool goes into the clay as the hand presses on, and no sphere of it into one of the
/// clay's.
#[test]
fn god_object_sinks_into_the_clay() {
    let run = stroke(0.01, 0.2, Frames::default(), Mode::GodObject);
    let pressed = run.ticks.iter().map(|t| t.truth.y).fold(0.0, f64::max);
    assert!(pressed > 0.5 && run.fidelity().error < 0.35, "{pressed} N, {:?}", run.fidelity());
    assert!(run.ticks.iter().all(|t| t.sample.gap > -1e-6));
}

/// The clay's force held from frame to frame drives a hand on clay of 1000 N/m, which the coupled one holds
/// still.
#[test]
fn held_forces_make_energy() {
    let made = |mode: Mode| stroke(0.02, 1.0, Frames::default(), mode).generated();
    let (held, coupled) = (made(Mode::ContactImpulse), made(Mode::Coupled));
    assert!(held > 1e-3 && coupled < 1e-6, "{held} and {coupled}");
}

/// Closed forms at hand-worked points.
#[test]
fn laws_are_their_closed_forms() {
    let close = |law: Law, depth: f64, force: f64| {
        let found = law.backbone(depth);
        assert!((found / force - 1.0).abs() < 1e-6, "{law:?}: {found}");
    };
    close(Law::Punch { radius: 2.5e-3, modulus: 1e5 }, 1e-3, 0.5);
    close(Law::Hertz { radius: 1e-2, modulus: 3e4 }, 1e-3, 4.0 / 3.0 * 3e4 * 0.1 * 1e-3f64.powf(1.5));
    close(
        Law::Cone { hardness: 1e4, half_angle: std::f64::consts::FRAC_PI_4, modulus: 1e5 },
        2e-3,
        1e4 * std::f64::consts::PI * 4e-6,
    );
    close(PLASTIC, 5e-3, 0.7);
    // A ball between two plates is softer than on a half space, by little at small depths.
    let tatara = Law::Tatara { radius: 1e-2, young_modulus: 3e4, poisson_ratio: 0.3 };
    let hertz = Law::Hertz { radius: 1e-2, modulus: 3e4 / 0.91 };
    let ratio = |depth: f64| tatara.backbone(depth) / hertz.backbone(depth);
    assert!((1.0..1.03).contains(&ratio(1e-5)) && (1.06..1.2).contains(&ratio(5e-4)), "{} {}", ratio(1e-5), ratio(5e-4));
}

/// What is pressed in stays in, and gives back its spring.
#[test]
fn reference_clay_yields_and_springs_back() {
    let mut clay = ReferenceClay::new(PLASTIC, 0.0);
    let force = |clay: &mut ReferenceClay, depth: f64| clay.force(DVec3::NEG_Y * depth).y;
    assert!((force(&mut clay, 5e-3) - 0.7).abs() < 1e-12);
    assert!((force(&mut clay, 4.8e-3) - 0.5).abs() < 1e-12);
    assert_eq!(force(&mut clay, 4e-3), 0.0);
    let model = clay.model(DVec3::ZERO, DVec3::NEG_Y * 4e-3);
    assert!((model.gap - 0.3e-3).abs() < 1e-12 && (model.yield_force - 0.63).abs() < 1e-12, "{model:?}");
}
