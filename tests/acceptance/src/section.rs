//! The part of a document that a command writes, between two marks.

use std::io::{Error, ErrorKind};
use std::path::Path;

/// The lines before and after the part; they stay.
pub type Marks = [&'static str; 2];

/// Puts `section(old)` in the place of what stands between the marks of the file `page`.
///
/// # Errors
/// A file that cannot be read or written, or one without marks.
pub fn write(page: &Path, marks: Marks, section: impl FnOnce(&str) -> String) -> std::io::Result<()> {
    let new = replace(&std::fs::read_to_string(page)?, marks, section);
    let missing = || Error::new(ErrorKind::InvalidData, format!("{} has no {} and end", page.display(), marks[0].trim()));
    std::fs::write(page, new.ok_or_else(missing)?)
}

/// The page with another section between its marks; all else as it was.
fn replace(page: &str, marks: Marks, section: impl FnOnce(&str) -> String) -> Option<String> {
    let (before, rest) = page.split_once(marks[0])?;
    let (old, after) = rest.split_once(marks[1])?;
    Some(format!("{before}{}{}{}{after}", marks[0], section(old), marks[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MARKS: Marks = ["<!-- X:BEGIN -->\n", "<!-- X:END -->"];

    #[test]
    fn only_what_stands_between_the_marks_changes() {
        let page = "before\n<!-- X:BEGIN -->\nold\n<!-- X:END -->\nafter\n<!-- Y:BEGIN -->\nother\n<!-- Y:END -->\n";
        let expected = page.replace("old\n", "old, new\n");
        assert_eq!(replace(page, MARKS, |old| format!("{}, new\n", old.trim())).as_deref(), Some(expected.as_str()));
        assert_eq!(replace("no marks", MARKS, str::to_owned), None);
        assert_eq!(replace("only one <!-- X:BEGIN -->\n", MARKS, str::to_owned), None);
    }
}
