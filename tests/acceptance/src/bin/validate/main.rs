//! Acceptance cases of the solver and the surface against closed-form answers, computed beside each scenario.
//!
//! `cargo validate SUITE [--quick] [--engine gpu] [--json FILE] [--docs docs] [--dump DIR] [--only
//! SUBSTRING]`
//!
//! Exit code 0: every row is within its limit or a known miss (docs/known_misses.ron). 1: a row is not, or a
//! known miss got a tenth worse or passes now. 2: bad arguments.
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a command-line tool prints its table and errors")]

mod cut_methods;
mod document;
mod dump;
mod evidence;

use clap::Parser;
use clay_acceptance::cases::{CASES, Case, Suite};
use clay_acceptance::data::{self, Outcome, Record, Run};
use clay_acceptance::lab::{self, EngineKind, Size};
use clay_acceptance::report::{Bound, KnownMiss, Row, Verdict, judge, parse_known};
use clay_acceptance::{machine, section};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Runs acceptance cases and compares them with closed-form answers.
#[derive(Parser)]
struct Args {
    /// The cases to run.
    suite: Suite,
    /// Smaller cases: under 3 minutes on 2 cores.
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

/// What the JSON file holds.
#[derive(Serialize)]
struct Output<'a> {
    suite: Suite,
    quick: bool,
    engine: EngineKind,
    adapter: String,
    driver: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    commit: Option<String>,
    rows: &'a [&'a Row],
}

fn main() -> ExitCode {
    let args = Args::parse();
    match run(&args) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::from(2)
        }
    }
}

/// Runs what was asked for; true if nothing failed.
fn run(args: &Args) -> Result<bool, String> {
    let known =
        parse_known(include_str!("../../../../../docs/known_misses.ron")).map_err(|e| format!("docs/known_misses.ron: {e}"))?;
    let is_chosen = |c: &&Case| {
        (args.suite == c.suite || (args.suite == Suite::All && c.suite != Suite::Speed))
            && args.only.as_ref().is_none_or(|part| c.name.contains(part))
    };
    let cases: Vec<&Case> = CASES.iter().filter(is_chosen).collect();
    if cases.is_empty() && args.suite != Suite::None {
        return Err(format!("no case of the suite has {:?} in its name", args.only.as_deref().unwrap_or_default()));
    }
    prepare(args)?;
    println!("{}", lab::engine(0).describe());
    let size = args.size();
    let mut found = vec![];
    let mut is_passed = true;
    println!("{:64} {:>12}    {:>10} unit", "case", "value", "limit");
    for case in cases {
        if case.is_native_only && args.engine == EngineKind::Gpu {
            println!("({}: left out, the gpu engine lacks its inputs)", case.name);
            continue;
        }
        let began = Instant::now();
        let rows = std::panic::catch_unwind(|| (case.run)(size))
            .unwrap_or_else(|_| vec![Row::at_most(format!("{}: ran to its end", case.name), f64::NAN, "-", 0.0)]);
        for row in &rows {
            is_passed &= print_row(row, &known);
        }
        println!("{:64} {:10.1} s", format!("({})", case.name), began.elapsed().as_secs_f64());
        found.push((case.name, rows));
    }
    write(args, &found, &known)?;
    if let Some(folder) = &args.dump {
        dump::write(folder, size)?;
    }
    Ok(is_passed)
}

/// Fails now, and not after the run, where results could not be written; opens the graphics device.
fn prepare(args: &Args) -> Result<(), String> {
    if let Some(docs) = &args.docs {
        data::read::<Record>(&data::acceptance(docs)).map_err(|e| format!("--docs {}: {e}", docs.display()))?;
    }
    if let Some(file) = &args.json {
        let folder = folder_of(file);
        if !folder.is_dir() {
            return Err(format!("--json {}: {} is not a folder", file.display(), folder.display()));
        }
    }
    args.engine.prepare()
}

/// Writes the rows of each case to where they were asked for.
fn write(args: &Args, found: &[(&str, Vec<Row>)], known: &[KnownMiss]) -> Result<(), String> {
    if let Some(docs) = &args.docs {
        document(args, docs, found, known).map_err(|e| format!("--docs {}: {e}", docs.display()))?;
    }
    if let Some(file) = &args.json {
        let output = Output {
            suite: args.suite,
            quick: args.quick,
            engine: args.engine,
            adapter: machine::processor(),
            driver: lab::engine(0).describe(),
            commit: machine::commit(),
            rows: &found.iter().flat_map(|f| &f.1).collect::<Vec<_>>(),
        };
        let text = serde_json::to_string_pretty(&output).map_err(|e| e.to_string())? + "\n";
        data::write(file, &text).map_err(|e| format!("--json {}: {e}", file.display()))?;
    }
    Ok(())
}

/// Puts the rows on record in the folder `docs`, and writes anew what the documents show of the record.
fn document(args: &Args, docs: &Path, found: &[(&str, Vec<Row>)], known: &[KnownMiss]) -> Result<(), String> {
    let run = Run {
        size: args.size(),
        engine: Some(args.engine),
        adapter: Some(args.engine.adapter()),
        date: machine::today(),
        commit: machine::commit(),
    };
    let record = |group: &str, row: &Row| Record { group: group.to_owned(), row: row.clone(), run: run.clone() };
    let new = found.iter().flat_map(|(case, rows)| rows.iter().map(|row| record(case, row))).collect();
    let file = data::acceptance(docs);
    let records = data::merged(data::read(&file)?, new, &CASES.iter().map(|case| case.name).collect::<Vec<_>>());
    data::write(&file, &data::text(&records)?).map_err(|e| format!("{}: {e}", file.display()))?;
    let picture = docs.join("images").join(cut_methods::NAME).with_extension("png");
    std::fs::write(&picture, cut_methods::draw(&records)?).map_err(|e| format!("{}: {e}", picture.display()))?;
    let page = docs.join("EVIDENCE.md");
    let fault = |e: String| format!("{}: {e}", page.display());
    section::write(&page, document::MARKS, &document::summary(&records, known)).map_err(|e| fault(e.to_string()))?;
    let results: Vec<Outcome> = data::read(&data::outcomes(docs))?;
    let text = std::fs::read_to_string(&page).map_err(|e| fault(e.to_string()))?;
    data::write(&page, &document::with_tables(text, &results).map_err(fault)?).map_err(|e| fault(e.to_string()))
}

/// Prints a row with its verdict; false if the row fails the run.
fn print_row(row: &Row, known: &[KnownMiss]) -> bool {
    let verdict = judge(row, known);
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
    println!("{:64} {:>12.4e} {limit} {:12} {text}", row.case, row.value, row.unit);
    !matches!(verdict, Verdict::Fail(_))
}

/// The folder that `file` stands in.
fn folder_of(file: &Path) -> &Path {
    file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or_else(|| Path::new("."))
}
