use super::*;
use crate::sim::prelude::*;
use glam::{DQuat, DVec2, DVec3};
use std::path::PathBuf;

/// A place for a recording, and its folder, which goes with it.
fn place() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("folder");
    let file = folder.path().join("run.clayrun");
    (folder, file)
}

fn clay() -> Snapshot {
    let domain = Domain::new(DVec3::splat(-0.1), DVec3::splat(0.3), 0.01, Walls::default()).expect("domain");
    let particle = |i: u32| Particle::at(domain.to_grid(DVec3::new(1e-3 * f64::from(i), 0.01, 0.1)), 1e-7, i);
    let material = ClayMaterial { yield_stress: f64::INFINITY, ..Preset::SoftClay.material() };
    Snapshot::new(domain, material, (0..100).map(particle).collect())
}

/// Writes these events and reads them back.
fn through_file(events: &[Event]) -> Vec<Event> {
    let (_folder, file) = place();
    let mut recorder = Recorder::create(&file, &NativeEngine::new()).expect("a file");
    events.iter().for_each(|event| recorder.write(event).expect("written"));
    Recording::open(&file).expect("a recording").map(|event| event.expect("an event")).collect()
}

/// A tool of `shape` on a way of numbers that have no short decimals.
fn path(id: u32, shape: ToolShape, contact: Contact) -> ToolPath {
    let sample = |i: u32| {
        let x = f64::from(i + 1) / 3.0;
        let rotation = DQuat::from_rotation_y(x) * DQuat::from_rotation_x(-x);
        PoseSample { time: x, pose: Pose { position: DVec3::new(x, -0.0, 1e-300 * x), rotation } }
    };
    ToolPath { id, tool: Tool { shape, contact }, sheet: 200, samples: (0..5).map(sample).collect() }
}

/// Every law and weld rule (clay that never yields too), shape, contact, method and output, each in a plan of
/// its own, comes back as it was, to the last bit; debugging text tells 0 from -0.
#[test]
fn plans_survive_a_file() {
    let plan = FramePlan::new(clay().material, 1.0 / 3e5, 7);
    let mut plans = vec![plan.clone()];
    for law in ClayLaw::ALL {
        for yield_stress in [f64::INFINITY, 1.0 / 3.0] {
            plans.extend(Weld::ALL.map(|weld| {
                let material = ClayMaterial { law, weld, yield_stress, young_modulus: 1e300, ..plan.material };
                FramePlan { material, ..plan.clone() }
            }));
        }
    }
    let law = ClayLaw::Worked { loss: 0.1, rate: 1.0 / 7.0, rest_time: f64::INFINITY };
    plans.push(FramePlan { material: ClayMaterial { law, ..plan.material }, ..plan.clone() });
    for shape in ToolShape::ALL {
        plans.extend(Contact::ALL.map(|contact| FramePlan { tools: vec![path(3, shape, contact)], ..plan.clone() }));
    }
    let bend = [DVec2::new(-0.1, 0.01), DVec2::new(1.0 / 30.0, 0.0), DVec2::new(0.1, 0.02)];
    let bent = ToolShape::BentBlade { profile: Profile::new(&bend).expect("a profile"), half_height: 0.1 };
    let all = ToolShape::ALL.into_iter().chain([bent]);
    let tools = (0..).zip(all).map(|(id, shape)| path(id, shape, Contact::Separate { friction: 0.3 })).collect();
    plans.push(FramePlan { tools, ..plan.clone() });
    plans.extend(CuttingMethod::ALL.map(|cutting| FramePlan { cutting, ..plan.clone() }));
    for (surface, state) in [(false, false), (false, true), (true, false), (true, true)] {
        let integrator = Integrator::Explicit { density_scale: 64.0 / 3.0 };
        let outputs = FrameOutputs { surface, state, support: surface != state, touch: surface && state };
        plans.push(FramePlan { id: u64::MAX, integrator, outputs, volume_averaging: 0.1, gravity: DVec3::NEG_Y, ..plan.clone() });
    }
    let events: Vec<Event> = std::iter::once(Event::Load(clay())).chain(plans.into_iter().map(Event::Plan)).collect();
    let read = through_file(&events);
    assert_eq!(read, events);
    assert_eq!(format!("{read:?}"), format!("{events:?}"));
}

fn events() -> Vec<Event> {
    let plan = FramePlan::new(clay().material, 1e-5, 3);
    vec![
        Event::Load(clay()),
        Event::StrokeBegan,
        Event::Plan(plan.clone()),
        Event::Plan(FramePlan { id: 1, tools: vec![path(1, ToolShape::ALL[0], Contact::ALL[0])], ..plan }),
        Event::Report(0),
        Event::Report(1),
        Event::StrokeEnded,
        Event::Load(Snapshot { time: 3.0, forecasts: Some([Forecast { reach: 0.1, ..Forecast::default() }; 2]), ..clay() }),
        Event::Ended(7),
    ]
}

#[test]
fn every_event_comes_back() {
    assert_eq!(through_file(&events()), events());
}

/// The file of [`events`], as bytes, and where each event ends.
fn file_of_events() -> (Vec<u8>, Vec<usize>) {
    let (_folder, file) = place();
    let mut recorder = Recorder::create(&file, &NativeEngine::new()).expect("a file");
    let length = || std::fs::metadata(&file).expect("a file").len() as usize;
    let mut ends = vec![length()];
    for event in events() {
        recorder.write(&event).expect("written");
        ends.push(length());
    }
    (std::fs::read(&file).expect("bytes"), ends)
}

/// What a file of these bytes gives, and whether it was cut short.
fn read(file: &Path, bytes: &[u8]) -> Result<(Vec<Event>, bool), String> {
    std::fs::write(file, bytes).expect("a file");
    let mut recording = Recording::open(file).map_err(|e| e.to_string())?;
    let events = recording.by_ref().collect::<Result<Vec<_>, _>>().map_err(|e| e.to_string())?;
    assert_eq!(recording.events(), events.len() as u64);
    Ok((events, recording.is_cut_short()))
}

/// Of a file that ends anywhere, the events before are read, and it is told whether one was cut.
#[test]
fn cut_file_gives_what_it_has() {
    let (_folder, file) = place();
    let (bytes, ends) = file_of_events();
    for length in (0..bytes.len()).step_by(37).chain(ends.iter().copied()) {
        let read = read(&file, &bytes[..length]);
        if length < ends[0] {
            let error = read.expect_err("no recording");
            assert!(error.contains("run.clayrun: event 0: the file is cut short") || length < 8, "{length}: {error}");
            continue;
        }
        let whole = ends.iter().filter(|end| **end <= length).count() - 1;
        assert_eq!(read, Ok((events()[..whole].to_vec(), !ends.contains(&length))), "cut to {length}");
    }
}

/// A changed byte anywhere is found, and named by file and event.
#[test]
fn changed_bytes_are_refused() {
    let (_folder, file) = place();
    let (bytes, ends) = file_of_events();
    for at in (0..bytes.len()).step_by(13) {
        let mut changed = bytes.clone();
        changed[at] ^= 0x20;
        let error = read(&file, &changed).expect_err("damaged");
        let event = ends.iter().filter(|end| **end <= at).count();
        let named = format!("run.clayrun: event {event}: its checksum does not fit");
        let lengths = format!("run.clayrun: event {event}: the checksum of its lengths");
        assert!(at < 12 || error.contains(&named) || error.contains(&lengths), "byte {at}: {error}");
        assert_eq!(error.lines().count(), 1);
    }
}

/// Events that have no place where they stand, and packets that are none.
#[test]
fn misplaced_events_are_named() {
    let (_folder, file) = place();
    let plan = || Event::Plan(FramePlan::new(clay().material, 1e-5, 3));
    let cases = [
        (vec![plan()], "event 1: no clay has been loaded before it"),
        (vec![Event::Load(clay()), Event::Report(0)], "event 2: it is a report where no frame is under way"),
        (vec![Event::Load(clay()), plan(), Event::Load(clay()), Event::Report(0)], "event 4: it is a report where no"),
    ];
    for (events, part) in cases {
        let mut recorder = Recorder::create(&file, &NativeEngine::new()).expect("a file");
        events.into_iter().for_each(|event| recorder.write(&event).expect("written"));
        let error = Recording::open(&file).expect("a recording").find_map(Result::err).expect("an error").to_string();
        assert!(error.contains(part), "{error}");
    }
    let start = file_of_events();
    let with = |head: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = start.0[..start.1[0]].to_vec();
        head(&mut bytes);
        read(&file, &bytes).expect_err("no event")
    };
    let unknown = with(&|bytes| packet::write(bytes, &"Melted", &[]).expect("written"));
    assert!(unknown.contains("run.clayrun: event 1: its head cannot be read: "), "{unknown}");
    let half = with(&|bytes| packet::write(bytes, &Event::Load(clay()), &[0; 7]).expect("written"));
    assert!(half.contains("event 1: it holds a part of a particle"), "{half}");
    let full = with(&|bytes| packet::write(bytes, &Event::StrokeBegan, &[0; 7]).expect("written"));
    assert!(full.contains("event 1: it holds more than an event of its kind"), "{full}");
}

/// Other files, other versions, folders and endless devices.
#[test]
fn other_files_are_named() {
    let (folder, file) = place();
    let (mut bytes, _) = file_of_events();
    bytes[8..12].copy_from_slice(&9u32.to_le_bytes());
    let cases =
        [(&bytes[..], "version 9; this program reads version 1"), (&clay().to_bytes(), "is no recording"), (b"", "is no")];
    for (bytes, part) in cases {
        let error = read(&file, bytes).expect_err("refused");
        assert!(error.contains("run.clayrun: ") && error.contains(part), "{error}");
    }
    assert!(Recording::open(folder.path()).is_err() && Recording::open(&folder.path().join("none")).is_err());
    #[cfg(unix)]
    assert!(matches!(Recording::open(Path::new("/dev/zero")), Err(RecordingError::NotARecording { .. })));
}

/// Two engines one after the other, as an app has them where a stroke is taken back: one file, the same bits,
/// and of the first engine nothing after the second has begun.
#[test]
fn recorded_engines_share_a_file() {
    let (_folder, file) = place();
    let recorder = engine::SharedRecorder::new(&file);
    let record = || recorder.record(Box::new(NativeEngine::new()));
    let clay = clay();
    let tools = vec![path(3, ToolShape::ALL[0], Contact::Stick)];
    let plan = |id: u64| FramePlan { id, ..FramePlan::new(clay.material, 1e-5, 3) };
    let mut first = record();
    first.load(&clay).expect("loaded");
    first.submit(plan(1)).expect("submitted");
    first.wait().expect("a report");
    first.submit(FramePlan { tools, ..plan(2) }).expect("submitted");
    let mut second = record();
    second.load(&clay).expect("loaded");
    first.wait().expect("a report that nobody wants");
    drop(first);
    second.submit(plan(3)).expect("submitted");
    let mut reference = NativeEngine::new();
    reference.load(&clay).expect("loaded");
    reference.submit(plan(3)).expect("submitted");
    reference.wait().expect("a report");
    drop(second);
    assert!(recorder.take_fault().is_none());
    let events: Vec<_> = Recording::open(&file).expect("a recording").map(|event| event.expect("an event")).collect();
    let kinds: Vec<_> =
        events.iter().map(|event| format!("{event:?}").split(['(', ' ']).next().unwrap_or_default().to_string()).collect();
    assert_eq!(kinds, ["Load", "Plan", "Report", "StrokeBegan", "Plan", "Load", "Plan", "Report", "Ended"]);
    let sum = reference.save().expect("the clay").checksum();
    assert_eq!(events.last(), Some(&Event::Ended(sum)));
    let mut engine = NativeEngine::new();
    for event in events {
        event.apply(&mut engine).expect("applied");
    }
    assert_eq!(engine.save().expect("the clay").checksum(), sum);
}
