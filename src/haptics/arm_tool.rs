//! A tool of the clay that an arm leads: ticks of the servo in, its way for a planner out; reports in,
//! contact models out. All in the clay's own frame.
//!
//! Two clocks meet here: the arm's, by which ticks and the spans of models are timed, and the planner's,
//! which may lag behind it. What a frame sweeps ends by the planner's lag before the last tick that it was
//! told of.

use super::model::ContactModel;
use super::touch::{ContactModels, FrameClock};
use crate::sim::frame::FrameReport;
use crate::sim::tool::{Pose, PoseSample};
use std::collections::VecDeque;

/// Ticks that wait for a look, at most: 4 s of 1 kHz; of more the older half goes, every second of it.
const WAITING_MAX: usize = 4096;

/// An arm's tool.
#[derive(Clone, Debug, Default)]
pub struct ArmTool {
    /// Since the last look, by the arm's clock.
    waiting: Vec<PoseSample>,
    /// The last that was looked at.
    last: Option<PoseSample>,
    /// Ids of the plans under way, and when what they sweep ends \[s\].
    under_way: VecDeque<(u64, f64)>,
    /// Up to when frames that did not fail have swept \[s\].
    swept: f64,
    models: ContactModels,
    frame: u64,
}

/// What an arm did since the last look.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmWay {
    /// Time that has passed by the arm's clock \[s\].
    pub elapsed: f64,
    /// Poses, their times before now \[s\], the last one now.
    pub samples: Vec<PoseSample>,
}

impl ArmTool {
    /// A tick of the servo: when, and where it wants the tool. One that is no later than the last, or no
    /// number, is left out.
    pub fn push(&mut self, time: f64, pose: Pose) {
        let sample = PoseSample { time, pose };
        let last = self.waiting.last().or(self.last.as_ref());
        if !sample.is_finite() || last.is_some_and(|last| last.time >= time) {
            return;
        }
        if self.waiting.len() >= WAITING_MAX {
            let mut index = 0;
            self.waiting.retain(|_| {
                index += 1;
                index > WAITING_MAX / 2 || index % 2 == 0
            });
        }
        self.waiting.push(sample);
    }

    /// What came since the last look: the pose where it stood then, if it has been looked at, and all after.
    /// None before the first tick.
    pub fn way(&mut self) -> Option<ArmWay> {
        let now = *self.waiting.last().or(self.last.as_ref())?;
        let from = self.last.replace(now);
        if from.is_none() {
            self.swept = now.time;
        }
        let before_now = |s: PoseSample| PoseSample { time: s.time - now.time, ..s };
        let waiting = self.waiting.drain(..);
        let samples = from.filter(|from| from.time < now.time).into_iter().chain(waiting).map(before_now).collect::<Vec<_>>();
        let samples = if samples.is_empty() { vec![before_now(now)] } else { samples };
        Some(ArmWay { elapsed: from.map_or(0.0, |from| now.time - from.time), samples })
    }

    /// An engine has taken a plan that ends `lag` \[s\] of the arm's clock before the last look.
    pub fn sent(&mut self, plan_id: u64, lag: f64) {
        if let Some(now) = self.last {
            self.under_way.push_back((plan_id, now.time - lag));
        }
    }

    /// The contact model of a report, for the tool that it calls `id`; `stamp` is when that is, by the host's
    /// clock \[s\]. None of a frame that failed, and where the tool was not in it: what is known ages.
    pub fn note(&mut self, report: &FrameReport, id: u32, stamp: f64) -> Option<ContactModel> {
        while self.under_way.front().is_some_and(|(plan, _)| *plan < report.plan_id) {
            self.under_way.pop_front();
        }
        let (_, end) = self.under_way.pop_front_if(|(plan, _)| *plan == report.plan_id)?;
        let touch = report.touches.iter().find(|touch| touch.id == id)?;
        let span = [self.swept, end.max(self.swept)];
        self.swept = span[1];
        self.frame += 1;
        let hand_time = span[1] - span[0];
        let rate = if hand_time > 0.0 { report.duration() / hand_time } else { 1.0 };
        let parts = report.implicit_steps();
        let clock = FrameClock { frame: self.frame, stamp, rate, span, parts, is_resting: report.is_resting() };
        Some(self.models.model(touch, report.residual, &clock))
    }

    /// Other clay, or the tool is put down anew: nothing of what was is known.
    pub fn forget(&mut self) {
        let frame = self.frame;
        *self = Self { frame, ..Self::default() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::touch::ToolTouch;
    use glam::DVec3;

    fn at(x: f64) -> Pose {
        Pose { position: DVec3::X * x, ..Pose::default() }
    }

    fn report(plan_id: u64, steps: u32) -> FrameReport {
        let touches = if steps > 0 { vec![ToolTouch { id: 5, normal: DVec3::Y, ..ToolTouch::default() }] } else { vec![] };
        FrameReport { plan_id, dt: 1e-3, steps, touches, ..FrameReport::default() }
    }

    /// Each look hands out what came since, from where the last one ended; what goes back in time or is no
    /// number is left out, and a look without news has the tool stand.
    #[test]
    fn way_goes_on_where_it_was_looked_at() {
        let mut tool = ArmTool::default();
        assert_eq!(tool.way(), None);
        [(0.1, 1.0), (0.101, 2.0), (0.1005, 9.0), (f64::NAN, 9.0), (0.102, f64::INFINITY)]
            .into_iter()
            .for_each(|(t, x)| tool.push(t, at(x)));
        let first = tool.way().expect("two ticks");
        assert_eq!((first.elapsed, first.samples.len(), first.samples[1]), (0.0, 2, PoseSample { time: 0.0, pose: at(2.0) }));
        tool.push(0.104, at(3.0));
        let next = tool.way().expect("a tick");
        assert!(
            (next.elapsed - 3e-3).abs() < 1e-12 && next.samples[0].pose == at(2.0) && next.samples[1].pose == at(3.0),
            "{next:?}"
        );
        let still = tool.way().expect("a place");
        assert_eq!((still.elapsed, still.samples), (0.0, vec![PoseSample { time: 0.0, pose: at(3.0) }]));
        (0..3 * WAITING_MAX as u64).for_each(|i| tool.push(1.0 + 1e-3 * i as f64, at(i as f64)));
        let long = tool.way().expect("ticks");
        assert!(
            long.samples.len() <= WAITING_MAX + 1
                && long.samples.last().expect("the last").pose == at(3.0 * WAITING_MAX as f64 - 1.0)
        );
    }

    /// A model's span goes on from where the last frame that did not fail ended, by the planner's lag; the
    /// rate is of that. Frames that failed, and tools that were not in them, have none.
    #[test]
    fn spans_follow_the_frames_that_ran() {
        let mut tool = ArmTool::default();
        tool.push(1.0, at(0.0));
        assert!(tool.way().is_some());
        tool.push(1.011, at(1.0));
        assert!(tool.way().is_some());
        tool.sent(0, 0.0);
        tool.sent(1, 0.0);
        let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-12;
        assert!(tool.note(&report(0, 0), 5, 0.0).is_none(), "it failed");
        tool.push(1.022, at(2.0));
        assert!(tool.way().is_some());
        assert!(tool.note(&report(1, 0), 5, 0.0).is_none());
        tool.sent(2, 2e-3);
        let model = tool.note(&report(2, 10), 5, 7.0).expect("a model");
        assert!(near(model.span, [1.0, 1.02]) && model.stamp == 7.0 && model.frame == 1, "{:?}", model.span);
        assert!((model.rate - 0.5).abs() < 1e-9, "{}", model.rate);
        tool.sent(3, 0.0);
        assert!(tool.note(&report(3, 10), 4, 0.0).is_none(), "another tool");
        tool.forget();
        assert_eq!(tool.way(), None);
    }
}
