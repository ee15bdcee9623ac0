//! Acceptance cases of the solver and the surface against closed-form answers, computed beside each scenario.
//!
//! `cargo validate SUITE [--quick] [--engine gpu] [--json FILE] [--docs docs] [--dump DIR] [--only
//! SUBSTRING]`
//!
//! Exit code 0: every row is within its limit or a known miss (docs/known_misses.ron). 1: a row is not, or a
//! known miss got a tenth worse, passes now or is met by no row, or a quick run has more rows or fewer than
//! [`CASES`] says, or a result could not be written. 2: bad arguments, or a place that takes no result:
//! nothing was run.

mod cut_methods;
mod document;
mod dump;
mod evidence;
mod outputs;

use clap::Parser;
use clay_acceptance::cases::{CASES, Case, Suite};
use clay_acceptance::lab::{self, EngineKind, Size};
use clay_acceptance::report::{Bound, KnownMiss, Row, Verdict, judge, parse_known, unmet};
use clay_acceptance::say;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

/// Runs acceptance cases and compares them with closed-form answers.
#[derive(Parser)]
struct Args {
    /// The cases to run.
    suite: Suite,
    /// Smaller cases: all of them take 10 to 20 minutes on 2 cores.
    #[arg(long)]
    quick: bool,
    /// Writes the rows to FILE.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Puts the rows on record in DOCS/data, in place of those of the same cases, size and engine, and writes
    /// the summary in DOCS/EVIDENCE.md anew.
    #[arg(long, value_name = "DOCS")]
    docs: Option<PathBuf>,
    /// The engine that runs the cases.
    #[arg(long, default_value = "native")]
    engine: EngineKind,
    /// Also writes data for peers (files, particles, fields, our times on them) to DIR; see benches/peers.
    #[arg(long, value_name = "DIR")]
    dump: Option<PathBuf>,
    /// Runs only cases whose name contains SUBSTRING.
    #[arg(long, value_name = "SUBSTRING")]
    only: Option<String>,
}

impl Args {
    /// How large the cases are.
    fn size(&self) -> Size {
        if self.quick { Size::Quick } else { Size::Full }
    }
}

fn main() -> ExitCode {
    let args = Args::parse();
    match run(&args) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(message) => {
            say::error(&message);
            ExitCode::from(2)
        }
    }
}

/// Runs what was asked for; true if nothing failed. An error is one of what was asked for: nothing was run.
fn run(args: &Args) -> Result<bool, String> {
    let known = parse_known(include_str!("../../../../../docs/known_misses.ron"))
        .map_err(|e| format!("docs/known_misses.ron: {e}"))?
        .rows;
    let is_chosen = |c: &&Case| {
        (args.suite == c.suite || (args.suite == Suite::All && c.suite != Suite::Speed))
            && args.only.as_ref().is_none_or(|part| c.name.contains(part))
    };
    let cases: Vec<&Case> = CASES.iter().filter(is_chosen).collect();
    if cases.is_empty() && args.suite != Suite::None {
        return Err(format!("no case of the suite has {:?} in its name", args.only.as_deref().unwrap_or_default()));
    }
    outputs::check(args, &known)?;
    args.engine.prepare()?;
    say::line(&lab::engine(0).describe());
    say::line(&format!("{:64} {:>12}    {:>10} unit", "case", "value", "limit"));
    let mut found = vec![];
    let mut is_passed = true;
    for case in cases {
        if case.is_native_only && args.engine == EngineKind::Gpu {
            say::line(&format!("({}: left out, the gpu engine lacks its inputs)", case.name));
            continue;
        }
        let (rows, is_sound) = run_case(case, args, &known);
        is_passed &= is_sound;
        found.push((case.name, rows));
    }
    let is_written = outputs::write(args, &found, &known);
    Ok(is_passed & is_written & say::was_heard())
}

/// Runs a case and prints its rows; false with them if it fails the run.
fn run_case(case: &Case, args: &Args, known: &[KnownMiss]) -> (Vec<Row>, bool) {
    let began = Instant::now();
    let rows = std::panic::catch_unwind(|| (case.run)(args.size()))
        .unwrap_or_else(|_| vec![Row::at_most(format!("{}: ran to its end", case.name), f64::NAN, "-", 0.0)]);
    let mut is_passed = true;
    for row in &rows {
        is_passed &= print_row(row, args.size(), known);
    }
    let gone = unmet(known, case.name, args.size(), &rows);
    let gone = gone.iter().map(|miss| format!("{}: is no row any more: take it off docs/known_misses.ron", miss.case));
    for fault in gone.chain(case.count_fault(args.size(), args.engine, rows.len())) {
        say::line(&format!("FAIL: {fault}"));
        is_passed = false;
    }
    say::line(&format!("{:64} {:10.1} s", format!("({})", case.name), began.elapsed().as_secs_f64()));
    (rows, is_passed)
}

/// Prints a row with its verdict; false if the row fails the run.
fn print_row(row: &Row, size: Size, known: &[KnownMiss]) -> bool {
    let verdict = judge(row, size, known);
    let text = match verdict {
        Verdict::Pass => "ok".to_owned(),
        Verdict::Figure => "measured".to_owned(),
        Verdict::Miss(reason) => format!("MISS (known): {reason}"),
        Verdict::Fail(reason) => format!("FAIL: {reason}"),
    };
    let limit = match row.bound {
        Bound::Max => format!("<= {:>10.3e}", row.limit),
        Bound::Min => format!(">= {:>10.3e}", row.limit),
        Bound::None => format!("{:13}", ""),
    };
    say::line(&format!("{:64} {:>12.4e} {limit} {:12} {text}", row.case, row.value, row.unit));
    !matches!(verdict, Verdict::Fail(_))
}
