//! The clay law: Hencky elasticity with a von Mises yield stress.
//!
//! `b = (I + h C)(I + E)(I + h C)^T`; Hencky strain `H = ln b / 2`, deviator `d`; if
//! `|d| > y = sqrt(2/3) sY / (2 mu)` it is shortened to `d (1 - g / |d|)` where
//! `2 mu (|d| - y - g) = sqrt(2/3) (H_mod a + eta (a / h)^n)`, `a = sqrt(2/3) g` (Herschel-Bulkley, hardening
//! modulus H_mod; without both `d *= y / |d|`), hardening `+= a`, `E = exp(2 H) - I`.
//! `sY = sY0 (1 - s zeta) (1 - loss D) + H_mod hardening` with zeta of Eq. 5 and the working D; then
//! `1 - D *= exp(-rate a)`, `D *= exp(-h / rest_time)`: [`ClayMaterial`] has both. Eigenvalues of `b` are
//! clamped to `[STRETCH_MIN^2, STRETCH_MAX^2]` and counted.
//!
//! Kirchhoff stress is `tau = 2 mu H + lambda tr(H) I` and the energy per rest volume
//! `mu H : H + lambda tr(H)^2 / 2` (Hencky 1928; Neff, Eidel & Martin 2016, ARMA 222). Yield is
//! `sqrt(3/2) |dev tau| <= sY`; the return along the deviator is exact for this law, because `H` adds as
//! small strains do, and keeps the volume (Simo 1992, CMAME 99).
//!
//! Logarithm and exponential are taken of the eigenvalues of `E` itself, by `ln_1p` and `exp_m1`: strains of
//! 1e-12 keep all digits.

use super::super::limits::{STRETCH_MAX, STRETCH_MIN};
use super::super::material::{ClayMaterial, SQRT_2_3};
use glam::{DMat3, DVec3};

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
                (a.col_mut(i)[j], a.col_mut(j)[i]) = (0.0, 0.0);
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

/// Kirchhoff stress tau \[Pa\] of elastic strain `E = b_e - I`.
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

/// ln J [-].
pub fn log_volume_ratio(elastic_strain: DMat3) -> f64 {
    hencky(Spectrum::of(elastic_strain).values).element_sum()
}

/// Volume ratio J [-].
pub fn volume_ratio(elastic_strain: DMat3) -> f64 {
    log_volume_ratio(elastic_strain).exp()
}

/// What a substep made of the elastic strain.
#[derive(Clone, Copy, Debug)]
pub struct Advanced {
    /// Elastic strain `E = b_e - I` [-].
    pub elastic_strain: DMat3,
    /// Kirchhoff stress \[Pa\] with it.
    pub stress: DMat3,
    /// Equivalent plastic strain gained [-].
    pub plastic_strain: f64,
    /// Whether a stretch was beyond its limits and was clamped.
    pub is_clamped: bool,
}

/// Strains the clay by the displacement gradient `increment = h C` [-] in `dt` \[s\] and returns it to the flow
/// stress of `yield_stress` \[Pa\] (present: softened and hardened): `b = (I + h C)(I + E)(I + h C)^T`; where
/// the Hencky deviator `d` exceeds `y = sqrt(2/3) sY / (2 mu)`, it is shortened by [`flow`].
pub fn advance(material: &ClayMaterial, yield_stress: f64, dt: f64, elastic_strain: DMat3, increment: DMat3) -> Advanced {
    // b - I expanded, so that the identity never swallows a small strain.
    let half = increment + increment * elastic_strain;
    let trial = elastic_strain + half + half.transpose() + increment * (DMat3::IDENTITY + elastic_strain) * increment.transpose();
    let spectrum = Spectrum::of(trial);

    let [low, high] = [STRETCH_MIN, STRETCH_MAX].map(|stretch| DVec3::splat(stretch * stretch - 1.0));
    let strain = spectrum.values.clamp(low, high);
    let is_clamped = strain != spectrum.values;

    let h = hencky(strain);
    let mean = h.element_sum() / 3.0;
    let deviator = h - mean;
    let norm = deviator.length();
    let stress_of = |h: DVec3| spectrum.with(2.0 * material.lame_mu() * h + material.lame_lambda() * h.element_sum());
    let limit = SQRT_2_3 * yield_stress / (2.0 * material.lame_mu());
    if norm <= limit {
        let elastic_strain = if is_clamped { spectrum.with(strain) } else { trial };
        return Advanced { elastic_strain, stress: stress_of(h), plastic_strain: 0.0, is_clamped };
    }
    let shortened = flow(material, norm - limit, dt);
    let returned = mean + deviator * ((norm - shortened) / norm);
    Advanced {
        elastic_strain: spectrum.with(returned.map(|h| (2.0 * h).exp_m1())),
        stress: stress_of(returned),
        plastic_strain: SQRT_2_3 * shortened,
        is_clamped,
    }
}

/// By how much flow shortens a Hencky deviator that is `excess` [-] too long, in `dt` \[s\]: the g of
/// `2 mu (excess - g) = sqrt(2/3) (H a + eta (a / dt)^n)` with the plastic strain `a = sqrt(2/3) g`, by
/// bisection.
pub fn flow(material: &ClayMaterial, excess: f64, dt: f64) -> f64 {
    let resistance = |g: f64| {
        let plastic = SQRT_2_3 * g;
        let viscous = if material.viscosity > 0.0 { material.viscosity * (plastic / dt).powf(material.flow_index) } else { 0.0 };
        SQRT_2_3 * (material.hardening_modulus * plastic + viscous) / (2.0 * material.lame_mu())
    };
    let (mut low, mut high) = (0.0, excess);
    if resistance(high) == 0.0 {
        return excess;
    }
    // As often as halving changes an f64.
    while {
        let middle = 0.5 * (low + high);
        if middle + resistance(middle) > excess {
            high = middle;
        } else {
            low = middle;
        }
        high - low > 1e-15 * excess
    } {}
    0.5 * (low + high)
}

/// The elastic strain with `ln J` changed by `change`, its deviator kept: `b *= exp(2 change / 3)`.
pub fn dilated(elastic_strain: DMat3, change: f64) -> DMat3 {
    let grown = (2.0 * change / 3.0).exp_m1();
    elastic_strain + (elastic_strain + DMat3::IDENTITY) * grown
}

#[cfg(test)]
mod tests {
    use super::*;

    fn material(yield_stress: f64) -> ClayMaterial {
        ClayMaterial { young_modulus: 1e6, poisson_ratio: 0.45, yield_stress, ..ClayMaterial::default() }
    }

    /// `gamma` of simple shear in equal steps, and the stress after each.
    fn simple_shear(material: &ClayMaterial, gamma: f64, steps: u32) -> Vec<(f64, DMat3)> {
        let increment = DMat3::from_cols(DVec3::ZERO, DVec3::X * (gamma / f64::from(steps)), DVec3::ZERO);
        let mut strain = DMat3::ZERO;
        let mut path = Vec::new();
        for step in 1..=steps {
            strain = advance(material, material.yield_stress, 1.0, strain, increment).elastic_strain;
            path.push((gamma * f64::from(step) / f64::from(steps), kirchhoff_stress(material, strain)));
        }
        path
    }

    /// Elastic simple shear: `tau_12 = 4 mu asinh(g/2) / sqrt(4 + g^2)`, `tau_11 - tau_22 = g tau_12`.
    #[test]
    fn elastic_shear_follows_its_closed_form() {
        let material = material(f64::INFINITY);
        for (gamma, stress) in simple_shear(&material, 2.0, 400) {
            let expected = 4.0 * material.lame_mu() * (gamma / 2.0).asinh() / (4.0 + gamma * gamma).sqrt();
            let difference = stress.x_axis.x - stress.y_axis.y;
            assert!((stress.y_axis.x / expected - 1.0).abs() < 1e-12, "{gamma}: {} {expected}", stress.y_axis.x);
            assert!((difference / (gamma * expected) - 1.0).abs() < 1e-10, "{gamma}: {difference}");
        }
    }

    /// Plastic simple shear: past `g_Y = 2 sinh e_Y`, `e_Y = sY / (2 sqrt3 mu)`, the stress turns by
    /// `phi' = coth(2 e_Y) cos phi - 1` from `phi = acos tanh e_Y`, with `tau_12 = (sY / sqrt3) sin phi`.
    #[test]
    fn plastic_shear_follows_its_equation_at_first_order() {
        let material = material(3e5);
        let strength = material.shear_strength();
        let yield_strain = strength / (2.0 * material.lame_mu());
        let yield_shear = 2.0 * yield_strain.sinh();
        let rate = |phi: f64| phi.cos() / (2.0 * yield_strain).tanh() - 1.0;
        let worst = |steps: u32| {
            let (mut gamma, mut phi, mut error) = (yield_shear, yield_strain.tanh().acos(), 0f64);
            for (next, stress) in simple_shear(&material, 4.0, steps) {
                if next <= yield_shear {
                    continue;
                }
                // One Runge-Kutta step of fourth order to `next`.
                let h = next - gamma;
                let a = rate(phi);
                let b = rate(phi + 0.5 * h * a);
                let c = rate(phi + 0.5 * h * b);
                phi += h / 6.0 * (a + 2.0 * b + 2.0 * c + rate(phi + h * c));
                gamma = next;
                error = error.max((stress.y_axis.x / strength - phi.sin()).abs());
            }
            error
        };
        let (coarse, fine) = (worst(1000), worst(10_000));
        assert!(fine < 1e-4 && (coarse / fine).log10() > 0.9, "{coarse:e} {fine:e}");
    }

    /// Uniaxial stress with free sides: `tau = min(E eps, sY)`, and plastic strain is what the elastic strain
    /// leaves of it.
    #[test]
    fn uniaxial_stress_is_elastic_then_constant() {
        let material = material(3e4);
        let step = 0.3f64 / 60.0;
        let (mut strain, mut hardening) = (DMat3::ZERO, 0.0);
        for i in 1..=60 {
            let advanced = |lateral: f64| {
                let increment = DVec3::new(step.exp_m1(), lateral.exp_m1(), lateral.exp_m1());
                advance(&material, material.yield_stress, 1.0, strain, DMat3::from_diagonal(increment))
            };
            // The lateral stress grows with the lateral strain: bisect for none.
            let (mut low, mut high) = (-step, 0.0);
            for _ in 0..80 {
                let middle = 0.5 * (low + high);
                let lateral = kirchhoff_stress(&material, advanced(middle).elastic_strain).y_axis.y;
                if lateral > 0.0 { high = middle } else { low = middle }
            }
            let end = advanced(low);
            strain = end.elastic_strain;
            hardening += end.plastic_strain;
            let eps = step * f64::from(i);
            let expected = (material.young_modulus * eps).min(material.yield_stress);
            let stress = kirchhoff_stress(&material, strain).x_axis.x;
            assert!((stress / expected - 1.0).abs() < 1e-9, "{eps}: {stress} {expected}");
            assert!((hardening - (eps - expected / material.young_modulus)).abs() < 1e-9, "{eps}: {hardening}");
        }
    }

    /// A strain of 1e-12 keeps its digits: Hooke's law to 1e-11 relative, and the pure rotation of a strain
    /// keeps its energy.
    #[test]
    fn tiny_strain_follows_hooke() {
        let material = material(f64::INFINITY);
        let shear = DMat3::from_cols(DVec3::new(2e-12, 1e-12, 0.0), DVec3::new(1e-12, -1e-12, 0.0), DVec3::ZERO);
        let expected = shear * material.lame_mu() + DMat3::IDENTITY * (0.5e-12 * material.lame_lambda());
        let stress = kirchhoff_stress(&material, shear);
        assert!(stress.abs_diff_eq(expected, 1e-11 * 1e-12 * material.young_modulus), "{stress} {expected}");
    }

    /// The return map changes the deviator only, and a stretch beyond the range is clamped and told.
    #[test]
    fn return_keeps_volume_and_clamp_is_counted() {
        let material = material(3e4);
        let increment = DMat3::from_cols(DVec3::new(0.2, 0.1, 0.0), DVec3::new(0.3, -0.1, 0.05), DVec3::new(0.0, 0.2, 0.1));
        let update = advance(&material, material.yield_stress, 1.0, DMat3::ZERO, increment);
        let volume = (DMat3::IDENTITY + increment).determinant();
        assert!(update.plastic_strain > 0.0 && (volume_ratio(update.elastic_strain) - volume).abs() < 1e-12);
        let clamped = advance(&material, f64::INFINITY, 1.0, DMat3::ZERO, DMat3::from_diagonal(DVec3::new(29.0, 0.0, -0.99)));
        assert!(clamped.is_clamped, "{clamped:?}");
        assert!((volume_ratio(clamped.elastic_strain) - 20.0 * 0.05).abs() < 1e-12, "{clamped:?}");
    }
}
