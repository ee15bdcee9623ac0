//! What the documents show of the chart: picture and sentences.

use super::table::{FILE, Table};
use super::verdict;
use bevy_clay::scene::export::whole::check_writable;
use clay_acceptance::section::{self, Marks};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Where the page holds the section, without these lines.
const MARKS: Marks<'_> = ["<!-- CHART:BEGIN -->\n", "<!-- CHART:END -->"];
/// Where the picture stands in the folder of the documents.
const PICTURE: &str = "images/chart.png";

/// Everything but the picture.
pub(crate) fn text(table: &Table) -> String {
    let mut text = format!("{}.\n\n", table.provenance());
    for sentence in verdict::sentences(table) {
        let _ = writeln!(text, "- {sentence}");
    }
    text
}

/// What stands between the marks.
fn section(table: &Table) -> String {
    format!("![Error against time](images/chart.png)\n\n{}\n", text(table))
}

/// The page in the folder of the documents.
fn page(docs: &Path) -> Result<(PathBuf, String), String> {
    let page = docs.join("EVIDENCE.md");
    let text = std::fs::read_to_string(&page).map_err(|e| format!("{}: {e}", page.display()))?;
    Ok((page, text))
}

/// Finds out whether [`documents`] can be made and written.
///
/// # Errors
/// A file that cannot be read or written, or a page without marks, by name.
pub(crate) fn check(docs: &Path) -> Result<(), String> {
    let (page, text) = page(docs)?;
    section::replace(&text, MARKS, "").map_err(|e| format!("{}: {e}", page.display()))?;
    [docs.join(FILE), page, docs.join(PICTURE)].iter().try_for_each(|file| check_writable(file)).map_err(|e| e.to_string())
}

/// The documents in `docs`: the table on record, the page with the section between its marks, the picture.
///
/// # Errors
/// A page that cannot be read or has no marks, or a table that JSON cannot hold, by its file.
pub(crate) fn documents(docs: &Path, table: &Table, png: Vec<u8>) -> Result<Vec<(PathBuf, Vec<u8>)>, String> {
    let file = docs.join(FILE);
    let record = table.record().map_err(|e| format!("{}: {e}", file.display()))?;
    let (page, text) = page(docs)?;
    let text = section::replace(&text, MARKS, &section(table)).map_err(|e| format!("{}: {e}", page.display()))?;
    Ok(vec![(file, record.into_bytes()), (page, text.into_bytes()), (docs.join(PICTURE), png)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use clay_acceptance::plot;

    /// The page and its picture are those of the table on record.
    #[test]
    fn page_says_what_is_on_record() {
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
        let table = Table::read(&docs).expect("the record");
        let page = std::fs::read_to_string(docs.join("EVIDENCE.md")).expect("the page");
        let rule = "run `cargo run --no-default-features --bin chart -- --redraw --out DIR --docs docs`";
        assert!(section::read(&page, MARKS) == Some(&section(&table)), "docs/EVIDENCE.md is not what docs/data says: {rule}");
        let size = super::super::picture::size(&table);
        let [_, drawn] = plot::draw(&super::super::picture::Chart(&table), size).expect("drawn");
        let shown = std::fs::read(docs.join(PICTURE)).expect("a picture");
        assert!(drawn == shown, "docs/{PICTURE} is not what docs/data says: {rule}");
        let text = std::fs::read_to_string(docs.join(FILE)).expect("the record");
        assert!(table.record().as_deref() == Ok(&text), "docs/{FILE} is not as the program writes it: {rule}");
    }
}
