//! The thread that ticks: by the wall's clock, or by ticks that are granted.

use crate::abi::{Callback, SCHEDULER_FULL, TIMER_ERROR};
use crate::lock;
use crate::world::{RATE, WORLD};
use std::cell::Cell;
use std::ffi::{c_ulong, c_void};
use std::sync::{Condvar, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How many callbacks there may be.
const ROOM: usize = 16;
/// Longest wait for a callback that is to run once \[s\]: what waits on a scheduler that stands would wait for
/// ever.
const WAIT: u64 = 2;

#[derive(Clone, Copy)]
struct Job {
    id: c_ulong,
    callback: Callback,
    /// The caller's pointer.
    data: usize,
    priority: u16,
    is_once: bool,
}

struct Scheduler {
    jobs: Vec<Job>,
    next_id: c_ulong,
    is_running: bool,
    /// Ticks that may be run, in virtual time.
    granted: u64,
    ticks: u64,
    thread: Option<JoinHandle<()>>,
}

static SCHEDULER: Mutex<Scheduler> =
    Mutex::new(Scheduler { jobs: vec![], next_id: 1, is_running: false, granted: 0, ticks: 0, thread: None });
/// Something of the scheduler changed.
static CHANGED: Condvar = Condvar::new();

thread_local! {
    static IS_SERVO: Cell<bool> = const { Cell::new(false) };
}

/// Puts a callback in its place, by priority; its number, or all ones.
pub(crate) fn add(callback: Callback, data: *mut c_void, priority: u16, is_once: bool) -> c_ulong {
    let is_full = lock(&WORLD).has("full");
    let mut scheduler = lock(&SCHEDULER);
    if is_full || scheduler.jobs.len() >= ROOM {
        drop(scheduler);
        lock(&WORLD).error(SCHEDULER_FULL);
        return c_ulong::MAX;
    }
    let id = scheduler.next_id;
    scheduler.next_id += 1;
    let at = scheduler.jobs.partition_point(|job| job.priority >= priority);
    scheduler.jobs.insert(at, Job { id, callback, data: data as usize, priority, is_once });
    id
}

/// Runs a callback within the scheduler, and waits for it.
pub(crate) fn run_once(callback: Callback, data: *mut c_void, priority: u16) {
    if IS_SERVO.get() {
        // SAFETY: the caller's callback and pointer, in the scheduler's thread.
        unsafe { callback(data) };
        return;
    }
    if !lock(&SCHEDULER).is_running {
        return lock(&WORLD).error(TIMER_ERROR);
    }
    let id = add(callback, data, priority, true);
    if id != c_ulong::MAX && !wait(id, true) {
        remove(id);
        lock(&WORLD).error(TIMER_ERROR);
    }
}

pub(crate) fn remove(id: c_ulong) {
    lock(&SCHEDULER).jobs.retain(|job| job.id != id);
    CHANGED.notify_all();
}

/// Whether a callback is over; `is_patient` waits for it, but not for ever.
pub(crate) fn wait(id: c_ulong, is_patient: bool) -> bool {
    let is_there = |scheduler: &mut Scheduler| scheduler.jobs.iter().any(|job| job.id == id);
    let mut scheduler = lock(&SCHEDULER);
    if !is_patient {
        return !is_there(&mut scheduler);
    }
    let waited = CHANGED.wait_timeout_while(scheduler, Duration::from_secs(WAIT), is_there);
    !waited.unwrap_or_else(std::sync::PoisonError::into_inner).1.timed_out()
}

pub(crate) fn start() {
    let mut scheduler = lock(&SCHEDULER);
    if scheduler.is_running {
        return;
    }
    (scheduler.is_running, scheduler.granted) = (true, 0);
    let spawned = std::thread::Builder::new().name("fake_hd servo".into()).spawn(servo);
    match spawned {
        Ok(thread) => scheduler.thread = Some(thread),
        Err(_) => {
            scheduler.is_running = false;
            drop(scheduler);
            lock(&WORLD).error(TIMER_ERROR);
        }
    }
}

/// Stops, and waits for the tick under way.
pub(crate) fn stop() {
    let mut scheduler = lock(&SCHEDULER);
    scheduler.is_running = false;
    let thread = scheduler.thread.take();
    drop(scheduler);
    CHANGED.notify_all();
    if let Some(thread) = thread.filter(|_| !IS_SERVO.get()) {
        drop(thread.join());
    }
    lock(&WORLD).stop();
}

/// Runs `count` ticks of virtual time and waits for them; how many the scheduler ran. Where it stands the
/// clock alone goes on.
pub(crate) fn advance(count: u64) -> u64 {
    let mut scheduler = lock(&SCHEDULER);
    let before = scheduler.ticks;
    if scheduler.is_running {
        scheduler.granted += count;
        CHANGED.notify_all();
        let is_busy = |scheduler: &mut Scheduler| scheduler.is_running && scheduler.granted > 0;
        scheduler = CHANGED.wait_while(scheduler, is_busy).unwrap_or_else(std::sync::PoisonError::into_inner);
    }
    let ran = scheduler.ticks - before;
    drop(scheduler);
    (ran..count).for_each(|_| lock(&WORLD).tick());
    ran
}

/// Ticks until it is stopped.
fn servo() {
    IS_SERVO.set(true);
    let is_virtual = lock(&WORLD).has("virtual");
    let mut next = Instant::now();
    loop {
        let mut scheduler = lock(&SCHEDULER);
        if is_virtual {
            let is_idle = |scheduler: &mut Scheduler| scheduler.is_running && scheduler.granted == 0;
            scheduler = CHANGED.wait_while(scheduler, is_idle).unwrap_or_else(std::sync::PoisonError::into_inner);
        }
        if !scheduler.is_running {
            return;
        }
        drop(scheduler);
        tick();
        let mut scheduler = lock(&SCHEDULER);
        scheduler.ticks += 1;
        scheduler.granted = scheduler.granted.saturating_sub(1);
        drop(scheduler);
        CHANGED.notify_all();
        if !is_virtual {
            next += Duration::from_secs_f64(1.0 / RATE);
            std::thread::sleep(next.saturating_duration_since(Instant::now()));
        }
    }
}

/// A tick: the world's, and every callback once.
fn tick() {
    let is_silent = {
        let mut world = lock(&WORLD);
        world.tick();
        world.has("silent")
    };
    if is_silent {
        return;
    }
    let jobs = lock(&SCHEDULER).jobs.clone();
    for job in jobs {
        // Taken out by one before it.
        if !lock(&SCHEDULER).jobs.iter().any(|other| other.id == job.id) {
            continue;
        }
        // SAFETY: the caller's callback and pointer, in the scheduler's thread; no lock is held.
        let goes_on = unsafe { (job.callback)(job.data as *mut c_void) } == 1;
        if job.is_once || !goes_on {
            remove(job.id);
        }
    }
}
