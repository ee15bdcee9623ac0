//! What accuracy costs: the error of cases with an exact answer against the time that a simulated second
//! takes, over every knob.
//!
//! `cargo run --release --no-default-features --bin chart -- --out DIR [--quick] [--engine gpu] [--only
//! SUBSTRING] [--docs docs [--redraw]]`
//!
//! Writes chart.csv, chart.svg and chart.png to DIR and prints what buys accuracy cheapest, from the figures.
//! Exit code 2: bad arguments.
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a command-line tool prints its table and errors")]

mod knobs;
mod page;
mod picture;
mod scenes;
mod table;
mod verdict;

use clap::Parser;
use clay_acceptance::lab::{self, EngineKind, Size};
use clay_acceptance::plot;
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
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::from(2)
        }
    }
}

fn run(args: &Args) -> Result<(), String> {
    let is_chosen = |s: &&Scene| args.only.as_ref().is_none_or(|part| s.name.contains(part));
    let scenes: Vec<&Scene> = SCENES.iter().filter(is_chosen).collect();
    if scenes.is_empty() {
        return Err(format!("no scene has {:?} in its name", args.only.as_deref().unwrap_or_default()));
    }
    std::fs::create_dir_all(&args.out).map_err(|e| format!("--out {}: {e}", args.out.display()))?;
    args.engine.prepare()?;
    let effort = match (args.smoke, args.quick) {
        (true, _) => Effort::Smoke,
        (_, true) => Effort::Quick,
        _ => Effort::Full,
    };
    let began = Instant::now();
    println!("{}", lab::engine(0).describe());
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
    let stem = args.out.join("chart");
    let csv = stem.with_extension("csv");
    table.write_csv(&csv).map_err(|e| format!("{}: {e}", csv.display()))?;
    let pictures = plot::write(&picture::Chart(&table), &stem, picture::size(&table)).map_err(|e| e.to_string())?;
    if let Some(docs) = &args.docs {
        page::write(docs, &table, &pictures[1]).map_err(|e| format!("--docs {}: {e}", docs.display()))?;
    }
    println!("\n{}", page::text(&table));
    println!("{} rows in {:.0} s:", table.rows.len(), began.elapsed().as_secs_f64());
    for file in [&csv, &pictures[0], &pictures[1]] {
        println!("{}", file.display());
    }
    Ok(())
}

/// Runs every point of a scene that the engine takes.
fn measure(scene: &Scene, effort: Effort) -> Vec<Row> {
    let mut rows = vec![];
    for point in (scene.points)(effort) {
        if let Some(reason) = scenes::refusal(&point.setting) {
            println!("{}: {} left out: {reason}", scene.name, point.label());
            continue;
        }
        let began = Instant::now();
        let run = (scene.run)(&point.setting);
        let found = scene.panels.iter().zip(&run.errors).map(|(panel, &error)| Row::new(scene, panel, point, error, &run));
        for row in found {
            println!("{}  {:6.1} s", row.line(), began.elapsed().as_secs_f64());
            rows.push(row);
        }
    }
    rows
}
