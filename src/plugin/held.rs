//! How long the plugin's systems hold the main thread.

use bevy::prelude::*;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// What counts as lately.
const LATELY: Duration = Duration::from_secs(1);

/// The times that systems of the plugin took lately; each of them watches itself.
#[derive(Resource, Default)]
pub(super) struct HeldTime {
    /// When a system ended and how long it took: later ones are shorter, so the first is the longest.
    times: VecDeque<(Instant, Duration)>,
}

impl HeldTime {
    /// Measures until the watch is dropped.
    pub(super) fn watch(&mut self) -> Watch<'_> {
        Watch { held: self, began: Instant::now() }
    }

    /// The longest time \[ms\] in the last second.
    pub(super) fn longest_ms(&self) -> f64 {
        self.times.front().map_or(0.0, |(_, time)| time.as_secs_f64() * 1e3)
    }

    fn note(&mut self, end: Instant, time: Duration) {
        while self.times.pop_front_if(|(at, _)| end.duration_since(*at) > LATELY).is_some() {}
        while self.times.pop_back_if(|(_, earlier)| *earlier <= time).is_some() {}
        self.times.push_back((end, time));
    }
}

/// A running measurement.
pub(super) struct Watch<'a> {
    held: &'a mut HeldTime,
    began: Instant,
}

impl Drop for Watch<'_> {
    fn drop(&mut self) {
        self.held.note(Instant::now(), self.began.elapsed());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn longest_time_is_of_the_last_second() {
        let mut held = HeldTime::default();
        let start = Instant::now();
        let ms = Duration::from_millis;
        for (at, time, longest) in [(0, 5, 5.0), (400, 3, 5.0), (900, 2, 5.0), (1100, 1, 3.0), (1500, 4, 4.0), (3000, 1, 1.0)] {
            held.note(start + ms(at), ms(time));
            assert!((held.longest_ms() - longest).abs() < 1e-9, "at {at} ms: {}", held.longest_ms());
        }
    }
}
