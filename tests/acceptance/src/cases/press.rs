//! Solid tools on clay as a hand has it: forces without steps, the same at every offset and angle to the
//! grid, held; nothing in the tool, nothing through it.

use crate::lab::{DX, Lab, Mover, Size, at_walls, block, jitter, place, room_with, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::scene::fill::{Fill, FilledPoint};
use bevy_clay::scene::solid::Solid;
use bevy_clay::sim::params::WALL_NODE;
use bevy_clay::sim::planner::{STEP_FRACTION, TOOL_TRAVEL_MAX, VOLUME_AVERAGING};
use bevy_clay::sim::prelude::*;
use bevy_clay::surface::extract::extract;
use bevy_clay::surface::field::SurfaceSettings;
use glam::{DQuat, DVec3, IVec3};
use rayon::prelude::*;
use std::f64::consts::FRAC_PI_2;

/// Travel between two samples of a force [cells].
pub(super) const SAMPLE: f64 = 0.02;

/// A force against travel: samples `[depth in cells, force]`, in order of depth.
pub(super) type Curve = Vec<[f64; 2]>;

/// The force at `depth` [cells], between samples.
pub(super) fn force_at(curve: &[[f64; 2]], depth: f64) -> f64 {
    let after = curve.iter().position(|c| c[0] >= depth).unwrap_or(0).max(1);
    let Some([a, b]) = curve.get(after - 1..=after) else { return f64::NAN };
    a[1] + (b[1] - a[1]) * (depth - a[0]) / (b[0] - a[0])
}

/// Jitters all but the outermost layer below `top`, as fills do.
pub(super) fn jitter_below(particles: &mut [Particle], amount: f64, top: f64) {
    let before: Vec<DVec3> = particles.iter().map(Particle::grid).collect();
    let is_even: Vec<bool> = particles.iter().map(|p| place(p).y > top - 0.3).collect();
    jitter(particles, amount, 3);
    for ((p, before), is_even) in particles.iter_mut().zip(before).zip(is_even) {
        let mut at = p.grid();
        if is_even {
            at.y = before.y;
        }
        p.set_grid(at);
    }
}

/// A quarter of a block, and a ball of `radius` [cells] that comes down in its corner.
pub(super) fn quarter(radius: f64) -> (Snapshot, Mover) {
    let walls = Walls { low: [Wall::Slip, Wall::Stick, Wall::Slip], high: [Wall::Slip, Wall::Separate, Wall::Slip] };
    let unit = radius / 4.0;
    let cells = |n: f64| (n * unit).round() as i32;
    let size = IVec3::new(cells(12.0), cells(10.0), cells(12.0));
    let domain = room_with([size.x, cells(16.0), size.z], walls);
    let mut particles = block(DVec3::ZERO, size);
    jitter_below(&mut particles, 0.125, f64::from(size.y));
    at_walls(&domain, &mut particles);
    let at = DVec3::Y * (f64::from(size.y) + radius + 0.05);
    let ball = ToolShape::Sphere { radius };
    let mover = Mover::new(&domain, ball, Contact::default(), at, DQuat::IDENTITY);
    (snapshot(domain, Preset::SoftClay.material(), particles), mover)
}

/// A ball of `radius` [cells] goes 1.15 of four deep at `speed` [m/s], in its last third cell at a quarter of
/// that and then at a sixteenth, and is held: forces of its full ball [N], at the start of the hold and after
/// `held` [s] of it, over the radius squared.
fn braked(radius: f64, speed: f64, held: f64, refine: f64) -> [f64; 2] {
    let (clay, mut mover) = quarter(radius);
    let mut lab = Lab::with_threads(&clay, stable_step(&clay.material) / refine, 1);
    lab.plan.volume_averaging = VOLUME_AVERAGING;
    let unit = radius / 4.0;
    let mut go = |way: f64, speed: f64| {
        let steps = (way * unit * DX / (speed * lab.plan.dt)).ceil();
        mover.velocity = DVec3::NEG_Y * (way * unit * DX / (steps * lab.plan.dt));
        lab.frame_moving(steps as u32, &mut mover);
    };
    go(0.05 / unit + 0.8, speed);
    go(0.25, 0.25 * speed);
    go(0.1, speed / 16.0);
    mover.velocity = DVec3::ZERO;
    let steps = (2e-3 / lab.plan.dt).round() as u32;
    let frames = (held / 2e-3).round() as u32;
    let forces: Vec<f64> = (0..frames).map(|_| lab.frame_moving(steps, &mut mover).tools[0].force.y).collect();
    let scale = 4.0 / (unit * unit);
    [forces[0], forces[forces.len() - 1]].map(|f| scale * f)
}

/// A ball that is braked and held keeps its force, whatever the grid.
pub fn held_ball(size: Size) -> Vec<Row> {
    let held = size.pick(0.03, 0.1, 0.3);
    let radii: &[f64] = size.pick(&[4.0], &[4.0], &[4.0, 8.0]);
    // The speed on the grid of the cases: 50 mm/s where a cell is 2 mm.
    let found: Vec<[f64; 2]> = radii.par_iter().map(|r| braked(*r, 0.1, held * DX / 0.002, 1.0)).collect();
    let mut rows = vec![Row::at_least("held ball of 4: force kept", found[0][1] / found[0][0], "-", 0.97)];
    if let [small, large] = found[..] {
        rows.push(Row::at_most("held ball of 4: force off that of 8", 100.0 * (small[1] / large[1] - 1.0).abs(), "%", 3.0));
    }
    rows
}

/// Mean force [N] on the full ball of 4 cells from 0.7 to 1.1 cells of depth, at `speed` [m/s], by steps
/// `refine` times as fine as the planner's.
fn moving(speed: f64, refine: f64) -> f64 {
    let (clay, mut mover) = quarter(4.0);
    let mut lab = Lab::with_threads(&clay, stable_step(&clay.material) / refine, 1);
    lab.plan.volume_averaging = VOLUME_AVERAGING;
    let mut go = |way: f64| {
        let steps = (way * DX / (speed * lab.plan.dt)).ceil();
        mover.velocity = DVec3::NEG_Y * (way * DX / (steps * lab.plan.dt));
        4.0 * lab.frame_moving(steps as u32, &mut mover).tools[0].force.y
    };
    go(0.05 + 0.7);
    go(0.4)
}

/// A ball that moves or is held bears the same whatever the time step, and little more at four times the
/// speed.
pub fn time_steps(size: Size) -> Vec<Row> {
    let refined: &[f64] = size.pick(&[4.0], &[4.0], &[4.0, 9.0]);
    let held_for = size.pick(4e-3, 0.02, 0.02);
    let speed = size.pick(0.4, 0.05, 0.05);
    let runs: Vec<(f64, f64)> =
        std::iter::once((1.0, 1.0)).chain(refined.iter().map(|r| (1.0, *r))).chain([(4.0, 1.0)]).collect();
    let forces: Vec<f64> = runs.par_iter().map(|(faster, refine)| moving(faster * speed, *refine)).collect();
    let held: Vec<f64> = runs[..runs.len() - 1].par_iter().map(|(_, refine)| braked(4.0, speed, held_for, *refine)[1]).collect();
    let off = |found: f64, of: f64| 100.0 * (found / of - 1.0).abs();
    let mut rows = vec![];
    for (i, refine) in (1..).zip(refined) {
        rows.push(Row::at_most(format!("moving ball of 4: force at dt / {refine}, off by"), off(forces[i], forces[0]), "%", 2.0));
        rows.push(Row::at_most(format!("held ball of 4: force at dt / {refine}, off by"), off(held[i], held[0]), "%", 2.0));
    }
    let fast = forces[forces.len() - 1];
    rows.push(Row::at_most(
        "moving ball of 4: force at four times the speed, more by",
        100.0 * (fast / forces[0] - 1.0),
        "%",
        3.0,
    ));
    rows
}

/// Force [N] on two plates that squeeze a ball of clay of 8 cells' radius along a direction `degrees` off the
/// grid, against the travel of each.
fn squeezed(degrees: f64, depth: f64, speed: f64) -> Curve {
    const RADIUS: f64 = 8.0;
    const ROOM: i32 = 32;
    let walls = Walls { low: [Wall::Separate; 3], high: [Wall::Separate; 3] };
    let domain = room_with([ROOM; 3], walls);
    let middle = DVec3::splat(f64::from(ROOM) / 2.0);
    let solid = Solid::Sphere { center: middle * DX, radius: RADIUS * DX };
    let (points, _) = Fill { spacing: 0.5 * DX, jitter: 0.25, seed: 9 }.fill(&[solid]);
    let particle =
        |(id, point): (u32, &FilledPoint)| Particle::at(point.position / DX + f64::from(WALL_NODE), point.volume as f32, id);
    let particles = (0..).zip(&points).map(particle).collect();
    let material = Preset::SoftClay.material();
    let mut lab = Lab::with_threads(&snapshot(domain, material, particles), stable_step(&material), 1);
    lab.plan.volume_averaging = VOLUME_AVERAGING;
    let rotation = DQuat::from_rotation_z(degrees.to_radians());
    let up = rotation * DVec3::Y;
    let shape = ToolShape::Box { half_size: DVec3::new(11.0, 4.0, 11.0) };
    let plate = |id, sign: f64| Mover {
        id,
        ..Mover::new(&domain, shape, Contact::default(), middle + sign * (RADIUS + 4.1) * up, rotation)
    };
    let mut plates = [plate(1, 1.0), plate(2, -1.0)];
    let steps = (SAMPLE * DX / speed / lab.plan.dt).ceil();
    let (mut travel, mut curve) = (-0.1, vec![]);
    while travel < depth {
        let velocity = up * (SAMPLE * DX / (steps * lab.plan.dt));
        (plates[0].velocity, plates[1].velocity) = (-velocity, velocity);
        let paths = plates.each_mut().map(|plate| plate.path(steps * lab.plan.dt));
        let report = lab.frame_with(steps as u32, &paths);
        curve.push([travel + 0.5 * SAMPLE, 0.5 * up.dot(report.tools[0].force - report.tools[1].force)]);
        travel += SAMPLE;
    }
    curve
}

/// A ball squeezed along directions to the grid bears the same.
pub fn directions(size: Size) -> Vec<Row> {
    let depth = size.pick(0.8, 0.8, 1.2);
    let angles: &[f64] = size.pick(&[0.0, 45.0], &[0.0, 20.0, 45.0], &[0.0, 20.0, 45.0]);
    let curves: Vec<Curve> = angles.par_iter().map(|a| squeezed(*a, depth, size.pick(0.2, 0.1, 0.05))).collect();
    let mut worst = 0.0f64;
    for i in (0..).map(|i| 0.6 + 0.05 * f64::from(i)).take_while(|d| *d < depth - SAMPLE) {
        let forces = curves.iter().map(|c| force_at(c, i));
        let (least, most) = forces.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), f| (l.min(f), m.max(f)));
        let spread = 100.0 * (most / least - 1.0);
        worst = if spread.is_finite() { worst.max(spread) } else { f64::NAN };
    }
    vec![Row::at_most("squeezed ball: force along directions to the grid, apart", worst, "%", 5.0)]
}

/// A tool of `shape` goes `way` [cells] through the top of a block at `speed` [m/s] and back: most particle
/// centres in it at any time, how deep [cells], and the 5th percentile of the drawn face's distance to it
/// where the face is nearer than half a cell, at the deepest.
fn driven(shape: ToolShape, reach: f64, way: f64, speed: f64) -> (usize, f64, f64) {
    let walls = Walls { low: [Wall::Slip, Wall::Stick, Wall::Slip], high: [Wall::Slip, Wall::Separate, Wall::Slip] };
    let domain = room_with([12, 20, 12], walls);
    let mut particles = block(DVec3::ZERO, IVec3::new(12, 10, 12));
    jitter_below(&mut particles, 0.125, 10.0);
    let material = Preset::SoftClay.material();
    // As the planner has it: the clay's limit, and a tenth of a cell of the tool's way.
    let dt = stable_step(&material).min(TOOL_TRAVEL_MAX * DX / speed);
    let mut lab = Lab::with_threads(&snapshot(domain, material, particles), dt, 1);
    lab.plan.volume_averaging = VOLUME_AVERAGING;
    let mut mover = Mover::new(&domain, shape, Contact::default(), DVec3::Y * (10.1 + reach), DQuat::IDENTITY);
    let steps = (0.1 * DX / speed / dt).ceil();
    let (mut most, mut deepest, mut face) = (0, 0.0f64, f64::NAN);
    for sign in [-1.0, 1.0] {
        mover.velocity = DVec3::Y * sign * 0.1 * DX / (steps * dt);
        for _ in 0..(way / 0.1) as u32 {
            if !lab.frame_moving(steps as u32, &mut mover).health.is_ok() {
                return (usize::MAX, f64::NAN, f64::NAN);
            }
            let distance = |at: DVec3| mover.tool.shape.distance(mover.pose.to_local(at)) / DX;
            let inside: Vec<f64> =
                lab.particles().iter().map(|p| distance(domain.to_world(p.grid()))).filter(|d| *d < 0.0).collect();
            most = most.max(inside.len());
            deepest = inside.iter().fold(deepest, |a, b| a.max(-b));
        }
        if sign < 0.0 {
            let source = lab.engine.surface().expect("clay is loaded");
            let mesh = extract(&source, &SurfaceSettings::default());
            let distances = mesh
                .positions
                .iter()
                .map(|p| mover.tool.shape.distance(mover.pose.to_local(DVec3::from_array(p.map(f64::from)))) / DX);
            let mut near: Vec<f64> = distances.filter(|d| *d < 0.5).collect();
            near.sort_by(f64::total_cmp);
            face = near.get(near.len() / 20).copied().unwrap_or(f64::NAN);
        }
    }
    (most, deepest, face)
}

/// Balls and a plate driven into clay at 5 m/s: no particle's centre is ever in them. A ball pressed in: the
/// drawn face stands in it by little.
pub fn nothing_inside(size: Size) -> Vec<Row> {
    let plate = ToolShape::Box { half_size: DVec3::new(4.0, 0.5, 4.0) };
    let mut rows = vec![];
    for (name, shape, reach) in [
        ("ball of 4 cells", ToolShape::Sphere { radius: 4.0 }, 4.0),
        ("ball of 1 cell", ToolShape::Sphere { radius: 1.0 }, 1.0),
        ("plate of 1 cell", plate, 0.5),
    ] {
        let (most, deepest, _) = driven(shape, reach, size.pick(3.0, 4.0, 4.0), 5.0);
        let count = if deepest.is_nan() { f64::NAN } else { most as f64 };
        rows.push(Row::at_most(format!("driven at 5 m/s, {name}: particle centres in it"), count, "particles", 0.0));
    }
    let (_, _, face) = driven(ToolShape::Sphere { radius: 4.0 }, 4.0, 3.0, size.pick(1.0, 0.5, 0.2));
    rows.push(Row::at_least("pressed ball of 4 cells: 5th percentile of the drawn face's distance", face, "cells", -0.1));
    rows
}

/// What parts the two blocks of [`carried_through`].
#[derive(Clone, Copy, Debug)]
enum Parting {
    /// A plate of this thickness [cells].
    Plate(f64),
    Blade,
    /// What a blade leaves.
    Cut,
}

impl Parting {
    /// The tool, across the x axis, and half its thickness [cells].
    fn tool(self) -> (ToolShape, DQuat, f64) {
        match self {
            Self::Plate(thickness) => {
                (ToolShape::Box { half_size: DVec3::new(0.5 * thickness, 10.0, 10.0) }, DQuat::IDENTITY, 0.5 * thickness)
            }
            Self::Blade | Self::Cut => {
                (ToolShape::Blade { half_width: 10.0, half_height: 10.0 }, DQuat::from_rotation_y(FRAC_PI_2), 0.0)
            }
        }
    }
}

/// What clay that leaves what parts it from other clay, at 0.05 m/s, has lost of its momentum after a quarter
/// of a cell, or given to the other, whichever is more [of m v]. The plane is `shift` [cells] off a node, its
/// normal turned about z, then about y.
fn carried_through(parting: Parting, shift: f64, degrees: [f64; 2]) -> f64 {
    let domain = room_with([20, 16, 16], Walls { low: [Wall::Separate; 3], high: [Wall::Separate; 3] });
    let [z, y] = degrees.map(f64::to_radians);
    let rotation = DQuat::from_rotation_y(y) * DQuat::from_rotation_z(z);
    let middle = DVec3::new(10.0 + shift, 8.0, 8.0);
    let (shape, across, half_thickness) = parting.tool();
    let side = |p: &Particle| (rotation.inverse() * (place(p) - middle)).x;
    let mut particles = block(DVec3::new(3.0, 4.0, 4.0), IVec3::new(14, 8, 8));
    particles.retain(|p| side(p).abs() > half_thickness + 0.25);
    let material = Preset::SoftClay.material();
    let dt = stable_step(&material);
    let mut tool = Mover::new(&domain, shape, Contact::default(), middle, rotation * across);
    if let Parting::Cut = parting {
        let mut lab = Lab::with_threads(&snapshot(domain, material, particles), dt, 1);
        lab.frame_moving(2, &mut tool);
        particles = lab.particles();
    }
    let speed = 0.05;
    let mut leaving = 0.0;
    for p in particles.iter_mut().filter(|p| side(p) > 0.0) {
        p.velocity = (rotation * DVec3::X * speed).as_vec3().to_array();
        leaving += speed;
    }
    let mut lab = Lab::with_threads(&snapshot(domain, material, particles), dt, 1);
    let steps = (0.25 * DX / speed / dt).ceil() as u32;
    let report = if let Parting::Cut = parting { lab.frame(steps) } else { lab.frame_moving(steps, &mut tool) };
    assert!(report.health.is_ok());
    let along = |p: &Particle| (rotation.inverse() * DVec3::from_array(p.velocity.map(f64::from))).x;
    let sums = lab.particles().iter().map(|p| (side(p) > 0.0, along(p))).fold([0.0; 2], |mut sums, (is_before, v)| {
        sums[usize::from(is_before)] += v;
        sums
    });
    (sums[1] - leaving).abs().max(sums[0].abs()) / leaving
}

/// A thin plate, a blade, or a cut between clay that goes and clay that stays: nothing of it gets through.
pub fn parted(size: Size) -> Vec<Row> {
    let plates = size.pick([1.0].as_slice(), &[1.0], &[1.0, 0.5, 0.1]);
    let mut partings: Vec<_> = plates.iter().map(|t| (format!("plate of {t} cells"), Parting::Plate(*t))).collect();
    partings.extend([("blade".to_string(), Parting::Blade), ("cut".to_string(), Parting::Cut)]);
    let mut rows = vec![];
    for (name, parting) in partings {
        let mut worst = 0.0f64;
        for (shift, degrees) in [(0.0, [0.0; 2]), (0.25, [0.0; 2]), (0.5, [20.0, 0.0]), (0.1, [45.0, 0.0]), (0.3, [45.0, 35.0])] {
            let carried = carried_through(parting, shift, degrees);
            worst = if carried.is_nan() { carried } else { worst.max(carried) };
        }
        rows.push(Row::at_most(format!("{name}: momentum that gets through"), worst, "of m v", 1e-4));
    }
    rows
}

/// A ball and two jaws on clay at 1.2 times the planner's step, for clay of two Poisson's ratios.
pub fn step_limit(size: Size) -> Vec<Row> {
    let ratios: &[f64] = size.pick(&[0.45], &[0.1, 0.45], &[0.0, 0.1, 0.3, 0.45, 0.49]);
    let is_stable = |nu: f64, fraction: f64| {
        let (clay, mut mover) = quarter(4.0);
        let material = ClayMaterial { poisson_ratio: nu, ..clay.material };
        let mut lab = Lab::new(&Snapshot { material, ..clay }, fraction * material.time_step_limit(DX, material.density));
        let per_step = 0.01 * DX / lab.plan.dt;
        mover.velocity = DVec3::NEG_Y * per_step;
        let mut reports = vec![lab.frame_moving(100, &mut mover)];
        mover.velocity = DVec3::ZERO;
        reports.extend((0..8).map(|_| lab.frame_moving(100, &mut mover)));
        // What is stable comes to rest, or rings on, and does not grow.
        let is_ok = reports.iter().all(|r| r.health.is_ok() && r.redone == 0 && r.clamped == 0);
        let greatest = |reports: &[FrameReport]| reports.iter().map(|r| r.energies.kinetic).fold(0.0, f64::max);
        let elastic = reports[8].energies.elastic;
        is_ok && greatest(&reports[5..]) < greatest(&reports[1..5]).max(1e-6 * elastic)
    };
    let limit = |nu: f64| {
        let steps = [0.7, 0.84, 0.9, 1.0, 1.1, 1.2, 1.3];
        steps.iter().copied().take_while(|f| is_stable(nu, *f)).last().unwrap_or(f64::NAN) / STEP_FRACTION
    };
    ratios
        .iter()
        .map(|nu| {
            Row::at_least(format!("step with a ball in the clay, nu {nu}: stable up to"), limit(*nu), "x the planner's", 1.2)
        })
        .collect()
}

/// A ball of `radius` [cells] of elastic clay between two plates, as an octant: greatest error of the force
/// against Tatara's, without an offset, and the same beyond a depth of 0.375 cells.
fn tatara_error(radius: f64) -> [f64; 2] {
    let found = super::tatara::octant(radius);
    let error = |from: f64| {
        let off = found.iter().filter(|f| f[0] >= from).map(|f| (f[1] / f[2] - 1.0).abs());
        off.fold(if found.is_empty() { f64::NAN } else { 0.0 }, f64::max)
    };
    [error(0.0), error(0.375)].map(|e| 100.0 * e)
}

/// Elastic balls whose pole stands at several places between nodes.
pub fn elastic_balls(size: Size) -> Vec<Row> {
    let radii: &[f64] = size.pick(&[], &[20.0], &[20.0, 20.5, 32.5]);
    let errors: Vec<[f64; 2]> = radii.par_iter().map(|r| tatara_error(*r)).collect();
    let rows_of = |(radius, [all, deep]): (&f64, [f64; 2])| {
        let name = |what: &str| format!("elastic ball of {radius}: force off Tatara's{what}");
        [Row::at_most(name(""), all, "%", 6.0), Row::at_most(name(" beyond 0.375 cells"), deep, "%", 4.0)]
    };
    radii.iter().zip(errors).flat_map(rows_of).collect()
}
