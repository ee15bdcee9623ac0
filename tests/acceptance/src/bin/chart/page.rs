//! What the documents show of the chart: sentences, picture and tables.

use super::knobs::Knob;
use super::table::{Row, Table};
use super::verdict;
use clay_acceptance::section::{self, Marks};
use std::fmt::Write as _;
use std::path::Path;

/// Where the page holds the section, without these lines.
const MARKS: Marks = ["<!-- CHART:BEGIN -->\n", "<!-- CHART:END -->"];

/// Everything but the picture.
pub(crate) fn text(table: &Table) -> String {
    let mut text = format!("{}, {}.\n\n", table.provenance(), table.date);
    for sentence in verdict::sentences(table) {
        let _ = writeln!(text, "- {sentence}");
    }
    text.push('\n');
    text + &markdown(table)
}

/// Copies the picture to images/chart.png in `docs` and puts the section between the marks of EVIDENCE.md.
///
/// # Errors
/// A file that cannot be read or written, or a page without marks.
pub(crate) fn write(docs: &Path, table: &Table, picture: &Path) -> std::io::Result<()> {
    let new = |_: &str| format!("![Error against time](images/chart.png)\n\n{}", text(table));
    section::write(&docs.join("EVIDENCE.md"), MARKS, new)?;
    std::fs::write(docs.join("images/chart.png"), std::fs::read(picture)?)
}

/// The table of each scene: a line per point, its errors side by side, a star on the front.
fn markdown(table: &Table) -> String {
    let mut text = String::new();
    let mut scenes: Vec<&str> = table.rows.iter().map(|r| r.scene).collect();
    scenes.dedup();
    for scene in scenes {
        let rows: Vec<&Row> = table.rows.iter().filter(|r| r.scene == scene).collect();
        let mut panels: Vec<&Row> = vec![];
        for row in &rows {
            if !panels.iter().any(|p| p.panel == row.panel) {
                panels.push(row);
            }
        }
        let names: Vec<&str> = panels.iter().map(|p| p.axis).collect();
        let _ = writeln!(text, "| {scene} | particles | {} | ms per simulated s (quartiles) |", names.join(" | "));
        let _ = writeln!(text, "|---|---|{}---|", "---|".repeat(names.len()));
        for row in rows.iter().filter(|r| r.panel == panels[0].panel) {
            let same = rows.iter().filter(|r| r.point == row.point);
            let errors: Vec<String> =
                same.map(|r| format!("{}{}", figure(r.error), if r.on_front { " *" } else { "" })).collect();
            let [low, median, high] = row.cost.map(figure);
            let label = if row.point.knob == Knob::Default { "**default**, " } else { "" };
            let _ = writeln!(
                text,
                "| {label}{} | {} | {} | {median} ({low}-{high}) |",
                row.point.label(),
                row.particles,
                errors.join(" | ")
            );
        }
        text.push('\n');
    }
    text
}

/// Three digits, no exponent.
fn figure(value: f64) -> String {
    let digits = 2 - value.abs().max(1e-9).log10().floor() as i32;
    format!("{value:.*}", digits.clamp(0, 6).unsigned_abs() as usize)
}

#[cfg(test)]
mod tests {
    use super::super::table::tests::table;
    use super::super::verdict::tests::rows;
    use super::*;

    #[test]
    fn table_stars_the_front() {
        let text = markdown(&table(rows()));
        assert!(text.contains("| **default**, 16 cells | 1000 | 1.00 * | 100 (90.0-110) |"), "{text}");
        assert!(text.contains("| 27 per cell | 1000 | 0.250 * | 300 (270-330) |"), "{text}");
        assert!(text.contains("| 24 cells | 1000 | 0.500 | 400 (360-440) |"), "{text}");
    }
}
