//! How long drawing takes, and whether there is time for more of it.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How long drawing takes: from the frame that is handed to the render world until the device has done it.
#[derive(Clone, Debug, Default)]
pub(super) struct Meter(Arc<Mutex<Measured>>);

/// What is known of the last picture.
#[derive(Clone, Copy, Debug, Default)]
struct Measured {
    began: Option<Instant>,
    ended: Option<Instant>,
    /// Whether its time counts: a picture of what does not change holds nobody up.
    is_counted: bool,
    /// Whether something was left out, for which there was no pipeline yet.
    is_incomplete: bool,
}

impl Meter {
    fn measured(&self) -> MutexGuard<'_, Measured> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A picture begins, whose time counts or not.
    pub(super) fn begin(&self, now: Instant, is_counted: bool) {
        *self.measured() = Measured { began: Some(now), is_counted, ..Measured::default() };
    }

    /// Says of the picture whether something was left out.
    pub(super) fn note(&self, is_incomplete: bool) {
        self.measured().is_incomplete = is_incomplete;
    }

    /// Whether something was left out of the last picture.
    pub(super) fn is_incomplete(&self) -> bool {
        self.measured().is_incomplete
    }

    /// The device has drawn the picture.
    pub(super) fn end(&self) {
        self.measured().ended.get_or_insert_with(Instant::now);
    }

    /// The time since the last picture began.
    pub(super) fn age(&self, now: Instant) -> Option<Duration> {
        self.measured().began.map(|began| now.saturating_duration_since(began))
    }

    /// Whether the last picture is done, and so long ago that drawing takes no more than `share` of the time.
    pub(super) fn has_time(&self, now: Instant, share: f32) -> bool {
        /// A device that was lost meanwhile says nothing.
        const LOST: Duration = Duration::from_secs(2);
        let Measured { began: Some(began), ended, is_counted, .. } = *self.measured() else { return true };
        let age = now.saturating_duration_since(began);
        match ended {
            None => age > LOST,
            Some(_) if !is_counted => true,
            Some(ended) => age >= (ended - began).div_f32(share.clamp(0.01, 1.0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture that took a time is followed by the next when its share of the time allows, never while it
    /// is drawn; one whose end nobody reports is given up.
    #[test]
    fn pictures_keep_to_their_share() {
        let meter = Meter::default();
        let start = Instant::now();
        let at = |ms: u64| start + Duration::from_millis(ms);
        assert!(meter.has_time(start, 0.5), "the first one");
        meter.begin(start, true);
        assert!(!meter.has_time(at(100), 1.0), "it is being drawn");
        assert!(meter.has_time(at(2001), 0.5), "its device is gone");
        *meter.measured() = Measured { began: Some(start), ended: Some(at(40)), is_counted: true, is_incomplete: false };
        assert!(!meter.has_time(at(79), 0.5) && meter.has_time(at(80), 0.5), "as long again is the clay's");
        assert!(meter.has_time(at(40), 1.0), "all of the time");
        meter.measured().is_counted = false;
        assert!(meter.has_time(at(41), 0.5), "it was of what does not change");
        assert_eq!(meter.age(at(90)), Some(Duration::from_millis(90)));
    }
}
