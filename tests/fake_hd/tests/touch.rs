//! The driver of a Touch through a library that is loaded as the true one is: every fault ends in no force,
//! in one message, and in force again.

mod bench;

use bench::{Bench, Seen, Wall, advance, advance_to, count, file, hand, leans, motors, options, plan, time};
use bevy_clay::haptics::device::failover::{Failover, FailoverEvent, Retry};
use bevy_clay::haptics::device::fault::{DeviceError, DeviceEvent, Fault};
use bevy_clay::haptics::device::hd::library::load;
use bevy_clay::haptics::device::touch::{Calibration, Touch, TouchOptions};
use bevy_clay::haptics::device::{DeviceInfo, DevicePhase, DeviceState, HapticDevice, NotStarted, RunningDevice, Servo};
use bevy_clay::haptics::safety::Stage;
use glam::DVec3;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, MutexGuard};
use std::time::Duration;

/// Counts what threads of loops allocate. (The library has an allocator of its own.)
struct Watching;

thread_local! {
    static IS_WATCHED: Cell<bool> = const { Cell::new(false) };
}
static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

/// From here on this thread is watched.
fn watch_allocations() {
    IS_WATCHED.set(true);
}

// SAFETY: the system's allocator does all of it.
unsafe impl GlobalAlloc for Watching {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(u64::from(IS_WATCHED.get()), Ordering::Relaxed);
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        ALLOCATIONS.fetch_add(u64::from(IS_WATCHED.get()), Ordering::Relaxed);
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Watching = Watching;

/// Longest time from a fault to no force \[s\].
const LATEST: f64 = 0.02;

/// A fault by plan from 2 s on: no force within 20 ms and until it ends, told once; force again by `back`
/// \[s\].
fn fault_ends_in_no_force(text: &str, fault: Option<Fault>, stage: Stage, end: f64, back: f64) {
    drop(thrown_hand_gets_no_force(text, 0.0, fault, stage, end, back));
}

/// As that, with a hand that the plan throws so far \[m\]: it is led back slowly. The device stays this
/// test's as long as what it returns lives.
fn thrown_hand_gets_no_force(
    text: &str,
    thrown: f64,
    fault: Option<Fault>,
    stage: Stage,
    end: f64,
    back: f64,
) -> MutexGuard<'static, ()> {
    let one = plan(&format!("virtual;{text}"));
    let mut bench = Bench::lean();
    bench.advance_to(2.0 + LATEST);
    while time() < end {
        assert_eq!(motors(), DVec3::ZERO, "{text} at {} s", time());
        bench.tick();
    }
    while time() < end + 1.0 && thrown > 0.0 {
        hand(0.005 + thrown * (end + 1.0 - time()));
        bench.tick();
    }
    let before = bench.seen.episodes(stage);
    bench.advance_to(back);
    assert!(leans(motors()), "{text}: {} at {back} s, {:?}", motors(), bench.events);
    if let Some(fault) = fault {
        assert_eq!(bench.told(fault), [1, 1], "{text}: {:?}", bench.events);
        assert_eq!(bench.events.len(), 2, "{text}: {:?}", bench.events);
    } else {
        assert!(bench.events.is_empty(), "{text}: {:?}", bench.events);
    }
    assert_eq!((before, bench.seen.episodes(stage)), (1, 1), "{text}: {stage:?}");
    assert_eq!(bench.running.phase(), DevicePhase::Running);
    one
}

#[test]
fn errors_of_force_end_in_no_force_and_in_force_again() {
    for code in ["0x0201", "0x0202", "0x0203", "0x0204"] {
        fault_ends_in_no_force(&format!("error={code}@2..2.3"), Some(Fault::Force), Stage::Device, 2.39, 3.5);
    }
}

#[test]
fn warm_motors_end_in_no_force_until_they_are_cool() {
    fault_ends_in_no_force("warm@1.99..2.3", Some(Fault::WarmMotors), Stage::Device, 2.35, 4.0);
}

#[test]
fn a_place_or_turn_that_is_no_number_ends_in_no_force() {
    fault_ends_in_no_force("nan_pose@2..2.3", Some(Fault::Pose), Stage::Device, 2.39, 3.5);
    fault_ends_in_no_force("nan_transform@2..2.3", Some(Fault::Pose), Stage::Device, 2.39, 3.5);
}

#[test]
fn a_hand_that_flies_ends_in_no_force() {
    // The arm takes 5 ms to be faster than 1 m/s.
    drop(thrown_hand_gets_no_force("speed=6@2..2.03", 0.18, None, Stage::Speed, 2.04, 4.5));
}

#[test]
fn the_librarys_own_limit_of_speed_is_an_error_of_force() {
    drop(thrown_hand_gets_no_force("max_speed=700;speed=4@2..2.03", 0.12, Some(Fault::Force), Stage::Device, 2.1, 4.5));
}

#[test]
fn calibration_that_is_lost_is_found_in_the_inkwell_with_the_motors_off() {
    // Looked at ten times a second; the library itself gives no force to an arm whose place it does not know.
    let text = "uncalibrated@2;inkwell@2.5..2.9";
    let _one = thrown_hand_gets_no_force(text, 0.0, Some(Fault::Uncalibrated), Stage::Device, 2.5, 4.5);
    assert!(count("calibrate") > 0);
    assert_eq!(count("calibrate_while_on"), 0);
}

#[test]
fn calibration_that_the_device_finds_itself_is_found() {
    let _one = plan("virtual;uncalibrated@2;auto");
    let mut bench = Bench::lean();
    bench.advance_to(4.0);
    assert!(leans(motors()), "{}", motors());
    assert_eq!((count("calibrate_while_on"), bench.told(Fault::Uncalibrated)), (0, [1, 1]));
}

#[test]
fn an_uncalibrated_device_opens_says_so_and_does_not_push() {
    let _one = plan("virtual;uncalibrated@0.001");
    advance(5);
    let touch = Touch::open(options()).unwrap();
    assert_eq!(touch.calibration(), Calibration::Needed);
    let mut bench = Bench::run(touch);
    hand(0.005);
    while time() < 1.0 {
        bench.tick();
        assert_eq!(motors(), DVec3::ZERO);
    }
    assert_eq!(bench.told(Fault::Uncalibrated), [1, 0]);
    assert!(bench.events[0].to_string().contains("inkwell"));
}

#[test]
fn stale_clay_fades_and_comes_back_once_the_hand_is_free() {
    let _one = plan("virtual");
    let mut bench = Bench::lean();
    bench.seen.is_frozen.store(true, Ordering::Relaxed);
    let start = time();
    let lean = motors().length();
    let mut last = lean;
    while time() < start + 1.0 {
        bench.tick();
        let (age, force) = (time() - start, motors().length());
        match age {
            ..0.0325 => assert!((force - lean).abs() < 0.05, "{age}: {force}"),
            0.1335.. => assert_eq!(force, 0.0, "{age}"),
            // The hand comes in as the force fades, and the wall with it.
            _ => assert!(force <= last + 0.03, "{age}: {force}"),
        }
        last = force;
    }
    bench.seen.is_frozen.store(false, Ordering::Relaxed);
    bench.advance_to(start + 2.0);
    assert_eq!(motors(), DVec3::ZERO, "the clay is back, the hand deep in it");
    hand(-0.005);
    bench.advance_to(start + 2.5);
    hand(0.005);
    bench.advance_to(start + 4.0);
    assert!(leans(motors()), "{}", motors());
    assert_eq!(bench.seen.episodes(Stage::Age), 1);
}

#[test]
fn a_device_that_does_not_answer_is_lost_and_can_be_opened_anew() {
    for code in ["0x0300", "0x0302", "0x0303", "0x0304"] {
        let _one = plan(&format!("virtual;error={code}@2"));
        let mut bench = Bench::lean();
        bench.advance_to(2.0 + LATEST);
        assert_eq!((motors(), bench.running.phase()), (DVec3::ZERO, DevicePhase::Lost), "{code}");
        let ticks = bench.seen.ticks.load(Ordering::Relaxed);
        bench.advance_to(2.5);
        assert_eq!(bench.seen.ticks.load(Ordering::Relaxed), ticks, "the loop is over");
        assert_eq!((bench.told(Fault::Lost), bench.events.len()), ([1, 0], 1), "{:?}", bench.events);
        assert!(matches!(Touch::open(options()), Err(DeviceError::Busy)), "one at a time");
        assert!(bench.running.stop().is_some(), "the servo comes back");
        let mut bench = Bench::run(Touch::open(options()).unwrap());
        bench.advance_to(4.0);
        assert!(leans(motors()), "{}", motors());
        assert_eq!((count("open"), count("close")), (2, 1));
    }
}

#[test]
fn a_scheduler_that_calls_nobody_is_told_once() {
    let _one = plan("virtual;silent@2..");
    let mut bench = Bench::lean();
    bench.advance_to(2.4);
    assert_eq!((bench.running.phase(), bench.events.len()), (DevicePhase::Running, 0));
    bench.advance_to(3.0);
    assert_eq!((bench.running.phase(), bench.told(Fault::Lost)), (DevicePhase::Lost, [1, 0]));
    assert!(bench.running.stop().is_some());
    assert_eq!(motors(), DVec3::ZERO);
}

#[test]
fn a_servo_that_panics_ends_the_loop_and_not_the_app() {
    let _one = plan("virtual");
    let mut bench = Bench::lean();
    bench.seen.is_broken.store(true, Ordering::Relaxed);
    bench.tick();
    assert_eq!((motors(), bench.running.phase(), bench.told(Fault::Servo)), (DVec3::ZERO, DevicePhase::Lost, [1, 0]));
    assert!(bench.running.stop().is_none(), "it is not used again");
    assert!(Touch::open(options()).is_ok());
}

#[test]
fn a_command_that_is_no_number_does_not_reach_the_library() {
    let _one = plan("virtual");
    let mut bench = Bench::lean();
    bench.seen.is_nan.store(true, Ordering::Relaxed);
    for _ in 0..200 {
        bench.tick();
        assert_eq!(motors(), DVec3::ZERO);
    }
    bench.seen.is_nan.store(false, Ordering::Relaxed);
    bench.advance_to(4.0);
    assert!(leans(motors()));
    assert_eq!((count("force_no_number"), bench.told(Fault::Command)), (0, [1, 1]));
}

#[test]
fn devices_that_do_not_open_are_told_in_one_message_and_open_later() {
    for (item, code) in [("no_device", 0x0300), ("busy", 0x0301)] {
        let _one = plan(&format!("virtual;{item}@0..1"));
        let error = Touch::open(options()).unwrap_err();
        assert!(matches!(error, DeviceError::Refused { code: told, internal: -7, .. } if told == code), "{error}");
        assert!(!error.to_string().contains('\n'), "{error}");
        advance_to(1.1);
        assert!(Touch::open(options()).is_ok(), "the claim was given back");
    }
    let _one = plan("virtual");
    let named = TouchOptions { name: Some(c"Left Device".into()), ..options() };
    assert!(matches!(Touch::open(named), Err(DeviceError::Refused { code: 0x0300, .. })));
}

#[test]
fn a_scheduler_without_room_is_told_and_gives_the_servo_back() {
    let _one = plan("virtual;full");
    let touch = Touch::open(options()).unwrap();
    let wall = Wall::new(&Arc::new(Seen::default()), touch.info());
    let not = Box::new(touch).run(Box::new(wall)).err().unwrap();
    assert!(matches!(not.error, DeviceError::Refused { code: 0x0501, .. }) && not.servo.is_some(), "{}", not.error);
    assert!(Touch::open(options()).is_ok());
}

#[test]
fn a_library_that_is_missing_or_another_is_told_with_what_helps() {
    let _one = plan("virtual");
    let with = |file: &str| TouchOptions { library: Some(file.into()), ..options() };
    let missing = Touch::open(with("/no/such/libHD.so")).unwrap_err().to_string();
    assert!(missing.contains("/no/such/libHD.so: ") && missing.contains("install OpenHaptics"), "{missing}");
    #[cfg(target_os = "linux")]
    {
        let another = Touch::open(with("libm.so.6")).unwrap_err().to_string();
        assert!(another.contains("hdInitDevice") && another.contains("another library"), "{another}");
    }
    assert!(Touch::open(options()).is_ok(), "the right one works after a wrong one");
}

#[test]
fn a_library_is_loaded_once_and_stays() {
    let [first, second] = [(); 2].map(|()| load(Some(&file())).unwrap());
    assert!(std::ptr::eq(first.api, second.api));
}

/// Millimetres, N/mm and columns of the library are SI and a turn here.
#[test]
fn what_a_device_says_is_si() {
    let _one = plan("virtual;button=3");
    let mut bench = Bench::run(Touch::open(options()).unwrap());
    let info = bench.running.info().clone();
    assert_eq!((info.name.as_str(), info.serial.as_str(), info.freedoms), ("Fake Touch", "F4K3", [6, 3]));
    assert_eq!((info.force_max, info.continuous_force_max, info.rate), (3.3, 0.88, 1000.0));
    assert!((info.stiffness_max - 500.0).abs() < 1e-9 && (info.damping_max - 4.0).abs() < 1e-9);
    assert!((info.workspace[0] - DVec3::new(-0.21, -0.11, -0.085)).length() < 1e-12);
    hand(-0.02);
    bench.advance_to(1.0);
    let state = bench.running.state().unwrap();
    assert!((state.position - DVec3::NEG_X * 0.02).length() < 1e-4 && state.velocity.length() < 0.01, "{state:?}");
    assert_eq!((state.buttons, state.is_muted, bench.running.phase()), (3, false, DevicePhase::Running));
    // A quarter to the left about Y takes X to -Z.
    assert!((state.rotation * DVec3::X - DVec3::NEG_Z).length() < 1e-9, "{:?}", state.rotation);
    assert!((state.time - time()).abs() < 2e-3);
}

#[test]
fn without_force_the_motors_stay_off() {
    let _one = plan("virtual");
    let mut bench = Bench::run(Touch::open(TouchOptions { has_force: false, ..options() }).unwrap());
    hand(0.005);
    while time() < 1.5 {
        bench.tick();
        assert_eq!(motors(), DVec3::ZERO);
    }
    assert!(bench.seen.ticks.load(Ordering::Relaxed) > 1000);
}

/// Pushes with 1 N, whatever it is told.
struct Heedless;

impl Servo for Heedless {
    fn tick(&mut self, _state: &DeviceState, _dt: f64) -> DVec3 {
        DVec3::X
    }
}

/// A servo without a chain of safety: the driver itself gives nothing while a fault lasts, and never more
/// than the device's greatest force.
#[test]
fn a_servo_that_heeds_nothing_is_held_by_the_driver() {
    let _one = plan("virtual;error=0x0201@1..1.1;error=0x0200@2..2.1;nan_pose@3..3.1;uncalibrated@4");
    let touch = Touch::open(options()).unwrap();
    let running = Box::new(touch).run(Box::new(Heedless)).map_err(|not| not.error).unwrap();
    for start in [1.0, 2.0, 3.0] {
        advance_to(start - 0.002);
        assert_eq!(motors(), DVec3::X, "{start} s");
        while time() < start + 0.19 {
            advance(1);
            let is_over = time() > start + LATEST;
            assert!(!is_over || motors() == DVec3::ZERO, "{} s: {}", time(), motors());
        }
    }
    advance_to(3.99);
    assert_eq!(motors(), DVec3::X);
    advance_to(4.0 + LATEST);
    assert_eq!(motors(), DVec3::ZERO);
    running.stop().unwrap();
}

/// The hand is in the wall before there is force; from nothing to all of it no step is greater than .3 N in
/// 1 ms.
#[test]
fn start_within_the_wall_does_not_kick() {
    let _one = plan("virtual");
    hand(0.01);
    advance(500);
    let mut bench = Bench::run(Touch::open(options()).unwrap());
    let mut last = DVec3::ZERO;
    bench.tick();
    assert!(motors().length() < 0.1, "{}", motors());
    while time() < 3.0 {
        bench.tick();
        assert!(motors().distance(last) <= 0.3 + 1e-9, "{} s: {last} to {}", time(), motors());
        last = motors();
    }
    assert!(last.length() > 1.0, "{last}");
}

#[test]
fn ticks_do_not_allocate() {
    let _one = plan("virtual;error=0x0202@1..1.1;nan_pose@1.3..1.4");
    let mut bench = Bench::run(Touch::open(options()).unwrap());
    hand(0.005);
    bench.advance_to(0.5);
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    bench.advance_to(2.0);
    assert_eq!(ALLOCATIONS.load(Ordering::Relaxed), before);
    assert_eq!(bench.events.len(), 4);
}

/// Holds a servo, and never ticks.
struct Idle(DeviceInfo);

struct Held(DeviceInfo, Box<dyn Servo>);

impl HapticDevice for Idle {
    fn info(&self) -> &DeviceInfo {
        &self.0
    }

    fn run(self: Box<Self>, servo: Box<dyn Servo>) -> Result<Box<dyn RunningDevice>, NotStarted> {
        Ok(Box::new(Held(self.0, servo)))
    }
}

impl RunningDevice for Held {
    fn info(&self) -> &DeviceInfo {
        &self.0
    }

    fn phase(&self) -> DevicePhase {
        DevicePhase::Running
    }

    fn state(&mut self) -> Option<DeviceState> {
        None
    }

    fn event(&mut self) -> Option<DeviceEvent> {
        None
    }

    fn stop(self: Box<Self>) -> Option<Box<dyn Servo>> {
        Some(self.1)
    }
}

/// The next thing that it tells; what is done aside takes its own time, the device's clock goes by `ticks`
/// each time it is asked.
fn next_in_ticks(failover: &mut Failover, ticks: u64) -> FailoverEvent {
    // A test whose event does not come ends all the same, after half a minute and more.
    for _ in 0..30_000 {
        advance(ticks);
        match failover.poll(time()) {
            Some(event) => return event,
            None => std::thread::sleep(Duration::from_millis(1)),
        }
    }
    panic!("nothing was told");
}

fn next(failover: &mut Failover) -> FailoverEvent {
    next_in_ticks(failover, 0)
}

#[test]
fn an_unplugged_device_has_a_stand_in_until_it_is_plugged_in_again() {
    let _one = plan("virtual;unplug@2..4");
    let touch = Touch::open(options()).unwrap();
    let info = touch.info().clone();
    drop(touch);
    let seen = Arc::new(Seen::default());
    let wall = Box::new(Wall::new(&seen, &info));
    let open = Arc::new(|| Touch::open(options()).map(|touch| Box::new(touch) as Box<dyn HapticDevice>));
    let stand_in = Arc::new(move || Ok(Box::new(Idle(info.clone())) as Box<dyn HapticDevice>));
    let retry = Retry { first: 0.5, growth: 1.0, most: 0.5 };
    let mut failover = Failover::start(open, stand_in, retry, wall).unwrap();
    assert!(matches!(next(&mut failover), FailoverEvent::StandIn));
    assert!(matches!(next(&mut failover), FailoverEvent::Here));
    hand(0.005);
    advance_to(1.999);
    assert!(leans(motors()) && failover.is_here());
    advance_to(2.0 + LATEST);
    assert_eq!(motors(), DVec3::ZERO);
    assert!(matches!(next(&mut failover), FailoverEvent::Device(event) if event.fault == Fault::Lost && event.code == 0x0302));
    assert!(matches!(next(&mut failover), FailoverEvent::StandIn));
    assert!(!failover.is_here() && failover.running().is_some());
    advance_to(2.6);
    assert!(matches!(next(&mut failover), FailoverEvent::Away(DeviceError::Refused { code: 0x0300, .. })));
    // Tried again in vain, and not told again.
    let opened = count("open");
    advance_to(3.2);
    for _ in 0..30_000 {
        assert!(failover.poll(time()).is_none());
        if count("open") > opened {
            break;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(count("open") > opened);
    advance_to(4.0);
    // When it is tried next depends on when the last try ended, aside.
    let here = next_in_ticks(&mut failover, 1);
    assert!(matches!(here, FailoverEvent::Here), "{here:?}");
    advance(2000);
    assert!(leans(motors()), "{}", motors());
    assert_eq!(seen.begun.load(Ordering::Relaxed), 2);
    assert!(failover.stop().is_some());
    assert_eq!(motors(), DVec3::ZERO);
}

#[test]
fn a_library_that_is_missing_leaves_the_stand_in() {
    let _one = plan("virtual");
    let seen = Arc::new(Seen::default());
    let info = Touch::open(options()).unwrap().info().clone();
    let wall = Box::new(Wall::new(&seen, &info));
    let missing = TouchOptions { library: Some(Path::new("/no/such/libHD.so").into()), ..options() };
    let open = Arc::new(move || Touch::open(missing.clone()).map(|touch| Box::new(touch) as Box<dyn HapticDevice>));
    let stand_in = Arc::new(move || Ok(Box::new(Idle(info.clone())) as Box<dyn HapticDevice>));
    let mut failover = Failover::start(open, stand_in, Retry::default(), wall).unwrap();
    assert!(matches!(next(&mut failover), FailoverEvent::StandIn));
    assert!(matches!(next(&mut failover), FailoverEvent::Away(DeviceError::Library(_))));
    assert!(failover.running().is_some() && !failover.is_here());
    advance(100);
    assert!(failover.stop().is_some());
}
