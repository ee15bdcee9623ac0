//! The part of a document that a command writes, between two marks.

use std::io::{Error, ErrorKind};
use std::path::Path;

/// The lines before and after the part; they stay.
pub type Marks<'a> = [&'a str; 2];

/// Puts `section` in the place of what stands between the marks of the file `page`.
///
/// # Errors
/// A file that cannot be read or written, or one without marks.
pub fn write(page: &Path, marks: Marks<'_>, section: &str) -> std::io::Result<()> {
    let new = replace(&std::fs::read_to_string(page)?, marks, section);
    let missing = || Error::new(ErrorKind::InvalidData, format!("{} has no {} and end", page.display(), marks[0].trim()));
    std::fs::write(page, new.ok_or_else(missing)?)
}

/// What stands between the marks of a page.
pub fn read<'a>(page: &'a str, marks: Marks<'_>) -> Option<&'a str> {
    Some(page.split_once(marks[0])?.1.split_once(marks[1])?.0)
}

/// The page with another section between its marks; all else as it was.
pub fn replace(page: &str, marks: Marks<'_>, section: &str) -> Option<String> {
    let (before, rest) = page.split_once(marks[0])?;
    let (_, after) = rest.split_once(marks[1])?;
    Some(format!("{before}{}{section}{}{after}", marks[0], marks[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MARKS: Marks<'_> = ["<!-- X:BEGIN -->\n", "<!-- X:END -->"];

    #[test]
    fn only_what_stands_between_the_marks_changes() {
        let page = "before\n<!-- X:BEGIN -->\nold\n<!-- X:END -->\nafter\n<!-- Y:BEGIN -->\nother\n<!-- Y:END -->\n";
        let expected = page.replace("old\n", "new\n");
        let new = replace(page, MARKS, "new\n").expect("marks");
        assert_eq!((new.as_str(), read(&new, MARKS)), (expected.as_str(), Some("new\n")));
        assert_eq!(replace("no marks", MARKS, "new"), None);
        assert_eq!(replace("only one <!-- X:BEGIN -->\n", MARKS, "new"), None);
    }
}
