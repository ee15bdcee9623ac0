//! `--record` and `--replay`.

#[expect(dead_code, reason = "the program alone withdraws a recording")]
#[path = "../../examples/headless/record.rs"]
mod record;

use crate::{BLOCK, Desk, HEADLESS, Ran};
use bevy_clay::prelude::*;
use record::Record;
use std::path::Path;
use std::process::Command;

/// A ball that presses into the block for a part of the run.
const PRESSED: &str = "clay: [Box(size: (0.01, 0.01, 0.01))], cell_width: 0.005, frame_time: 0.005, duration: 0.05, tools: [(shape: Sphere(radius: 0.005), \
    keyframes: [(time: 0.01, position: (0, 0.0105, 0)), (time: 0.03, position: (0, 0.0085, 0))])]";

/// `headless SCENE --out out --record run.clayrun`.
pub(crate) fn recorded(desk: &Desk, scene: &str) -> Ran {
    Ran::of(desk.command(scene).args(["--record", "run.clayrun"]))
}

pub(crate) fn replay(desk: &Desk) -> Ran {
    Ran::of(Command::new(&*HEADLESS).current_dir(desk.0.path()).args(["--replay", "run.clayrun"]))
}

/// Without the scene and without a folder of results.
#[test]
fn replay_has_the_same_bits() {
    let desk = Desk::new();
    recorded(&desk, PRESSED).ends(0, &[]);
    assert_eq!(desk.summary()["frames"]["run"], 10);
    std::fs::remove_file(desk.at("scene.ron")).expect("a scene");
    std::fs::remove_dir_all(desk.at("out")).expect("results");
    let ran = replay(&desk);
    ran.ends(0, &[]);
    assert!(
        ran.out.contains("run.clayrun: 10 frames replayed, 0.050 s of clay") && ran.out.contains(": the same bits"),
        "{ran:?}"
    );
    assert!(!desk.at("out").exists());
}

/// The file as the program wrote it, with one text in it for another of its length, and checksums that fit.
fn forge(desk: &Desk, from: &str, to: &str) {
    let mut bytes = std::fs::read(desk.at("run.clayrun")).expect("a recording");
    let at = bytes.windows(from.len()).rposition(|part| part == from.as_bytes()).expect("the text");
    bytes[at..at + from.len()].copy_from_slice(to.as_bytes());
    let word = |bytes: &[u8], at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    let mut start = 12;
    while start < bytes.len() {
        let [head, body] = [word(&bytes, start), word(&bytes, start + 4)].map(|length| length as usize);
        let end = start + 20 + head + body;
        let sum = crc32fast::hash(&bytes[start + 20..end]).to_le_bytes();
        bytes[start + 12..start + 16].copy_from_slice(&sum);
        let sum = crc32fast::hash(&bytes[start..start + 16]).to_le_bytes();
        bytes[start + 16..start + 20].copy_from_slice(&sum);
        start = end;
    }
    std::fs::write(desk.at("run.clayrun"), bytes).expect("a recording");
}

/// Another way of the tool: an error where the engine is the same, and a line that says so where it is not.
#[test]
fn other_bits_are_told() {
    let desk = Desk::new();
    recorded(&desk, PRESSED).ends(0, &[]);
    forge(&desk, "radius:0.005", "radius:0.004");
    replay(&desk).ends(1, &["error: run.clayrun: 10 frames replayed, 0.050 s of clay, "]);
    forge(&desk, "native CPU engine, ", "native CPU engines ");
    let ran = replay(&desk);
    ran.ends(0, &["warning: run.clayrun: was made by version "]);
    assert!(ran.out.contains("other bits than the run's"), "{ran:?}");
}

/// What a killed run leaves is replayed as far as it goes.
#[test]
fn killed_run_is_replayed_as_far_as_it_goes() {
    let desk = Desk::new();
    recorded(&desk, PRESSED).ends(0, &[]);
    let bytes = std::fs::read(desk.at("run.clayrun")).expect("a recording");
    std::fs::write(desk.at("run.clayrun"), &bytes[..bytes.len() - 300]).expect("a recording");
    let ran = replay(&desk);
    ran.ends(0, &["warning: run.clayrun: its run was killed, the last of them cut: "]);
    assert!(ran.error.contains(" frames can be read, and there is no end to compare with"), "{ran:?}");
    assert!(ran.out.contains(" frames replayed") && !ran.out.contains("same bits"), "{ran:?}");
}

/// A plan that the engine refuses stops the run and is no part of it: the recording is whole without it.
#[test]
fn run_stopped_by_a_refusal_is_replayed() {
    let desk = Desk::new();
    let scene = ClayScene::from_ron(&format!("({PRESSED})")).expect("a scene");
    let built = scene.build(Path::new(".")).expect("clay");
    let (record, mut engine) = Record::of(Some(&desk.at("run.clayrun")), NativeEngine::new());
    engine.load(&built.snapshot).expect("loaded");
    let mut planner = built.planner();
    for frame in 0..4 {
        let Decision::Run(mut plan) = built.next(frame, &mut planner) else { panic!("a frame") };
        if frame == 3 {
            plan.dt = 0.0;
            engine.submit(plan).expect_err("no step of 0 s");
            break;
        }
        engine.submit(plan).expect("taken");
        planner.sent();
        let mut report = engine.wait().expect("a report");
        planner.note(&mut report);
    }
    drop(engine);
    assert_eq!(record.fault(), None);
    let ran = replay(&desk);
    ran.ends(0, &[]);
    assert!(ran.out.contains("run.clayrun: 3 frames replayed") && ran.out.contains(": the same bits"), "{ran:?}");
}

/// Bad recordings end with 2, before a frame is run.
#[test]
fn bad_recordings_are_named() {
    let desk = Desk::new();
    replay(&desk).ends(2, &["error: run.clayrun: "]);
    desk.write("run.clayrun", "(clay: [])");
    replay(&desk).ends(2, &["error: run.clayrun: is no recording of a run"]);
    recorded(&desk, BLOCK).ends(0, &[]);
    let bytes = std::fs::read(desk.at("run.clayrun")).expect("a recording");
    let mut other = bytes.clone();
    other[8] = 77;
    std::fs::write(desk.at("run.clayrun"), &other).expect("a recording");
    replay(&desk).ends(2, &["error: run.clayrun: is a recording of version 77; this program reads version 1"]);
    let mut damaged = bytes.clone();
    let at = bytes.len() - 1000;
    damaged[at] ^= 1;
    std::fs::write(desk.at("run.clayrun"), &damaged).expect("a recording");
    let ran = replay(&desk);
    ran.ends(2, &["error: run.clayrun: event "]);
    assert!(ran.error.contains("checksum") && ran.out.is_empty(), "{ran:?}");
    let with_scene = |argument: &str| Ran::of(desk.command(BLOCK).args(["--replay", argument]));
    with_scene("run.clayrun").ends(2, &["error: the argument '[SCENE]' cannot be used with '--replay <FILE>'"]);
    Ran::of(&mut Command::new(&*HEADLESS)).ends(2, &["error: the following required arguments were not provided: <SCENE>"]);
}

/// A recording that outgrows its disk (here a limit on its size) is told, and the run goes on.
#[test]
fn full_disk_costs_the_recording_alone() {
    let desk = Desk::new();
    let mut command = desk
        .command_after("trap '' XFSZ; ulimit -f 24", &BLOCK.replace("duration: 0.05", "duration: 0.5, outputs: (surface: None)"));
    command.args(["--record", "run.clayrun"]);
    let ran = Ran::of(&mut command);
    assert!(ran.code == Some(1) && ran.error.contains("error: the recording ends early: run.clayrun: "), "{ran:?}");
    let summary = desk.summary();
    assert_eq!((&summary["frames"]["run"], &summary["exit_status"]), (&30.into(), &1.into()));
}
