//! A plate dragged over clay: friction as the law of contact has it.

use super::press::jitter_below;
use crate::lab::{DX, Lab, Mover, Size, block, room_with, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};
use std::f64::consts::PI;

/// Height of the block \[cells\], between a floor that holds it and the plate.
const HEIGHT: f64 = 3.0;

/// Frames over which the plate gets to its speed: eight periods of the block's shear.
const START: u32 = 20;

/// A wide plate is pressed on a block and dragged, from rest on: greatest error of what it feels along over
/// what it feels across against `mu`, in all frames at full speed. `damping` is over the critical one of the
/// block's lowest mode of shear.
fn dragged(mu: f64, damping: f64) -> f64 {
    let walls = Walls { low: [Wall::Separate, Wall::Stick, Wall::Separate], high: [Wall::Separate; 3] };
    let domain = room_with([20, 8, 12], walls);
    let mut particles = block(DVec3::new(4.0, 0.0, 3.0), IVec3::new(6, HEIGHT as i32, 6));
    jitter_below(&mut particles, 0.125, HEIGHT);
    let material = Preset::SoftClay.material();
    let mut lab = Lab::with_threads(&snapshot(domain, material, particles), stable_step(&material), 1);
    let shear_speed = (material.lame_mu() / material.density).sqrt();
    lab.plan.validation.damping = damping * PI * shear_speed / (HEIGHT * DX);
    let shape = ToolShape::Box { half_size: DVec3::new(14.0, 1.0, 8.0) };
    let contact = Contact::Separate { friction: mu };
    let mut mover = Mover::new(&domain, shape, contact, DVec3::new(7.0, HEIGHT + 1.05, 6.0), DQuat::IDENTITY);
    let speed = 0.002 * DX / lab.plan.dt;
    mover.velocity = DVec3::NEG_Y * 0.15 * speed;
    lab.frame_moving(400, &mut mover);
    let mut worst = 0.0f64;
    for i in 0..START + 30 {
        let part = (f64::from(i + 1) / f64::from(START)).min(1.0);
        mover.velocity = DVec3::X * speed * part * part * (3.0 - 2.0 * part);
        let felt = lab.frame_moving(40, &mut mover).tools[0].force;
        if i >= START {
            let off = (felt.x.hypot(felt.z) / felt.y / mu - 1.0).abs();
            worst = if off.is_nan() || worst.is_nan() { f64::NAN } else { worst.max(off) };
        }
    }
    worst
}

/// What a plate feels along over what it feels across is the friction.
///
/// From rest: a plate at full speed at once sets a block swinging, which nothing damps. With much friction
/// that of a block that is not damped is steady, but not stable: modes across and along feed each other
/// through Coulomb friction, whatever the stiffness of the contact (flutter; of this block in finite elements
/// with friction 0.6, a rigid contact and no damping, by 0.06 c_s / dx). It ends in waves of stick and slip,
/// under which the plate feels less than the friction, as between elastic half-spaces (Adams 1998, J. Appl.
/// Mech. 65:470) and under layers (Yastrebov 2016, arXiv 1507.07334).
pub fn sliding(size: Size) -> Vec<Row> {
    let all: &[(f64, f64)] = &[(0.1, 0.0), (0.3, 0.0), (0.6, 0.0), (0.6, 0.3)];
    let cases = size.pick(&all[1..2], all, all);
    let row = |(mu, damping): &(f64, f64)| {
        let damped = if *damping > 0.0 { ", damped" } else { "" };
        Row::at_most(
            format!("dragged plate, friction {mu}{damped}: F_t / F_n off it by"),
            100.0 * dragged(*mu, *damping),
            "%",
            0.5,
        )
    };
    cases.iter().map(row).collect()
}
