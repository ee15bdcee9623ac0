//! Runs a scene without a window: `cargo run --no-default-features --example headless -- SCENE.ron --out DIR [--frames N]`.
//!
//! Writes into DIR: `summary.json` (the run at a glance), `metrics.csv` (a line per frame), the surface and the particles of the last frame; with
//! the default features also pictures, `frame_NNNN.png`, as many as `--pictures N` says. Ends with checks of its own. Exit code 2: bad input, nothing written; 1: a check failed; 0: all is well.
#![expect(clippy::print_stdout, clippy::print_stderr, reason = "a command-line program")]

#[cfg(feature = "bevy")]
#[path = "headless/pictures.rs"]
mod pictures;
#[cfg(not(feature = "bevy"))]
#[path = "headless/no_pictures.rs"]
mod pictures;

use bevy_clay::prelude::*;
use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

#[derive(Parser)]
#[command(about = "Runs a clay scene without a window")]
struct Args {
    /// Scene file (RON).
    scene: PathBuf,
    /// Folder for the results, made if missing.
    #[arg(long, default_value = "out")]
    out: PathBuf,
    /// Runs only the first N frames.
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,
    /// Pictures of the run, evenly spread, the last of its end: 4 if not said. They need the default features and a graphics adapter.
    #[arg(long)]
    pictures: Option<u64>,
}

/// Pictures where none were asked for.
const PICTURES: u64 = 4;

fn main() -> ExitCode {
    let args = Args::parse();
    let began = Instant::now();
    let prepared = Scene::load(&args.scene).map_err(|e| e.to_string()).and_then(|scene| {
        let base = args.scene.parent().unwrap_or(Path::new("."));
        let built = scene.build(base).map_err(|e| e.to_string())?;
        probe(&args.out)?;
        Ok(built)
    });
    let built = match prepared {
        Ok(built) => built,
        Err(error) => {
            eprintln!("error: {error}");
            return ExitCode::from(2);
        }
    };
    built.warnings.iter().for_each(|w| eprintln!("warning: {w}"));
    match run(&built, &args, began) {
        Ok(faults) if faults.is_empty() => ExitCode::SUCCESS,
        Ok(faults) => {
            faults.iter().for_each(|f| eprintln!("check failed: {f}"));
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Makes the folder and finds out, before hours are spent, whether files can be written there.
fn probe(out: &Path) -> Result<(), String> {
    let refused = |e: std::io::Error| format!("{}: the output folder cannot be written: {e}", out.display());
    fs::create_dir_all(out).map_err(refused)?;
    let file = out.join(format!(".probe.{}.tmp", std::process::id()));
    fs::write(&file, b"").and_then(|()| fs::remove_file(&file)).map_err(refused)
}

/// What the frames had in common.
#[derive(Default)]
struct Run {
    metrics: String,
    health: Health,
    steps: u64,
    redone: u64,
    balance_max: f64,
    mass_error_max: f64,
    ratio: (f64, f64),
    force_max: Vec<f64>,
    substep_seconds: f64,
}

impl Run {
    fn add(&mut self, report: &FrameReport, cell_width: f64) {
        let force = |t: &ToolReport| t.force.length();
        let strongest = report.tools.iter().map(force).fold(0.0, f64::max);
        let pushed: u64 = report.tools.iter().map(|t| t.pushed_back).sum();
        let mass_error = (report.grid_mass / report.particle_mass - 1.0).abs();
        let ms = |s: f64| s * 1e3;
        let t = &report.timings;
        // Writing to a String cannot fail.
        let _ = writeln!(
            self.metrics,
            "{},{:.6},{:.6e},{:.6e},{:.5},{:.5},{:.6e},{pushed},{},{:.4e},{:.4},{:.5},{:.3e},{:.3e},{:.3},{:.3},{:.3},{:.3},{:.3},{:.3e},{:.3e},\"{}\"",
            report.plan_id,
            report.time,
            report.energies.kinetic,
            report.energies.elastic,
            report.volume_ratio.0,
            report.volume_ratio.1,
            strongest,
            report.steps,
            report.dt,
            report.density_scale,
            report.speed(cell_width),
            report.kinetic_ratio(),
            report.real_time_factor(),
            ms(t.total),
            ms(t.rebin),
            ms(t.grid),
            ms(t.particles),
            ms(t.report),
            report.balance_error(),
            mass_error,
            report.health
        );
        self.health.insert(report.health);
        self.steps += u64::from(report.steps);
        self.redone += u64::from(report.redone);
        self.balance_max = self.balance_max.max(report.balance_error());
        self.mass_error_max = self.mass_error_max.max(mass_error);
        self.ratio = (self.ratio.0.min(report.volume_ratio.0), self.ratio.1.max(report.volume_ratio.1));
        for tool in &report.tools {
            let index = tool.id as usize - 1;
            if self.force_max.len() <= index {
                self.force_max.resize(index + 1, 0.0);
            }
            self.force_max[index] = self.force_max[index].max(force(tool));
        }
        self.substep_seconds += t.total;
    }
}

const HEADER: &str = "frame,time_s,kinetic_J,elastic_J,J_min,J_max,tool_force_max_N,pushed_back,steps,dt_s,density_scale,speed_max_m_s,kinetic_ratio,real_time_factor,\
    total_ms,rebin_ms,grid_ms,particles_ms,report_ms,balance_error,mass_error,health";

fn run(built: &BuiltScene, args: &Args, began: Instant) -> Result<Vec<String>, String> {
    let frames = built.frame_count().min(args.frames.unwrap_or(u64::MAX));
    let mut engine = NativeEngine::new();
    engine.load(&built.snapshot).map_err(|e| e.to_string())?;
    println!(
        "{}: {} particles, {:.2} mm cells, {frames} frames on the {}",
        built.scene.file,
        built.snapshot.particles.len(),
        built.snapshot.domain.cell_width * 1e3,
        engine.describe()
    );
    let style =
        ProgressStyle::with_template("{bar:40} {pos}/{len} frames, {eta} left, {msg}").unwrap_or(ProgressStyle::default_bar());
    let bar = ProgressBar::new(frames).with_style(style);
    let mut run = Run { metrics: format!("{HEADER}\n"), ratio: (f64::INFINITY, 0.0), ..Run::default() };
    let cell_width = built.snapshot.domain.cell_width;
    let mut last = FrameReport::default();
    let pictures = args.pictures.unwrap_or(PICTURES).min(frames);
    let mut moments = vec![];
    let mut planner = built.planner();
    for frame in 0..frames {
        let Decision::Run(plan) = built.next(frame, &mut planner) else { break };
        engine.submit(plan.clone()).map_err(|e| e.to_string())?;
        planner.sent();
        last = engine.wait().map_err(|e| e.to_string())?;
        planner.note(&mut last);
        run.add(&last, cell_width);
        if last.health.contains(Health::GIVEN_UP) {
            bar.abandon_with_message(format!("stopped: {}", last.health));
            break;
        }
        // The frames whose ends divide the run into equal parts.
        if (frame + 1) * pictures / frames > frame * pictures / frames
            && let Some(source) = engine.surface().filter(|_| pictures::ARE_DRAWN)
        {
            let pose = |path: &ToolPath| (path.tool.shape, path.pose_at(plan.duration()));
            let tools = plan.tools.iter().map(pose).collect();
            moments.push(pictures::Moment {
                frame: frame + 1,
                surface: extract_with_grains(&source, &SurfaceSettings::default()).drawn(),
                tools,
            });
        }
        bar.set_message(format!("{} steps, J {:.2}..{:.2}", last.steps, last.volume_ratio.0, last.volume_ratio.1));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let mut faults = finish(built, args, &mut engine, &run, &last, began)?;
    // Pictures that were asked for and could not be drawn are a fault; others are missed in a line.
    match pictures::draw(moments, &args.out) {
        Ok(files) => files.iter().for_each(|f| println!("picture: {}", f.display())),
        Err(reason) if args.pictures.is_some_and(|n| n > 0) => faults.push(format!("no pictures: {reason}")),
        Err(reason) if pictures > 0 => println!("no pictures: {reason}"),
        Err(_) => {}
    }
    Ok(faults)
}

/// Writes the results and checks them.
fn finish(
    built: &BuiltScene,
    args: &Args,
    engine: &mut NativeEngine,
    run: &Run,
    last: &FrameReport,
    began: Instant,
) -> Result<Vec<String>, String> {
    let outputs = &built.scene.outputs;
    let mut faults = vec![];
    let mut check = |holds: bool, fault: String| {
        if !holds {
            faults.push(fault);
        }
    };
    check(!run.health.contains(Health::GIVEN_UP), format!("the run stopped at {:.3} s: {}", last.time, run.health));
    check(run.ratio.0.is_finite() && run.ratio.1.is_finite(), "a volume ratio is not finite".into());
    check(run.mass_error_max <= 1e-7, format!("grid mass is off by {:.1e}", run.mass_error_max));
    check(run.balance_max <= 1e-5, format!("momentum is off by {:.1e} of what moved", run.balance_max));
    let snapshot = engine.save().map_err(|e| e.to_string())?;
    let mut surface = serde_json::Value::Null;
    if let (Some(name), Some(source)) = (&outputs.surface, engine.surface()) {
        // Grains are no solid: they are left out of what is written.
        let Extraction { mesh, grains } = extract_with_grains(&source, &SurfaceSettings::new(outputs.tier));
        let written = write_bodies(&args.out.join(name), &mesh, &outputs.export).map_err(|e| e.to_string())?;
        let (mesh, _) = print_ready(&mesh);
        let defects = MeshCheck::of(&mesh);
        let volumes: Vec<f64> = written.bodies.iter().map(|b| b.volume * 1e6).collect();
        let triangles: usize = written.bodies.iter().map(|b| b.triangles).sum();
        let error = mesh.volume() / last.volume - 1.0;
        check(defects.is_closed_manifold(), format!("the surface is not a closed manifold: {defects:?}"));
        let off = format!("the surface encloses {:+.1} % more than the particles' volume", error * 100.0);
        // Clay of fewer than 1000 cells is all skin: there the figure says how coarse the scene is, not whether it ran well.
        if snapshot.particles.len() >= 8000 {
            check(error.abs() <= 0.03, off);
        } else if error.abs() > 0.03 {
            eprintln!("warning: {off}");
        }
        let sizes = volumes.iter().take(8).map(|v| format!("{v:.3}")).collect::<Vec<_>>().join(", ");
        println!("surface: {triangles} triangles, {} bodies of {sizes} cm^3", volumes.len());
        if !grains.is_empty() {
            println!("surface: without the {} particles that stand outside of it", grains.len());
        }
        if written.dropped_bodies > 0 {
            let (count, volume) = (written.dropped_bodies, written.dropped_volume * 1e6);
            eprintln!("warning: {count} bodies of {volume:.4} cm^3 together were left out, as `volume_min` asks for");
        }
        for reason in written.bodies.iter().filter_map(|b| b.not_simplified.as_ref()) {
            eprintln!("warning: a body was written without simplification: {reason}");
        }
        let file_name = |path: &PathBuf| path.file_name().map(|f| f.to_string_lossy().into_owned());
        let files: Vec<_> = written.files.iter().filter_map(file_name).collect();
        surface = serde_json::json!({"files": files, "triangles": triangles, "bodies_cm3": volumes, "volume_error": error, "grains": grains.len(),
            "closed_manifold": defects.is_closed_manifold(), "pillows_dropped": written.repairs.pillows, "crumbs_dropped": written.repairs.crumbs,
            "bodies_dropped": written.dropped_bodies, "dropped_cm3": written.dropped_volume * 1e6});
    }
    if outputs.particles {
        write_particles(&args.out.join("particles.ply"), &snapshot).map_err(|e| e.to_string())?;
    }
    if outputs.metrics {
        write_text(&args.out.join("metrics.csv"), &run.metrics).map_err(|e| e.to_string())?;
    }
    let forces: Vec<_> = run
        .force_max
        .iter()
        .zip(&built.scene.tools)
        .map(|(f, t)| serde_json::json!({"tool": t.name, "force_max_N": f}))
        .collect();
    let summary = serde_json::json!({
        "scene": built.scene.file, "engine": engine.describe(), "particles": snapshot.particles.len(),
        "cell_width_m": snapshot.domain.cell_width, "simulated_s": snapshot.time, "substeps": run.steps, "frames_redone": run.redone,
        "wall_s": began.elapsed().as_secs_f64(), "engine_s": run.substep_seconds, "health": run.health.to_string(),
        "J": [run.ratio.0, run.ratio.1], "balance_error_max": run.balance_max, "mass_error_max": run.mass_error_max,
        "rest_volume_m3": snapshot.rest_volume(), "volume_m3": last.volume, "tools": forces, "surface": surface, "faults": faults,
        "warnings": built.warnings,
    });
    write_text(&args.out.join("summary.json"), &format!("{summary:#}\n")).map_err(|e| e.to_string())?;
    println!(
        "{:.2} s of clay in {:.1} s, {} substeps, J {:.3} .. {:.3}, momentum kept to {:.0e}; results in {}",
        snapshot.time,
        began.elapsed().as_secs_f64(),
        run.steps,
        run.ratio.0,
        run.ratio.1,
        run.balance_max,
        args.out.display()
    );
    Ok(faults)
}
