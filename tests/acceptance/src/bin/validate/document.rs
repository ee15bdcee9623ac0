//! The summary of the acceptance cases in docs/EVIDENCE.md: a line per case, from the rows on record in
//! docs/data.

use super::cut_methods::{NAME, TITLE};
use super::evidence::{self, EVIDENCE};
use clay_acceptance::cases::CASES;
use clay_acceptance::data::{Outcome, Record};
use clay_acceptance::lab::{EngineKind, Size};
use clay_acceptance::report::{Bound, KnownMiss, Row, Verdict, judge};
use clay_acceptance::section::{self, Marks};
use std::fmt::Write as _;

/// Where EVIDENCE.md holds the summary.
const MARKS: Marks<'static> = ["<!-- VALIDATE:BEGIN -->\n", "<!-- VALIDATE:END -->"];

/// The summary of the rows on record.
fn summary(records: &[Record], known: &[KnownMiss]) -> String {
    let mut text =
        "| case | rows | exact answer | nearest to its limit | published | run |\n|---|---|---|---|---|---|\n".to_owned();
    let mut misses = String::new();
    for case in CASES {
        let shown = shown(records, case.name);
        if !shown.is_empty() {
            let _ = writeln!(text, "{}", line(case.name, &shown));
        }
        for record in shown {
            match judge(&record.row, record.run.size, known) {
                Verdict::Pass | Verdict::Figure => {}
                Verdict::Miss(reason) => writeln!(misses, "- {}: {reason}", against_limit(&record.row)).expect("text"),
                Verdict::Fail(reason) => writeln!(misses, "- **fails**: {}: {reason}", against_limit(&record.row)).expect("text"),
            }
        }
    }
    if misses.is_empty() {
        misses.push_str("None.\n");
    }
    let unknown = records.iter().filter(|r| r.run.commit.is_none()).count();
    let unknown = match unknown {
        0 => String::new(),
        _ => format!("\nThe commit of {unknown} of the {} rows on record is not known.\n", records.len()),
    };
    format!("{text}{unknown}\nMisses:\n\n{misses}\n![{TITLE}](images/{NAME}.png)\n\n")
}

/// The marks of a table of results of other commands.
fn marks(table: &str) -> [String; 2] {
    ["BEGIN", "END"].map(|end| format!("<!-- RESULTS {table}:{end} -->\n"))
}

/// The page with what is on record of both kinds.
pub(crate) fn page(page: &str, records: &[Record], known: &[KnownMiss], results: &[Outcome]) -> Result<String, String> {
    with_tables(section::replace(page, MARKS, &summary(records, known))?, results)
}

/// The page with the tables of results of other commands as they are on record; an error names a table that
/// the page has no marks for.
fn with_tables(mut page: String, results: &[Outcome]) -> Result<String, String> {
    let mut names: Vec<&str> = results.iter().map(|r| r.table.as_str()).collect();
    names.dedup();
    for name in names {
        let rows: Vec<&Outcome> = results.iter().filter(|r| r.table == name).collect();
        let columns: Vec<&str> = rows[0].cells.iter().map(|c| c.0.as_str()).collect();
        let mut text = format!("| {} | run |\n|{}---|\n", columns.join(" | "), "---|".repeat(columns.len()));
        for row in rows {
            let cells: Vec<&str> = row.cells.iter().map(|c| c.1.as_str()).collect();
            let _ = writeln!(text, "| {} | {} |", cells.join(" | "), row.run.words());
        }
        let [begin, end] = marks(name);
        page = section::replace(&page, [&begin, &end], &text)?;
    }
    Ok(page)
}

/// The rows of a case that stand for it: of each engine those of the full run, or of the quick one where
/// there was no other.
fn shown<'a>(records: &'a [Record], case: &str) -> Vec<&'a Record> {
    let of = |engine, size| {
        let is_so = move |r: &&Record| r.group == case && r.run.engine == Some(engine) && r.run.size == size;
        records.iter().filter(is_so).collect::<Vec<_>>()
    };
    let best = |engine| {
        let full = of(engine, Size::Full);
        if full.is_empty() { of(engine, Size::Quick) } else { full }
    };
    [EngineKind::Native, EngineKind::Gpu].into_iter().flat_map(best).collect()
}

/// The line of a case: what it is judged by is told of the row that comes nearest to its limit.
fn line(case: &str, shown: &[&Record]) -> String {
    let judged: Vec<&&Record> = shown.iter().filter(|r| r.row.bound != Bound::None).collect();
    let nearest = judged.iter().max_by(|a, b| share(&a.row).total_cmp(&share(&b.row)));
    let evidence = evidence::of(EVIDENCE, case, nearest.map_or("", |r| &r.row.case));
    let [exact, published] = evidence.map_or(["", ""], |e| [e.exact, e.published]);
    let count = match shown.len() - judged.len() {
        0 => judged.len().to_string(),
        unlimited => format!("{} + {unlimited} without a limit", judged.len()),
    };
    let mut runs: Vec<String> = vec![];
    for run in shown.iter().map(|r| r.run.words()) {
        if !runs.contains(&run) {
            runs.push(run);
        }
    }
    let nearest = nearest.map_or_else(String::new, |r| against_limit(&r.row));
    format!("| {case} | {count} | {exact} | {nearest} | {published} | {} |", runs.join("; "))
}

/// How much of what its limit allows a row takes; beyond 1 it misses.
fn share(row: &Row) -> f64 {
    let (value, of) = if row.bound == Bound::Max { (row.value, row.limit) } else { (row.limit, row.value) };
    // A count of 0 where none is allowed, and a yes, are as far from their limits as can be; what is no
    // number misses it.
    if value == 0.0 || (row.unit == "yes" && row.ok) {
        0.0
    } else if value.is_nan() || of.is_nan() {
        f64::INFINITY
    } else {
        value / of
    }
}

/// A row in words: its value and its limit.
fn against_limit(row: &Row) -> String {
    let unit = if row.unit == "-" { String::new() } else { format!(" {}", row.unit) };
    let sign = if row.bound == Bound::Max { "<=" } else { ">=" };
    format!("{}: {} (limit {sign} {}{unit})", row.case, figure(row.value), figure(row.limit))
}

/// Three digits, with an exponent where many zeros would stand.
pub(crate) fn figure(value: f64) -> String {
    let magnitude = value.abs();
    if !value.is_finite() {
        return "none".to_owned();
    }
    if magnitude != 0.0 && !(1e-3..1e5).contains(&magnitude) {
        return format!("{value:.1e}").replace(".0e", "e");
    }
    let digits = if magnitude == 0.0 { 0 } else { (2 - magnitude.log10().floor() as i32).clamp(0, 5) };
    let text = format!("{value:.*}", digits.unsigned_abs() as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clay_acceptance::cases::Suite;
    use clay_acceptance::data::{self, Run};
    use clay_acceptance::report::parse_known;
    use std::path::{Path, PathBuf};

    fn docs() -> PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs")
    }

    fn record(row: Row, size: Size) -> Record {
        let run = Run { size, engine: Some(EngineKind::Native), adapter: None, date: "2026-01-02".into(), commit: None };
        Record { group: "bar".into(), row, run }
    }

    #[test]
    fn figures_have_three_digits() {
        let texts = [0.0, 1.8e-7, 1e-5, 0.0345, 0.2, 5.2814, 1e3, 12_345.6, 2e6, f64::NAN].map(figure);
        assert_eq!(texts, ["0", "1.8e-7", "1e-5", "0.0345", "0.2", "5.28", "1000", "12346", "2e6", "none"]);
    }

    /// The row nearest to its limit stands for the case, a count of zero for none; full runs for quick ones.
    #[test]
    fn case_is_told_by_its_nearest_row() {
        let rows = [
            record(Row::at_most("bar: count", 0.0, "count", 0.0), Size::Full),
            record(Row::at_most("bar: error", 0.05, "%", 0.1), Size::Full),
            record(Row::at_least("bar: order", 2.0, "-", 1.8), Size::Full),
            record(Row::figure("bar: time", 7.0, "s"), Size::Full),
            record(Row::at_most("bar: error", 0.09, "%", 0.1), Size::Quick),
        ];
        let text = summary(&rows, &[]);
        let line = text.lines().find(|l| l.starts_with("| bar |")).expect("a line");
        assert!(
            line.starts_with("| bar | 3 + 1 without a limit | ") && line.contains("| bar: order: 2 (limit >= 1.8) |"),
            "{line}"
        );
        assert!(line.ends_with("| full, native, 2026-01-02 |") && text.contains("\nNone.\n"), "{text}");
    }

    #[test]
    fn rows_of_unknown_commits_are_counted() {
        let mut rows = [1.0, 2.0, 3.0].map(|value| record(Row::figure("bar: time", value, "s"), Size::Full));
        rows[1].run.commit = Some("abc".into());
        let text = summary(&rows, &[]);
        assert!(text.contains("\nThe commit of 2 of the 3 rows on record is not known.\n"), "{text}");
        rows.iter_mut().for_each(|r| r.run.commit = Some("abc".into()));
        assert!(!summary(&rows, &[]).contains("not known"));
    }

    #[test]
    fn misses_are_named() {
        let known = [KnownMiss {
            group: "bar".into(),
            sizes: vec![Size::Full],
            case: "bar: error".into(),
            limit: 0.1,
            value: 0.2,
            reason: "ripple".into(),
        }];
        let rows = [0.2, 0.3].map(|value| record(Row::at_most("bar: error", value, "%", 0.1), Size::Full));
        let text = summary(&rows, &known);
        assert!(text.contains("\n- bar: error: 0.2 (limit <= 0.1 %): ripple\n"), "{text}");
        assert!(text.contains("\n- **fails**: bar: error: 0.3 (limit <= 0.1 %): is more than 10 % worse"), "{text}");
    }

    /// The page says what is on record, of every case of the solver; its picture is that of the record.
    #[test]
    fn page_says_what_is_on_record() {
        let records: Vec<Record> = data::read(&data::acceptance(&docs())).expect("the record");
        let known = parse_known(&std::fs::read_to_string(docs().join("known_misses.ron")).expect("a list")).expect("a list").rows;
        let page = std::fs::read_to_string(docs().join("EVIDENCE.md")).expect("the page");
        let summary = summary(&records, &known);
        let rule = "run `cargo validate none --docs docs`";
        assert!(section::read(&page, MARKS) == Some(summary.as_str()), "docs/EVIDENCE.md is not what docs/data says: {rule}");
        let drawn = super::super::cut_methods::draw(&records).expect("drawn");
        let picture = std::fs::read(docs().join(format!("images/{NAME}.png"))).expect("a picture");
        assert!(drawn == picture, "docs/images/{NAME}.png is not what docs/data says: {rule}");
        for case in CASES.iter().filter(|c| !matches!(c.suite, Suite::Surface | Suite::Speed)) {
            assert!(summary.contains(&format!("\n| {} |", case.name)), "no row of {}", case.name);
            let name = evidence::case_of(case.name);
            assert!(EVIDENCE.iter().any(|e| e.case == name), "no evidence of {name}");
        }
        let results: Vec<Outcome> = data::read(&data::outcomes(&docs())).expect("the record");
        let is_same = with_tables(page.clone(), &results).as_ref() == Ok(&page);
        assert!(is_same, "a table of docs/EVIDENCE.md is not what docs/data says: {rule}");
        let text = std::fs::read_to_string(data::acceptance(&docs())).expect("the record");
        assert!(
            data::text(&records).as_deref() == Ok(&text),
            "docs/data/acceptance.json is not as the program writes it: {rule}"
        );
    }
}
