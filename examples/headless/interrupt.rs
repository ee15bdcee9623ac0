//! Ctrl+C: what is under way ends and everything is written; a second one ends the program at once.

use crate::{Exit, say};
use std::sync::atomic::{AtomicBool, Ordering};

static IS_REQUESTED: AtomicBool = AtomicBool::new(false);

/// Begins to listen.
///
/// # Errors
/// The system gives no handler.
pub(crate) fn watch() -> Result<(), String> {
    let handler = || {
        if IS_REQUESTED.swap(true, Ordering::Relaxed) {
            std::process::exit(Exit::Interrupted as i32);
        }
        say::warning("interrupted: the frame or picture under way ends, then the results are written; once more ends at once");
    };
    ctrlc::set_handler(handler).map_err(|e| format!("Ctrl+C cannot be listened to: {e}"))
}

/// Whether the run is to end.
pub(crate) fn is_requested() -> bool {
    IS_REQUESTED.load(Ordering::Relaxed)
}
