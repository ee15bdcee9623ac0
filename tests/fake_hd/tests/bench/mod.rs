//! The library under test as a driver finds it, and a servo that feels a wall.
#![allow(dead_code, reason = "each suite uses a part of it")]

use bevy_clay::haptics::device::fault::{DeviceEvent, Fault};
use bevy_clay::haptics::device::touch::{Touch, TouchOptions};
use bevy_clay::haptics::device::{DeviceInfo, DeviceState, HapticDevice, RunningDevice, Servo};
use bevy_clay::haptics::safety::{SafetyChain, SafetyReport, SafetySettings, Stage};
use glam::DVec3;
use libloading::Library;
use std::ffi::{CString, c_char};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};

/// The library's file: Cargo puts it beside the tests, or a folder above.
pub(crate) fn file() -> PathBuf {
    let name = format!("{}fake_hd{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let test = std::env::current_exe().expect("a path");
    let found = test.ancestors().skip(1).take(2).map(|folder| folder.join(&name)).find(|file| file.exists());
    found.unwrap_or_else(|| panic!("no {name} beside {}", test.display()))
}

/// Its own entries.
pub(crate) struct Control {
    advance: unsafe extern "system" fn(u64) -> u64,
    time: unsafe extern "system" fn() -> f64,
    hand: unsafe extern "system" fn(f64, f64, f64),
    motors: unsafe extern "system" fn(*mut f64),
    count: unsafe extern "system" fn(*const c_char) -> u64,
    reset: unsafe extern "system" fn(*const c_char) -> u8,
}

static CONTROL: LazyLock<Control> = LazyLock::new(|| {
    // SAFETY: the library of this package, with the types of its `control`; it is never unloaded.
    unsafe {
        let library = Box::leak(Box::new(Library::new(file()).expect("the library")));
        Control {
            advance: *library.get(b"fakehd_advance").expect("an entry"),
            time: *library.get(b"fakehd_time").expect("an entry"),
            hand: *library.get(b"fakehd_hand").expect("an entry"),
            motors: *library.get(b"fakehd_motors").expect("an entry"),
            count: *library.get(b"fakehd_count").expect("an entry"),
            reset: *library.get(b"fakehd_reset").expect("an entry"),
        }
    }
});

/// The device's clock \[s\].
pub(crate) fn time() -> f64 {
    // SAFETY: takes nothing.
    unsafe { (CONTROL.time)() }
}

/// Lets ticks go by; how many the scheduler ran.
pub(crate) fn advance(ticks: u64) -> u64 {
    // SAFETY: takes a number.
    unsafe { (CONTROL.advance)(ticks) }
}

/// Lets ticks go by until `end` \[s\].
pub(crate) fn advance_to(end: f64) {
    advance(((end - time()) * 1000.0).round().max(0.0) as u64);
}

/// Where the hand wants to be along X \[m\].
pub(crate) fn hand(x: f64) {
    // SAFETY: takes numbers.
    unsafe { (CONTROL.hand)(x, 0.0, 0.0) }
}

/// Force on the motors \[N\].
pub(crate) fn motors() -> DVec3 {
    let mut force = [0.0; 3];
    // SAFETY: room for three.
    unsafe { (CONTROL.motors)(force.as_mut_ptr()) };
    DVec3::from_array(force)
}

/// How often something happened.
pub(crate) fn count(what: &str) -> u64 {
    let what = CString::new(what).expect("a text");
    // SAFETY: a text.
    unsafe { (CONTROL.count)(what.as_ptr()) }
}

/// The one device is one test's at a time. All is anew, by that plan.
pub(crate) fn plan(text: &str) -> MutexGuard<'static, ()> {
    static ONE: Mutex<()> = Mutex::new(());
    let guard = ONE.lock().unwrap_or_else(PoisonError::into_inner);
    let text = CString::new(text).expect("a text");
    // SAFETY: a text.
    assert_eq!(unsafe { (CONTROL.reset)(text.as_ptr()) }, 1, "{text:?}");
    guard
}

pub(crate) fn options() -> TouchOptions {
    TouchOptions { library: Some(file()), clock: time, ..TouchOptions::default() }
}

/// What a test says to its servo and sees of it.
#[derive(Default)]
pub(crate) struct Seen {
    /// The clay's models are no longer renewed.
    pub(crate) is_frozen: AtomicBool,
    /// It asks for a force that is no number.
    pub(crate) is_nan: AtomicBool,
    /// It panics.
    pub(crate) is_broken: AtomicBool,
    pub(crate) ticks: AtomicU64,
    pub(crate) begun: AtomicU64,
    pub(crate) report: Mutex<SafetyReport>,
    pub(crate) state: Mutex<Option<DeviceState>>,
}

impl Seen {
    pub(crate) fn episodes(&self, stage: Stage) -> u32 {
        self.report.lock().expect("a lock").episodes(stage)
    }
}

/// Stiffness of the wall \[N/m\].
const WALL: f64 = 400.0;

/// A wall at x = 0, behind the chain of safety.
pub(crate) struct Wall {
    seen: Arc<Seen>,
    chain: SafetyChain,
    stamp: f64,
}

impl Wall {
    pub(crate) fn new(seen: &Arc<Seen>, info: &DeviceInfo) -> Self {
        Self { seen: seen.clone(), chain: SafetyChain::new(SafetySettings::default(), info), stamp: f64::NEG_INFINITY }
    }
}

impl Servo for Wall {
    fn begin(&mut self, info: &DeviceInfo) {
        self.seen.begun.fetch_add(1, Ordering::Relaxed);
        self.chain.begin(info);
    }

    fn tick(&mut self, state: &DeviceState, dt: f64) -> DVec3 {
        crate::watch_allocations();
        assert!(!self.seen.is_broken.load(Ordering::Relaxed), "a fault by plan");
        if !self.seen.is_frozen.load(Ordering::Relaxed) {
            self.stamp = state.time;
        }
        let asked = DVec3::NEG_X * WALL * state.position.x.max(0.0);
        let force = self.chain.apply(asked, state.time - self.stamp, state, dt);
        self.seen.ticks.fetch_add(1, Ordering::Relaxed);
        *self.seen.report.lock().expect("a lock") = *self.chain.report();
        *self.seen.state.lock().expect("a lock") = Some(*state);
        if self.seen.is_nan.load(Ordering::Relaxed) { DVec3::NAN } else { force }
    }
}

/// A Touch that ticks, with a hand that leans on the wall.
pub(crate) struct Bench {
    pub(crate) running: Box<dyn RunningDevice>,
    pub(crate) seen: Arc<Seen>,
    pub(crate) events: Vec<DeviceEvent>,
}

impl Bench {
    /// Runs a Touch that is open.
    pub(crate) fn run(touch: Touch) -> Self {
        let seen = Arc::new(Seen::default());
        let wall = Wall::new(&seen, touch.info());
        let running = Box::new(touch).run(Box::new(wall)).map_err(|not| not.error).expect("a loop");
        Self { running, seen, events: vec![] }
    }

    /// Opens the Touch and leans on the wall for two seconds: .67 N.
    pub(crate) fn lean() -> Self {
        let mut bench = Self::run(Touch::open(options()).expect("a Touch"));
        hand(0.005);
        bench.advance_to(1.999);
        assert!(leans(motors()), "{}", motors());
        bench
    }

    /// Lets a tick go by.
    pub(crate) fn tick(&mut self) {
        advance(1);
        self.events.extend(std::iter::from_fn(|| self.running.event()));
    }

    pub(crate) fn advance_to(&mut self, end: f64) {
        while time() < end - 0.5e-3 {
            self.tick();
        }
    }

    /// How often a fault began and ended.
    pub(crate) fn told(&self, fault: Fault) -> [usize; 2] {
        [true, false].map(|begun| self.events.iter().filter(|e| e.fault == fault && e.has_begun == begun).count())
    }
}

/// Whether the hand leans on the wall.
pub(crate) fn leans(force: DVec3) -> bool {
    force.x < -0.6 && force.x > -0.75
}
