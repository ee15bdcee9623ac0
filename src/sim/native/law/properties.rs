//! What the law of eight particles keeps for every state, by series and by eigenvalues alike.

use super::super::super::oracle::law::Spectrum;
use super::*;
use glam::{DMat3, DQuat, DVec3};
use proptest::prelude::*;

const LAW: Law = Law { mu2: 0.02, lambda: 0.09 };

/// Eight times the same particle through the law.
fn step(increment: DMat3, elastic: DMat3, yield_norm: f32) -> Update {
    let l = increment.to_cols_array_2d().map(|c| c.map(|v| F8::splat(v as f32)));
    update(&LAW, &ELASTIC, &l, &eight(elastic), F8::splat(yield_norm))
}

/// The strain of a Hencky strain by eigenvalues, after no step at all.
fn unstrained(x: DMat3) -> Exact {
    by_eigenvalues(&LAW, &ELASTIC, lane(&eight(x), 0), f32::INFINITY)
}

fn eight(m: DMat3) -> Sym8 {
    [m.x_axis.x, m.y_axis.y, m.z_axis.z, m.x_axis.y, m.x_axis.z, m.y_axis.z].map(|v| F8::splat(v as f32))
}

/// The seventh lane: all are the same.
fn matrix_of(s: &Sym8) -> DMat3 {
    let [xx, yy, zz, xy, xz, yz] = lane(s, 6).map(f64::from);
    DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz))
}

fn hencky_of(elastic: DMat3) -> DMat3 {
    let spectrum = Spectrum::of(elastic);
    spectrum.with(spectrum.values.map(|e| 0.5 * e.ln_1p()))
}

fn trace(m: DMat3) -> f64 {
    m.x_axis.x + m.y_axis.y + m.z_axis.z
}

fn contraction(a: DMat3, b: DMat3) -> f64 {
    a.to_cols_array().iter().zip(b.to_cols_array()).map(|(a, b)| a * b).sum()
}

/// Greatest entry of `a - b`.
fn distance(a: DMat3, b: DMat3) -> f64 {
    (a - b).to_cols_array().iter().fold(0.0, |most, entry| entry.abs().max(most))
}

fn increment(size: f64) -> impl Strategy<Value = DMat3> {
    prop::array::uniform9(-size..size).prop_map(|entries| DMat3::from_cols_array(&entries))
}

/// Elastic strain of a random Hencky strain of norm up to `size`: 0.3 is on both sides of the series' reach.
fn strain(size: f64) -> impl Strategy<Value = DMat3> {
    (increment(1.0), 0.0..size).prop_map(|(m, size)| {
        let spectrum = Spectrum::of((m + m.transpose()) * 0.5);
        let scale = size / spectrum.values.length().max(1e-3);
        spectrum.with((spectrum.values * scale).map(|h| (2.0 * h).exp_m1()))
    })
}

fn rotation() -> impl Strategy<Value = DMat3> {
    prop::array::uniform4(-1.0..1.0).prop_filter_map("a quaternion of length 0", |[x, y, z, w]| {
        let q = DQuat::from_xyzw(x, y, z, w);
        (q.length() > 0.1).then(|| DMat3::from_quat(q.normalize()))
    })
}

proptest! {
    /// A turned step is the step turned, and a rotation after the step turns its result: to f32 rounding.
    #[test]
    fn law_is_objective(e in strain(0.3), l in increment(0.05), r in rotation(), y in 0.001f32..0.2) {
        let turned = |m: DMat3| r * m * r.transpose();
        let plain = step(l, e, y);
        for other in [step(turned(l), turned(e), y), step(r * (DMat3::IDENTITY + l) - DMat3::IDENTITY, e, y)] {
            let (strain, stress) = (turned(matrix_of(&plain.elastic_strain)), turned(matrix_of(&plain.stress)));
            prop_assert!(distance(matrix_of(&other.elastic_strain), strain) < 2e-6);
            prop_assert!(distance(matrix_of(&other.stress), stress) < 2e-6 * 0.1);
            prop_assert!((other.plastic.0[6] - plain.plastic.0[6]).abs() < 2e-6);
        }
    }

    /// The return keeps J and ends within the yield norm, and the stress does work on the strain it lost.
    #[test]
    fn return_keeps_volume_and_dissipates(e in strain(0.5), l in increment(0.1), y in 0.001f32..0.2) {
        let trial = hencky_of(matrix_of(&step(l, e, f32::INFINITY).elastic_strain));
        let after = step(l, e, y);
        let h = hencky_of(matrix_of(&after.elastic_strain));
        prop_assert!((trace(h) - trace(trial)).abs() < 2e-6, "{} {}", trace(h), trace(trial));
        let deviator = h - DMat3::from_diagonal(DVec3::splat(trace(h) / 3.0));
        prop_assert!(contraction(deviator, deviator).sqrt() < f64::from(y) + 2e-6);
        let lost = contraction(matrix_of(&after.stress), trial - h);
        prop_assert!(after.plastic.0[6] >= 0.0 && lost > -1e-7 * 0.1, "{lost}");
        prop_assert!((lost - f64::from(LAW.mu2 * y * after.plastic.0[6] / SQRT_2_3)).abs() < 1e-6 * 0.1, "{lost}");
        let of_state = stress(&LAW, &after.elastic_strain);
        prop_assert!(distance(matrix_of(&of_state), matrix_of(&after.stress)) < 2e-6 * 0.1);
    }

    /// Exponential after logarithm is the strain again: the series within their reach, eigenvalues for
    /// stretches of 1/7 to 7.
    #[test]
    fn exponential_undoes_logarithm(e in strain(0.5), large in strain(2.0)) {
        let norm = contraction(e, e).sqrt();
        let x = if norm > 0.249 { e * (0.249 / norm) } else { e };
        let back = matrix_of(&expm1(&hencky::<F8>(&eight(x))));
        prop_assert!(distance(back, x) < 1.5e-7, "{back} {x}");
        let exact = matrix_of(&unstrained(large).elastic_strain.map(F8::splat));
        let size = contraction(large, large).sqrt();
        prop_assert!(distance(exact, large) <= 1e-7 * size, "{exact} {large}");
    }
}
