//! The clock that the hand's loop and the clay share.

use std::sync::OnceLock;
use std::time::Instant;

/// Seconds since this was first asked for, in this process \[s\]. Clay frames are stamped by it, and devices
/// that have no clock of their own are timed by it. It never goes back, and neither waits nor allocates once
/// it was asked.
pub fn now() -> f64 {
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_secs_f64()
}
