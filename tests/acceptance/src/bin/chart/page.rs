//! What the documents show of the chart: picture and sentences.

use super::table::{FILE, Table};
use super::verdict;
use clay_acceptance::data;
use clay_acceptance::section::{self, Marks};
use std::fmt::Write as _;
use std::path::Path;

/// Where the page holds the section, without these lines.
const MARKS: Marks<'_> = ["<!-- CHART:BEGIN -->\n", "<!-- CHART:END -->"];

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

/// Puts the table on record in `docs`, copies the picture to images/chart.png there, and the section between
/// the marks of EVIDENCE.md.
///
/// # Errors
/// A file that cannot be read or written, or a page without marks.
pub(crate) fn write(docs: &Path, table: &Table, picture: &Path) -> Result<(), String> {
    let fault = |e: std::io::Error| e.to_string();
    data::write(&docs.join(FILE), &table.record()?).map_err(fault)?;
    section::write(&docs.join("EVIDENCE.md"), MARKS, &section(table)).map_err(fault)?;
    std::fs::read(picture).and_then(|bytes| std::fs::write(docs.join("images/chart.png"), bytes)).map_err(fault)
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
        let folder = tempfile::tempdir().expect("a folder");
        let size = super::super::picture::size(&table);
        let [_, drawn] = plot::write(&super::super::picture::Chart(&table), &folder.path().join("chart"), size).expect("drawn");
        let [drawn, shown] = [drawn, docs.join("images/chart.png")].map(|file| std::fs::read(file).expect("a picture"));
        assert!(drawn == shown, "docs/images/chart.png is not what docs/data says: {rule}");
        let text = std::fs::read_to_string(docs.join(FILE)).expect("the record");
        assert!(table.record().as_deref() == Ok(&text), "docs/{FILE} is not as the program writes it: {rule}");
    }
}
