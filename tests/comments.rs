//! Comments fit the page: what is wider is read to its end by nobody.

use std::fs;
use std::path::Path;

/// Widest line of a comment [columns]; code keeps rustfmt's own width.
const WIDEST: usize = 110;

/// Number and width of the lines of comments that are too wide. Examples in documentation are code.
fn wide_lines(text: &str) -> impl Iterator<Item = (usize, usize)> {
    let mut is_example = false;
    let comments = (1..).zip(text.lines()).filter(|(_, line)| line.trim_start().starts_with("//"));
    comments.filter_map(move |(number, line)| {
        // The reader of a unit, \[m\], does not see its escapes.
        let width = line.replace("\\[", "[").replace("\\]", "]").chars().count();
        is_example ^= line.trim_start_matches([' ', '/', '!']).starts_with("```");
        (width > WIDEST && !is_example).then_some((number, width))
    })
}

/// The lines of comments under `folder` that are too wide, in Rust and WGSL.
fn too_wide(folder: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            too_wide(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "rs" || ending == "wgsl") {
            let text = fs::read_to_string(&path).expect("a text");
            found.extend(wide_lines(&text).map(|(number, width)| format!("{}:{number}: {width}", path.display())));
        }
    }
}

/// The check itself finds what it is for, and leaves alone what is allowed.
#[test]
fn wide_comments_are_found() {
    let wide = "/".repeat(WIDEST + 1);
    let text =
        format!("{wide}\nlet code = \"{wide}\";\n//! ```\n//! {wide}\n//! ```\n    {}\n{}\\[m\\]\n", &wide[1..], &wide[4..]);
    assert_eq!(wide_lines(&text).collect::<Vec<_>>(), [(1, WIDEST + 1), (6, WIDEST + 4)]);
}

#[test]
fn comments_fit_the_page() {
    let mut found = vec![];
    for folder in ["src", "tests", "examples", "benches"] {
        too_wide(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder), &mut found);
    }
    assert!(found.is_empty(), "comments wider than {WIDEST} columns:\n{}", found.join("\n"));
}
