//! How fast the clay goes against the wall clock.

use std::time::{Duration, Instant};

/// Simulated time against wall time, over stretches of a second.
#[derive(Default)]
pub(super) struct Pace {
    since: Option<(Instant, f64)>,
    rate: f64,
}

impl Pace {
    /// The rate, with the clay at `time` \[s\] now.
    pub(super) fn rate(&mut self, time: f64) -> f64 {
        const STRETCH: Duration = Duration::from_secs(1);
        let (began, start) = *self.since.get_or_insert_with(|| (Instant::now(), time));
        let wall = began.elapsed();
        if wall >= STRETCH {
            self.rate = (time - start) / wall.as_secs_f64();
            self.since = Some((Instant::now(), time));
        }
        self.rate
    }
}
