//! What the documents show: pictures, what the planner's own settings cost, and what the same error costs.

use super::equal::{self, LEVELS};
use super::picture;
use super::sweep::{ERRORS, Family, Point, named};
use super::table::{FILE, Table};
use bevy_clay::scene::export::whole::check_writable;
use bevy_clay::sim::prelude::*;
use clay_acceptance::cases::implicit::Way;
use clay_acceptance::section::{self, Marks};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Where the page holds the section, without these lines.
const MARKS: Marks<'_> = ["<!-- WORK_PRECISION:BEGIN -->\n", "<!-- WORK_PRECISION:END -->"];

/// A picture in the folder of the documents.
fn shown(docs: &Path, name: &str) -> PathBuf {
    docs.join("images").join(name).with_extension("png")
}

/// The text of a figure: three digits.
fn figure(value: f64) -> String {
    let digits = (2 - value.abs().log10().floor().clamp(-3.0, 2.0) as i32).max(0) as usize;
    format!("{value:.digits$}")
}

/// What a run costs and is off by, in a cell of the table.
fn cell(point: Option<&&Point>) -> String {
    let Some(p) = point else { return "-".into() };
    let errors = p.errors.map_or_else(|| "not sound".into(), |e| e.map(figure).join(" / "));
    format!("{} passes, {} ms: {errors}", figure(p.passes), figure(p.time))
}

/// The implicit run nearest to what the planner asks for.
fn own<'a>(points: &'a [&'a Point], accuracy: StepAccuracy) -> Option<&'a &'a Point> {
    points.iter().find(|p| picture::accuracy_of(p) == Some(accuracy))
}

/// A row of the table of costs: the fewest passes of real density, the planner's scaled inertia, its steps.
fn costs(table: &Table, tool: &str, speed: f64) -> String {
    let points = table.of(tool, speed);
    let real = points.iter().find(|p| p.way == Way::Explicit(1.0));
    let scaled = points.iter().find(|p| picture::is_fast(p));
    let [interactive, fine] = [StepAccuracy::Interactive, StepAccuracy::Fine].map(|a| cell(own(&points, a)));
    let own = points.last().map_or_else(String::new, |p| p.uncertainty.map(figure).join(" / "));
    format!("| {} | {own} | {} | {} | {interactive} | {fine} |", named(tool, speed), cell(real), cell(scaled))
}

/// The columns of the table of equal errors: what is compared with implicit steps, index of the error, error.
fn compared() -> impl Iterator<Item = (Family, usize, f64)> {
    let of = |family| (0..ERRORS.len()).flat_map(move |error| LEVELS.map(|level| (family, error, level)));
    [Family::Scaled, Family::Real].into_iter().flat_map(of)
}

/// A row of the table of equal errors.
fn gains(table: &Table, tool: &str, speed: f64) -> String {
    let points = table.of(tool, speed);
    let mut text = format!("| {} |", named(tool, speed));
    for (family, error, level) in compared() {
        let ratio = match equal::gain(&points, family, error, level) {
            None => "-".into(),
            Some(ratio) if ratio.is_infinite() => "never".into(),
            Some(ratio) => figure(ratio),
        };
        let _ = write!(text, " {ratio} |");
    }
    text
}

/// Everything but the pictures.
pub(crate) fn text(table: &Table) -> String {
    let mut text = format!("{}.\n\n", table.provenance());
    text += "| tool | reference's own: force / ways % | explicit, planner's step | scaled inertia, `Fast` | implicit, `Interactive` | implicit, `Fine` |\n|---|---|---|---|---|---|\n";
    for (tool, speed) in table.strokes() {
        let _ = writeln!(text, "{}", costs(table, tool, speed));
    }
    text += "\nTime of explicit steps over that of implicit ones at the same error, each from its best setting (-: an error that implicit steps do not reach; never: one that the others do not):\n\n| tool |";
    for (family, error, level) in compared() {
        let _ = write!(text, " {}, {} {level} % |", family.name(), ERRORS[error]);
    }
    let _ = writeln!(text, "\n|{}", "---|".repeat(compared().count() + 1));
    for (tool, speed) in table.strokes() {
        let _ = writeln!(text, "{}", gains(table, tool, speed));
    }
    text
}

/// What stands between the marks.
fn section(table: &Table) -> String {
    let [passes, time] = picture::NAMES;
    format!("![Error against passes](images/{passes}.png)\n![Error against time](images/{time}.png)\n\n{}\n", text(table))
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
    let files = picture::NAMES.map(|name| shown(docs, name)).into_iter().chain([docs.join(FILE), page]);
    files.into_iter().try_for_each(|file| check_writable(&file)).map_err(|e| e.to_string())
}

/// The documents in `docs`: the table on record, the page with the section between its marks, the pictures.
///
/// # Errors
/// A page that cannot be read or has no marks, or a table that JSON cannot hold, by its file.
pub(crate) fn documents(docs: &Path, table: &Table, pngs: [Vec<u8>; 2]) -> Result<Vec<(PathBuf, Vec<u8>)>, String> {
    let file = docs.join(FILE);
    let record = table.record().map_err(|e| format!("{}: {e}", file.display()))?;
    let (page, text) = page(docs)?;
    let text = section::replace(&text, MARKS, &section(table)).map_err(|e| format!("{}: {e}", page.display()))?;
    let mut files = vec![(file, record.into_bytes()), (page, text.into_bytes())];
    files.extend(picture::NAMES.map(|name| shown(docs, name)).into_iter().zip(pngs));
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::super::table::tests::table;
    use super::*;

    /// The page and its pictures are those of the table on record.
    #[test]
    fn page_says_what_is_on_record() {
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
        let table = Table::read(&docs).expect("the record");
        let page = std::fs::read_to_string(docs.join("EVIDENCE.md")).expect("the page");
        let rule = "run `cargo run --no-default-features --bin work_precision -- --redraw --out DIR --docs docs`";
        assert!(section::read(&page, MARKS) == Some(&section(&table)), "docs/EVIDENCE.md is not what docs/data says: {rule}");
        for (name, [_, drawn]) in picture::NAMES.iter().zip(picture::draw(&table).expect("drawn")) {
            let file = std::fs::read(shown(&docs, name)).expect("a picture");
            assert!(drawn == file, "docs/images/{name}.png is not what docs/data says: {rule}");
        }
        let text = std::fs::read_to_string(docs.join(FILE)).expect("the record");
        assert!(table.record().as_deref() == Ok(&text), "docs/{FILE} is not as the program writes it: {rule}");
    }

    /// Costs of the planner's settings that were run, and ratios at errors that both reach.
    #[test]
    fn rows_hold_costs_and_ratios() {
        let table = table();
        assert_eq!(
            costs(&table, "strip", 20.0),
            "| strip, 20 mm/s | 0.200 / 0.300 | 400 passes, 800 ms: 0.500 / 1.00 | 50.0 passes, 100 ms: 4.00 / 9.00 | - | - |"
        );
        assert_eq!(gains(&table, "strip", 20.0), "| strip, 20 mm/s | - | 5.00 | - | - | - | 40.0 | - | - |");
    }
}
