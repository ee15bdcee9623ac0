//! The place of a tool among spheres: exact, outside, in few pivots, the same at every stiffness, and fast.

use crate::lab::Size;
use crate::report::Row;
use bevy_clay::haptics::proxy::{ActiveSet, Constraint, Multipliers, Pairs, Proxy, Solution, Solver, Surroundings, ToolSpheres};
use bevy_clay::haptics::reference::bed::{Bed, square_tool};
use glam::{DQuat, DVec3, Vec3};
use rayon::prelude::*;
use std::hint::black_box;
use std::time::Instant;

/// Ticks of a drag at 50 mm/s.
const TICKS: usize = 200;
const DEPTH: f64 = 6e-3;
/// Gap up to which pairs are looked for \[m\].
const MARGIN: f64 = 4e-4;

/// A drag of 25 spheres: the problem of each tick, and what the proxy came to.
struct Drag {
    problems: Vec<(Pairs, DVec3)>,
    places: Vec<DVec3>,
    pivots: u32,
    /// Least gap of Eq. 7 over all pairs there are \[m\].
    gap: f64,
}

impl Drag {
    fn new(stiffness: f64) -> Self {
        let (bed, tool) = (Bed::new(7_777_777), square_tool(5, 1.5e-3, Bed::RADIUS));
        let mut proxy = Proxy::at(bed.above(&tool));
        let mut drag = Self { problems: vec![], places: vec![], pivots: 0, gap: f64::INFINITY };
        for tick in 0..TICKS {
            let (target, near) = (bed.drag(tick, DEPTH), bed.near(proxy.position));
            let mut pairs = Pairs::default();
            pairs.collect(&tool, proxy.position, DQuat::IDENTITY, &near, MARGIN);
            let about = Surroundings { tool: &tool, rotation: DQuat::IDENTITY, near: &near, outwards: DVec3::Y };
            let step = proxy.advance(target, DVec3::splat(stiffness), &about, Solver::ActiveSet);
            drag.pivots = drag.pivots.max(step.iterations);
            drag.gap = drag.gap.min(least_gap(&bed, &tool, proxy.position));
            drag.places.push(proxy.position);
            drag.problems.push((pairs, target));
        }
        drag
    }
}

fn least_gap(bed: &Bed, tool: &ToolSpheres, place: DVec3) -> f64 {
    let gaps = tool.spheres().iter().flat_map(|sphere| {
        let gap = move |p: &bevy_clay::haptics::model::NearParticle| {
            (place + sphere.centre).distance(Vec3::from_array(p.position).as_dvec3()) - sphere.radius - f64::from(p.radius)
        };
        bed.particles.iter().map(gap)
    });
    gaps.fold(f64::INFINITY, f64::min)
}

/// The solution by trying all sets of up to three planes.
fn by_trial(planes: &[Constraint], target: DVec3) -> DVec3 {
    let is_outside = |x: DVec3| planes.iter().all(|p| p.gap(x) > -1e-10);
    let mut best = if is_outside(target) { target } else { DVec3::INFINITY };
    let mut consider = |x: DVec3| {
        if x.is_finite() && x.distance(target) < best.distance(target) && is_outside(x) {
            best = x;
        }
    };
    let offset = |i: usize| -planes[i].gap(target);
    for i in 0..planes.len() {
        let n = planes[i].normal;
        consider(target + n * offset(i));
        for j in 0..i {
            let m = planes[j].normal;
            let line = n.cross(m);
            consider(target + (offset(i) * m.cross(line) + offset(j) * line.cross(n)) / line.length_squared());
            for k in 0..j {
                let l = planes[k].normal;
                let corner = offset(i) * m.cross(l) + offset(j) * l.cross(n) + offset(k) * n.cross(m);
                consider(target + corner / n.dot(m.cross(l)));
            }
        }
    }
    best
}

/// Against all sets by trial, at every tick of a drag or at some.
pub fn exactness(size: Size) -> Vec<Row> {
    let drag = Drag::new(500.0);
    let every = size.pick(40, 8, 1);
    let problems: Vec<usize> = (0..TICKS).step_by(every).collect();
    let error = |i: &usize| {
        let (pairs, target) = &drag.problems[*i];
        let found = ActiveSet::default().solve(pairs, DVec3::ONE, *target);
        if found.is_feasible { found.position.distance(by_trial(pairs.constraints(), *target)) } else { f64::INFINITY }
    };
    let error = problems.par_iter().map(error).reduce(|| 0.0, f64::max);
    let scales = [0.25, 4.0, 4096.0];
    let other = scales.iter().map(|scale| Drag::new(500.0 * scale).places);
    let changed: usize = other.map(|places| places.iter().zip(&drag.places).filter(|(a, b)| a != b).count()).sum();
    vec![
        Row::at_most("proxy: off the exact place", 1e9 * error, "nm", 1.0),
        Row::at_most("proxy: pivots", f64::from(drag.pivots), "-", 12.0),
        Row::at_least("proxy: least gap to the clay", 1e6 * drag.gap, "um", -1.0),
        Row::at_most("proxy: places changed by a scale of the stiffness", changed as f64, "-", 0.0),
    ]
}

/// Mean time of a solution \[us\], each tick's least of several rounds.
fn timed<S: Default>(drag: &Drag, mut solve: impl FnMut(&mut S, &Pairs, DVec3) -> Solution) -> f64 {
    let mut least = [f64::INFINITY; TICKS];
    for _ in 0..15 {
        let mut state = S::default();
        for ((pairs, target), least) in drag.problems.iter().zip(&mut least) {
            let began = Instant::now();
            black_box(solve(&mut state, pairs, *target));
            *least = least.min(1e6 * began.elapsed().as_secs_f64());
        }
    }
    least.iter().sum::<f64>() / TICKS as f64
}

/// The exact solver against the published one, both from where they ended the tick before.
pub fn times(_: Size) -> Vec<Row> {
    let drag = Drag::new(500.0);
    let pairs: usize = drag.problems.iter().map(|(pairs, _)| pairs.constraints().len()).sum();
    let exact = timed(&drag, |state: &mut ActiveSet, pairs, target| state.solve(pairs, DVec3::ONE, target));
    let swept = timed(&drag, |state: &mut Multipliers, pairs, target| state.solve(pairs, DVec3::ONE, target));
    vec![
        Row::figure("proxy, 25 spheres 6 mm deep: pairs", pairs as f64 / TICKS as f64, "-"),
        Row::figure("proxy, 25 spheres 6 mm deep: active set", exact, "us"),
        Row::figure("proxy, 25 spheres 6 mm deep: Gauss-Seidel, warm", swept, "us"),
        Row::at_least("proxy, 25 spheres 6 mm deep: faster by", swept / exact, "-", 5.0),
    ]
}
