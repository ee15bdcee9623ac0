//! What was seen of a hand lately: samples for plots, times from stage to stage.

use crate::haptics::servo::ServoSample;
use std::collections::VecDeque;

/// Samples that are kept for plots: two seconds of 1 kHz.
pub const SAMPLES_MAX: usize = 2000;

/// Times of a stage \[s\]: how often, their mean, and the greatest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Latency {
    /// How often it was measured.
    pub count: u64,
    /// Their mean \[s\].
    pub mean: f64,
    /// The greatest \[s\].
    pub greatest: f64,
}

impl Latency {
    pub(super) fn note(&mut self, time: f64) {
        self.count += 1;
        self.mean += (time - self.mean) / self.count as f64;
        self.greatest = self.greatest.max(time);
    }

    pub(super) fn join(&mut self, other: Self) {
        let count = self.count + other.count;
        if count > 0 {
            self.mean += (other.mean - self.mean) * other.count as f64 / count as f64;
        }
        (self.count, self.greatest) = (count, self.greatest.max(other.greatest));
    }
}

/// What the thread of the clay has seen since the app last looked.
#[derive(Clone, Debug, Default)]
pub(super) struct Track {
    /// Samples, the oldest first.
    pub(super) samples: VecDeque<ServoSample>,
    /// From the last pose that a model knows of to when it was published.
    pub(super) model: Latency,
    /// Between two models.
    pub(super) interval: Latency,
    /// When the last one was published \[s\].
    pub(super) published: Option<f64>,
}

impl Track {
    pub(super) fn see(&mut self, sample: ServoSample) {
        if self.samples.len() == SAMPLES_MAX {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
    }

    /// A model was published at `stamp` \[s\] that knows of the hand up to `known` \[s\].
    pub(super) fn publish(&mut self, stamp: f64, known: f64) {
        self.model.note((stamp - known).max(0.0));
        if let Some(before) = self.published.replace(stamp) {
            self.interval.note(stamp - before);
        }
    }

    pub(super) fn take(&mut self) -> Self {
        let empty = Self { published: self.published, ..Self::default() };
        std::mem::replace(self, empty)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn latencies_join_to_those_of_all() {
        let (mut all, mut parts) = (Latency::default(), [Latency::default(); 2]);
        for i in 0..7 {
            let time = f64::from(i * i) * 1e-3;
            all.note(time);
            parts[usize::from(i > 2)].note(time);
        }
        let [mut joined, second] = parts;
        joined.join(second);
        joined.join(Latency::default());
        assert!((joined.mean - all.mean).abs() < 1e-15 && (joined.count, joined.greatest) == (7, all.greatest), "{joined:?}");
    }
}
