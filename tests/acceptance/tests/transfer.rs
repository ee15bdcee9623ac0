//! What nodes do not see of the particles' velocities: kept, faded, and never made.

use bevy_clay::sim::oracle::Oracle;
use bevy_clay::sim::prelude::*;
use clay_acceptance::agreement::{CELL, block, plan, soft};
use glam::{DVec3, IVec3};

/// A free block whose particles go their own ways, of `sign` by their places in the cell, so that nodes see
/// little of it.
fn noisy(speed: f64) -> (Oracle, FramePlan) {
    let mut s = block(IVec3::new(8, 6, 7), 4.0, Walls::default(), soft());
    let p = FramePlan { gravity: DVec3::ZERO, ..plan(&s, 0.25, 20, vec![]) };
    for q in &mut s.particles {
        let sign = q.offset.iter().map(|x| if *x < 0.5 { -1.0 } else { 1.0 }).product::<f64>();
        let way = DVec3::new(1.0, -0.7, 0.4) + 0.3 * DVec3::new(0.2, 0.5, -0.9) * f64::from(q.id % 7);
        q.velocity = (sign * way * speed * CELL / p.dt).as_vec3().to_array();
    }
    (Oracle::new(&s), p)
}

/// Momentum and angular momentum are those of before, to rounding, whatever part of them nodes see.
#[test]
fn noise_keeps_momentum_and_angular_momentum() {
    let (mut oracle, plan) = noisy(0.02);
    let first = oracle.run(&FramePlan { steps: 1, ..plan.clone() });
    let last = oracle.run(&plan);
    let scale = last.momentum_scale.max(first.momentum_scale);
    assert!((last.momentum - first.momentum).length() < 1e-12 * scale, "{} {}", first.momentum, last.momentum);
    let turned = (last.angular_momentum - first.angular_momentum).length();
    assert!(turned < 1e-12 * scale * 10.0 * CELL, "{} {}", first.angular_momentum, last.angular_momentum);
}

/// What nodes do not see fades with time, by as much at any step.
#[test]
fn noise_fades_in_the_same_time_at_any_step() {
    let left = |refine: u32| {
        let (mut oracle, plan) = noisy(1e-4);
        let dt = plan.dt / f64::from(refine);
        let before = oracle.run(&FramePlan { dt: 1e-9 * dt, steps: 1, ..plan.clone() }).energies.kinetic;
        let after = oracle.run(&FramePlan { dt, steps: plan.steps * refine, ..plan.clone() });
        let shear_speed = (plan.material.lame_mu() / plan.material.density).sqrt();
        let time = plan.duration() * shear_speed / (1.2 * CELL);
        (after.energies.kinetic / before, (-2.0 * time).exp())
    };
    let [(coarse, faded), (fine, _)] = [1, 4].map(left);
    println!("left {coarse} {fine} of {faded}");
    assert!((coarse / faded - 1.0).abs() < 0.1 && (fine / coarse - 1.0).abs() < 0.02, "{coarse} {fine} {faded}");
}
