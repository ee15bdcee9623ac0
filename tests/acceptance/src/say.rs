//! Lines for whoever listens. A closed or full standard output is no reason to lose a run: its results are
//! the files.

use std::io::{self, Error, ErrorKind, Write};
use std::sync::OnceLock;

/// Why standard output takes no more lines; unset while it does.
static END: OnceLock<Error> = OnceLock::new();

/// A line on standard output, while it takes any.
pub fn line(text: &str) {
    if END.get().is_some() {
        return;
    }
    let mut out = io::stdout().lock();
    if let Err(error) = writeln!(out, "{text}").and_then(|()| out.flush()) {
        END.get_or_init(|| error);
    }
}

/// A line on standard error about what is wrong.
pub fn error(text: &str) {
    // Where standard error is closed there is nobody left to tell; the exit code says it too.
    let _ = writeln!(io::stderr().lock(), "error: {text}");
}

/// Whether standard output took every line. That it did not is said on standard error, unless the reader has
/// had enough and closed it, as `head` does: then nothing is wrong.
pub fn was_heard() -> bool {
    match END.get() {
        Some(cause) if cause.kind() != ErrorKind::BrokenPipe => {
            error(&format!("standard output took no more lines: {cause}"));
            false
        }
        _ => true,
    }
}
