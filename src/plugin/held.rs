//! How long the plugin's systems hold the main thread.

use bevy::prelude::*;
use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// What counts as lately.
const LATELY: Duration = Duration::from_secs(1);

/// The times that systems of the plugin took lately; each of them watches itself. Taken by [`Res`], so that
/// measuring keeps no system from running beside another: the lock is held for one entry of a list.
#[derive(Resource, Default)]
pub(super) struct HeldTime {
    times: Mutex<Times>,
}

impl HeldTime {
    /// Measures until the watch is dropped.
    pub(super) fn watch(&self) -> Watch<'_> {
        Watch { held: self, began: Instant::now() }
    }

    /// The longest time \[ms\] in the last second.
    pub(super) fn longest_ms(&self) -> f64 {
        self.times().longest_ms()
    }

    fn times(&self) -> MutexGuard<'_, Times> {
        self.times.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// When a system ended and how long it took: later ones are shorter, so the first is the longest.
#[derive(Default)]
struct Times(VecDeque<(Instant, Duration)>);

impl Times {
    fn longest_ms(&self) -> f64 {
        self.0.front().map_or(0.0, |(_, time)| time.as_secs_f64() * 1e3)
    }

    fn note(&mut self, end: Instant, time: Duration) {
        while self.0.pop_front_if(|(at, _)| end.saturating_duration_since(*at) > LATELY).is_some() {}
        while self.0.pop_back_if(|(_, earlier)| *earlier <= time).is_some() {}
        self.0.push_back((end, time));
    }
}

/// A running measurement.
pub(super) struct Watch<'a> {
    held: &'a HeldTime,
    began: Instant,
}

impl Drop for Watch<'_> {
    fn drop(&mut self) {
        self.held.times().note(Instant::now(), self.began.elapsed());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn longest_time_is_of_the_last_second() {
        let mut times = Times::default();
        let start = Instant::now();
        let ms = Duration::from_millis;
        for (at, time, longest) in [(0, 5, 5.0), (400, 3, 5.0), (900, 2, 5.0), (1100, 1, 3.0), (1500, 4, 4.0), (3000, 1, 1.0)] {
            times.note(start + ms(at), ms(time));
            assert!((times.longest_ms() - longest).abs() < 1e-9, "at {at} ms: {}", times.longest_ms());
        }
    }

    /// Systems that measure themselves may run beside each other.
    #[test]
    fn measuring_systems_run_side_by_side() {
        let mut world = World::new();
        world.init_resource::<HeldTime>();
        let mut schedule = Schedule::default();
        let measured = |held: Res<HeldTime>| drop(held.watch());
        schedule.add_systems((measured, measured));
        schedule.initialize(&mut world).expect("a schedule");
        assert!(schedule.graph().conflicting_systems().is_empty());
        schedule.run(&mut world);
        assert!(world.resource::<HeldTime>().longest_ms() > 0.0);
    }
}
