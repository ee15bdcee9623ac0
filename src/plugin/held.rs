//! How long the plugin's systems hold the main thread.

use bevy::prelude::*;
use cpu_time::ThreadTime;
use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// What counts as lately.
const LATELY: Duration = Duration::from_secs(1);

/// The processor time that the plugin's systems took of each frame of the app lately, on the threads of
/// Bevy's schedules; each of them watches itself. What other programs or threads kept them from running is no
/// time of theirs. Taken by [`Res`], so that measuring keeps no system from running beside another: the lock
/// is held for one sum.
#[derive(Resource, Default)]
pub(super) struct HeldTime {
    times: Mutex<Times>,
}

impl HeldTime {
    /// Measures until the watch is dropped.
    pub(super) fn watch(&self) -> Watch<'_> {
        Watch { held: self, began: ThreadTime::try_now().ok() }
    }

    /// The longest time \[ms\] in the last second.
    pub(super) fn longest_ms(&self) -> f64 {
        self.times().longest_ms()
    }

    fn times(&self) -> MutexGuard<'_, Times> {
        self.times.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Ends a frame of the app.
pub(super) fn end_frame(held: Res<HeldTime>) {
    held.times().end_frame(Instant::now());
}

#[derive(Default)]
struct Times {
    /// Of the frame that goes on.
    now: Duration,
    /// When a frame ended and what it took: later ones are shorter, so the first is the longest.
    recent: VecDeque<(Instant, Duration)>,
}

impl Times {
    fn longest_ms(&self) -> f64 {
        self.recent.front().map_or(0.0, |(_, time)| time.as_secs_f64() * 1e3)
    }

    fn end_frame(&mut self, end: Instant) {
        let time = std::mem::take(&mut self.now);
        while self.recent.pop_front_if(|(at, _)| end.saturating_duration_since(*at) > LATELY).is_some() {}
        while self.recent.pop_back_if(|(_, earlier)| *earlier <= time).is_some() {}
        self.recent.push_back((end, time));
    }
}

/// A running measurement; none where the system has no clock for it.
pub(super) struct Watch<'a> {
    held: &'a HeldTime,
    began: Option<ThreadTime>,
}

impl Drop for Watch<'_> {
    fn drop(&mut self) {
        let time = self.began.as_ref().and_then(|began| began.try_elapsed().ok());
        self.held.times().now += time.unwrap_or_default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn longest_frame_is_of_the_last_second() {
        let mut times = Times::default();
        let start = Instant::now();
        let ms = Duration::from_millis;
        for (at, time, longest) in [(0, 5, 5.0), (400, 3, 5.0), (900, 2, 5.0), (1100, 1, 3.0), (1500, 4, 4.0), (3000, 1, 1.0)] {
            times.now += ms(time);
            times.end_frame(start + ms(at));
            assert!((times.longest_ms() - longest).abs() < 1e-9, "at {at} ms: {}", times.longest_ms());
        }
    }

    /// Spins for `ms` of the thread's own time.
    fn work(ms: u64) {
        let began = ThreadTime::now();
        while began.elapsed() < Duration::from_millis(ms) {}
    }

    /// What systems of one frame take adds up, frames do not, and time spent asleep is none.
    #[test]
    fn frames_take_the_sum_of_their_systems() {
        let held = HeldTime::default();
        for frame in [&[4, 5], &[4, 4]] {
            for ms in frame {
                let _watch = held.watch();
                work(*ms);
                std::thread::sleep(Duration::from_millis(40));
            }
            held.times().end_frame(Instant::now());
        }
        assert!((9.0..17.0).contains(&held.longest_ms()), "{} ms", held.longest_ms());
    }

    /// Systems that measure themselves may run beside each other.
    #[test]
    fn measuring_systems_run_side_by_side() {
        let mut world = World::new();
        world.init_resource::<HeldTime>();
        let mut schedule = Schedule::default();
        let measured = |held: Res<HeldTime>| {
            let _watch = held.watch();
            work(1);
        };
        schedule.add_systems((measured, measured));
        schedule.initialize(&mut world).expect("a schedule");
        assert!(schedule.graph().conflicting_systems().is_empty());
        schedule.run(&mut world);
        world.resource::<HeldTime>().times().end_frame(Instant::now());
        assert!(world.resource::<HeldTime>().longest_ms() >= 2.0);
    }
}
