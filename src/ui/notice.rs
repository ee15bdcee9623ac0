//! What came of what was asked for, in one line.

use crate::plugin::events::{ClayChange, ClayChanged, ClayEngineLost, ClayExported, ClayTrouble};
use bevy::prelude::*;
use std::path::PathBuf;

/// The last thing worth saying to the user.
#[derive(Resource, Clone, Debug, Default)]
pub struct ClayNotice {
    /// One line; empty for nothing.
    pub text: String,
    /// Whether it is bad news.
    pub is_error: bool,
}

impl ClayNotice {
    /// Good news.
    pub fn say(&mut self, text: impl Into<String>) {
        *self = Self { text: text.into(), is_error: false };
        info!("{}", self.text);
    }

    /// Bad news.
    pub fn warn(&mut self, text: impl Into<String>) {
        *self = Self { text: text.into(), is_error: true };
        warn!("{}", self.text);
    }
}

/// Says what was done.
pub(super) fn changed(news: On<ClayChanged>, mut notice: ResMut<ClayNotice>) {
    notice.say(match news.change {
        ClayChange::Reset => "back at the start".into(),
        ClayChange::Resampled(width) => format!("the clay stands on cells of {:.2} mm", width * 1e3),
        ClayChange::OffcutsDropped => "offcuts gone: the largest piece is left".into(),
        ClayChange::Undone(left) => format!("taken back, {left} left to take back"),
        ClayChange::Redone(left) => format!("done again, {left} left to do again"),
    });
}

/// Says which files there are.
pub(super) fn exported(news: On<ClayExported>, mut notice: ResMut<ClayNotice>) {
    let absolute = |path: &PathBuf| std::path::absolute(path).unwrap_or_else(|_| path.clone()).display().to_string();
    let first = news.files.first().map(absolute).unwrap_or_default();
    notice.say(match news.files.len() {
        0 | 1 => format!("wrote {first}"),
        count => format!("wrote {first} and {} more files", count - 1),
    });
}

/// Says what is wrong.
pub(super) fn trouble(news: On<ClayTrouble>, mut notice: ResMut<ClayNotice>) {
    notice.warn(news.error.to_string());
}

/// Says that an engine went.
pub(super) fn lost(news: On<ClayEngineLost>, mut notice: ResMut<ClayNotice>) {
    notice.warn(news.reason.clone());
}
