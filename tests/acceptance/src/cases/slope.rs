//! The upper half of a block on a cut that is a slope: it stays, or slides as friction has it.

use crate::lab::{Lab, Size, block, elastic, jitter, place, room_with, snapshot, stable_step, velocity};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use bevy_clay::sim::tool::CUT_FRICTION;
use glam::{DVec3, IVec3};

/// Gravity [m/s^2].
const GRAVITY: f64 = 9.81;
/// How long it is let go \[s\].
const TIME: f64 = 0.06;
/// Slopes below and above the friction's 26.6 degrees.
const STAYS: f64 = 25.0;
const SLIDES: f64 = 28.0;

/// Acceleration [m/s^2] down a slope of `angle`, whose fall is turned by `azimuth` from the grid [degrees],
/// of the clay over it.
fn acceleration(angle: f64, azimuth: f64) -> f64 {
    let walls = Walls { low: [Wall::Separate, Wall::Stick, Wall::Separate], high: [Wall::Separate; 3] };
    let domain = room_with([24, 20, 24], walls);
    let mut particles = block(DVec3::new(7.0, 0.0, 7.0), IVec3::splat(10));
    jitter(&mut particles, 0.1, 5);
    let (turned, level) = (azimuth.to_radians(), DVec3::Y);
    let out = DVec3::new(turned.cos(), 0.0, turned.sin());
    let (sin, cos) = angle.to_radians().sin_cos();
    let (normal, down) = (cos * level + sin * out, cos * out - sin * level);
    let height = |at: DVec3| (at - DVec3::new(12.0, 5.0, 12.0)).dot(normal);
    for p in &mut particles {
        let above = height(place(p));
        if above.abs() < 2.5 {
            p.tags[0] = Tag { sheet: 1, side: if above < 0.0 { -1 } else { 1 } };
        }
    }
    let is_over: Vec<bool> = particles.iter().map(|p| height(place(p)) > 0.0).collect();
    let material = ClayMaterial { weld: Weld::Off, ..elastic(0.3) };
    let mut lab = Lab::new(&snapshot(domain, material, particles), stable_step(&material));
    let frames = |time: f64, dt: f64| (time / dt / 40.0).round() as u32;
    // What bears is still, and sheared almost as far, before anything slides: a block that is let go swings.
    let before = (angle - 1.0).min(26.0).to_radians();
    lab.plan.gravity = GRAVITY * (before.sin() * down - before.cos() * normal);
    lab.plan.validation.damping = 300.0;
    (0..frames(0.05, lab.plan.dt)).for_each(|_| _ = lab.frame(40));
    lab.plan.validation.damping = 0.0;
    lab.plan.gravity = -GRAVITY * level;
    let speed = |lab: &Lab| {
        let all: Vec<f64> =
            lab.particles().iter().zip(&is_over).filter(|(_, over)| **over).map(|(p, _)| velocity(p).dot(down)).collect();
        all.iter().sum::<f64>() / all.len() as f64
    };
    let third = frames(TIME / 3.0, lab.plan.dt);
    let mut means = [0.0; 3];
    for mean in &mut means {
        for _ in 0..third {
            lab.frame(40);
            *mean += speed(&lab) / f64::from(third);
        }
    }
    (means[2] - means[1]) / (f64::from(third * 40) * lab.plan.dt)
}

/// A slope just below the angle of friction holds what lies on it; one just above lets it slide by
/// `g (sin - mu cos)`, whichever way it falls.
pub(super) fn slopes(size: Size) -> Vec<Row> {
    let azimuths = size.pick(&[30.0][..], &[30.0], &[0.0, 15.0, 30.0, 45.0]);
    let rows = |azimuth: &f64| {
        let (sin, cos) = SLIDES.to_radians().sin_cos();
        let slides = acceleration(SLIDES, *azimuth) / (GRAVITY * (sin - CUT_FRICTION * cos));
        let stays = acceleration(STAYS, *azimuth) / GRAVITY;
        let name = |angle: f64, what: &str| format!("cut with a slope of {angle} degrees, azimuth {azimuth}: {what}");
        [
            Row::at_most(name(SLIDES, "acceleration off g (sin - mu cos)"), 100.0 * (slides - 1.0).abs(), "%", 5.0),
            Row::at_most(name(STAYS, "acceleration"), 100.0 * stays.abs(), "% of g", 0.2),
        ]
    };
    azimuths.iter().flat_map(rows).collect()
}
