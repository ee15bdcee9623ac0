//! Homogeneous strain paths through the full step: the outer nodes of a block follow the path, the inner ones
//! are free and have to.
//!
//! The paths `F(t)` make velocity fields without inertia or body force, and homogeneous stress makes no
//! force: clay and nodes between the driven ones must follow, and every particle must have the stress of the
//! closed form.

use crate::lab::{DX, Lab, Size, block, elastic, place, room, set_velocity, snapshot, stable_step, wave_step, world};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use bevy_clay::sim::validation::AffineDrive;
use glam::{DMat3, DVec3, IVec3};

/// Substeps of a path.
const STEPS: u32 = 1000;

/// Half an edge of the box of free nodes [cells]: those up to 2 from its middle. Not on a node: there the
/// last bit would decide.
const FREE: f64 = 2.5;

/// A body under an affine drive, free near its middle.
struct Driven {
    lab: Lab,
    drive: AffineDrive,
}

impl Driven {
    /// `particles` about the middle of a room of `cells`, that start with the velocity gradient `gradient`
    /// [1/s].
    fn new(cells: [i32; 3], mut particles: Vec<Particle>, material: ClayMaterial, dt: f64, gradient: DMat3) -> Self {
        let domain = room(cells, Wall::Separate);
        let middle = middle(cells);
        for p in &mut particles {
            set_velocity(p, gradient * (place(p) - middle) * DX);
            p.affine = gradient.to_cols_array_2d().map(|c| c.map(|x| x as f32));
        }
        let free = [-FREE, FREE].map(|half| world(&domain, middle + half));
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

/// Middle of a room of `cells` [cells].
fn middle(cells: [i32; 3]) -> DVec3 {
    (IVec3::from_array(cells) / 2).as_dvec3()
}

/// A block of `size` cells in the middle of a room of `cells`.
fn centred(cells: [i32; 3], size: [i32; 3]) -> Vec<Particle> {
    let size = IVec3::from_array(size);
    block(middle(cells) - 0.5 * size.as_dvec3(), size)
}

/// The clay that comes within reach of the free nodes while it is sheared by `gamma`; every free node has all
/// its clay at all times.
fn sheared_clay(cells: [i32; 3], gamma: f64) -> Vec<Particle> {
    // The outermost free node is 2 cells from the middle and a particle's stencil reaches 1.5.
    const REACH: f64 = 3.6;
    let length = 2 * (REACH * (1.0 + gamma)).ceil() as i32;
    let mut particles = centred(cells, [length, 8, 8]);
    particles.retain(|p| {
        let at = place(p) - middle(cells);
        let (first, last) = (at.x.min(at.x + gamma * at.y), at.x.max(at.x + gamma * at.y));
        at.y.abs() < REACH && at.z.abs() < REACH && first < REACH && last > -REACH
    });
    particles
}

/// Kirchhoff stress 12 [Pa] of a particle sheared in its xy plane: `2 mu H` with the logarithm of the 2 x 2
/// block of `I + E` in closed form.
fn shear_stress(material: &ClayMaterial, p: &Particle) -> f64 {
    let [xx, yy, _, xy, _, _] = p.elastic_strain.map(f64::from);
    let (mean, radius) = (0.5 * (xx + yy), (0.25 * (xx - yy).powi(2) + xy * xy).sqrt());
    // (ln b_1 - ln b_2) / (b_1 - b_2) -> 1 / b for equal ones.
    let slope =
        if radius > 0.0 { ((mean + radius).ln_1p() - (mean - radius).ln_1p()) / (2.0 * radius) } else { 1.0 / (1.0 + mean) };
    material.lame_mu() * xy * slope
}

/// Shears a block by `gamma` in `steps` substeps; the greatest difference [Pa] of any particle's stress 12
/// from `exact(gamma)` over the path beyond the shear `from`.
fn shear_error(material: ClayMaterial, gamma: f64, steps: u32, dt: f64, from: f64, exact: &dyn Fn(f64) -> f64) -> f64 {
    const SAMPLES: u32 = 50;
    let rate = gamma / (f64::from(steps) * dt);
    let gradient = DMat3::from_cols(DVec3::ZERO, DVec3::X * rate, DVec3::ZERO);
    let cells = [2 * (4.0 * gamma).ceil() as i32 + 16, 16, 16];
    let mut driven = Driven::new(cells, sheared_clay(cells, gamma), material, dt, gradient);
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

/// Stress 12 [Pa] of von Mises clay in simple shear, exact: with `e_Y = sY / (2 sqrt3 mu)` it yields at
/// `g_Y = 2 sinh e_Y`; from then on `tau_12 = (sY / sqrt3) sin phi`,
/// `tau_11 - tau_22 = 2 (sY / sqrt3) cos phi` with `phi' = coth(2 e_Y) cos phi - 1`,
/// `phi(g_Y) = acos tanh e_Y`.
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

/// Greatest relative error of any particle's stress in an elastic stretch by `amount`. With free nodes only
/// for a small one: the particles' distance leaves half a cell, their sum in place of the integral makes
/// forces, and the stress varies, by 2e-4 of it at 2 %, growing with the third power.
fn stretch_error(amount: f64, is_free: bool) -> f64 {
    const FRAMES: u32 = 50;
    let material = elastic(0.3);
    let dt = wave_step(&material, 0.3);
    let cells = [24, 16, 16];
    // Each substep of a frame stretches by the same factor: the end is exact.
    let stretch = |frame: u32| 1.0 + amount * f64::from(frame) / f64::from(FRAMES);
    let factor = |frame: u32| ((stretch(frame + 1) / stretch(frame)).ln() * f64::from(FRAMES) / f64::from(STEPS)).exp_m1();
    let gradient = |frame: u32| DMat3::from_diagonal(DVec3::X * factor(frame) / dt);
    let mut driven = Driven::new(cells, centred(cells, [12, 8, 8]), material, dt, gradient(0));
    if !is_free {
        driven.drive.free = [driven.drive.about; 2];
    }
    for frame in 0..FRAMES {
        driven.frame(STEPS / FRAMES, gradient(frame));
    }
    let modulus = material.lame_lambda() + 2.0 * material.lame_mu();
    let exact = modulus * amount.ln_1p();
    driven.lab.particles().iter().map(|p| (axial_stress(&material, p) / exact - 1.0).abs()).fold(0.0, f64::max)
}

/// Elastic stretch and shear, and plastic shear, against their closed forms.
pub fn paths(size: Size) -> Vec<Row> {
    let free = elastic(0.3);
    let shear =
        shear_error(free, 1.0, STEPS, wave_step(&free, 0.3), 0.0, &|g| elastic_shear(&free, g)) / elastic_shear(&free, 1.0);
    let clay = Preset::SoftClay.material();
    let k = clay.shear_strength();
    let plastic =
        |steps| shear_error(clay, 4.0, steps, wave_step(&clay, 0.3), 0.0, &|g| plastic_shear(&clay, clay.yield_stress, g)) / k;
    let error = plastic(STEPS);
    let hardening = ClayMaterial { hardening_modulus: 0.1 * clay.young_modulus, ..clay };
    let (width, inertia, end) = size.pick((4, 0.008, Bar::ASKED.0), (4, 0.008, Bar::ASKED.0), (6, 0.002, 2.3));
    let bar = Bar { material: hardening, width, inertia }.stretched(end);
    let mut rows = vec![
        Row::at_most("full step: elastic stretch by 1 %", stretch_error(0.01, true), "relative", 1e-4),
        Row::at_most("full step: elastic stretch by 30 %, every node driven", stretch_error(0.3, false), "relative", 1e-4),
        Row::at_most("full step: elastic simple shear by 1", shear, "relative", 1e-4),
        Row::at_most("full step: plastic simple shear by 4", error, "of k", 2e-4),
        Row::at_most("full step: viscous steady shear, n = 0.3", creep_error(0.3), "relative", 1e-3),
        Row::at_most("full step: viscous steady shear, n = 1", creep_error(1.0), "relative", 1e-3),
        Row::at_most("full step: hardening stretch to 1.8, force", bar.error, "relative", Bar::ASKED.1),
    ];
    if size == Size::Full {
        rows.push(Row::at_least("full step: hardening stretch, force within 3 % up to", bar.reached, "stretch", Bar::ASKED.0));
        let ratio = error / plastic(10 * STEPS);
        rows.push(Row::at_least("full step: plastic shear, error over that of 10x the steps", ratio, "-", 8.0));
        rows.push(Row::at_most("full step: plastic shear, error over that of 10x the steps, at most", ratio, "-", 12.0));
    }
    rows
}

/// Herschel-Bulkley clay in steady simple shear: `tau_12 = (s / sqrt3) sech 2e`, `e = s / (2 sqrt3 mu)`,
/// `s = sY + eta a'^n`. Elastic strain rests, so all work is plastic: `s a' = tau_12 g'` and
/// `a' = (g' / sqrt3) sech 2e`, by iteration.
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

/// A hardening bar stretched along x: `tau = sY + E H / (E + H) (eps - sY / E)` of the axial Hencky strain
/// eps, with free sides.
struct Bar {
    material: ClayMaterial,
    /// Edge of its square section at rest [cells].
    width: i32,
    /// `rho V^2 / k` of the clay where the bar is let go, 10 cells from its middle, at the speed V.
    inertia: f64,
}

/// How well a bar's force follows the closed form.
struct BarForce {
    /// Greatest relative error to the acceptance stretch.
    error: f64,
    /// Stretch [-] to which the error was within its limit.
    reached: f64,
}

impl Bar {
    /// Stretch [-] to which the force must be right, and its relative error.
    const ASKED: (f64, f64) = (1.8, 0.03);
    /// Free nodes are closer than this to the middle [cells].
    const FREE: f64 = 10.5;

    /// Kirchhoff stress [Pa] at axial strain `strain`.
    fn stress(&self, strain: f64) -> f64 {
        let (e, h, yield_stress) = (self.material.young_modulus, self.material.hardening_modulus, self.material.yield_stress);
        (e * strain).min(yield_stress + e * h / (e + h) * (strain - yield_stress / e))
    }

    /// Strain of the sides.
    fn side(&self, strain: f64) -> f64 {
        let elastic = self.stress(strain) / self.material.young_modulus;
        -self.material.poisson_ratio * elastic - 0.5 * (strain - elastic)
    }

    /// Force [N] at axial strain `strain`.
    fn force(&self, strain: f64) -> f64 {
        (f64::from(self.width) * DX).powi(2) * self.stress(strain) / strain.exp()
    }

    /// Stretches the bar to `end`: its ends are driven as the closed form moves, 21 planes of nodes in the
    /// middle are free.
    fn stretched(&self, end: f64) -> BarForce {
        // Frames of equal strain, 200 to the acceptance stretch.
        let strain = Self::ASKED.0.ln() / 200.0;
        let speed = (self.inertia * self.material.shear_strength() / self.material.density).sqrt();
        let dt = stable_step(&self.material);
        let steps = (strain * 10.0 * DX / speed / dt).ceil() as u32;
        let gradient = |frame: u32| {
            let [before, after] = [frame, frame + 1].map(|frame| strain * f64::from(frame));
            let sides = self.side(after) - self.side(before);
            DMat3::from_diagonal(DVec3::new(strain, sides, sides) / (f64::from(steps) * dt))
        };
        // 3.5 cells of each end are driven from the start.
        let length = 28;
        let cells = [2 * (14.0 * end).ceil() as i32 + 8, self.width + 6, self.width + 6];
        let mut driven = Driven::new(cells, centred(cells, [length, self.width, self.width]), self.material, dt, gradient(0));
        let about = driven.drive.about;
        driven.drive.free = [-1.0, 1.0].map(|sign| about + sign * DVec3::new(Self::FREE * DX, 1.0, 1.0));
        let mut found = BarForce { error: 0.0, reached: 1.0 };
        for frame in 0..(end.ln() / strain).round() as u32 {
            let report = driven.frame(steps, gradient(frame));
            let reached = strain * f64::from(frame + 1);
            // From stretch 1.03 on: before, it is elastic or just yields, and waves ring.
            if reached < 0.03 {
                continue;
            }
            let error = self.force_error(&driven.lab.particles(), cells, self.force(reached));
            let error = if report.health.is_ok() && error.is_finite() { error } else { f64::INFINITY };
            if frame < 200 {
                found.error = found.error.max(error);
            }
            if error > Self::ASKED.1 {
                break;
            }
            found.reached = reached.exp();
        }
        found
    }

    /// Greatest relative difference from `exact` [N] of the force between any two planes of free nodes: what
    /// the upper nodes pull the lower ones with, the sum of `4 V tau_11 w (x_i - x_p) / dx^2`. At rest it is
    /// the same everywhere and that on the driven ends.
    ///
    /// The stress of a particle or the mean of some is not the force: with particles 0.9 cells apart, their
    /// sum in place of the integral waves along the bar with the beat of 9 cells between particles and nodes;
    /// strains by 0.035 (rms 0.025), stresses by 8 % (rms 6.6 %).
    fn force_error(&self, particles: &[Particle], cells: [i32; 3], exact: f64) -> f64 {
        // By the lower plane; clay stands at least 4 cells from the room's walls.
        let mut forces = vec![0.0; cells[0] as usize + 1];
        for p in particles {
            let x = place(p).x;
            let base = (x - 0.5).floor();
            let f = x - base;
            let pull = 4.0 * axial_stress(&self.material, p) * f64::from(p.rest_volume) / DX;
            let [middle, last] = [(0.75 - (f - 1.0).powi(2)) * (1.0 - f), 0.5 * (f - 0.5).powi(2) * (2.0 - f)];
            forces[base as usize] += pull * (middle + last);
            forces[base as usize + 1] += pull * last;
        }
        let is_free = |&(lower, _): &(usize, &f64)| (lower as f64 + 0.5 - middle(cells).x).abs() < Self::FREE;
        forces.iter().enumerate().filter(is_free).map(|(_, force)| (force / exact - 1.0).abs()).fold(0.0, f64::max)
    }
}

/// Kirchhoff stress 11 [Pa] of a particle stretched along the axes.
fn axial_stress(material: &ClayMaterial, p: &Particle) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|i| 0.5 * f64::from(p.elastic_strain[i]).ln_1p());
    2.0 * material.lame_mu() * x + material.lame_lambda() * (x + y + z)
}
