//! The last seconds of the clay, for plots.

use crate::plugin::clay::ClayReport;
use bevy::prelude::*;
use std::collections::VecDeque;

/// How long is remembered \[s\].
pub const SPAN: f64 = 10.0;
/// Most samples that are remembered: the rate of a fast engine over the span.
const SAMPLES_MAX: usize = 2400;

/// One frame of the clay.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Wall clock of the app \[s\].
    pub time: f64,
    /// Greatest force on a tool \[N\].
    pub force: f64,
    /// Wall time of the frame \[ms\].
    pub frame_ms: f64,
}

/// The samples of the last [`SPAN`], oldest first.
#[derive(Resource, Clone, Debug, Default)]
pub struct RecentFrames {
    samples: VecDeque<Sample>,
}

impl RecentFrames {
    /// The samples, oldest first.
    pub fn samples(&self) -> impl Iterator<Item = &Sample> {
        self.samples.iter()
    }

    fn push(&mut self, sample: Sample) {
        self.samples.push_back(sample);
        while self.samples.pop_front_if(|old| sample.time - old.time > SPAN).is_some() {}
        while self.samples.len() > SAMPLES_MAX {
            self.samples.pop_front();
        }
    }
}

/// Remembers what the reports say.
pub(super) fn record(mut reports: MessageReader<ClayReport>, time: Res<Time<Real>>, mut history: ResMut<RecentFrames>) {
    for ClayReport { report, .. } in reports.read() {
        let force = report.tools.iter().map(|t| t.force.length()).fold(0.0, f64::max);
        history.push(Sample { time: time.elapsed_secs_f64(), force, frame_ms: report.timings.total * 1e3 });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn history_is_of_the_last_seconds_and_bounded() {
        let mut history = RecentFrames::default();
        for i in 0..100 {
            history.push(Sample { time: f64::from(i), force: 0.0, frame_ms: 1.0 });
        }
        assert_eq!(history.samples().map(|s| s.time).collect::<Vec<_>>(), (89..100).map(f64::from).collect::<Vec<_>>());
        for i in 0..10_000 {
            history.push(Sample { time: 100.0 + f64::from(i) * 1e-4, force: 0.0, frame_ms: 1.0 });
        }
        assert_eq!(history.samples().count(), SAMPLES_MAX);
    }
}
