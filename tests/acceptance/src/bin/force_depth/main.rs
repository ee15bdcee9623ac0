//! Force over depth of each way to make it: a hand presses down at 5 mm/s, as in the paper's Fig. 8, holds,
//! and leaves, in clay whose own force is known. CSV, SVG and PNG.
//!
//! `cargo run --release --no-default-features --bin force_depth -- --out DIR`
//!
//! Virtual time: every machine draws the same. Exit code 1: a file could not be written. 2: bad arguments,
//! or a place that takes no file: nothing was run.

mod picture;

use bevy_clay::scene::export::whole::check_writable;
use clap::Parser;
use clay_acceptance::cases::haptics::{Curve, curves};
use clay_acceptance::{data, plot, say};
use picture::Curves;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Draws force over depth.
#[derive(Parser)]
struct Args {
    /// Folder of force_depth.csv, .png and .svg; made if it is not there.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

fn main() -> ExitCode {
    match run(&Args::parse().out) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(message) => {
            say::error(&message);
            ExitCode::from(2)
        }
    }
}

/// Runs all modes; true if all files were written. An error is one of the place: nothing was run.
fn run(out: &Path) -> Result<bool, String> {
    std::fs::create_dir_all(out).map_err(|e| format!("--out {}: {e}", out.display()))?;
    let stem = out.join("force_depth");
    let [svg, png] = plot::files(&stem);
    let csv = stem.with_extension("csv");
    [&csv, &svg, &png].into_iter().try_for_each(|file| check_writable(file)).map_err(|e| format!("--out {e}"))?;
    let curves = curves();
    let mut files = vec![(csv, table(&curves).into_bytes())];
    let mut faults = vec![];
    match plot::draw(&Curves(&curves), picture::SIZE) {
        Ok([drawn_svg, drawn_png]) => files.extend([(svg, drawn_svg), (png, drawn_png)]),
        Err(error) => faults.push(error.to_string()),
    }
    faults.extend(data::write_each("--out", &files));
    faults.iter().for_each(|fault| say::error(fault));
    files.iter().for_each(|(file, _)| say::line(&file.display().to_string()));
    Ok(faults.is_empty() & say::was_heard())
}

/// A line a point.
fn table(curves: &[Curve]) -> String {
    let mut text = "mode,time_s,depth_mm,force_n,clay_force_n\n".to_owned();
    for curve in curves {
        for [time, depth, force, clay] in &curve.points {
            // Writing to a string does not fail.
            let _ = writeln!(text, "{},{time:.4},{depth:.4},{force:.5},{clay:.5}", curve.name.replace(',', ""));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mode's line of the table, whose columns are those of the header.
    #[test]
    fn table_has_its_columns() {
        let curve = Curve { name: "clay's force, held", points: vec![[0.1, 2.0, 0.5, 0.25]] };
        let text = table(&[curve]);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[1], "clay's force held,0.1000,2.0000,0.50000,0.25000");
        assert_eq!(lines[0].split(',').count(), lines[1].split(',').count());
    }
}
