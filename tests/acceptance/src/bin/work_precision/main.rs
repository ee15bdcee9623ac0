//! What a frame costs one way and another, and what it is off by: explicit steps, explicit steps with scaled
//! inertia, and implicit ones, of a strip, a ball and a blade that are pressed into clay at four speeds, and
//! of clay that no tool drives.
//!
//! `cargo run --release --no-default-features --bin work_precision -- --out DIR [--quick] [--only SUBSTRING]
//! [--docs docs [--redraw]]`
//!
//! Writes work_precision.csv and two pictures, each as SVG and PNG, to DIR, and prints what the planner's own
//! settings and what the same error cost. Times are of one core and of this process alone, so that other work
//! on the machine changes them little.
//!
//! Exit code 1: a result could not be written. 2: bad arguments, or a place that takes no result: nothing was
//! run.

mod equal;
mod page;
mod picture;
mod sweep;
mod table;

use bevy_clay::scene::export::whole::check_writable;
use clap::Parser;
use clay_acceptance::lab::Size;
use clay_acceptance::report::Bound;
use clay_acceptance::{data, plot, say};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;
use sweep::Job;
use table::Table;

/// Measures error against cost, one way of integrating and another, and draws it.
#[derive(Parser)]
struct Args {
    /// The folder for work_precision.csv and the pictures.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Tools half as wide: about eight minutes of a core.
    #[arg(long, conflicts_with = "smoke")]
    quick: bool,
    /// One speed, and few runs: whether the command works.
    #[arg(long)]
    smoke: bool,
    /// Writes runs, pictures and tables to data/work_precision.json, images/ and between the marks of
    /// EVIDENCE.md in DOCS.
    #[arg(long, value_name = "DOCS")]
    docs: Option<PathBuf>,
    /// Measures nothing, and draws what DOCS has on record.
    #[arg(long, requires = "docs")]
    redraw: bool,
    /// Runs only tools, or what clay does without one, whose name contains SUBSTRING.
    #[arg(long, value_name = "SUBSTRING")]
    only: Option<String>,
}

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(message) => {
            say::error(&message);
            ExitCode::from(2)
        }
    }
}

/// Runs what was asked for; true if all results were written. An error is one of what was asked for: nothing
/// was run.
fn run(args: &Args) -> Result<bool, String> {
    let size = match (args.smoke, args.quick) {
        (true, _) => Size::Test,
        (_, true) => Size::Quick,
        _ => Size::Full,
    };
    let is_chosen = |job: &Job| args.only.as_ref().is_none_or(|part| job.tool.contains(part));
    let jobs: Vec<Job> = sweep::jobs(size).into_iter().filter(is_chosen).collect();
    if jobs.is_empty() {
        return Err(format!("no tool has {:?} in its name", args.only.as_deref().unwrap_or_default()));
    }
    check(args)?;
    let began = Instant::now();
    let table = match &args.docs {
        Some(docs) if args.redraw => Table::read(docs).map_err(|e| format!("--redraw: {e}"))?,
        _ => {
            let mut table = Table::new(size);
            for job in &jobs {
                table.points.extend(job.measure(&mut |point| say::line(&point.line())));
            }
            table
        }
    };
    let is_written = write(args, &table);
    say::line(&format!("\n{}", page::text(&table)));
    for row in equal::rows(&table).iter().filter(|row| row.bound != Bound::None) {
        let verdict = if row.ok { "reached" } else { "missed" };
        say::line(&format!("{}: {:.2} (limit >= {}): {verdict}", row.case, row.value, row.limit));
    }
    say::line(&format!("\n{} runs in {:.0} s:", table.points.len(), began.elapsed().as_secs_f64()));
    for file in files(args) {
        say::line(&file.display().to_string());
    }
    Ok(is_written & say::was_heard())
}

/// The table and the pictures.
fn files(args: &Args) -> Vec<PathBuf> {
    let pictures = picture::NAMES.into_iter().flat_map(|name| plot::files(&args.out.join(name)));
    std::iter::once(args.out.join("work_precision.csv")).chain(pictures).collect()
}

/// Makes the folder and finds out whether every result could be written.
fn check(args: &Args) -> Result<(), String> {
    std::fs::create_dir_all(&args.out).map_err(|e| format!("--out {}: {e}", args.out.display()))?;
    files(args).iter().try_for_each(|file| check_writable(file)).map_err(|e| format!("--out {e}"))?;
    let Some(docs) = &args.docs else { return Ok(()) };
    page::check(docs).map_err(|e| format!("--docs {e}"))
}

/// Writes each result for itself; says on standard error what could not be written, and whether nothing was
/// amiss.
fn write(args: &Args, table: &Table) -> bool {
    let mut contents = vec![table.csv().into_bytes()];
    let mut faults = vec![];
    match picture::draw(table) {
        Ok(drawn) => {
            if let Some(docs) = &args.docs {
                match page::documents(docs, table, drawn.clone().map(|[_, png]| png)) {
                    Ok(files) => faults.extend(data::write_each("--docs", &files)),
                    Err(error) => faults.push(format!("--docs {error}")),
                }
            }
            contents.extend(drawn.into_iter().flatten());
        }
        Err(error) => faults.push(error.to_string()),
    }
    let files: Vec<(PathBuf, Vec<u8>)> = files(args).into_iter().zip(contents).collect();
    faults.extend(data::write_each("--out", &files));
    faults.iter().for_each(|fault| say::error(fault));
    faults.is_empty()
}
