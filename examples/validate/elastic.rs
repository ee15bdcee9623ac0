//! Elastic clay against closed forms: the first axial mode of a free bar, a column under its own weight.

use crate::lab::{self, DX, Lab, Size, block, elastic, place, room, set_velocity, snapshot, wave_step};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use glam::{DVec3, IVec3};
use std::f64::consts::PI;

/// Relative frequency error and damping ratio of the first axial mode of a free bar of `cells` x 4 x 4 cells, nu = 0: `f = c / (2 L)`.
fn vibrate(cells: i32) -> (f64, f64) {
    let material = elastic(0.0);
    let c = material.wave_speed(material.density);
    let dt = wave_step(&material, 0.4);
    let length = f64::from(cells) * DX;
    let mut particles = block(DVec3::new(4.0, 4.0, 4.0), IVec3::new(cells, 4, 4));
    let along = |p: &Particle| (place(p).x - 4.0) * DX;
    let mode: Vec<f64> = particles.iter().map(|p| (PI * along(p) / length).cos()).collect();
    for p in &mut particles {
        let x = PI * along(p) / length;
        set_velocity(p, DVec3::X * 1e-3 * c * x.cos());
        p.affine[0][0] = (-1e-3 * c * PI / length * x.sin()) as f32;
    }
    let count = particles.len() as f64;
    let mut lab = Lab::new(&snapshot(room([cells + 8, 12, 12], Wall::Separate), material, particles), dt);
    let period = 2.0 * length / c;
    let steps = (5.0 * period / dt) as usize;
    let amplitude: Vec<f64> = (0..steps)
        .map(|_| {
            lab.frame(1);
            let sum: f64 = lab.particles().iter().zip(&mode).map(|(p, m)| f64::from(p.velocity[0]) * m).sum();
            2.0 * sum / count
        })
        .collect();
    (period / measured_period(&amplitude, dt) - 1.0, damping_ratio(&amplitude, dt, period))
}

/// Twice the mean distance of the zero crossings.
fn measured_period(amplitude: &[f64], dt: f64) -> f64 {
    let crossing = |(i, w): (usize, &[f64])| (w[0] * w[1] < 0.0).then(|| dt * (i as f64 + 1.0 + w[0] / (w[0] - w[1])));
    let crossings: Vec<f64> = amplitude.windows(2).enumerate().filter_map(crossing).collect();
    match crossings[..] {
        [first, .., last] => 2.0 * (last - first) / (crossings.len() - 1) as f64,
        _ => f64::NAN,
    }
}

/// Decay of the greatest amplitude about each half period, over pi.
fn damping_ratio(amplitude: &[f64], dt: f64, period: f64) -> f64 {
    let peak = |j: u32| {
        let centre = f64::from(j) * period / 2.0;
        let near = |(i, a): (usize, &f64)| (((i + 1) as f64 * dt - centre).abs() < period / 4.0).then_some(a.abs());
        amplitude.iter().enumerate().filter_map(near).fold(0.0, f64::max)
    };
    let last = 9;
    -(peak(last) / peak(1)).ln() / f64::from(last - 1) / PI
}

/// The bar at two or three resolutions. Limits at 32 cells; at 16 they are those times 4 (order 2) and 8 (order 3). The order is that from the coarsest
/// to the finest.
pub(crate) fn bar(size: Size) -> Vec<Row> {
    let lengths: &[i32] = size.pick(&[8, 16], &[8, 16], &[16, 32, 64]);
    let found: Vec<(i32, f64, f64)> = lengths
        .iter()
        .map(|&n| {
            let (frequency, damping) = vibrate(n);
            (n, frequency, damping)
        })
        .collect();
    let [coarsest, judged, ..] = found[..] else { return vec![] };
    let finest = found[found.len() - 1];
    let (frequency_limit, damping_limit) = if judged.0 == 32 { (0.15, 0.01) } else { (0.6, 0.08) };
    let name = |what: &str| format!("bar of {} cells: {what}", judged.0);
    let order = (coarsest.1 / finest.1).abs().ln() / f64::from(finest.0 / coarsest.0).ln();
    vec![
        Row::at_most(name("frequency error"), 100.0 * judged.1.abs(), "%", frequency_limit),
        Row::at_most(name("damping ratio"), 100.0 * judged.2.abs(), "%", damping_limit),
        Row::at_least(format!("bar of {} to {} cells: order of the frequency", coarsest.0, finest.0), order, "-", 1.8),
    ]
}

/// Stretch l of confined Hencky clay under `load` [Pa]: `M ln(l) / l = -load`, by Newton.
fn stretch(modulus: f64, load: f64) -> f64 {
    (0..50).fold(1.0, |l: f64, _| l - (modulus * l.ln() / l + load) / (modulus * (1.0 - l.ln()) / (l * l)))
}

/// Relative L2 errors of displacement and stress of a column of 4 x `cells` x 4 cells between slip walls on a slip floor, under gravity that grows and
/// stays; with clamped walls in place of mirrors if `is_clamped`.
fn self_weight(cells: i32, is_clamped: bool) -> (f64, f64) {
    let height = f64::from(cells) * DX;
    // As in the reference computation: rho g H / M = 0.0147.
    let material = ClayMaterial { density: 1500.0, young_modulus: 1500.0 * 9.81 * height / 0.0147, ..elastic(0.0) };
    let modulus = material.lame_lambda() + 2.0 * material.lame_mu();
    let wave = material.wave_speed(material.density);
    let particles = block(DVec3::ZERO, IVec3::new(4, cells, 4));
    let rest: Vec<f64> = particles.iter().map(|p| place(p).y * DX).collect();
    let mut lab = Lab::new(&snapshot(room([4, cells + 4, 4], Wall::Slip), material, particles), wave_step(&material, 0.4));
    lab.plan.validation.damping = 1.4 * PI / 2.0 * wave / height;
    lab.plan.validation.clamped_walls = is_clamped;
    let (frames, steps) = (100, (60.0 * height / wave / lab.plan.dt / 100.0) as u32);
    for frame in 0..frames {
        lab.plan.gravity.y = -9.81 * (f64::from(frame + 1) / 40.0).min(1.0);
        lab.frame(steps);
    }
    let (mut du, mut uu, mut ds, mut ss) = (0.0, 0.0, 0.0, 0.0);
    let load = |x: f64| material.density * 9.81 * (height - x);
    for (p, &x) in lab.particles().iter().zip(&rest) {
        // Displacement: the integral of l - 1 by the midpoint rule on 200 pieces; error 1e-6 of it.
        let piece = |i: i32| stretch(modulus, load(x * (f64::from(i) + 0.5) / 200.0)) - 1.0;
        let u = (0..200).map(piece).sum::<f64>() * x / 200.0;
        let stress = modulus * stretch(modulus, load(x)).ln();
        let found = modulus * 0.5 * f64::from(p.elastic_strain[1]).ln_1p();
        du += (place(p).y * DX - x - u).powi(2);
        uu += u * u;
        ds += (found - stress).powi(2);
        ss += stress * stress;
    }
    ((du / uu).sqrt(), (ds / ss).sqrt())
}

/// The column against its closed form, and clamped walls as the negative control: they have to be told from mirrors.
pub(crate) fn column(size: Size) -> Vec<Row> {
    let cells: i32 = size.pick(8, 16, 32);
    let (displacement, stress) = self_weight(cells, false);
    // Reference computation, f64 in the plane: 7.8e-4 and 1.1e-2 at 16 cells, 9.6e-4 and 2.2e-2 at 8; half as much again is let pass.
    let (u_limit, stress_limit) = size.pick((1.44e-3, 3.3e-2), (1.17e-3, 1.65e-2), (1e-3, 1e-2));
    let name = |what: &str| format!("column of {cells} cells: {what}");
    let mut rows = vec![
        Row::at_most(name("displacement"), displacement, "relative L2", u_limit),
        Row::at_most(name("stress"), stress, "relative L2", stress_limit),
    ];
    if !lab::is_gpu() {
        let clamped = self_weight(cells, true);
        rows.push(Row::at_least(name("displacement, clamped over mirrored error"), clamped.0 / displacement, "-", 5.0));
        rows.push(Row::at_least(name("stress, clamped over mirrored error"), clamped.1 / stress, "-", 5.0));
    }
    rows
}
