//! Methods of cutting beside each other: ours, the paper's to the letter, rigid particles and interactive
//! particles. Only ours is judged.

use crate::cases::blade::{DEPTH, Witness, along_x, kept_when_pulled};
use crate::lab::{Lab, Mover, Random, Size, at_walls, block, jitter, room, snapshot, wave_step};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use glam::{DVec3, IVec3};

/// The methods and what the rows call them.
const METHODS: [(CuttingMethod, &str); 4] = [
    (CuttingMethod::TwoFields, "ours"),
    (CuttingMethod::Published, "as published"),
    (CuttingMethod::RigidParticles, "rigid particles"),
    (CuttingMethod::InteractiveParticles, "interactive particles"),
];

/// How far the blade goes [cells].
const WAY: f64 = 16.0;
/// Half the blade's width and height [cells].
const HALF: (f64, f64) = (1.5, 6.0);

/// What a sweep left.
struct Sweep {
    /// Particles in the swept volume at the start.
    swept: usize,
    /// Those among them that went through the blade.
    through: usize,
    /// Greatest depth behind the blade of each of them [cells], in order.
    depths: Vec<f64>,
    ratio: (f64, f64),
}

/// A lab with a block that fills a channel, and the blade in it.
fn channel(method: CuttingMethod, seed: u64, threads: usize) -> (Lab, Mover) {
    let domain = room([40, 20, 6], Wall::Slip);
    let material = ClayMaterial { poisson_ratio: 0.3, ..Preset::SoftClay.material() };
    let mut particles = block(DVec3::new(6.0, 0.0, 0.0), IVec3::new(24, 16, 6));
    jitter(&mut particles, 0.1, seed);
    let (low, high) = domain.wall_nodes();
    particles.iter_mut().for_each(|p| p.set_grid(p.grid().clamp(low.as_dvec3(), high.as_dvec3())));
    at_walls(&domain, &mut particles);
    let mut lab = Lab::with_threads(&snapshot(domain, material, particles), wave_step(&material, 0.4), threads);
    lab.plan.cutting = method;
    let shape = ToolShape::Blade { half_width: HALF.0, half_height: HALF.1 };
    let at = DVec3::new(11.03 + 0.3 * Random::new(seed).uniform(), 8.0, 3.0);
    let mover = Mover::new(&domain, shape, Contact::Separate { friction: 0.0 }, at, along_x());
    (lab, mover)
}

/// Frames of how many substeps, of which share of the asked one, watch a blade well that goes `travel` cells
/// per substep: a tenth of a cell where substeps are short; and from 0.15 cells on, where the engine would
/// halve its step for the clay's speed and hide the way round the rim, the parts are planned.
fn frames(travel: f64) -> (u32, f64) {
    let parts = ((travel / 0.15).ceil() as u32).next_power_of_two();
    (((0.1 / travel) as u32).max(1), 1.0 / f64::from(parts))
}

/// The blade is swept through the block, `travel` cells per substep of CFL number 0.4.
fn sweep(method: CuttingMethod, travel: f64, seed: u64) -> Sweep {
    let (mut lab, mut mover) = channel(method, seed, 0);
    let mut before = lab.particles();
    let domain = lab.engine.save().expect("clay is loaded").domain;
    let cell = domain.cell_width;
    mover.velocity = DVec3::X * travel * cell / lab.plan.dt;
    let (steps, share) = frames(travel);
    lab.plan.dt *= share;
    let local = |pose: &Pose, p: &Particle| pose.to_local(domain.to_world(p.grid()));
    let mut witness = Witness::new(HALF.0 * cell, HALF.1 * cell, DEPTH * cell, before.len());
    let is_swept = |p: &Particle| {
        let q = local(&mover.pose, p) / cell;
        q.x.abs() <= HALF.0 && q.y.abs() <= HALF.1 && (0.0..WAY).contains(&q.z)
    };
    let swept: Vec<usize> = (0..before.len()).filter(|i| is_swept(&before[*i])).collect();
    let mut ratio = (f64::INFINITY, 0.0f64);
    for _ in 0..(WAY / (travel * share * f64::from(steps))).ceil() as u32 {
        let start = mover.pose;
        let report = lab.frame_moving(steps, &mut mover);
        ratio = (ratio.0.min(report.volume_ratio.0), ratio.1.max(report.volume_ratio.1));
        let after = lab.particles();
        for (i, (a, b)) in before.iter().zip(&after).enumerate() {
            witness.watch(i, local(&start, a), local(&mover.pose, b), report.redone > 0);
        }
        before = after;
    }
    let through = swept.iter().filter(|i| witness.is_through(**i)).count();
    let depths = swept.iter().map(|i| witness.depth(*i) / cell).collect();
    Sweep { swept: swept.len(), through, depths, ratio }
}

/// Core nanoseconds per particle and substep: a frame with the blade amid the clay, on one core.
fn time(method: CuttingMethod, steps: u32) -> f64 {
    let (mut lab, mut mover) = channel(method, 0, 1);
    mover.velocity = DVec3::X * 0.05 * crate::lab::DX / lab.plan.dt;
    lab.frame_moving(2, &mut mover);
    let report = lab.frame_moving(steps, &mut mover);
    report.timings.total * 1e9 / (report.particle_count as f64 * f64::from(report.steps))
}

/// The greatest and the one that 95 % do not exceed.
fn greatest_and_p95(sweeps: &[Sweep]) -> (f64, f64) {
    let mut depths: Vec<f64> = sweeps.iter().flat_map(|s| &s.depths).copied().collect();
    depths.sort_by(f64::total_cmp);
    let at = (0.95 * depths.len() as f64) as usize;
    (depths.last().copied().unwrap_or(f64::NAN), depths.get(at).copied().unwrap_or(f64::NAN))
}

/// Each method at each speed.
pub fn compared(size: Size) -> Vec<Row> {
    let speeds: &[f64] = size.pick(&[0.5], &[0.1, 0.5], &[0.02, 0.1, 0.5, 1.0, 3.0]);
    let seeds = size.pick(1, 1, 5);
    let mut rows = vec![];
    for (method, called) in METHODS {
        // Ours has to keep its limits; of the others there is only something to tell.
        let row = |name: String, value: f64, unit: &'static str, limit: f64| match method {
            CuttingMethod::TwoFields => Row::at_most(name, value, unit, limit),
            _ => Row::figure(name, value, unit),
        };
        for &travel in speeds {
            let sweeps: Vec<Sweep> = (0..seeds).map(|seed| sweep(method, travel, seed)).collect();
            let name = |what: &str| format!("cut methods, {called}: {what}, {seeds} sweeps at {travel} a substep");
            let sum = |f: &dyn Fn(&Sweep) -> usize| sweeps.iter().map(f).sum::<usize>() as f64;
            let through = 100.0 * sum(&|s| s.through) / sum(&|s| s.swept);
            let (greatest, p95) = greatest_and_p95(&sweeps);
            rows.push(row(name("swept particles that go through"), through, "%", 0.0));
            rows.push(row(name("greatest depth behind the blade"), greatest, "cells", DEPTH));
            rows.push(Row::figure(name("P95 depth behind the blade"), p95, "cells"));
            rows.push(Row::figure(name("least J"), sweeps.iter().map(|s| s.ratio.0).fold(f64::INFINITY, f64::min), "-"));
            rows.push(Row::figure(name("greatest J"), sweeps.iter().map(|s| s.ratio.1).fold(0.0, f64::max), "-"));
        }
        let crosses = (kept_when_pulled(method) - 1.0).abs();
        rows.push(row(format!("cut methods, {called}: momentum that crosses the cut after the blade"), crosses, "of m v", 1e-3));
        let cost = time(method, size.pick(5, 10, 200));
        rows.push(Row::figure(format!("cut methods, {called}: time per particle and substep"), cost, "core-ns"));
    }
    rows
}
