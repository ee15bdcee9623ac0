//! The clay law along homogeneous strain paths, through the whole substep.
//!
//! One particle with so much inertia that its stress does not move it: its velocity gradient L stays, and n
//! substeps make `F = (I + h L)^n`.

use crate::lab::{DX, Lab, Size, room, snapshot};
use crate::report::Row;
use bevy_clay::sim::prelude::*;
use glam::{DMat3, DVec3};

/// Substeps of a path.
const STEPS: u32 = 1000;

/// The particle after [`STEPS`] substeps of the strain increment `increment` = h L.
fn follow(yield_stress: f64, increment: DMat3) -> Particle {
    let material = ClayMaterial { density: 1e15, yield_stress, ..Preset::SoftClay.material() };
    let dt = 1e-4;
    let mut particle = Particle::at(DVec3::new(9.3, 9.6, 9.4), (DX.powi(3) / 8.0) as f32, 0);
    particle.affine = increment.to_cols_array_2d().map(|c| c.map(|x| (x / dt) as f32));
    let mut lab = Lab::with_threads(&snapshot(room([8; 3], Wall::Separate), material, vec![particle]), dt, 1);
    lab.frame(STEPS);
    lab.particles()[0]
}

/// I + E of a particle.
fn left_cauchy_green(p: &Particle) -> DMat3 {
    let [xx, yy, zz, xy, xz, yz] = p.elastic_strain.map(f64::from);
    DMat3::IDENTITY + DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz))
}

fn largest(m: DMat3) -> f64 {
    m.to_cols_array().iter().fold(0.0, |a: f64, x| a.max(x.abs()))
}

/// Elastic and plastic stretch and simple shear.
pub fn paths(_: Size) -> Vec<Row> {
    let mut rows = elastic_paths();
    rows.extend(plastic_stretch());
    rows.extend(plastic_shear());
    rows
}

fn elastic_paths() -> Vec<Row> {
    let n = f64::from(STEPS);
    let rate = 3e-4;
    let stretched = follow(f64::INFINITY, DMat3::from_diagonal(DVec3::X * rate));
    let hencky = 0.5 * f64::from(stretched.elastic_strain[0]).ln_1p();
    let gamma = 1.0;
    let shear = |g: f64| DMat3::from_cols(DVec3::X, DVec3::new(g, 1.0, 0.0), DVec3::Z);
    let sheared = follow(f64::INFINITY, shear(gamma / n) - DMat3::IDENTITY);
    let exact = shear(gamma) * shear(gamma).transpose();
    vec![
        Row::at_most("strain paths: elastic stretch", (hencky / (n * rate.ln_1p()) - 1.0).abs(), "relative", 1e-4),
        Row::at_most("strain paths: elastic simple shear", largest(left_cauchy_green(&sheared) - exact), "of b", 1e-4),
    ]
}

/// Axial stretch that keeps the volume but for a known swelling: the axial stress difference is the yield
/// stress.
fn plastic_stretch() -> Vec<Row> {
    let clay = Preset::SoftClay.material();
    let rate = 1e-3;
    let axes = DVec3::new(rate, -0.5 * rate, -0.5 * rate);
    let p = follow(clay.yield_stress, DMat3::from_diagonal(axes));
    let hencky = [0, 1, 2].map(|i| 0.5 * f64::from(p.elastic_strain[i]).ln_1p());
    let difference = 2.0 * clay.lame_mu() * (hencky[0] - hencky[1]);
    let volume = f64::from(STEPS) * (axes.x.ln_1p() + axes.y.ln_1p() + axes.z.ln_1p());
    // Plastic strain: the whole deviator of the path less its elastic part, as an equivalent strain.
    let path = f64::from(STEPS) * (axes.x.ln_1p() - axes.y.ln_1p()) * 2.0 / 3.0;
    let plastic = path - clay.yield_stress / (3.0 * clay.lame_mu());
    vec![
        Row::at_most("strain paths: plastic stretch, stress", (difference / clay.yield_stress - 1.0).abs(), "relative", 1e-4),
        Row::at_most("strain paths: plastic stretch, ln J", (hencky.iter().sum::<f64>() - volume).abs(), "-", 1e-5),
        Row::at_most(
            "strain paths: plastic stretch, plastic strain",
            (f64::from(p.hardening) / plastic - 1.0).abs(),
            "relative",
            1e-4,
        ),
    ]
}

/// Simple shear by 4: the shear stress is k, the volume stays, the plastic strain is (gamma - k / mu) /
/// sqrt 3.
fn plastic_shear() -> Vec<Row> {
    let clay = Preset::SoftClay.material();
    let gamma = 4.0;
    let increment = DMat3::from_cols(DVec3::ZERO, DVec3::X * gamma / f64::from(STEPS), DVec3::ZERO);
    let p = follow(clay.yield_stress, increment);
    let b = left_cauchy_green(&p);
    // |dev H| is small: ln b / 2 by its series to third order, error 1e-6 of it.
    let e = b - DMat3::IDENTITY;
    let hencky = (e - e * e * 0.5 + e * e * e / 3.0) * 0.5;
    let shear = 2.0 * clay.lame_mu() * hencky.y_axis.x;
    let plastic = (gamma - clay.shear_strength() / clay.lame_mu()) / 3f64.sqrt();
    vec![
        // Of the order of the strain increment over the yield strain, squared, and of the yield strain
        // itself, squared: 3e-4.
        Row::at_most("strain paths: plastic shear, stress", (shear / clay.shear_strength() - 1.0).abs(), "relative", 1e-3),
        Row::at_most("strain paths: plastic shear, ln J", (0.5 * b.determinant().ln()).abs(), "-", 1e-4),
        Row::at_most(
            "strain paths: plastic shear, plastic strain",
            (f64::from(p.hardening) / plastic - 1.0).abs(),
            "relative",
            1e-3,
        ),
    ]
}
