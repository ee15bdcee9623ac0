//! Cost of a substep: core-ns per particle and substep of a block of clay that falls onto the floor, with
//! `--tool` and a ball of a quarter of its width that stands in its top.
//!
//! `cargo bench --no-default-features --bench substep -- [--gpu] [--tool] [--json] [--threads T] [--particles
//! N] [--grid G]`; `benches/peers/run.sh` runs it beside Taichi on the same scene. Core-ns is the CPU time of
//! all threads: it hardly moves when other work shares the machine.
#![expect(clippy::print_stdout, reason = "a benchmark prints its figures")]

use bevy_clay::prelude::*;
use bevy_clay::sim::prelude::*;
use cpu_time::ProcessTime;
use glam::{DVec3, IVec3};
use std::time::Instant;

/// The peers' scene: E 1e5, nu 0.1, yield 2 kPa, rho 1000, a 1 m room, dt a quarter of the wave limit.
fn scene(particles: usize, cells: i32) -> (Snapshot, f64) {
    let material =
        ClayMaterial { density: 1000.0, young_modulus: 1e5, poisson_ratio: 0.1, yield_stress: 2e3, ..ClayMaterial::default() };
    let dx = 1.0 / f64::from(cells);
    let dt = 0.25 * dx / material.wave_speed(material.density);
    let domain = Domain::new(DVec3::ZERO, DVec3::ONE, dx, Walls::default()).expect("a room of 1 m");
    let side = (particles as f64).cbrt().ceil() as i32;
    let mut random = 7u64;
    let mut jitter = || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        0.4 * ((random >> 33) as f64 / (1u64 << 31) as f64) - 0.2
    };
    let floor = domain.wall_nodes().0.as_dvec3();
    let low =
        floor + DVec3::new(f64::from(cells) / 2.0 - f64::from(side) / 4.0, 1.0, f64::from(cells) / 2.0 - f64::from(side) / 4.0);
    let at = |i: usize| {
        let i = i as i32;
        IVec3::new(i / side / side, i / side % side, i % side).as_dvec3()
    };
    let volume = (dx.powi(3) / 8.0) as f32;
    let particles = (0..particles)
        .map(|i| {
            let x = low + (at(i) + 0.5 + DVec3::new(jitter(), jitter(), jitter())) / 2.0;
            let mut p = Particle::at(x, volume, i as u32);
            p.velocity[1] = (-0.03 * dx / dt) as f32;
            p
        })
        .collect();
    (Snapshot::new(domain, material, particles), dt)
}

/// A ball a quarter as wide as the block, its centre in the middle of the block's top.
fn ball(snapshot: &Snapshot, dt: f64) -> ToolPath {
    let places = || snapshot.particles.iter().map(|p| snapshot.domain.to_world(p.grid()));
    let low = places().reduce(DVec3::min).expect("clay");
    let high = places().reduce(DVec3::max).expect("clay");
    let top = DVec3::new(0.5 * (low.x + high.x), high.y, 0.5 * (low.z + high.z));
    let sample = |time: f64| PoseSample { time, pose: Pose { position: top, ..Pose::default() } };
    let tool = Tool { shape: ToolShape::Sphere { radius: (high.x - low.x) / 8.0 }, contact: Contact::default() };
    ToolPath { id: 1, tool, sheet: 0, samples: vec![sample(0.0), sample(1000.0 * dt)] }
}

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let value = |name: &str| args.iter().position(|a| a == name).and_then(|i| args.get(i + 1)?.parse::<usize>().ok());
    let is_json = args.iter().any(|a| a == "--json");
    let threads = value("--threads").unwrap_or(0);
    let sizes = value("--particles").map_or(vec![13_800, 104_900], |n| vec![n]);
    let grids = value("--grid").map_or(vec![60, 120, 200], |g| vec![g]);
    let has_tool = args.iter().any(|a| a == "--tool");
    let is_gpu = args.iter().any(|a| a == "--gpu");
    let mut engine: Box<dyn Engine> = if is_gpu {
        Box::new(GpuDevice::headless().and_then(GpuEngine::new).expect("a graphics adapter"))
    } else {
        Box::new(NativeEngine::with_threads(threads))
    };
    if !is_json {
        println!("{}", engine.describe());
    }
    for &particles in &sizes {
        for &grid in &grids {
            run(engine.as_mut(), particles, grid as i32, has_tool, is_json);
        }
    }
}

fn run(engine: &mut dyn Engine, particles: usize, grid: i32, has_tool: bool, is_json: bool) {
    let (snapshot, dt) = scene(particles, grid);
    engine.load(&snapshot).expect("the scene loads");
    let ball = ball(&snapshot, dt);
    let mut frame = |steps: u32| {
        let mut plan = FramePlan::new(snapshot.material, dt, steps);
        plan.gravity = DVec3::new(0.0, -9.81, 0.0);
        plan.tools = has_tool.then(|| ball.clone()).into_iter().collect();
        let (wall, cpu) = (Instant::now(), ProcessTime::now());
        engine.submit(plan).expect("the plan is sound");
        let report = engine.wait().expect("the engine runs");
        assert!(report.health.is_ok(), "{}", report.health);
        (wall.elapsed().as_secs_f64(), cpu.elapsed().as_secs_f64(), report.timings)
    };
    frame(4);
    let (mut wall, mut cpu, mut passes) = (f64::INFINITY, f64::INFINITY, Default::default());
    for _ in 0..5 {
        let (w, c, t) = frame(40);
        if c < cpu {
            (cpu, passes) = (c, t);
        }
        wall = wall.min(w);
    }
    let per = 1e9 / (40.0 * particles as f64);
    let core_ns = cpu * per;
    if is_json {
        println!(
            "{}",
            serde_json::json!({"tool": "bevy_clay", "engine": engine.describe(), "particles": particles, "grid": grid, "core_ns_per_particle": core_ns,
            "wall_ms": wall / 40.0 * 1e3})
        );
    } else {
        println!(
            "{particles:7} particles, {grid:3}^3: {core_ns:6.1} core-ns, {:7.3} ms wall per substep (rebin {:.0} %, grid {:.0} %, particles {:.0} %, report {:.0} %)",
            wall / 40.0 * 1e3,
            passes.rebin / passes.total * 100.0,
            passes.grid / passes.total * 100.0,
            passes.particles / passes.total * 100.0,
            passes.report / passes.total * 100.0
        );
    }
}
