//! Cost of the loop of force: 25 spheres dragged 6 mm deep through a bed of spheres at 50 mm/s, the solvers
//! of Eq. 6 on the same 200 problems, each from where it ended the one before, and a whole tick of each
//! mode.
//!
//! `cargo bench --no-default-features --features reference --bench haptics`. Times are of one thread, the
//! least of several rounds: another program's time is not counted in.
#![expect(clippy::print_stdout, reason = "a benchmark prints its figures")]

use bevy_clay::haptics::device::DeviceState;
use bevy_clay::haptics::model::{ContactModel, NearParticle};
use bevy_clay::haptics::proxy::{ActiveSet, Multipliers, Pairs, Proxy, Solution, Solver, Surroundings, ToolSpheres};
use bevy_clay::haptics::reference::bed::{Bed, square_tool};
use bevy_clay::haptics::servo::{ForceLoop, Mode, ServoSettings};
use glam::{DMat3, DQuat, DVec3};
use std::hint::black_box;
use std::time::Instant;

/// Ticks of a drag, and rounds of it.
const TICKS: usize = 200;
const ROUNDS: usize = 15;
/// How far pairs are looked for \[m\].
const MARGIN: f64 = 4e-4;
/// \[m\]
const DEPTH: f64 = 6e-3;
/// Ticks between two clay frames.
const FRAME: usize = 11;

/// The problems of a drag.
fn problems(bed: &Bed, tool: &ToolSpheres) -> Vec<(Pairs, DVec3)> {
    let mut proxy = Proxy::at(bed.above(tool));
    let problem = |tick: usize| {
        let target = bed.drag(tick, DEPTH);
        let near = bed.near(proxy.position);
        let about = Surroundings { tool, rotation: DQuat::IDENTITY, near: &near, outwards: DVec3::Y };
        let mut pairs = Pairs::default();
        pairs.collect(tool, proxy.position, DQuat::IDENTITY, &near, MARGIN);
        proxy.advance(target, DVec3::ONE, &about, Solver::ActiveSet);
        (pairs, target)
    };
    (0..TICKS).map(problem).collect()
}

/// Mean and greatest time of a call \[us\], each call's least of all rounds, and iterations: mean, greatest.
fn timed<S>(start: impl Fn() -> S, mut call: impl FnMut(&mut S, usize) -> u32) -> [f64; 4] {
    let mut least = [f64::INFINITY; TICKS];
    let mut iterations = [0; TICKS];
    for _ in 0..ROUNDS {
        let mut state = start();
        for tick in 0..TICKS {
            let began = Instant::now();
            iterations[tick] = call(&mut state, tick);
            least[tick] = least[tick].min(1e6 * began.elapsed().as_secs_f64());
        }
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let counts = iterations.map(f64::from);
    [mean(&least), least.iter().copied().fold(0.0, f64::max), mean(&counts), counts.iter().copied().fold(0.0, f64::max)]
}

fn say(name: &str, [mean, most, iterations, iterations_max]: [f64; 4]) {
    println!("{name:36} {mean:8.2} us mean {most:8.2} us most   {iterations:7.1} iterations mean {iterations_max:6} most");
}

fn main() {
    let (bed, tool) = (Bed::new(7_777_777), square_tool(5, 1.5e-3, Bed::RADIUS));
    let problems = problems(&bed, &tool);
    let pairs: usize = problems.iter().map(|(pairs, _)| pairs.constraints().len()).sum();
    println!("25 spheres, {:.0} pairs on average, {} mm deep", pairs as f64 / TICKS as f64, 1e3 * DEPTH);
    let warm = timed(Multipliers::default, |state, i| solved(state.solve(&problems[i].0, DVec3::ONE, problems[i].1)));
    let cold = timed(|| (), |(), i| solved(Multipliers::default().solve(&problems[i].0, DVec3::ONE, problems[i].1)));
    let exact = timed(ActiveSet::default, |state, i| solved(state.solve(&problems[i].0, DVec3::ONE, problems[i].1)));
    say("projected Gauss-Seidel, cold", cold);
    say("projected Gauss-Seidel, warm", warm);
    say("active set, warm", exact);
    println!("active set faster than warm Gauss-Seidel by {:.1}", warm[0] / exact[0]);
    for mode in [Mode::PaperAnchor { relaxes: false }, Mode::GodObject, Mode::ContactImpulse, Mode::Coupled] {
        say(&format!("tick, {mode:?}"), ticks(&bed, &tool, mode));
    }
}

fn solved(solution: Solution) -> u32 {
    black_box(solution.position);
    solution.iterations
}

/// Whole ticks of a servo, a clay frame every 11 of them.
fn ticks(bed: &Bed, tool: &ToolSpheres, mode: Mode) -> [f64; 4] {
    let models: Vec<ContactModel> = (0..TICKS).step_by(FRAME).map(|tick| model(bed, tick)).collect();
    let settings = ServoSettings { mode, tool: *tool, ..ServoSettings::default() };
    timed(
        || ForceLoop::new(settings),
        |force, tick| {
            if tick % FRAME == 0 {
                force.receive(&models[tick / FRAME]);
            }
            let position = bed.drag(tick, DEPTH);
            let sample = force.step(&state(tick, position), 1e-3);
            black_box(sample.hand_force);
            sample.iterations
        },
    )
}

fn state(tick: usize, position: DVec3) -> DeviceState {
    DeviceState {
        time: tick as f64 * 1e-3,
        position,
        rotation: DQuat::IDENTITY,
        velocity: DVec3::ZERO,
        buttons: 0,
        motor_temperature: 0.0,
        is_muted: false,
    }
}

/// A frame of a bed that the tool has pressed on, as it is at a tick.
fn model(bed: &Bed, tick: usize) -> ContactModel {
    let place = bed.drag(tick, 0.0);
    let near: Vec<NearParticle> = bed.near(place);
    let mut model = ContactModel {
        frame: tick as u64 + 1,
        rate: 1.0,
        position: place,
        normal: DVec3::Y,
        stiffness: DMat3::from_diagonal(DVec3::splat(1000.0)),
        yield_force: 1.0,
        friction: 0.3,
        density: 1.0,
        near_count: near.len() as u32,
        ..ContactModel::NONE
    };
    model.near[..near.len()].copy_from_slice(&near);
    model
}
