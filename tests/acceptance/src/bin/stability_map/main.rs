//! Where a run blows up, over step, stiffness and tool speed, for the law as published and the one by
//! default, the latter by implicit steps too: CSV, PNG and SVG.
//!
//! `cargo run --release --no-default-features --bin stability_map -- --out DIR [--quick]`
//!
//! A block of clay stands on a sticky floor for 0.3 s; then a rod goes down into it to mid-height and stays
//! there to 0.6 s. The step is set past every limiter; implicit ones are as long as the rod takes for its way
//! in one, all the time. A run has blown up when a frame was redone for speed or given up, a particle's
//! stretch left 0.05 .. 20, a number is not finite, or the energy that the tool did not bring grew beyond 1.5
//! times the first. It is flagged when the report of a frame says that implicit steps left forces out of
//! balance, or anything else of the clay's health.
//!
//! Exit code 0: the law by default blows up nowhere up to the default steps. 1: it does, or a file could not
//! be written. 2: bad arguments, or a place that takes no file: nothing was run.

mod picture;

use bevy_clay::scene::export::whole::check_writable;
use bevy_clay::sim::planner::{RESIDUAL_MAX, STEP_FRACTION};
use bevy_clay::sim::prelude::*;
use clap::Parser;
use clay_acceptance::cases::collapse::{Collapse, Touch};
use clay_acceptance::{data, plot, say};
use picture::Map;
use rayon::prelude::*;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Maps where a run blows up, over step, stiffness and tool speed.
#[derive(Parser)]
struct Args {
    /// Folder of stability_map.csv, .png and .svg; made if it is not there.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// A coarse map, in less than a minute.
    #[arg(long)]
    quick: bool,
}

/// Yield stress of the default clay far from the tool [Pa]; near it is a fifth, as in the reference
/// computation of the published law's failure.
const YIELD_STRESS: f64 = 1e4;
/// Growth of the energy that is a blow-up.
const GROWTH_MAX: f64 = 1.5;

/// A law under test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Law {
    /// In the files.
    pub(crate) name: &'static str,
    law: ClayLaw,
    softening: f64,
    poisson_ratio: f64,
    /// Softening length [cells].
    length: f64,
    /// Whether its steps are implicit, with as many passes as the planner gives them by default.
    pub(crate) is_implicit: bool,
}

const BY_DEFAULT: Law =
    Law { name: "by default", law: ClayLaw::Softened, softening: 0.8, poisson_ratio: 0.45, length: 3.0, is_implicit: false };
const LAWS: [Law; 3] = [
    BY_DEFAULT,
    Law { name: "as published", law: ClayLaw::AsPublished, softening: 0.0, poisson_ratio: 0.1, ..BY_DEFAULT },
    Law { name: "by default, implicit", is_implicit: true, ..BY_DEFAULT },
];

impl Law {
    /// The clay with Young's modulus over yield stress `stiffness`.
    fn material(&self, stiffness: f64, cell_width: f64) -> ClayMaterial {
        ClayMaterial {
            density: 1000.0,
            young_modulus: stiffness * YIELD_STRESS,
            poisson_ratio: self.poisson_ratio,
            yield_stress: YIELD_STRESS,
            softening: self.softening,
            softening_length: self.length * cell_width,
            law: self.law,
            ..ClayMaterial::default()
        }
    }
}

/// What a run is at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    /// Index of the law.
    pub(crate) law: usize,
    /// Index of the tool's speed.
    pub(crate) speed: usize,
    /// Index of the stiffness.
    pub(crate) stiffness: usize,
    /// Index of the step.
    pub(crate) step: usize,
}

/// How a run ended, in the order of the tests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    /// Nothing blew up.
    Sound,
    /// Nothing blew up, and a report said that something is amiss.
    Flagged,
    /// A frame was given up, or a number is not finite.
    GivenUp,
    /// A frame was redone with smaller steps: a node went further than half a cell in a substep.
    Speed,
    /// A particle's stretch left 0.05 .. 20.
    Stretch,
    /// Energy from nothing.
    Energy,
}

impl End {
    /// Whether it is one that must not be.
    fn is_blown(self) -> bool {
        !matches!(self, Self::Sound | Self::Flagged)
    }

    /// A word for it, and the letter on the map.
    pub(crate) fn name(self) -> (&'static str, &'static str) {
        match self {
            Self::Sound => ("sound", ""),
            Self::Flagged => ("flagged", "R"),
            Self::GivenUp => ("given up", "G"),
            Self::Speed => ("speed", "V"),
            Self::Stretch => ("stretch", "J"),
            Self::Energy => ("energy", "E"),
        }
    }
}

/// The axes of the map.
pub(crate) struct Axes {
    /// Time step over the isolated particle's limit.
    pub(crate) steps: Vec<f64>,
    /// Travel of the tool in an implicit step [cells].
    pub(crate) travels: Vec<f64>,
    /// Young's modulus over yield stress.
    pub(crate) stiffness: Vec<f64>,
    /// Tool speed over the wave speed.
    pub(crate) speeds: Vec<f64>,
    cells_per_metre: i32,
}

impl Axes {
    fn new(quick: bool) -> Self {
        if quick {
            return Self {
                steps: vec![0.35, 0.7, 1.4, 2.1],
                travels: vec![0.1125, 0.225, 0.45, 0.9],
                stiffness: vec![10.0, 55.0],
                speeds: vec![0.05, 0.25],
                cells_per_metre: 20,
            };
        }
        Self {
            steps: vec![0.35, 0.5, 0.7, 0.85, 1.0, 1.2, 1.4, 1.7, 2.0],
            travels: vec![0.05625, 0.1125, 0.225, 0.45, 0.675, 0.9, 1.35, 1.8, 2.7],
            stiffness: vec![10.0, 30.0, 55.0, 100.0, 300.0],
            speeds: vec![0.01, 0.05, 0.25],
            cells_per_metre: 24,
        }
    }

    /// The steps of a law's runs, and which of them the planner takes at most.
    pub(crate) fn steps_of(&self, law: usize) -> (&[f64], f64) {
        if LAWS[law].is_implicit { (&self.travels, StepAccuracy::default().travel()) } else { (&self.steps, STEP_FRACTION) }
    }

    fn points(&self) -> Vec<Point> {
        let mut points = vec![];
        for law in 0..LAWS.len() {
            for speed in 0..self.speeds.len() {
                for stiffness in 0..self.stiffness.len() {
                    points.extend((0..self.steps_of(law).0.len()).map(|step| Point { law, speed, stiffness, step }));
                }
            }
        }
        points
    }
}

/// One run: how it ended, and the greatest energy over the first.
fn run(axes: &Axes, point: Point) -> (End, f64) {
    let cell_width = 1.0 / f64::from(axes.cells_per_metre);
    let law = &LAWS[point.law];
    let material = law.material(axes.stiffness[point.stiffness], cell_width);
    let speed = axes.speeds[point.speed] * material.wave_speed(material.density);
    let unit = if law.is_implicit { cell_width / speed } else { material.time_step_limit(cell_width, material.density) };
    let dt = axes.steps_of(point.law).0[point.step] * unit;
    let mut block = Collapse::new(material, axes.cells_per_metre, dt, Touch::Rod, 1);
    if law.is_implicit {
        block.lab.plan.integrator = Integrator::Implicit { passes: StepAccuracy::default().passes() };
    }
    // Frames of a hundredth of a second, and shorter while a fast rod goes down.
    let frame_steps = |time: f64| (time / dt).ceil().max(1.0) as u32;
    let way = block.height / 2.0 * cell_width;
    let (mut time, mut gone, mut first, mut growth) = (0.0, 0.0, f64::NAN, 1.0f64);
    let mut end = End::Sound;
    while time < 0.6 {
        let is_moving = time >= 0.3 && gone < way;
        let steps = frame_steps(if is_moving { (0.02f64).min((way - gone) / speed) } else { 0.02 });
        let report = block.frame(steps, if is_moving { speed } else { 0.0 });
        gone += if is_moving { speed * duration(steps, dt) } else { 0.0 };
        time += duration(steps, dt);
        let energy = block.energy(&report, &block.lab.particles()) - block.tool_work;
        first = if first.is_nan() { energy } else { first };
        growth = growth.max(energy / first);
        let judged = judge(&report, energy, growth);
        if judged.is_blown() {
            return (judged, growth);
        }
        end = if judged == End::Flagged { judged } else { end };
    }
    (end, growth)
}

fn duration(steps: u32, dt: f64) -> f64 {
    f64::from(steps) * dt
}

fn judge(report: &FrameReport, energy: f64, growth: f64) -> End {
    if report.health.contains(Health::GIVEN_UP) || report.health.contains(Health::NON_FINITE) || !energy.is_finite() {
        End::GivenUp
    } else if report.redone > 0 {
        End::Speed
    } else if report.clamped > 0 {
        End::Stretch
    } else if growth > GROWTH_MAX {
        End::Energy
    } else if report.residual > RESIDUAL_MAX || !report.health.is_ok() {
        End::Flagged
    } else {
        End::Sound
    }
}

fn csv(axes: &Axes, results: &[(Point, End, f64)]) -> String {
    let mut text = "law,tool speed over wave speed,E over yield stress,dt over limit (implicit: cells travelled in a step),\
                    blown up,why,energy over first\n"
        .to_owned();
    for (p, end, growth) in results {
        let (law, why) = (LAWS[p.law].name, end.name().0);
        let (speed, stiffness, step) = (axes.speeds[p.speed], axes.stiffness[p.stiffness], axes.steps_of(p.law).0[p.step]);
        let blown = u8::from(end.is_blown());
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{law},{speed},{stiffness},{step:.3},{blown},{why},{growth:.4}");
    }
    text
}

/// The table and the picture.
fn files(out: &Path) -> [PathBuf; 3] {
    let stem = out.join("stability_map");
    let [svg, png] = plot::files(&stem);
    [stem.with_extension("csv"), svg, png]
}

/// Makes the folder and finds out whether every file could be written.
fn check(out: &Path) -> Result<(), String> {
    std::fs::create_dir_all(out).map_err(|e| format!("--out {}: {e}", out.display()))?;
    files(out).iter().try_for_each(|file| check_writable(file)).map_err(|e| format!("--out {e}"))
}

/// Writes each file for itself; says on standard error what could not be written, and whether nothing was
/// amiss.
fn write(out: &Path, axes: &Axes, results: &[(Point, End, f64)]) -> bool {
    let [table, svg, png] = files(out);
    let mut faults = data::write_each("--out", &[(table, csv(axes, results).into_bytes())]);
    let map = Map { axes, laws: LAWS, results };
    match plot::draw(&map, map.size()) {
        Ok([drawn_svg, drawn_png]) => faults.extend(data::write_each("--out", &[(svg, drawn_svg), (png, drawn_png)])),
        Err(error) => faults.push(error.to_string()),
    }
    faults.iter().for_each(|fault| say::error(fault));
    faults.is_empty()
}

fn main() -> ExitCode {
    let args = Args::parse();
    let axes = Axes::new(args.quick);
    if let Err(error) = check(&args.out) {
        say::error(&error);
        return ExitCode::from(2);
    }
    let results: Vec<(Point, End, f64)> = axes
        .points()
        .into_par_iter()
        .map(|point| {
            let (end, growth) = run(&axes, point);
            (point, end, growth)
        })
        .collect();
    let is_written = write(&args.out, &axes, &results);
    files(&args.out).iter().for_each(|f| say::line(&f.display().to_string()));
    let within = |law: usize, is_so: &dyn Fn(End) -> bool| {
        let (steps, most) = axes.steps_of(law);
        let at = |p: &Point| p.law == law && steps[p.step] <= most + 1e-9;
        results.iter().filter(|(p, end, _)| at(p) && is_so(*end)).count()
    };
    for (i, law) in LAWS.iter().enumerate() {
        let (_, most) = axes.steps_of(i);
        let most = if law.is_implicit { format!("{most} cells a step") } else { format!("{most} of the limit") };
        let (blown, flagged) = (within(i, &|end| end.is_blown()), within(i, &|end| end == End::Flagged));
        say::line(&format!("law {}: at up to {most} {blown} runs blew up, and {flagged} were flagged", law.name));
    }
    let is_ours = |law: &usize| LAWS[*law].law == ClayLaw::Softened;
    let blown: usize = (0..LAWS.len()).filter(is_ours).map(|law| within(law, &|end| end.is_blown())).sum();
    if is_written & say::was_heard() && blown == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
