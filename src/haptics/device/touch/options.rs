//! How a Touch is opened.

use crate::haptics::clock;
use std::ffi::CString;
use std::path::PathBuf;

/// How a Touch is opened.
#[derive(Clone, Debug)]
pub struct TouchOptions {
    /// The library's file; without one it is looked for: see
    /// [`candidates`](crate::haptics::device::hd::library::candidates).
    pub library: Option<PathBuf>,
    /// The device's name in the driver's setup; the default one without.
    pub name: Option<CString>,
    /// The clock that ticks are timed by \[s\].
    pub clock: fn() -> f64,
    /// Whether it may push. Without it the motors stay off.
    pub has_force: bool,
}

impl Default for TouchOptions {
    fn default() -> Self {
        Self { library: None, name: None, clock: clock::now, has_force: true }
    }
}
