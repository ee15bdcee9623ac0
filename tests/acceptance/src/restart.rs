//! Runs that are stopped and go on, and runs that are replayed: they have the bits of those that were not.

use bevy_clay::prelude::*;
use bevy_clay::scene::prelude::*;
use bevy_clay::scene::recording::{Event, Origin};
use bevy_clay::sim::prelude::*;
use std::ops::Range;
use std::path::Path;

/// A ball presses into a block and a blade cuts it meanwhile; inertia is scaled while they do, so that plans
/// depend on the reports of two frames before. 2,048 particles, 10 frames of a few dozen substeps.
const SCENE: &str = "(
    clay: [Box(size: (0.032, 0.016, 0.032), center: (0, 0.008, 0))],
    cell_width: 0.004,
    jitter: 0.3,
    frame_time: 0.003,
    duration: 0.03,
    integrator: Explicit,
    inertia: Fast,
    tools: [
        (name: \"ball\", shape: Sphere(radius: 0.006), keyframes: [
            (time: 0, position: (-0.006, 0.0222, 0.009)), (time: 0.02, position: (-0.006, 0.0202, 0.009)), (time: 0.03, position: (-0.006, 0.0242, 0.009)),
        ]),
        (name: \"blade\", shape: Blade(half_width: 0.03, half_height: 0.02), keyframes: [
            (time: 0, position: (0.008, 0.0365, 0)), (time: 0.024, position: (0.008, 0.034, 0)), (time: 0.03, position: (0.008, 0.037, 0)),
        ]),
    ],
)";

/// Frames of a restarted scene that are compared, at most: twice as many as the planner looks back.
const FRAMES_ALIKE: usize = 4;

/// Where a run of a scene stands after a frame.
#[derive(Clone, Debug, PartialEq)]
struct Moment {
    /// The clay, as a file holds it: in the engine's own order, with what it carries.
    clay: Vec<u8>,
    /// The planner, as text.
    planner: String,
}

/// Runs these frames of the scene; where it stands after each, and the plans.
fn run_scene(engine: &mut dyn Engine, built: &BuiltScene, mut planner: Planner, frames: Range<u64>) -> Vec<(Moment, FramePlan)> {
    let policy = built.planner().policy;
    planner.policy = policy;
    let frame = |index| {
        let Decision::Run(plan) = built.next(index, &mut planner) else { panic!("the planner waits") };
        engine.submit(plan.clone()).expect("a sound plan");
        planner.sent();
        let mut report = engine.wait().expect("an engine");
        assert!(!report.health.contains(Health::GIVEN_UP), "frame {index}: {}", report.health);
        planner.note(&mut report);
        let clay = engine.save().expect("a state").to_bytes();
        (Moment { clay, planner: ron::to_string(planner.state()).expect("text") }, plan)
    };
    frames.map(frame).collect()
}

fn scene() -> BuiltScene {
    ClayScene::from_ron(SCENE).and_then(|scene| scene.build(Path::new("."))).expect("a sound scene")
}

/// A scene restarted after some of its frames, mid-press and mid-cut, from the files of clay and planner, on
/// an engine of its own, has the same plans and the same bits, frame by frame, as one that went on.
///
/// # Panics
/// It has not.
pub fn assert_scene_restarts(mut engine: impl FnMut() -> Box<dyn Engine>) {
    let built = scene();
    let mut first = engine();
    first.load(&built.snapshot).expect("the clay loads");
    let whole = run_scene(&mut *first, &built, built.planner(), 0..built.frame_count());
    let scaled = whole.iter().filter(|(_, plan)| plan.density_scale() > 1.0).count();
    let last = Snapshot::from_bytes(&whole[whole.len() - 1].0.clay).expect("a snapshot");
    let cut = last.particles.iter().filter(|p| p.tags[0].side != 0).count();
    assert!(scaled > 2 && cut > 50, "{scaled} frames of scaled inertia, {cut} particles at the cut");
    // One, two and more frames of history: the ball presses, the blade enters, cuts and leaves.
    for at in [1, 4, 8] {
        let Moment { clay, planner } = &whole[at - 1].0;
        let clay = Snapshot::from_bytes(clay).expect("a snapshot");
        let clinging = clay.particles.iter().filter(|p| p.anchors[0] != Anchor::default()).count();
        assert!(at != 4 || clinging > 2, "{clinging} particles cling to the ball");
        let planner = Planner::resume(&clay, ron::from_str(planner).expect("a planner"));
        let mut other = engine();
        other.load(&clay).expect("the clay loads");
        // A moment is all that the next one depends on.
        let end = whole.len().min(at + FRAMES_ALIKE);
        let rest = run_scene(&mut *other, &built, planner, at as u64..end as u64);
        assert_same(&rest, &whole[at..end], at);
    }
}

fn assert_same(ours: &[(Moment, FramePlan)], theirs: &[(Moment, FramePlan)], at: usize) {
    assert_eq!(ours.len(), theirs.len());
    for (frame, ((ours, plan), (theirs, planned))) in (at..).zip(ours.iter().zip(theirs)) {
        assert_eq!(plan, planned, "restarted after {at} frames: the plan of frame {frame}");
        assert!(ours.clay == theirs.clay, "restarted after {at} frames: the clay after frame {frame}");
        assert_eq!(ours.planner, theirs.planner, "restarted after {at} frames: the planner after frame {frame}");
    }
}

/// Runs plans with two frames under way, as an app does; the clay at each frame's end, as a file holds it.
fn run_plans(engine: &mut dyn Engine, clay: &Snapshot, plans: &[FramePlan]) -> Vec<Vec<u8>> {
    engine.load(clay).expect("the clay loads");
    let mut rest = plans.iter().map(|plan| FramePlan { outputs: FrameOutputs::ALL, ..plan.clone() });
    let mut states = vec![];
    loop {
        while engine.pending() < 2
            && let Some(plan) = rest.next()
        {
            engine.submit(plan).expect("a sound plan");
        }
        if engine.pending() == 0 {
            return states;
        }
        let report = engine.wait().expect("an engine");
        assert!(!report.health.contains(Health::GIVEN_UP), "{}", report.health);
        states.push(engine.state_deferred().expect("clay is loaded")().expect("a state").to_bytes());
    }
}

/// Plans that average no volumes, restarted after so many of them as `stops` say from states that frames
/// handed out while the next was under way, have the same bits.
///
/// # Panics
/// They have not.
pub fn assert_plans_restart(mut engine: impl FnMut() -> Box<dyn Engine>, clay: &Snapshot, plans: &[FramePlan], stops: &[usize]) {
    assert!(plans.iter().all(|plan| plan.volume_averaging == 0.0));
    let whole = run_plans(&mut *engine(), clay, plans);
    for &at in stops {
        let clay = Snapshot::from_bytes(&whole[at - 1]).expect("a snapshot");
        let rest = run_plans(&mut *engine(), &clay, &plans[at..]);
        for (frame, (ours, theirs)) in (at..).zip(rest.iter().zip(&whole[at..])) {
            assert!(ours == theirs, "restarted after {at} frames: the clay after frame {frame}");
        }
        assert_eq!(rest.len(), plans.len() - at);
    }
}

/// A recorded half of a scene that is replayed on an engine of its own ends with the same bits, and says so.
///
/// # Panics
/// It does not.
pub fn assert_replays(mut engine: impl FnMut() -> Box<dyn Engine>) {
    let folder = tempfile::tempdir().expect("folder");
    let file = folder.path().join("run.clayrun");
    let built = scene();
    let mut first = engine();
    let mut recorder = Recorder::create(&file, &*first).expect("a file");
    let mut write = |event| recorder.write(&event).expect("written");
    first.load(&built.snapshot).expect("the clay loads");
    write(Event::Load(built.snapshot.clone()));
    // By then the ball presses and the blade cuts.
    let half = run_scene(&mut *first, &built, built.planner(), 0..built.frame_count() / 2);
    for (index, (_, plan)) in half.into_iter().enumerate() {
        write(Event::Plan(plan));
        write(Event::Report(index as u64));
    }
    let clay = first.save().expect("a state");
    write(Event::Ended(clay.checksum()));

    let mut second = engine();
    let recording = Recording::open(&file).expect("a recording");
    assert_eq!(*recording.origin(), Origin::of(&*second));
    let mut last = None;
    for event in recording {
        let event = event.expect("a sound event");
        last = Some(event.clone());
        event.apply(&mut *second).expect("an engine");
    }
    let replayed = second.save().expect("a state");
    assert!(replayed.to_bytes() == clay.to_bytes(), "other bits");
    assert_eq!(last, Some(Event::Ended(replayed.checksum())));
}
