//! What was felt in the last half second.

use glam::DVec3;

/// Ticks that are kept: more than a stall of 200 ms with the latency of its frames.
const LENGTH: usize = 512;

/// A tick that was.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Past {
    pub(super) time: f64,
    /// Force on the tool \[N\].
    pub(super) force: DVec3,
    /// Its integral from the start \[N s\].
    pub(super) impulse: DVec3,
    /// Where the clay's spring was free \[m\].
    pub(super) origin: DVec3,
    /// By how much frames had moved that, in all \[m\], and the integral of it from the start \[m s\].
    pub(super) moved: DVec3,
    pub(super) moved_sum: DVec3,
    /// What the ledger had paid, in all \[N s\].
    pub(super) paid: DVec3,
    /// Where the clay's tool was \[m\], and how far a blade had slid in its plane, in all \[m\].
    pub(super) tool: DVec3,
    pub(super) slid: f64,
}

impl Past {
    /// The integrals at a later tick.
    fn sums(&self, later: &Self) -> [DVec3; 2] {
        let half = 0.5 * (later.time - self.time);
        [self.impulse + half * (self.force + later.force), self.moved_sum + half * (self.moved + later.moved)]
    }
}

/// The last ticks, in order.
#[derive(Clone, Debug)]
pub(super) struct History {
    /// As long as it will ever be.
    past: Vec<Past>,
    count: usize,
    next: usize,
}

impl History {
    /// Room for all ticks that are kept: what is made here is all that is ever allocated.
    pub(super) fn new() -> Self {
        Self { past: vec![Past::default(); LENGTH], count: 0, next: 0 }
    }

    /// Without room, for a moment.
    pub(super) const fn none() -> Self {
        Self { past: vec![], count: 0, next: 0 }
    }

    /// Forgets all ticks.
    pub(super) fn clear(&mut self) {
        (self.count, self.next) = (0, 0);
    }

    /// The newest tick.
    fn last(&self) -> Option<&Past> {
        (self.count > 0).then(|| self.at(self.count - 1))
    }

    /// Tick number `index`, the oldest first.
    fn at(&self, index: usize) -> &Past {
        &self.past[(self.next + LENGTH - self.count + index) % LENGTH]
    }

    /// Takes in a tick; its integrals are made here, by the trapezium.
    pub(super) fn push(&mut self, tick: Past) {
        let [impulse, moved_sum] = self.last().map_or([DVec3::ZERO; 2], |before| before.sums(&tick));
        self.past[self.next] = Past { impulse, moved_sum, ..tick };
        self.next = (self.next + 1) % LENGTH;
        self.count = (self.count + 1).min(LENGTH);
    }

    /// What was at a time, between its two ticks; none before the oldest and after the newest.
    pub(super) fn look(&self, time: f64) -> Option<Past> {
        if self.count == 0 || time < self.at(0).time || time > self.at(self.count - 1).time {
            return None;
        }
        let (mut low, mut high) = (0, self.count - 1);
        while high - low > 1 {
            let middle = low.midpoint(high);
            if self.at(middle).time <= time { low = middle } else { high = middle }
        }
        let (a, b) = (self.at(low), self.at(high));
        let share = if b.time > a.time { (time - a.time) / (b.time - a.time) } else { 0.0 };
        let mix = |a: DVec3, b: DVec3| a.lerp(b, share);
        let between = Past {
            time,
            force: mix(a.force, b.force),
            origin: mix(a.origin, b.origin),
            moved: mix(a.moved, b.moved),
            paid: mix(a.paid, b.paid),
            tool: mix(a.tool, b.tool),
            slid: a.slid + (b.slid - a.slid) * share,
            ..Past::default()
        };
        let [impulse, moved_sum] = a.sums(&between);
        Some(Past { impulse, moved_sum, ..between })
    }

    /// The ticks after a time, in order.
    pub(super) fn after(&self, time: f64) -> impl Iterator<Item = &Past> {
        (0..self.count).map(|index| self.at(index)).filter(move |past| past.time > time)
    }

    /// Means of force \[N\] and of what frames had moved \[m\] between two ticks, of which the one is later:
    /// at the ends of so many equal parts, or over all of it where there are none.
    pub(super) fn means(&self, [first, last]: &[Past; 2], parts: u32) -> [DVec3; 2] {
        let duration = last.time - first.time;
        if parts == 0 {
            return [last.impulse - first.impulse, last.moved_sum - first.moved_sum].map(|sum| sum / duration);
        }
        let part = duration / f64::from(parts);
        let ends = (1..parts).filter_map(|i| self.look(first.time + f64::from(i) * part)).chain([*last]);
        let [mut force, mut moved] = [DVec3::ZERO; 2];
        ends.for_each(|end| (force, moved) = (force + end.force, moved + end.moved));
        [force, moved].map(|sum| sum / f64::from(parts))
    }

    /// What was at both ends of a span.
    pub(super) fn ends(&self, [from, to]: [f64; 2]) -> Option<[Past; 2]> {
        Some([self.look(from)?, self.look(to)?])
    }
}
