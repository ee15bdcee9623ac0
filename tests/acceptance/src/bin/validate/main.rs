//! Acceptance cases of the solver and the surface against closed-form answers, computed beside each scenario.
//!
//! `cargo validate SUITE [--quick] [--engine gpu] [--json FILE] [--docs docs] [--dump DIR] [--only SUBSTRING]`
//!
//! Exit code 0: every row is within its limit or a known miss (docs/known_misses.ron). 1: a row is not, or a known miss got a tenth
//! worse or passes now. 2: bad arguments.
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a command-line tool prints its table and errors")]

mod document;
mod dump;
mod evidence;

use bevy_clay::sim::prelude::*;
use clap::{Parser, ValueEnum};
use clay_acceptance::cases::{CASES, Case, Suite};
use clay_acceptance::lab::{self, Size};
use clay_acceptance::report::{Bound, KnownMiss, Row, Verdict, judge, parse_known};
use clay_acceptance::{machine, section};
use serde::Serialize;
use std::io::Write;
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
    /// Puts the rows into the table between the marks of EVIDENCE.md in DOCS; other cases, and those without a row, keep their lines.
    #[arg(long, value_name = "DOCS")]
    docs: Option<PathBuf>,
    /// The engine that runs the cases.
    #[arg(long, default_value = "native")]
    engine: Kind,
    /// Also writes data for peers (files, particles, fields, our times on them) to DIR; see benches/peers.
    #[arg(long, value_name = "DIR")]
    dump: Option<PathBuf>,
    /// Runs only cases whose name contains SUBSTRING.
    #[arg(long, value_name = "SUBSTRING")]
    only: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    /// On the processor.
    Native,
    /// Compute passes on the default graphics adapter.
    Gpu,
}

impl Kind {
    /// Its name in the table.
    fn name(self) -> &'static str {
        match self {
            Self::Native => "native",
            Self::Gpu => "gpu",
        }
    }
}

/// What the JSON file holds.
#[derive(Serialize)]
struct Output<'a> {
    suite: Suite,
    quick: bool,
    engine: Kind,
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
        (args.suite == Suite::All || args.suite == c.suite) && args.only.as_ref().is_none_or(|part| c.name.contains(part))
    };
    let cases: Vec<&Case> = CASES.iter().filter(is_chosen).collect();
    if cases.is_empty() {
        return Err(format!("no case of the suite has {:?} in its name", args.only.as_deref().unwrap_or_default()));
    }
    prepare(args)?;
    println!("{}", lab::engine(0).describe());
    let size = if args.quick { Size::Quick } else { Size::Full };
    let mut found = vec![];
    let mut is_passed = true;
    println!("{:64} {:>12}    {:>10} unit", "case", "value", "limit");
    for case in cases {
        if case.is_native_only && args.engine == Kind::Gpu {
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
        in_page(docs, str::to_owned)?;
    }
    if let Some(file) = &args.json {
        let folder = folder_of(file);
        if !folder.is_dir() {
            return Err(format!("--json {}: {} is not a folder", file.display(), folder.display()));
        }
    }
    if args.engine == Kind::Gpu {
        let engine = GpuDevice::headless().and_then(GpuEngine::new).map_err(|e| format!("--engine gpu: {e}"))?;
        lab::GPU.get_or_init(|| std::sync::Mutex::new(engine));
    }
    Ok(())
}

/// Writes the rows of each case to where they were asked for.
fn write(args: &Args, found: &[(&str, Vec<Row>)], known: &[KnownMiss]) -> Result<(), String> {
    if let Some(docs) = &args.docs {
        let mark = format!("{}, {}, {}", if args.quick { "quick" } else { "full" }, args.engine.name(), machine::today());
        let lines: Vec<document::Lines> = CASES
            .iter()
            .map(|case| {
                let rows = found.iter().filter(|f| f.0 == case.name).flat_map(|f| &f.1);
                (case.name, rows.map(|row| document::line(case.name, row, known, &mark)).collect())
            })
            .collect();
        in_page(docs, |old| document::section(old, &lines, &origin()))?;
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
        write_json(file, &output).map_err(|e| format!("--json {}: {e}", file.display()))?;
    }
    Ok(())
}

/// Puts `section(old)` in the place of the table in EVIDENCE.md of `docs`.
fn in_page(docs: &Path, section: impl FnOnce(&str) -> String) -> Result<(), String> {
    let page = docs.join("EVIDENCE.md");
    section::write(&page, document::MARKS, section).map_err(|e| format!("--docs: {}: {e}", page.display()))
}

/// The command line, when and on what it ran.
fn origin() -> String {
    let quoted = |a: String| if a.contains(' ') { format!("\"{a}\"") } else { a };
    let arguments: Vec<String> = std::env::args().skip(1).map(quoted).collect();
    let commit = machine::commit().map_or_else(String::new, |c| format!("; commit {c}"));
    let (command, engine) = (arguments.join(" "), lab::engine(0).describe());
    format!("`cargo validate {command}`; {}; {}; {engine}{commit}.", machine::today(), machine::processor())
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

/// Writes the whole file or none: beside it first, then renamed.
fn write_json(file: &Path, output: &Output<'_>) -> std::io::Result<()> {
    let mut beside = tempfile::NamedTempFile::new_in(folder_of(file))?;
    serde_json::to_writer_pretty(&mut beside, output)?;
    beside.write_all(b"\n")?;
    beside.persist(file)?;
    Ok(())
}
