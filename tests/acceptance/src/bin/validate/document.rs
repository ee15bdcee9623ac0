//! The table of acceptance cases in docs/EVIDENCE.md: a line per row, from the rows of a run.

use super::evidence::{self, EVIDENCE};
use clay_acceptance::report::{Bound, KnownMiss, Row, Verdict, judge};
use clay_acceptance::section::Marks;
use std::fmt::Write as _;

/// Where EVIDENCE.md holds the table.
pub(crate) const MARKS: Marks = ["<!-- VALIDATE:BEGIN -->\n", "<!-- VALIDATE:END -->"];

/// A case and the lines of its rows; none where it was not run or has no row at this size.
pub(crate) type Lines = (&'static str, Vec<String>);

/// The line of one row. `run` tells size, engine and day, so that lines of several runs can stand beside each other.
pub(crate) fn line(case: &str, row: &Row, known: &[KnownMiss], run: &str) -> String {
    let evidence = evidence::of(EVIDENCE, case, &row.case);
    let mark = match judge(row, known) {
        Verdict::Pass | Verdict::Figure => "",
        Verdict::Miss(_) => " (known miss)",
        Verdict::Fail(_) => " (**fails**)",
    };
    let unit = if row.unit == "-" { String::new() } else { format!(" {}", row.unit) };
    let [exact, published] = evidence.map_or(["", ""], |e| [e.exact, e.published]);
    let (ours, limit) = (figure(row.value), figure(row.limit));
    let limit = match row.bound {
        Bound::Max => format!("<= {limit}{unit}"),
        Bound::Min => format!(">= {limit}{unit}"),
        Bound::None => format!("none [{}]", row.unit),
    };
    format!("| {case} | {} | {exact} | {ours}{mark} | {limit} | {published} | {run} |", row.case)
}

/// The section with the lines of `found` in place of those of the same cases in the `old` one. `origin` says how the new lines were made.
pub(crate) fn section(old: &str, found: &[Lines], origin: &str) -> String {
    let mut text = format!("Last run: {origin}\n\n");
    text += "| case | figure | exact answer | ours | limit | published | run |\n|---|---|---|---|---|---|---|\n";
    for (case, lines) in found {
        let kept = old.lines().filter(|l| lines.is_empty() && l.starts_with(&format!("| {case} |")));
        for line in kept.chain(lines.iter().map(String::as_str)) {
            let _ = writeln!(text, "{line}");
        }
    }
    text.push('\n');
    text
}

/// Three digits, with an exponent where many zeros would stand.
fn figure(value: f64) -> String {
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
    use clay_acceptance::cases::{CASES, Suite};

    #[test]
    fn figures_have_three_digits() {
        let texts = [0.0, 1.8e-7, 1e-5, 0.0345, 0.2, 5.2814, 1e3, 12_345.6, 2e6, f64::NAN].map(figure);
        assert_eq!(texts, ["0", "1.8e-7", "1e-5", "0.0345", "0.2", "5.28", "1000", "12346", "2e6", "none"]);
    }

    #[test]
    fn line_says_whether_a_miss_is_known() {
        let known = [KnownMiss { case: "Hertz: force".into(), limit: 0.05, value: 0.42, reason: "ripple".into() }];
        let row = |value: f64| line("Hertz", &Row::at_most("Hertz: force", value, "relative", 0.05), &known, "full, day");
        assert!(row(0.424).contains("| 0.424 (known miss) | <= 0.05 relative |"), "{}", row(0.424));
        assert!(row(0.6).contains("| 0.6 (**fails**) |"), "{}", row(0.6));
        assert!(row(0.424).ends_with("| full, day |") && row(0.424).contains("4/3 E"), "{}", row(0.424));
    }

    /// Cases that were run get their new lines, the others keep theirs, in the order of the cases.
    #[test]
    fn run_of_a_part_keeps_the_other_lines() {
        let old =
            "Last run: then\n\n| case |\n|---|\n| bar | a | old |\n| bar | b | old |\n| cone | c | old |\n| gone | d | old |\n\n";
        let found = [
            ("bar", vec![]),
            ("column", vec!["| column | e | new |".to_owned()]),
            ("cone", vec!["| cone | c | new |".to_owned()]),
        ];
        let new = section(old, &found, "now");
        let lines: Vec<&str> = new.lines().skip(4).collect();
        assert_eq!(lines, ["| bar | a | old |", "| bar | b | old |", "| column | e | new |", "| cone | c | new |", ""]);
        assert!(new.starts_with("Last run: now\n\n| case | figure |"));
    }

    /// The document as it stands has a line of every case of the solver.
    #[test]
    fn document_has_every_case() {
        let page = include_str!("../../../../../docs/EVIDENCE.md");
        let (_, rest) = page.split_once(MARKS[0]).expect("the first mark");
        let (table, _) = rest.split_once(MARKS[1]).expect("the second mark");
        for case in CASES.iter().filter(|c| c.suite != Suite::Surface) {
            assert!(table.lines().any(|l| l.starts_with(&format!("| {} |", case.name))), "no line of {}", case.name);
            assert!(EVIDENCE.iter().any(|e| e.case == case.name), "no evidence of {}", case.name);
        }
    }
}
