//! Words of files, paths and other programs in messages: one short line, whatever they hold.

use std::path::Path;

/// Letters of a file's words that a message shows.
const WORD: usize = 60;
/// Letters of a message from elsewhere.
const LINE: usize = 200;
/// Letters of a path.
const PATH: usize = 300;
/// Letters of a message of this crate, which may list what is known.
const LIST: usize = 500;

/// A path as messages name it: one line of at most 300 letters.
pub fn named(path: &Path) -> String {
    cut(&path.display().to_string(), PATH)
}

/// The beginning of a word of a file, fit for a line.
pub(super) fn short(word: &str) -> String {
    cut(word, WORD)
}

/// A message from elsewhere as one line of at most 200 letters.
pub fn one_line(text: &str) -> String {
    cut(text, LINE)
}

/// A message of this crate, which may list what is known, as one line of at most 500 letters.
pub(super) fn listed(text: &str) -> String {
    cut(text, LIST)
}

fn cut(text: &str, most: usize) -> String {
    let mut line: String = text.chars().map(printable).take(most).collect();
    if text.chars().nth(most).is_some() {
        line.push_str("...");
    }
    line
}

fn printable(c: char) -> char {
    if c.is_control() { ' ' } else { c }
}
