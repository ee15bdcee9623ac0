//! The clay law: Hencky elasticity with a von Mises yield stress.
//!
//! With `b_e = I + E` and `H = ln(b_e) / 2`, Kirchhoff stress is `tau = 2 mu H + lambda tr(H) I` and the energy per rest volume
//! `mu H : H + lambda tr(H)^2 / 2` (Hencky 1928; Neff, Eidel & Martin 2016, ARMA 222). Yield is `sqrt(3/2) |dev tau| <= sY`; the return
//! along the deviator is exact for this law, because `H` adds as small strains do, and keeps the volume (Simo 1992, CMAME 99).
//!
//! Logarithm and exponential are taken of the eigenvalues of `E` itself, by `ln_1p` and `exp_m1`: strains of 1e-12 keep all digits.

use super::super::material::ClayMaterial;
use glam::{DMat3, DVec3};

/// Least and greatest elastic stretch [-]; beyond, the strain is clamped and counted.
pub const STRETCH_RANGE: (f64, f64) = (0.05, 20.0);

/// A symmetric matrix by its eigenvalues and, as columns, its unit eigenvectors.
#[derive(Clone, Copy, Debug)]
pub struct Spectrum {
    /// Eigenvalues.
    pub values: DVec3,
    /// Eigenvectors.
    pub axes: DMat3,
}

impl Spectrum {
    /// Eigenvalues by cyclic Jacobi rotations, exact to rounding relative to the greatest.
    pub fn of(symmetric: DMat3) -> Self {
        const SWEEPS: usize = 12;
        let mut a = symmetric;
        let mut axes = DMat3::IDENTITY;
        let negligible = 1e-20 * a.to_cols_array().iter().fold(0.0, |most: f64, entry| most.max(entry.abs()));
        for _ in 0..SWEEPS {
            for (i, j) in [(0, 1), (0, 2), (1, 2)] {
                let off = a.col(j)[i];
                if off.abs() <= negligible {
                    continue;
                }
                // Tangent of the smaller angle that makes entry (i, j) vanish (Golub & Van Loan, 8.5).
                let theta = 0.5 * (a.col(j)[j] - a.col(i)[i]) / off;
                let tangent = theta.signum() / (theta.abs() + theta.hypot(1.0));
                let cosine = 1.0 / tangent.hypot(1.0);
                let sine = tangent * cosine;
                let mut rotation = DMat3::IDENTITY;
                rotation.col_mut(i)[i] = cosine;
                rotation.col_mut(j)[j] = cosine;
                rotation.col_mut(j)[i] = sine;
                rotation.col_mut(i)[j] = -sine;
                a = rotation.transpose() * a * rotation;
                axes *= rotation;
            }
        }
        Self { values: DVec3::new(a.x_axis.x, a.y_axis.y, a.z_axis.z), axes }
    }

    /// The matrix with the same axes and other eigenvalues.
    pub fn with(&self, values: DVec3) -> DMat3 {
        let matrix = self.axes * DMat3::from_diagonal(values) * self.axes.transpose();
        (matrix + matrix.transpose()) * 0.5
    }
}

/// Principal Hencky strains [-] `ln(1 + e) / 2` of the principal values `e` of `E`.
fn hencky(strain: DVec3) -> DVec3 {
    strain.map(|e| 0.5 * e.ln_1p())
}

/// Kirchhoff stress tau [Pa] of elastic strain `E = b_e - I`.
pub fn kirchhoff_stress(material: &ClayMaterial, elastic_strain: DMat3) -> DMat3 {
    let spectrum = Spectrum::of(elastic_strain);
    let h = hencky(spectrum.values);
    spectrum.with(2.0 * material.lame_mu() * h + material.lame_lambda() * h.element_sum())
}

/// Elastic energy per rest volume [J/m^3].
pub fn energy_density(material: &ClayMaterial, elastic_strain: DMat3) -> f64 {
    let h = hencky(Spectrum::of(elastic_strain).values);
    material.lame_mu() * h.length_squared() + 0.5 * material.lame_lambda() * h.element_sum().powi(2)
}

/// Volume ratio J [-].
pub fn volume_ratio(elastic_strain: DMat3) -> f64 {
    hencky(Spectrum::of(elastic_strain).values).element_sum().exp()
}

/// What a substep made of the elastic strain.
#[derive(Clone, Copy, Debug)]
pub struct Advanced {
    /// Elastic strain `E = b_e - I` [-].
    pub elastic_strain: DMat3,
    /// Equivalent plastic strain gained [-].
    pub plastic_strain: f64,
    /// Whether a stretch left [`STRETCH_RANGE`].
    pub is_clamped: bool,
}

/// Strains the clay by the displacement gradient `increment = h C` [-] and returns it to `yield_stress` [Pa]:
/// `b = (I + h C)(I + E)(I + h C)^T`; where the Hencky deviator `d` exceeds `y = sqrt(2/3) sY / (2 mu)`, `d *= y / |d|`.
pub fn advance(material: &ClayMaterial, yield_stress: f64, elastic_strain: DMat3, increment: DMat3) -> Advanced {
    // b - I expanded, so that the identity never swallows a small strain.
    let half = increment + increment * elastic_strain;
    let trial = elastic_strain + half + half.transpose() + increment * (DMat3::IDENTITY + elastic_strain) * increment.transpose();
    let spectrum = Spectrum::of(trial);

    let (low, high) = STRETCH_RANGE;
    let strain = spectrum.values.clamp(DVec3::splat(low * low - 1.0), DVec3::splat(high * high - 1.0));
    let is_clamped = strain != spectrum.values;

    let h = hencky(strain);
    let mean = h.element_sum() / 3.0;
    let deviator = h - mean;
    let norm = deviator.length();
    let limit = (2.0f64 / 3.0).sqrt() * yield_stress / (2.0 * material.lame_mu());
    if norm <= limit {
        let elastic_strain = if is_clamped { spectrum.with(strain) } else { trial };
        return Advanced { elastic_strain, plastic_strain: 0.0, is_clamped };
    }
    let returned = mean + deviator * (limit / norm);
    Advanced {
        elastic_strain: spectrum.with(returned.map(|h| (2.0 * h).exp_m1())),
        plastic_strain: (2.0f64 / 3.0).sqrt() * (norm - limit),
        is_clamped,
    }
}
