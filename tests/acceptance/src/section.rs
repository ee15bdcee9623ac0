//! The part of a document that a command writes, between two marks.

/// The lines before and after the part; they stay.
pub type Marks<'a> = [&'a str; 2];

/// What stands between the marks of a page.
pub fn read<'a>(page: &'a str, marks: Marks<'_>) -> Option<&'a str> {
    Some(page.split_once(marks[0])?.1.split_once(marks[1])?.0)
}

/// The page with another section between its marks; all else as it was.
///
/// # Errors
/// A page without the marks, which are named.
pub fn replace(page: &str, marks: Marks<'_>, section: &str) -> Result<String, String> {
    let parts = page.split_once(marks[0]).and_then(|(before, rest)| Some((before, rest.split_once(marks[1])?.1)));
    let (before, after) = parts.ok_or_else(|| format!("no {} and end", marks[0].trim()))?;
    Ok(format!("{before}{}{section}{}{after}", marks[0], marks[1]))
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
        let missing = || Err("no <!-- X:BEGIN --> and end".to_owned());
        assert_eq!(replace("no marks", MARKS, "new"), missing());
        assert_eq!(replace("only one <!-- X:BEGIN -->\n", MARKS, "new"), missing());
    }
}
