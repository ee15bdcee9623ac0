use super::*;

/// Presses along X as a spring does, and counts.
#[derive(Default)]
struct Spring {
    ticks: usize,
    time: f64,
    begun: usize,
}

impl Servo for Spring {
    fn begin(&mut self, info: &DeviceInfo) {
        assert!(info.force_max > 0.0);
        self.begun += 1;
    }

    fn tick(&mut self, state: &DeviceState, dt: f64) -> DVec3 {
        self.ticks += 1;
        self.time += dt;
        state.position * -100.0
    }
}

/// A hand that goes to and fro for so many ticks, with the numbers that are hard to write.
fn trace(count: u32) -> Trace {
    let tick = |i: u32| {
        let time = 10.0 + f64::from(i) / 1000.0;
        let state = DeviceState {
            time,
            position: DVec3::new((7.0 * time).sin() / 30.0, 1.0 / 3.0, -1e-300),
            rotation: DQuat::from_rotation_y(time),
            velocity: DVec3::new((7.0 * time).cos(), -0.0, 5e-324),
            buttons: i % 4,
            motor_temperature: 0.0,
            is_muted: false,
        };
        TraceTick { state, force: DVec3::new(0.1 + 0.2, -f64::from(i), f64::MIN_POSITIVE) }
    };
    let mut info = usual();
    (info.name, info.force_max) = ("A pen, of some kind".into(), 2.9);
    Trace { info, ticks: (0..count).map(tick).collect() }
}

fn written(trace: &Trace) -> String {
    let mut bytes = vec![];
    let mut writer = TraceWriter::new(&mut bytes, &trace.info).unwrap();
    trace.ticks.iter().for_each(|tick| writer.write(tick).unwrap());
    writer.finish().unwrap();
    String::from_utf8(bytes).unwrap()
}

#[test]
fn what_is_written_is_read_to_the_same_bit() {
    let trace = trace(50);
    let mut read = Trace::from_text(&written(&trace)).unwrap();
    assert!((read.info.rate - 1000.0).abs() < 1e-6, "{}", read.info.rate);
    read.info.rate = trace.info.rate;
    assert_eq!(read, trace);
    for (a, b) in read.ticks.iter().zip(&trace.ticks) {
        assert_eq!(a.state.velocity.y.to_bits(), b.state.velocity.y.to_bits());
    }
}

#[test]
fn wrong_files_are_told_by_line() {
    let good = written(&trace(3));
    let cases = [
        (good.replace("trace 1", "trace 2"), 1),
        (good.replace("# force_max 2.9", "# force_max -1"), 3),
        (good.replace("# force_max", "# forces"), 3),
        (good.replace("10.001,", "9.5,"), 7),
        (good.replace("10.001,", "NaN,"), 7),
        (good.replacen(",1,0.3", ",x,0.3", 1), 7),
        (good.trim_end().rsplit_once(',').unwrap().0.to_string(), 8),
    ];
    for (text, line) in cases {
        assert_eq!(Trace::from_text(&text).map_err(|(line, _)| line), Err(line), "{text}");
    }
    assert!(Trace::read(Path::new("/no/such/trace")).unwrap_err().to_string().contains("/no/such/trace"));
}

#[test]
fn a_trace_plays_every_tick_in_virtual_time() {
    let trace = trace(40);
    let mut spring = Spring::default();
    let forces = trace.play(&mut spring);
    assert_eq!((spring.ticks, spring.begun), (40, 1));
    assert!((spring.time - 0.04).abs() < 1e-9);
    assert!(forces.iter().zip(&trace.ticks).all(|(force, tick)| *force == tick.state.position * -100.0));
}

/// In real time it plays the same ticks, comes to its end and hands the servo back.
#[test]
fn a_trace_plays_every_tick_in_real_time() {
    let mut running = Box::new(TraceDevice(trace(40))).run(Box::<Spring>::default()).map_err(|not| not.error).unwrap();
    while running.phase() == DevicePhase::Running {
        std::thread::yield_now();
    }
    assert_eq!(running.phase(), DevicePhase::Ended);
    assert_eq!(running.state().unwrap().time, 10.039);
    assert!(running.stop().is_some());
}

#[test]
fn recorded_forces_are_played_by_time_and_end_with_nothing() {
    let trace = trace(10);
    let state = trace.ticks[0].state;
    let mut playback = ForcePlayback::new(trace);
    // Ticks of half the length, a quarter later than the trace's, see each force twice.
    playback.tick(&state, -0.25e-3);
    let forces: Vec<f64> = (0..22).map(|_| playback.tick(&state, 0.5e-3).y).collect();
    assert_eq!(forces[..6], [0.0, 0.0, -1.0, -1.0, -2.0, -2.0]);
    assert_eq!(forces[16..], [-8.0, -8.0, -9.0, -9.0, 0.0, 0.0]);
    assert_eq!(ForcePlayback::new(Trace { ticks: vec![], info: usual() }).tick(&state, 1e-3), DVec3::ZERO);
}
