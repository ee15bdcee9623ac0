//! The ways of the tools in a hand, or in several: timed poses in, the piece of them that a frame sweeps out.
//!
//! All samples stand on one time, the hand's: that of the caller's clock since the planner was made. Frames
//! sweep it piece by piece, each second of the hand in a second of clay, so that a tool in slow motion is as
//! fast as the hand was, and late; where the engine affords longer frames, they catch up. A frame that was
//! given up is swept again.

use super::super::tool::{Pose, PoseSample, Tool, ToolPath};
use serde::{Deserialize, Serialize};
use std::collections::{HashMap, VecDeque};

/// What the tools do with the hand's way that the clay had no time for. They go no faster than the hand went,
/// and do not wait for time in which no tool moved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Backlog {
    /// They go all of it, late. A tool that was let go of leaves the clay when it has been where the hand
    /// was.
    #[default]
    WorkOff,
    /// Of what is older than [`LAG_MAX`] they go the chord alone, and a tool that was let go of leaves at
    /// once.
    Drop,
}

/// How far tools lag behind the hand before [`Backlog::Drop`] leaves some of its way out \[s\]: less than a
/// tenth of a second goes unnoticed.
pub const LAG_MAX: f64 = 0.1;
/// Hand time that a frame may sweep beyond its own length [s]: two samples of a clock of 1 kHz, for clocks
/// that are not in step.
const CLOCK_SLACK: f64 = 2e-3;
/// Greatest part of a frame's length that counts as such.
const SLACK_PART: f64 = 0.25;
/// Most samples of one visit that wait, a minute of a clock of 1 kHz; beyond, every second of the older half
/// goes.
const SAMPLES_MAX: usize = 1 << 16;

/// Where a tool has been since the last look, by its own clock.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolSamples {
    /// Tells one tool from another for as long as it is held.
    pub key: u64,
    /// Shape and contact.
    pub tool: Tool,
    /// Poses in order of time \[s\], of any clock that goes on from look to look; the last one is now. At least
    /// one. Of a tool that is new, those of the time that has passed since the last look count.
    pub samples: Vec<PoseSample>,
}

impl ToolSamples {
    /// A tool that was looked at once.
    pub fn now(key: u64, tool: Tool, pose: Pose) -> Self {
        Self { key, tool, samples: vec![PoseSample { time: 0.0, pose }] }
    }
}

/// One visit of a tool: from where it was put down to where it was let go of.
#[derive(Clone, Debug)]
struct Visit {
    key: u64,
    /// Names the tool in plans and reports.
    id: u32,
    tool: Tool,
    /// In hand time; never empty.
    samples: VecDeque<PoseSample>,
    /// The tool's own clock at the last sample \[s\].
    own_time: f64,
    is_let_go: bool,
    /// Whether a frame was planned that sweeps some of it.
    is_begun: bool,
}

impl Visit {
    fn start(&self) -> f64 {
        self.samples[0].time
    }

    fn end(&self) -> f64 {
        self.samples[self.samples.len() - 1].time
    }

    fn pose_at(&self, time: f64) -> Pose {
        let next = self.samples.partition_point(|s| s.time <= time);
        match (next.checked_sub(1).map(|i| self.samples[i]), self.samples.get(next)) {
            (Some(last), None) => last.pose,
            // Without rounding: a tool that stands, stands.
            (Some(a), Some(b)) if a.time == time || a.pose == b.pose => a.pose,
            (Some(a), Some(b)) => a.pose.between(b.pose, (time - a.time) / (b.time - a.time)),
            (None, _) => self.samples[0].pose,
        }
    }

    /// When the tool next moves, from `time` on; nothing if it stands to the end of its way.
    fn next_motion(&self, time: f64) -> Option<f64> {
        let first = self.samples.partition_point(|s| s.time <= time).saturating_sub(1);
        let moves = |i: &usize| self.samples[*i].pose != self.samples[*i + 1].pose;
        (first..self.samples.len() - 1).find(moves).map(|i| self.samples[i].time.max(time))
    }

    /// Whether a frame from `time` on has some of it to sweep, if it was let go of.
    fn goes_on_at(&self, time: f64) -> bool {
        self.end() > time || (!self.is_begun && self.end() == time)
    }

    /// Whether a frame from `from` to `to` may have it, for all that its own times say.
    fn is_due(&self, from: f64, to: f64) -> bool {
        if self.is_let_go { self.start() < to && self.goes_on_at(from) } else { self.start() <= to }
    }

    /// Takes in poses of the tool's own clock, the last of them at `now` in hand time. A clock that goes
    /// faster than the hand's is fitted into the time that has passed, so that no pose is lost.
    fn follow(&mut self, samples: &[PoseSample], now: f64, swept: f64) {
        let Some(last) = samples.last() else { return };
        let (room, span) = (now - self.end(), last.time - self.own_time);
        let scale = if span > room { room / span } else { 1.0 };
        // A clock that was set back tells nothing about before.
        let known = if span < 0.0 { f64::NEG_INFINITY } else { self.own_time };
        for inner in samples[..samples.len() - 1].iter().filter(|s| s.time > known) {
            self.add(PoseSample { time: now - (last.time - inner.time) * scale, pose: inner.pose }, swept);
        }
        self.add(PoseSample { time: now, pose: last.pose }, swept);
        self.own_time = last.time;
    }

    /// Adds a pose; one of a time that is swept already would be a jump.
    fn add(&mut self, sample: PoseSample, swept: f64) {
        let last = self.samples.len() - 1;
        if sample.time > self.samples[last].time {
            self.samples.push_back(sample);
        } else if self.samples[last].time > swept {
            self.samples[last].pose = sample.pose;
        }
        if self.samples.len() > SAMPLES_MAX {
            let mut index = 0;
            self.samples.retain(|_| {
                index += 1;
                index > SAMPLES_MAX / 2 || index % 2 == 1
            });
        }
    }

    /// Time \[s\] that the chord from `from` to `to` takes at the mean speed at which the tool moved between,
    /// where it did.
    fn chord_time(&self, from: f64, to: f64) -> f64 {
        let inner = self.samples.iter().filter(|s| s.time > from && s.time < to).copied();
        let end = |time| PoseSample { time, pose: self.pose_at(time) };
        let samples: Vec<PoseSample> = std::iter::once(end(from)).chain(inner).chain([end(to)]).collect();
        let radius = self.tool.shape.bounding_radius();
        let moves = samples.windows(2).filter(|w| w[0].pose != w[1].pose);
        let add =
            |(way, time): (f64, f64), w: &[PoseSample]| (way + w[0].pose.way(w[1].pose, radius), time + w[1].time - w[0].time);
        let (way, time) = moves.fold((0.0, 0.0), add);
        let chord = end(from).pose.way(end(to).pose, radius);
        if way > 0.0 { time * (chord / way).min(1.0) } else { 0.0 }
    }

    /// The way from `from` to `to` in a frame of `duration` \[s\].
    fn path(&self, from: f64, to: f64, duration: f64) -> ToolPath {
        // Times closer than this tell rounding, not speed.
        let apart = 1e-6 * duration;
        let scale = duration / (to - from);
        let mut samples = vec![PoseSample { time: 0.0, pose: self.pose_at(from) }];
        for inner in self.samples.iter().filter(|s| s.time > from && s.time < to) {
            let time = (inner.time - from) * scale;
            if time > apart && duration - time > apart && time - samples[samples.len() - 1].time > apart {
                samples.push(PoseSample { time, pose: inner.pose });
            }
        }
        if self.samples.len() > 1 || self.start() < to {
            samples.push(PoseSample { time: duration, pose: self.pose_at(to) });
        }
        ToolPath { id: self.id, tool: self.tool, sheet: 0, samples }
    }
}

/// A frame under way: the hand's time that it sweeps, and where it leaves the tools.
#[derive(Clone, Debug)]
struct Sweep {
    from: f64,
    duration: f64,
    ends: HashMap<u64, Pose>,
}

/// What a frame sweeps.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    /// How long the frame is [s]: as long as was asked for, or up to where a tool is put down anew.
    pub duration: f64,
    /// In the order of the tools' ids.
    pub paths: Vec<ToolPath>,
    /// Ids of tools that are put down anew.
    pub put_down: Vec<u32>,
    to: f64,
    ends: HashMap<u64, Pose>,
}

/// The ways of all tools.
#[derive(Clone, Debug, Default)]
pub(super) struct Trails {
    /// The hand's time now \[s\].
    clock: f64,
    /// Up to where frames have been planned.
    swept: f64,
    visits: Vec<Visit>,
    under_way: VecDeque<Sweep>,
    /// Where the first frame began that was given up, while others are under way.
    lost: Option<f64>,
    /// Where the last frame began that was given up.
    failed: Option<f64>,
    /// What each tool is called in plans and reports, from where it is first put down until the clay has no
    /// more of it.
    ids: HashMap<u64, u32>,
    /// The last name that was given.
    last_id: u32,
    /// Where the clay has each tool.
    seen: HashMap<u64, Pose>,
}

impl Trails {
    /// Lets `time` \[s\] pass, in which the tools went these ways; those not among them have been let go of.
    pub(super) fn pass(&mut self, time: f64, tools: &[ToolSamples]) {
        let before = self.clock;
        self.clock += time;
        for visit in &mut self.visits {
            visit.is_let_go |= !tools.iter().any(|t| t.key == visit.key);
        }
        for tool in tools {
            match self.visits.iter_mut().find(|v| v.key == tool.key && !v.is_let_go) {
                Some(visit) => {
                    visit.tool = tool.tool;
                    visit.follow(&tool.samples, self.clock, self.swept);
                }
                None => self.put_down(tool, before),
            }
        }
    }

    /// Begins a visit with what its tool did since `before` in hand time.
    fn put_down(&mut self, tool: &ToolSamples, before: f64) {
        let Some(last) = tool.samples.last() else { return };
        let on_hand_time = |s: &PoseSample| self.clock - (last.time - s.time).max(0.0);
        let is_known = |s: &PoseSample| on_hand_time(s) < before;
        let [first, rest @ ..] = &tool.samples[tool.samples.iter().take_while(|s| is_known(s)).count()..] else { return };
        let id = *self.ids.entry(tool.key).or_insert_with(|| {
            self.last_id = self.last_id.wrapping_add(1);
            self.last_id
        });
        let samples = [PoseSample { time: on_hand_time(first), pose: first.pose }].into();
        let mut visit =
            Visit { key: tool.key, id, tool: tool.tool, samples, own_time: first.time, is_let_go: false, is_begun: false };
        visit.follow(rest, self.clock, self.swept);
        self.visits.push(visit);
    }

    /// The hand's time that the tools lag behind it \[s\].
    pub(super) fn lag(&self) -> f64 {
        self.clock - self.swept
    }

    /// Where the clay has a tool at the end of the last frame reported.
    pub(super) fn seen(&self, key: u64) -> Option<Pose> {
        self.seen.get(&key).copied()
    }

    /// The key of the tool that plans and reports call `id`.
    pub(super) fn key(&self, id: u32) -> Option<u64> {
        self.ids.iter().find(|(_, other)| **other == id).map(|(key, _)| *key)
    }

    /// What the next frame sweeps: `owed` \[s\] of the way, and as much more of a backlog as it can within
    /// `most` \[s\]. It is swept again until [`Self::send`] says that an engine has taken the frame.
    pub(super) fn piece(&mut self, owed: f64, most: f64, backlog: Backlog) -> Piece {
        let slack = CLOCK_SLACK.min(SLACK_PART * owed);
        if self.lag() > owed + slack {
            self.skip_rest(owed);
            if backlog == Backlog::Drop {
                self.cut_corner(owed);
            }
        }
        if backlog == Backlog::Drop {
            self.visits.retain(|v| !v.is_let_go);
        }
        let from = self.swept;
        // What has failed is not tried again at greater length.
        let may_catch_up = self.lag() > owed + slack && self.failed != Some(from);
        let mut duration = if may_catch_up { self.lag().min(most).max(owed) } else { owed };
        let mut to = if self.lag() > duration + slack { from + duration } else { self.clock };
        if let Some(end) = self.handover(from, to) {
            (duration, to) = (duration * (end - from) / (to - from), end);
        }
        let mut piece = Piece { duration, paths: vec![], put_down: vec![], to, ends: HashMap::new() };
        let mut here = self.in_frame(from, to);
        here.sort_by_key(|i| self.visits[*i].id);
        for i in here {
            let visit = &mut self.visits[i];
            piece.paths.push(visit.path(from, to, duration));
            piece.ends.insert(visit.key, visit.pose_at(to));
            if !std::mem::replace(&mut visit.is_begun, true) {
                piece.put_down.push(visit.id);
            }
        }
        piece
    }

    /// The visits that a frame from `from` to `to` sweeps. A tool that was put down anew cannot be at both
    /// places: as long as the visit before has a way to go, that one is in the frame.
    fn in_frame(&self, from: f64, to: f64) -> Vec<usize> {
        let mut here: Vec<usize> = vec![];
        for (i, visit) in self.visits.iter().enumerate() {
            let is_late = here.iter().any(|j| self.visits[*j].is_let_go && self.visits[*j].key == visit.key);
            if visit.is_due(from, to) && !is_late {
                here.push(i);
            }
        }
        here
    }

    /// When, within a frame from `from` to `to`, the first tool was put down anew: the frame ends there.
    fn handover(&self, from: f64, to: f64) -> Option<f64> {
        let here = self.in_frame(from, to);
        let late = (0..self.visits.len()).filter(|i| !here.contains(i)).map(|i| &self.visits[i]);
        let times = late.filter(|v| v.is_due(from, to)).map(Visit::start);
        times.filter(|t| *t > from && *t < to).reduce(f64::min)
    }

    /// The engine has taken the frame of a piece.
    pub(super) fn send(&mut self, piece: Piece) {
        let from = std::mem::replace(&mut self.swept, piece.to);
        self.under_way.push_back(Sweep { from, duration: piece.duration, ends: piece.ends });
    }

    /// The engine has refused the frame of a piece: tools that were let go of are not held up to it again,
    /// nor are poses that are no numbers.
    pub(super) fn refuse(&mut self) {
        for visit in &mut self.visits {
            visit.samples.retain(PoseSample::is_finite);
        }
        self.visits.retain(|v| !v.is_let_go && !v.samples.is_empty());
    }

    /// The oldest frame under way has ended. What a frame that was given up had to sweep is swept again by
    /// the next one that is planned after all under way have ended; if that fails too, without the tools that
    /// were let go of. The time \[s\] that was given up.
    pub(super) fn end(&mut self, is_given_up: bool) -> f64 {
        let Some(sweep) = self.under_way.pop_front() else { return 0.0 };
        if is_given_up {
            self.lost = self.lost.or(Some(sweep.from));
        } else {
            self.seen = sweep.ends;
        }
        if self.under_way.is_empty()
            && let Some(from) = self.lost.take()
        {
            if self.failed.replace(from) == Some(from) {
                self.visits.retain(|v| !v.is_let_go);
            }
            self.swept = from;
        }
        self.forget();
        if is_given_up { sweep.duration } else { 0.0 }
    }

    /// The frames under way will never end. The time \[s\] that is given up with them.
    pub(super) fn lose_all(&mut self) -> f64 {
        let time = (0..self.under_way.len()).map(|_| self.end(true)).sum();
        // That was not the tools' fault.
        self.failed = None;
        time
    }

    /// Whether the next frame has to wait until those under way have ended, because one was given up.
    pub(super) fn is_mending(&self) -> bool {
        self.lost.is_some()
    }

    /// Forgets the tools' ways: they are put down anew.
    pub(super) fn lift(&mut self) {
        self.visits.clear();
        self.swept = self.clock;
        self.lost = None;
        // What is under way has nothing to sweep again.
        self.under_way.iter_mut().for_each(|sweep| sweep.from = self.clock);
    }

    /// Drops samples that no frame can need again.
    fn forget(&mut self) {
        let under_way = self.under_way.front().map(|sweep| sweep.from);
        let needed = self.lost.into_iter().chain(under_way).fold(self.swept, f64::min);
        self.visits.retain(|v| !v.is_let_go || v.goes_on_at(needed));
        let (visits, under_way, seen) = (&self.visits, &self.under_way, &self.seen);
        self.ids.retain(|key, _| {
            let is_under_way = under_way.iter().any(|sweep| sweep.ends.contains_key(key));
            is_under_way || seen.contains_key(key) || visits.iter().any(|v| v.key == *key)
        });
        for visit in &mut self.visits {
            let first = visit.samples.partition_point(|s| s.time <= needed).saturating_sub(1);
            visit.samples.drain(..first);
        }
    }

    /// Passes over time in which no tool moves, is put down or let go of, as long as a frame's worth is left.
    fn skip_rest(&mut self, duration: f64) {
        let last = self.clock - duration;
        let event = |v: &Visit| match v.start() {
            start if start > self.swept => Some(start),
            _ => v.next_motion(self.swept),
        };
        let next = self.visits.iter().filter_map(event).fold(last, f64::min);
        self.swept = self.swept.max(next);
    }

    /// Puts a chord in the place of all but the last [`LAG_MAX`] of the way, which takes as long as it does
    /// at the speed of the way.
    fn cut_corner(&mut self, duration: f64) {
        let to = self.clock - LAG_MAX.max(duration);
        let from = self.swept;
        if to <= from {
            return;
        }
        let held = |v: &Visit| v.start() <= from && v.end() > from;
        let needed = self.visits.iter().filter(|v| held(v)).map(|v| v.chord_time(from, to)).fold(0.0, f64::max);
        // What comes after moves up, so that the way before, which may have to be swept again, stays as it
        // was.
        let (corner, gap) = (from + needed, to - from - needed);
        for visit in self.visits.iter_mut().filter(|v| v.end() > from) {
            let at_corner = (visit.start() <= to).then(|| PoseSample { time: corner, pose: visit.pose_at(to) });
            let at_start = held(visit).then(|| PoseSample { time: from, pose: visit.pose_at(from) });
            let before = visit.samples.iter().filter(|s| s.time < from).copied();
            let after = visit.samples.iter().filter(|s| s.time > to).map(|s| PoseSample { time: s.time - gap, ..*s });
            visit.samples = before.chain(at_start).chain(at_corner).chain(after).collect();
            // A way of no length has both its ends in one.
            visit.samples.make_contiguous();
            if needed == 0.0 && at_start.is_some() {
                visit.samples.remove(visit.samples.partition_point(|s| s.time < from));
            }
        }
        self.clock -= gap;
    }
}
