//! A tool that a hand leads: what its arm felt, on file.

use super::replay::{recorded, replay};
use super::{BLOCK, Desk};
use bevy_clay::haptics::device::trace::{ForcePlayback, Trace};
use bevy_clay::haptics::device::{DeviceState, Servo};
use glam::DVec3;

/// A hand that means to go 8 mm into a block, and out again.
const PRESS: &str = "clay: [Box(size: (0.02, 0.01, 0.02))], cell_width: 0.002, duration: 1.6, frame_time: 0.0125,
    tools: [(shape: Sphere(radius: 0.005), hand: Stylus, keyframes: [
        (time: 0.0, position: (0.0, 0.0105, 0.0)), (time: 0.9, position: (0.0, 0.0105, 0.0)),
        (time: 1.2, position: (0.0, 0.0025, 0.0)), (time: 1.3, position: (0.0, 0.0025, 0.0)),
        (time: 1.6, position: (0.0, 0.0105, 0.0))])]";

/// Its force is the clay's and comes once clay is there; the arm stays where the clay stops it; the run is
/// the same again, from its recording too; and the arm's trace plays on an arm.
#[test]
fn force_of_a_hand_is_on_file() {
    let desk = Desk::new();
    let runs = [0; 2].map(|_| {
        recorded(&desk, PRESS).ends(0, &[]);
        std::fs::read_to_string(desk.at("out/force.csv")).expect("force.csv")
    });
    assert!(runs[0] == runs[1], "a hand's run is the same again");
    let trace = Trace::read(&desk.at("out/force.csv")).expect("a trace");
    assert!((1400..1800).contains(&trace.ticks.len()), "{}", trace.ticks.len());
    let greatest = |from: f64, to: f64| {
        let within = trace.ticks.iter().filter(|tick| (from..to).contains(&tick.state.time));
        within.map(|tick| tick.force.y).fold(0.0, f64::max)
    };
    let (before, pressed, after) = (greatest(0.0, 0.9), greatest(1.1, 1.35), greatest(1.59, 1.7));
    assert!(before == 0.0 && pressed > 0.3 && after == 0.0, "{before} {pressed} {after} N");
    let deepest = trace.ticks.iter().map(|tick| tick.state.position.y).fold(0.0, f64::min);
    assert!((-7.8e-3..-4e-3).contains(&deepest), "the clay holds the hand back: {deepest} m");
    let mut played = ForcePlayback::new(trace.clone());
    let state = DeviceState { position: DVec3::ZERO, ..trace.ticks[0].state };
    let felt = (0..1600).map(|_| played.tick(&state, 1e-3).y).fold(0.0, f64::max);
    assert!((felt - pressed).abs() < 0.05 * pressed, "{felt} of {pressed} N");
    let ran = replay(&desk);
    ran.ends(0, &[]);
    assert!(ran.out.contains("the same bits"), "{ran:?}");
    let told = desk.summary()["hand_force_max_N"].as_f64().expect("a number");
    assert!((told - pressed).abs() < 0.05 * pressed, "{told} N");
}

/// One arm, which does not turn its tool.
#[test]
fn hands_that_cannot_be_are_refused() {
    let desk = Desk::new();
    let tool = "(shape: Sphere(radius: 0.005), hand: Pinch, keyframes: [(time: 0.0, position: (0.0, 0.02, 0.0))])";
    let turned = "(shape: Sphere(radius: 0.005), hand: Firm, keyframes: [(time: 0.0, position: (0.0, 0.02, 0.0)),
        (time: 1.0, position: (0.0, 0.01, 0.0), rotation: (axis: (0.0, 1.0, 0.0), degrees: 20.0))])";
    for (tools, name) in [(format!("[{tool}, {tool}]"), "tools.hand"), (format!("[{turned}]"), "keyframes.rotation")] {
        desk.run(&format!("{BLOCK}, tools: {tools}")).ends(2, &[name]);
    }
}
