//! Lines for whoever listens. A closed or full standard output is no reason to lose a run: its results are
//! the files.

use std::io::{self, ErrorKind, Write};
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether standard output still takes lines.
static IS_HEARD: AtomicBool = AtomicBool::new(true);

/// A line on standard output. Once it takes no more, that is said on standard error, unless the reader has
/// had enough and closed it, as `head` does.
pub(crate) fn line(text: &str) {
    if !IS_HEARD.load(Ordering::Relaxed) {
        return;
    }
    let mut out = io::stdout().lock();
    if let Err(error) = writeln!(out, "{text}").and_then(|()| out.flush()) {
        IS_HEARD.store(false, Ordering::Relaxed);
        if error.kind() != ErrorKind::BrokenPipe {
            warning(&format!("standard output takes no more lines: {error}; the run goes on"));
        }
    }
}

/// A line on standard error about what is odd.
pub(crate) fn warning(text: &str) {
    on_error("warning", text);
}

/// A line on standard error about what is wrong.
pub(crate) fn error(text: &str) {
    on_error("error", text);
}

fn on_error(kind: &str, text: &str) {
    // Where standard error is closed there is nobody left to tell; faults stand in the summary as well.
    let _ = writeln!(io::stderr().lock(), "{kind}: {text}");
}
