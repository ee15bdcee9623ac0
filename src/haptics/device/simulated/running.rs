//! The arm in real time.

use super::super::Servo;
use super::arm::SimulatedArm;
use crate::haptics::priority;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time before a tick in which the thread watches the clock instead of sleeping: a sleep ends 50 to 100 us
/// late on an idle machine.
const WATCH: Duration = Duration::from_micros(150);

/// How far a thread that was held up may be behind before it gives up to catch up.
const BEHIND_MAX: Duration = Duration::from_millis(100);

/// How well the ticks kept time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Timing {
    /// Ticks.
    pub ticks: u64,
    /// Ticks a second since the start \[Hz\].
    pub rate: f64,
    /// How late a tick came at most \[s\].
    pub late_max: f64,
    /// How late ticks come on average \[s\].
    pub late_mean: f64,
}

#[derive(Debug, Default)]
struct Shared {
    is_stopped: AtomicBool,
    ticks: AtomicU64,
    /// Nanoseconds.
    late_max: AtomicU64,
    late_sum: AtomicU64,
    elapsed: AtomicU64,
}

/// An arm that runs on a thread of its own until it is stopped or dropped.
#[derive(Debug)]
pub struct RunningArm {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<SimulatedArm>>,
}

impl SimulatedArm {
    /// Runs in real time, a tick each period of its settings.
    ///
    /// # Errors
    /// A thread that the system does not start.
    pub fn start(self, servo: Box<dyn Servo>) -> std::io::Result<RunningArm> {
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        let run = move || {
            // Where it may not be raised it runs as it is: `priority::refusal` keeps why.
            _ = priority::raise();
            keep_time(self, servo, &of_thread)
        };
        let thread = std::thread::Builder::new().name("simulated arm".into()).spawn(run)?;
        Ok(RunningArm { shared, thread: Some(thread) })
    }
}

/// The loop of the thread: virtual time is led by the clock.
fn keep_time(mut arm: SimulatedArm, mut servo: Box<dyn Servo>, shared: &Shared) -> SimulatedArm {
    let (start, begun) = (Instant::now(), arm.time());
    let period = Duration::from_secs_f64(arm.info().rate.recip());
    let mut due = Duration::ZERO;
    while !shared.is_stopped.load(Ordering::Relaxed) {
        due += period;
        wait_until(start + due);
        let now = start.elapsed();
        let late = now.saturating_sub(due);
        if late > BEHIND_MAX {
            due = now;
        }
        arm.run(&mut *servo, begun + due.as_secs_f64());
        shared.ticks.fetch_add(1, Ordering::Relaxed);
        shared.late_max.fetch_max(late.as_nanos() as u64, Ordering::Relaxed);
        shared.late_sum.fetch_add(late.as_nanos() as u64, Ordering::Relaxed);
        shared.elapsed.store(now.as_nanos() as u64, Ordering::Relaxed);
    }
    arm
}

/// Sleeps until shortly before an instant and watches the clock for the rest.
fn wait_until(instant: Instant) {
    let left = instant.saturating_duration_since(Instant::now());
    if left > WATCH {
        std::thread::sleep(left - WATCH);
    }
    while Instant::now() < instant {
        std::hint::spin_loop();
    }
}

impl RunningArm {
    /// How well it has kept time so far.
    pub fn timing(&self) -> Timing {
        let ticks = self.shared.ticks.load(Ordering::Relaxed);
        let seconds = |nanoseconds: &AtomicU64| nanoseconds.load(Ordering::Relaxed) as f64 * 1e-9;
        let count = ticks.max(1) as f64;
        Timing {
            ticks,
            rate: ticks as f64 / seconds(&self.shared.elapsed).max(f64::MIN_POSITIVE),
            late_max: seconds(&self.shared.late_max),
            late_mean: seconds(&self.shared.late_sum) / count,
        }
    }

    /// Whether its thread has ended: its servo panicked.
    pub fn is_over(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Ends the thread and gives the arm back; none if its servo panicked.
    pub fn stop(mut self) -> Option<SimulatedArm> {
        self.shared.is_stopped.store(true, Ordering::Relaxed);
        self.thread.take().and_then(|thread| thread.join().ok())
    }
}

impl Drop for RunningArm {
    fn drop(&mut self) {
        self.shared.is_stopped.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // A panic of the servo has been reported by the thread itself.
            drop(thread.join());
        }
    }
}
