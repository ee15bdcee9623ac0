//! Homogeneous strain paths through the full step: the outer nodes of a block follow the path, the inner ones are free and have to.
//!
//! The paths `F(t)` make velocity fields without inertia or body force, and homogeneous stress makes no force: clay and nodes between
//! the driven ones must follow, and every particle must have the stress of the closed form.

use crate::lab::{DX, Lab, Size, block, elastic, place, room, set_velocity, snapshot, stable_step, wave_step, world};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use bevy_clay::sim::validation::AffineDrive;
use glam::{DMat3, DVec3, IVec3};

/// Substeps of a path.
const STEPS: u32 = 1000;

/// A block under an affine drive, free within 2 cells of its middle.
struct Driven {
    lab: Lab,
    drive: AffineDrive,
}

impl Driven {
    /// A block of `size` cells in a room of `cells`, that starts with the velocity gradient `gradient` [1/s].
    fn new(cells: [i32; 3], size: IVec3, material: ClayMaterial, dt: f64, gradient: DMat3) -> Self {
        let domain = room(cells, Wall::Separate);
        let middle = (IVec3::from_array(cells) / 2).as_dvec3();
        let mut particles = block(middle - 0.5 * size.as_dvec3(), size);
        for p in &mut particles {
            set_velocity(p, gradient * (place(p) - middle) * DX);
            p.affine = gradient.to_cols_array_2d().map(|c| c.map(|x| x as f32));
        }
        // Not on a node: there the last bit would decide.
        let free = [-2.5, 2.5].map(|half| world(&domain, middle + half));
        let drive = AffineDrive { gradient, about: world(&domain, middle), free };
        Self { lab: Lab::new(&snapshot(domain, material, particles), dt), drive }
    }

    /// Runs `steps` substeps at `gradient` [1/s].
    fn frame(&mut self, steps: u32, gradient: DMat3) -> FrameReport {
        self.drive.gradient = gradient;
        self.lab.plan.validation.affine_drive = Some(self.drive);
        self.lab.frame(steps)
    }
}

/// Kirchhoff stress 12 [Pa] of a particle sheared in its xy plane: `2 mu H` with the logarithm of the 2 x 2 block of `I + E` in closed form.
fn shear_stress(material: &ClayMaterial, p: &Particle) -> f64 {
    let [xx, yy, _, xy, _, _] = p.elastic_strain.map(f64::from);
    let (mean, radius) = (0.5 * (xx + yy), (0.25 * (xx - yy).powi(2) + xy * xy).sqrt());
    // (ln b_1 - ln b_2) / (b_1 - b_2) -> 1 / b for equal ones.
    let slope =
        if radius > 0.0 { ((mean + radius).ln_1p() - (mean - radius).ln_1p()) / (2.0 * radius) } else { 1.0 / (1.0 + mean) };
    material.lame_mu() * xy * slope
}

/// Shears a block by `gamma` in `steps` substeps; the greatest difference [Pa] of any particle's stress 12 from `exact(gamma)` over the path
/// beyond the shear `from`.
fn shear_error(material: ClayMaterial, gamma: f64, steps: u32, dt: f64, from: f64, exact: &dyn Fn(f64) -> f64) -> f64 {
    const SAMPLES: u32 = 50;
    let rate = gamma / (f64::from(steps) * dt);
    let gradient = DMat3::from_cols(DVec3::ZERO, DVec3::X * rate, DVec3::ZERO);
    // At the free box's top the block is shifted by 2.5 gamma: it must still reach beyond the box, with a particle's stencil.
    let half = (2.5 * gamma + 2.5 + 2.0).ceil() as i32;
    let room = half + (4.0 * gamma).ceil() as i32 + 4;
    let mut driven = Driven::new([2 * room, 16, 16], IVec3::new(2 * half, 8, 8), material, dt, gradient);
    let mut worst = 0.0f64;
    for sample in 1..=SAMPLES {
        let report = driven.frame(steps / SAMPLES, gradient);
        let reached = gamma * f64::from(sample) / f64::from(SAMPLES);
        if reached < from {
            continue;
        }
        let expected = exact(reached);
        let error = |p: &Particle| (shear_stress(&material, p) - expected).abs();
        let greatest = driven.lab.particles().iter().map(error).fold(0.0, f64::max);
        worst = if report.health.is_ok() { worst.max(greatest) } else { f64::NAN };
    }
    worst
}

/// Stress 12 [Pa] of elastic Hencky clay in simple shear.
fn elastic_shear(material: &ClayMaterial, gamma: f64) -> f64 {
    4.0 * material.lame_mu() * (0.5 * gamma).asinh() / (4.0 + gamma * gamma).sqrt()
}

/// Stress 12 [Pa] of von Mises clay in simple shear, exact: with `e_Y = sY / (2 sqrt3 mu)` it yields at `g_Y = 2 sinh e_Y`; from then on
/// `tau_12 = (sY / sqrt3) sin phi`, `tau_11 - tau_22 = 2 (sY / sqrt3) cos phi` with `phi' = coth(2 e_Y) cos phi - 1`, `phi(g_Y) = acos tanh e_Y`.
fn plastic_shear(material: &ClayMaterial, yield_stress: f64, gamma: f64) -> f64 {
    let strain = yield_stress / (2.0 * 3f64.sqrt() * material.lame_mu());
    let first = 2.0 * strain.sinh();
    if gamma <= first {
        return elastic_shear(material, gamma);
    }
    let slope = |phi: f64| phi.cos() / (2.0 * strain).tanh() - 1.0;
    // Runge and Kutta's fourth order in steps of 1/50 of the relaxation length 2 e_Y: error below 1e-9.
    let count = ((gamma - first) / (2.0 * strain) * 50.0).ceil().max(1.0);
    let h = (gamma - first) / count;
    let mut phi = strain.tanh().acos();
    for _ in 0..count as u32 {
        let a = slope(phi);
        let b = slope(phi + 0.5 * h * a);
        let c = slope(phi + 0.5 * h * b);
        let d = slope(phi + h * c);
        phi += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
    }
    yield_stress / 3f64.sqrt() * phi.sin()
}

/// Greatest relative error of any particle's stress in an elastic stretch by `amount`. With free nodes only for a small one: the particles' distance leaves
/// half a cell, their sum in place of the integral makes forces, and the stress varies, by 2e-4 of it at 2 %, growing with the third power.
fn stretch_error(amount: f64, is_free: bool) -> f64 {
    let material = elastic(0.3);
    let dt = wave_step(&material, 0.3);
    let rate = amount / (f64::from(STEPS) * dt);
    let mut driven = Driven::new([24, 16, 16], IVec3::new(12, 8, 8), material, dt, DMat3::from_diagonal(DVec3::X * rate));
    if !is_free {
        driven.drive.free = [driven.drive.about; 2];
    }
    for step in 0..STEPS {
        // `F = I + t F'` has the gradient `F' F^-1`.
        let stretch = 1.0 + rate * dt * f64::from(step);
        driven.frame(1, DMat3::from_diagonal(DVec3::X * rate / stretch));
    }
    let modulus = material.lame_lambda() + 2.0 * material.lame_mu();
    let exact = modulus * amount.ln_1p();
    driven.lab.particles().iter().map(|p| (axial_stress(&material, p) / exact - 1.0).abs()).fold(0.0, f64::max)
}

/// Elastic stretch and shear, and plastic shear, against their closed forms.
pub(crate) fn paths(size: Size) -> Vec<Row> {
    let free = elastic(0.3);
    let shear =
        shear_error(free, 1.0, STEPS, wave_step(&free, 0.3), 0.0, &|g| elastic_shear(&free, g)) / elastic_shear(&free, 1.0);
    let clay = Preset::SoftClay.material();
    let k = clay.shear_strength();
    let plastic =
        |steps| shear_error(clay, 4.0, steps, wave_step(&clay, 0.3), 0.0, &|g| plastic_shear(&clay, clay.yield_stress, g)) / k;
    let error = plastic(STEPS);
    let mut rows = vec![
        Row::at_most("full step: elastic stretch by 1 %", stretch_error(0.01, true), "relative", 1e-4),
        Row::at_most("full step: elastic stretch by 30 %, every node driven", stretch_error(0.3, false), "relative", 1e-4),
        Row::at_most("full step: elastic simple shear by 1", shear, "relative", 1e-4),
        Row::at_most("full step: plastic simple shear by 4", error, "of k", 2e-4),
        Row::at_most("full step: viscous steady shear, n = 0.3", creep_error(0.3), "relative", 1e-3),
        Row::at_most("full step: viscous steady shear, n = 1", creep_error(1.0), "relative", 1e-3),
        Row::at_most("full step: hardening stretch to 1.8, force", hardening_error(), "relative", 0.03),
    ];
    if size == Size::Full {
        let ratio = error / plastic(10 * STEPS);
        rows.push(Row::at_least("full step: plastic shear, error over that of 10x the steps", ratio, "-", 8.0));
        rows.push(Row::at_most("full step: plastic shear, error over that of 10x the steps, at most", ratio, "-", 12.0));
    }
    rows
}

/// Herschel-Bulkley clay in steady simple shear: `tau_12 = (s / sqrt3) sech 2e`, `e = s / (2 sqrt3 mu)`, `s = sY + eta a'^n`. Elastic strain rests, so all
/// work is plastic: `s a' = tau_12 g'` and `a' = (g' / sqrt3) sech 2e`, by iteration.
fn creep_error(flow_index: f64) -> f64 {
    let clay = Preset::SoftClay.material();
    let (dt, gamma) = (wave_step(&clay, 0.3), 4.0);
    let rate = gamma / (f64::from(STEPS) * dt);
    // Half the yield stress again.
    let viscosity = 0.5 * clay.yield_stress / (rate / 3f64.sqrt()).powf(flow_index);
    let sech = |stress: f64| 1.0 / (stress / (3f64.sqrt() * clay.lame_mu())).cosh();
    let next = |stress: f64| clay.yield_stress + viscosity * (rate / 3f64.sqrt() * sech(stress)).powf(flow_index);
    let stress = (0..20).fold(1.5 * clay.yield_stress, |stress, _| next(stress));
    let steady = stress / 3f64.sqrt() * sech(stress);
    let clay = ClayMaterial { viscosity, flow_index, ..clay };
    shear_error(clay, gamma, STEPS, dt, 3.0, &|_| steady) / steady
}

/// Greatest relative error of the force on a hardening bar stretched to 1.8, `tau = sY + E H / (E + H) (eps - sY / E)`: its ends are driven as the closed form
/// moves, the middle 20 cells are free, with free sides.
fn hardening_error() -> f64 {
    const END: f64 = 1.8;
    const FRAMES: u32 = 200;
    let clay = Preset::SoftClay.material();
    let material = ClayMaterial { hardening_modulus: 0.1 * clay.young_modulus, ..clay };
    let (e, h) = (material.young_modulus, material.hardening_modulus);
    let tau = |strain: f64| (e * strain).min(clay.yield_stress + e * h / (e + h) * (strain - clay.yield_stress / e));
    let side = |strain: f64| -material.poisson_ratio * tau(strain) / e - 0.5 * (strain - tau(strain) / e);
    // rho V^2 / k = 0.002 where the bar is let go, 10 cells from its middle.
    let speed = (0.002 * clay.shear_strength() / clay.density).sqrt();
    let dt = stable_step(&material);
    let steps = (END.ln() * 10.0 * DX / speed / dt / f64::from(FRAMES)).ceil() as u32;
    let time = f64::from(steps) * dt;
    let at = |frame: u32| END.ln() * f64::from(frame) / f64::from(FRAMES);
    let gradient = |frame: u32| {
        let sides = (side(at(frame + 1)) - side(at(frame))) / time;
        DMat3::from_diagonal(DVec3::new((at(frame + 1) - at(frame)) / time, sides, sides))
    };
    let mut driven = Driven::new([80, 12, 12], IVec3::new(40, 6, 6), material, dt, gradient(0));
    let about = driven.drive.about;
    driven.drive.free = [-1.0, 1.0].map(|sign| about + sign * DVec3::new(10.5 * DX, 1.0, 1.0));
    let mut worst = 0.0f64;
    for frame in 0..FRAMES {
        let report = driven.frame(steps, gradient(frame));
        let particles = driven.lab.particles();
        let middle: Vec<f64> =
            particles.iter().filter(|p| (place(p).x - 40.0).abs() < 5.0).map(|p| axial_stress(&material, p)).collect();
        let mean = middle.iter().sum::<f64>() / middle.len() as f64;
        // From stretch 1.03 on: before, it is elastic or just yields, and waves ring.
        if at(frame + 1) > 0.03 {
            let error = (mean / tau(at(frame + 1)) - 1.0).abs();
            worst = if report.health.is_ok() && error.is_finite() { worst.max(error) } else { f64::NAN };
        }
    }
    worst
}

/// Kirchhoff stress 11 [Pa] of a particle stretched along the axes.
fn axial_stress(material: &ClayMaterial, p: &Particle) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|i| 0.5 * f64::from(p.elastic_strain[i]).ln_1p());
    2.0 * material.lame_mu() * x + material.lame_lambda() * (x + y + z)
}
