//! A tool of the clay that an arm leads: ticks of the servo in, its way for a planner out; reports in,
//! contact models out. All in the clay's own frame.
//!
//! Two clocks meet here: the arm's, by which ticks and the spans of models are timed, and the planner's, which
//! may lag behind it. What a frame sweeps ends by the planner's lag before the last tick that it was told of.

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
        let clock = FrameClock { frame: self.frame, stamp, rate, span, is_resting: report.is_resting() };
        Some(self.models.model(touch, &clock))
    }

    /// Other clay, or the tool is put down anew: nothing of what was is known.
    pub fn forget(&mut self) {
        let frame = self.frame;
        *self = Self { frame, ..Self::default() };
    }
}
