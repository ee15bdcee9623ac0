//! What accuracy costs: the error of cases with an exact answer against the time that a simulated second
//! takes, over every knob.
//!
//! `cargo run --release --no-default-features --bin chart -- --out DIR [--quick] [--engine gpu] [--only
//! SUBSTRING] [--docs docs [--redraw]]`
//!
//! Writes chart.csv, chart.svg and chart.png to DIR and prints what buys accuracy cheapest, from the figures.
//! Exit code 1: a result could not be written. 2: bad arguments, or a place that takes no result: nothing was
//! run.

mod knobs;
mod page;
mod picture;
mod scenes;
mod table;
mod verdict;

use bevy_clay::scene::export::whole::check_writable;
use clap::Parser;
use clay_acceptance::lab::{self, EngineKind, Size};
use clay_acceptance::{data, plot, say};
use knobs::Effort;
use scenes::{SCENES, Scene};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;
use table::{Row, Table};

/// Measures error against cost over every knob, and draws it.
#[derive(Parser)]
struct Args {
    /// The folder for chart.csv, chart.svg and chart.png.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Fewer and coarser grids: about 3 minutes on 2 free cores.
    #[arg(long, conflicts_with = "smoke")]
    quick: bool,
    /// Two points a scene: whether the command works.
    #[arg(long)]
    smoke: bool,
    /// Writes rows, picture and sentences to data/chart.json, images/chart.png and between the marks of
    /// EVIDENCE.md in DOCS.
    #[arg(long, value_name = "DOCS")]
    docs: Option<PathBuf>,
    /// Measures nothing, and draws what DOCS has on record.
    #[arg(long, requires = "docs")]
    redraw: bool,
    /// The engine that runs the scenes.
    #[arg(long, default_value = "native")]
    engine: EngineKind,
    /// Runs only scenes whose name contains SUBSTRING.
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
    let is_chosen = |s: &&Scene| args.only.as_ref().is_none_or(|part| s.name.contains(part));
    let scenes: Vec<&Scene> = SCENES.iter().filter(is_chosen).collect();
    if scenes.is_empty() {
        return Err(format!("no scene has {:?} in its name", args.only.as_deref().unwrap_or_default()));
    }
    check(args)?;
    args.engine.prepare()?;
    let effort = match (args.smoke, args.quick) {
        (true, _) => Effort::Smoke,
        (_, true) => Effort::Quick,
        _ => Effort::Full,
    };
    let began = Instant::now();
    say::line(&lab::engine(0).describe());
    let table = match &args.docs {
        Some(docs) if args.redraw => Table::read(docs).map_err(|e| format!("--redraw: {e}"))?,
        _ => {
            let mut table = Table::new(args.engine, if effort == Effort::Full { Size::Full } else { Size::Quick });
            for scene in scenes {
                table.rows.extend(measure(scene, effort));
            }
            table.mark_fronts();
            table
        }
    };
    let is_written = write(args, &table);
    say::line(&format!("\n{}", page::text(&table)));
    say::line(&format!("{} rows in {:.0} s:", table.rows.len(), began.elapsed().as_secs_f64()));
    for file in files(args) {
        say::line(&file.display().to_string());
    }
    Ok(is_written & say::was_heard())
}

/// The table and the picture.
fn files(args: &Args) -> [PathBuf; 3] {
    let stem = args.out.join("chart");
    let [svg, png] = plot::files(&stem);
    [stem.with_extension("csv"), svg, png]
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
    let [csv, svg, png] = files(args);
    let mut faults = data::write_each("--out", &[(csv, table.csv().into_bytes())]);
    match plot::draw(&picture::Chart(table), picture::size(table)) {
        Ok([drawn_svg, drawn_png]) => {
            if let Some(docs) = &args.docs {
                match page::documents(docs, table, drawn_png.clone()) {
                    Ok(files) => faults.extend(data::write_each("--docs", &files)),
                    Err(error) => faults.push(format!("--docs {error}")),
                }
            }
            faults.extend(data::write_each("--out", &[(svg, drawn_svg), (png, drawn_png)]));
        }
        Err(error) => faults.push(error.to_string()),
    }
    faults.iter().for_each(|fault| say::error(fault));
    faults.is_empty()
}

/// Runs every point of a scene that the engine takes.
fn measure(scene: &Scene, effort: Effort) -> Vec<Row> {
    let mut rows = vec![];
    for point in (scene.points)(effort) {
        if let Some(reason) = scenes::refusal(&point.setting) {
            say::line(&format!("{}: {} left out: {reason}", scene.name, point.label()));
            continue;
        }
        let began = Instant::now();
        let run = (scene.run)(&point.setting);
        let found = scene.panels.iter().zip(&run.errors).map(|(panel, &error)| Row::new(scene, panel, point, error, &run));
        for row in found {
            say::line(&format!("{}  {:6.1} s", row.line(), began.elapsed().as_secs_f64()));
            rows.push(row);
        }
    }
    rows
}
