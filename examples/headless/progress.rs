//! How far the run is: a bar in a terminal, now and then a line elsewhere.

use crate::say;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{self, IsTerminal};
use std::time::{Duration, Instant};

/// Lines of a run that is not watched in a terminal.
const LINES: u64 = 10;
/// Longest silence of one whose frames take long.
const SILENCE_MAX: Duration = Duration::from_secs(30);

pub(crate) struct Progress {
    frames: u64,
    done: u64,
    /// Drawn on standard error, where that is a terminal.
    bar: ProgressBar,
    /// Whether lines are written.
    lines: bool,
    began: Instant,
    said: Instant,
}

impl Progress {
    pub(crate) fn new(frames: u64) -> Self {
        let style = ProgressStyle::with_template("{bar:40} {pos}/{len} frames, {eta} left, {msg}")
            .unwrap_or(ProgressStyle::default_bar());
        let now = Instant::now();
        let lines = !(io::stdout().is_terminal() && io::stderr().is_terminal());
        Self { frames, done: 0, bar: ProgressBar::new(frames).with_style(style), lines, began: now, said: now }
    }

    /// One more frame is done; `message` says how it went.
    pub(crate) fn step(&mut self, message: &str) {
        let tenths = |done: u64| done * LINES / self.frames;
        self.done += 1;
        self.bar.set_message(message.to_string());
        self.bar.inc(1);
        if !self.lines || (tenths(self.done) == tenths(self.done - 1) && self.said.elapsed() < SILENCE_MAX) {
            return;
        }
        self.said = Instant::now();
        let left = self.began.elapsed().as_secs_f64() * (self.frames - self.done) as f64 / self.done as f64;
        say::line(&format!("frame {} of {}, about {left:.0} s left, {message}", self.done, self.frames));
    }

    /// Leaves the terminal as it was.
    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
