//! Cost of the implicit step beside an explicit substep: core-ns per particle and pass of a block of clay
//! under a ball that sinks in at 20 mm/s, one step a frame of 1/90 s, and of a substep of the same clay.
//!
//! `cargo bench --no-default-features --bench implicit -- [--threads T] [--particles N] [--passes P]
//! [--frames F]`. Core-ns is the CPU time of all threads, all that a frame takes included: it moves less than
//! wall time when other work shares the machine, and its ratio to the substep's of the same run less still.
//! What begins and ends a step is found by frames of fewer passes.
#![expect(clippy::print_stdout, reason = "a benchmark prints its figures")]

use bevy_clay::prelude::*;
use bevy_clay::sim::planner::VOLUME_AVERAGING;
use bevy_clay::sim::prelude::*;
use cpu_time::ProcessTime;
use glam::{DVec3, IVec3};
use std::time::Instant;

const CELL: f64 = 1e-3;
const FRAME: f64 = 1.0 / 90.0;
/// [m/s]
const SPEED: f64 = 0.02;
/// Frames before the measurement: the ball is in by a cell and a half.
const WARM_UP: usize = 7;
/// The fewest passes of a step, and frames of so many before the measurement.
const PASSES_MIN: u32 = 3;
const SHORT: usize = 3;
/// Substeps of an explicit measurement: one sort, and one averaging of volumes in eight.
const SUBSTEPS: u32 = 40;

/// A cube of clay on the floor, eight particles to a cell, in a room with a third of it about.
fn scene(count: usize) -> Snapshot {
    let side = (count as f64).cbrt().ceil() as i32;
    let cells = f64::from(side) / 2.0;
    let room = DVec3::new(2.0, 1.5, 2.0) * cells * CELL;
    let domain = Domain::new(DVec3::ZERO, room, CELL, Walls::default()).expect("a room");
    let mut random = 7u64;
    let mut jitter = || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        0.4 * ((random >> 33) as f64 / (1u64 << 31) as f64) - 0.2
    };
    let low = domain.to_grid(DVec3::new(0.5, 0.0, 0.5) * cells * CELL);
    let particle = |i: usize| {
        let i = i as i32;
        // Layer by layer from the floor on.
        let at = IVec3::new(i / side % side, i / side / side, i % side).as_dvec3();
        let x = low + (at + 0.5 + DVec3::new(jitter(), jitter(), jitter())) / 2.0;
        Particle::at(x, (CELL.powi(3) / 8.0) as f32, i.cast_unsigned())
    };
    let particles = (0..count).map(particle).collect();
    Snapshot::new(domain, Preset::SoftClay.material(), particles)
}

/// A ball with a third of the block's width across, and how far it is above the clay's top at the start of
/// the first frame [m].
fn ball(snapshot: &Snapshot, from: f64, to: f64) -> ToolPath {
    let places = || snapshot.particles.iter().map(|p| snapshot.domain.to_world(p.grid()));
    let low = places().reduce(DVec3::min).expect("clay");
    let high = places().reduce(DVec3::max).expect("clay");
    let top = DVec3::new(0.5 * (low.x + high.x), high.y, 0.5 * (low.z + high.z));
    let radius = (high.x - low.x) / 6.0;
    let at = |time: f64| Pose { position: top + DVec3::Y * (radius - SPEED * time), ..Pose::default() };
    let sample = |time: f64| PoseSample { time: time - from, pose: at(time) };
    let tool = Tool { shape: ToolShape::Sphere { radius }, contact: Contact::default() };
    ToolPath { id: 1, tool, sheet: 0, samples: vec![sample(from), sample(to)] }
}

/// What a frame took: wall and CPU time \[s\], and the report.
struct Taken {
    wall: f64,
    cpu: f64,
    report: FrameReport,
}

fn run(engine: &mut dyn Engine, plan: FramePlan) -> Taken {
    let (wall, cpu) = (Instant::now(), ProcessTime::now());
    engine.submit(plan).expect("the plan is sound");
    let report = engine.wait().expect("the engine runs");
    assert!(report.health.is_ok(), "{}", report.health);
    Taken { wall: wall.elapsed().as_secs_f64(), cpu: cpu.elapsed().as_secs_f64(), report }
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let value = |name: &str| args.iter().position(|a| a == name).and_then(|i| args.get(i + 1)?.parse::<usize>().ok());
    let sizes = value("--particles").map_or(vec![30_000, 104_900], |n| vec![n]);
    let (passes, frames) = (value("--passes").unwrap_or(15), value("--frames").unwrap_or(10));
    let mut engine = NativeEngine::with_threads(value("--threads").unwrap_or(0));
    println!("{}", engine.describe());
    for count in sizes {
        measure(&mut engine, count, passes as u32, frames);
    }
}

fn measure(engine: &mut NativeEngine, count: usize, passes: u32, frames: usize) {
    let snapshot = scene(count);
    engine.load(&snapshot).expect("the scene loads");
    let plan = |dt: f64, steps: u32, from: f64| {
        let mut plan = FramePlan::new(snapshot.material, dt, steps);
        plan.gravity = DVec3::new(0.0, -9.81, 0.0);
        plan.volume_averaging = VOLUME_AVERAGING;
        plan.tools = vec![ball(&snapshot, from, from + plan.duration())];
        plan
    };
    let implicit = |frame: usize, passes: u32| {
        let mut plan = plan(FRAME, 1, frame as f64 * FRAME);
        plan.integrator = Integrator::Implicit { passes };
        plan
    };
    (0..WARM_UP).for_each(|frame| drop(run(engine, implicit(frame, passes))));
    let first = WARM_UP + SHORT;
    let short: Vec<Taken> = (WARM_UP..first).map(|frame| run(engine, implicit(frame, PASSES_MIN))).collect();
    let steps: Vec<Taken> = (first..first + frames).map(|frame| run(engine, implicit(frame, passes))).collect();
    let [short, least] = [&short, &steps].map(|frames| frames.iter().min_by(|a, b| a.cpu.total_cmp(&b.cpu)).expect("a frame"));
    let wall = steps.iter().map(|step| step.wall).fold(f64::INFINITY, f64::min);
    let per_pass = 1e9 * least.cpu / (f64::from(least.report.passes) * count as f64);

    let dt = 0.5 * snapshot.material.time_step_limit(CELL, snapshot.material.density);
    let explicit = || plan(dt, SUBSTEPS, (first + frames) as f64 * FRAME);
    let substeps = (0..5).map(|_| run(engine, explicit()).cpu).fold(f64::INFINITY, f64::min);
    let per_substep = 1e9 * substeps / (f64::from(SUBSTEPS) * count as f64);

    println!(
        "{count:7} particles: {per_pass:6.1} core-ns per particle and pass (explicit substep {per_substep:.1}: ratio {:.2}), \
         {:7.2} ms wall and {:7.2} core-ms a frame of {} passes, {} cut, residual {:.1e} ({})",
        per_pass / per_substep,
        1e3 * wall,
        1e3 * least.cpu,
        least.report.passes,
        least.report.rejected,
        least.report.residual,
        shares(least, short),
    );
}

/// What takes which part of a frame, by another of fewer passes.
fn shares(frame: &Taken, short: &Taken) -> String {
    let t = &frame.report.timings;
    let [sort, cycles, report] = [t.rebin, t.grid, t.report].map(|seconds| seconds / t.total * 100.0);
    let [passes, fewer] = [frame, short].map(|taken| f64::from(taken.report.passes));
    let pass = (frame.cpu - short.cpu) / (passes - fewer) / frame.cpu * 100.0;
    let ends = 100.0 - passes * pass - sort - report;
    format!(
        "passes {:.0} %, begin and end {ends:.0} %, sorting {sort:.0} %, report {report:.0} %; of it V-cycles and L-BFGS {cycles:.0} %",
        passes * pass,
    )
}
