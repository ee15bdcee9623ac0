//! Scaled inertia: what it must not touch, and what it does to momentum.

use crate::lab::{self, DX, Mover, Size, block, place, room_with, snapshot};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};

/// Length of a frame \[s\].
const FRAME: f64 = 5e-3;

/// A cube's fall.
#[derive(Default)]
struct Fall {
    /// As the clay has it and by the book, on which it is so many cells long or less.
    way: [f64; 2],
    /// Frames of scaled inertia, and changes of the scale.
    scaled: u32,
    changes: u32,
    /// Greatest error of a frame's balance of momentum, and that of the whole run.
    worst: f64,
    whole: f64,
}

/// A ball presses a block at 10 mm/s; a cube beside it falls by 8 cells and lands. Frames as apps and scenes
/// plan them.
fn fall(inertia: InertiaScaling, duration: f64) -> Fall {
    let domain = room_with([24, 20, 12], Walls::default());
    let mut particles = block(DVec3::new(1.0, 0.0, 1.0), IVec3::new(10, 5, 10));
    let count = particles.len();
    particles.extend(block(DVec3::new(17.0, 8.0, 4.0), IVec3::splat(4)));
    (0..).zip(&mut particles).for_each(|(id, p)| p.id = id);
    let material = Preset::SoftClay.material();
    let clay = snapshot(domain, material, particles);
    let mut engine = lab::engine(0);
    engine.load(&clay).expect("the clay loads");
    let mut planner = Planner::new(&clay);
    let outputs = FrameOutputs { state: true, ..FrameOutputs::default() };
    let integrator = if lab::is_gpu() { IntegratorChoice::Explicit } else { IntegratorChoice::Auto };
    planner.policy = Policy { inertia, outputs, integrator, ..Policy::default() };
    let gravity = planner.policy.gravity;
    let radius = 4.0;
    let at = DVec3::new(6.0, 5.0 + radius, 6.0);
    let mut mover = Mover::new(&domain, ToolShape::Sphere { radius }, Contact::default(), at, DQuat::IDENTITY);
    mover.velocity = DVec3::NEG_Y * 0.01;
    let height = |particles: &[Particle]| {
        let cube = particles.iter().filter(|p| p.id as usize >= count);
        cube.map(|p| place(p).y).sum::<f64>() / (particles.len() - count) as f64
    };
    let start = height(&clay.particles);
    let (mut found, mut speed, mut by_book) = (Fall::default(), 0.0, 0.0);
    let (mut momentum, mut scale, mut scale_before) = (DVec3::ZERO, 0.0, 1.0);
    for _ in 0..(duration / FRAME) as u32 {
        let Decision::Run(plan) = planner.frame(&material, FRAME, &[mover.path(FRAME)]) else {
            unreachable!("no frame is under way")
        };
        engine.submit(plan).expect("a sound plan");
        planner.sent();
        let mut report = engine.wait().expect("the engine runs");
        planner.note(&mut report);
        assert!(report.health.is_ok(), "{}", report.health);
        // Steps of symplectic Euler, each with the speed at its end.
        by_book += speed * FRAME - 0.5 * gravity.y * FRAME * (FRAME + report.dt);
        speed -= gravity.y * FRAME;
        if by_book < 7.0 * DX {
            let now = height(&engine.state_deferred().expect("clay is loaded")().expect("a state").particles);
            found.way = [(start - now) * DX, by_book];
        }
        found.scaled += u32::from(report.density_scale > 1.0);
        found.changes += u32::from(report.density_scale != scale_before);
        scale_before = report.density_scale;
        found.worst = found.worst.max(report.balance_error());
        let on_tools: DVec3 = report.tools.iter().map(|t| t.impulse).sum();
        let given = report.gravity_impulse + report.wall_impulse + report.damping_impulse + report.unbalanced_impulse;
        momentum += given - on_tools + report.rescaled_momentum;
        scale += report.impulse_scale + report.rescaled_momentum.length();
        found.whole = (report.momentum - momentum).length() / (scale + report.momentum_scale);
    }
    found
}

/// What falls beside a press keeps g; once it has landed inertia is scaled, and each change of that is
/// accounted for.
pub fn beside_a_press(size: Size) -> Vec<Row> {
    let scaled = fall(InertiaScaling::Accurate, size.pick(0.25, 0.3, 0.5));
    let [way, by_book] = scaled.way;
    let limit = if lab::is_gpu() { 1e-5 } else { 1e-6 };
    // A run that never changed its scale proves nothing.
    let whole = if scaled.changes > 0 { scaled.whole } else { f64::NAN };
    vec![
        Row::at_most("cube falling beside a press: off g by", 100.0 * (way / by_book - 1.0).abs(), "%", 0.1),
        Row::at_least("the same: frames of scaled inertia", scaled.scaled.into(), "frames", 5.0),
        Row::at_most("the same: momentum balance of a frame", scaled.worst, "relative", limit),
        Row::at_most("the same: momentum balance over changes of scale", whole, "relative", limit),
    ]
}
