//! The clay law, eight particles wide: Hencky elasticity and von Mises return on `E = b_e - I`.
//!
//! `ln(I + X)` by the Pade [3/3] approximant and `exp` by Taylor up to |X| = [`SERIES_MAX`]; beyond, per
//! particle by eigenvalues in f64. Stress is scaled: `tau * 4 h^2 / (rho_s dx^2)`, the form in which it
//! enters the affine momentum in cells and substeps.

use super::super::limits::{self, FLOW_STEPS, STRETCH_MAX, STRETCH_MIN};
use super::simd::{F8, Lanes, fused};

#[cfg(all(test, feature = "reference"))]
mod properties;

/// A symmetric tensor of eight particles: xx yy zz xy xz yz.
pub(super) type Sym8 = [F8; 6];

#[expect(clippy::cast_possible_truncation, reason = "the kernels are f32")]
pub(super) const SERIES_MAX: f32 = limits::SERIES_MAX as f32;

/// Scaled moduli of one substep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Law {
    /// 2 mu * 4 h^2 / (rho_s dx^2).
    pub mu2: f32,
    /// lambda * 4 h^2 / (rho_s dx^2).
    pub lambda: f32,
}

/// What resists plastic flow beyond the yield stress, in norms of the Hencky deviator: shortening it by g
/// takes `hardening g + viscous g^index` of its excess over the yield norm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flow {
    /// `(2/3) H / (2 mu)`.
    pub hardening: f32,
    /// `sqrt(2/3) eta (sqrt(2/3) / h)^n / (2 mu)`.
    pub viscous: f32,
    /// n.
    pub index: f32,
}

impl Flow {
    /// Whether the yield norm is all there is.
    pub(super) fn is_plain(&self) -> bool {
        self.hardening == 0.0 && self.viscous == 0.0
    }

    /// The g that shortens a deviator `excess` too long: root of
    /// `(1 + hardening) g + viscous g^index = excess`.
    #[inline(always)]
    fn shortening(&self, excess: f32) -> f32 {
        let linear = 1.0 + self.hardening;
        if self.viscous == 0.0 {
            return excess / linear;
        }
        if self.index == 1.0 {
            return excess / (linear + self.viscous);
        }
        // In z = g^index the function is convex and rising, so Newton's method falls to the root from above;
        // either term alone is above.
        let power = 1.0 / self.index;
        let mut z = (excess / self.viscous).min((excess / linear).powf(self.index));
        for _ in 0..FLOW_STEPS {
            let g = linear * z.powf(power);
            z -= (g + self.viscous * z - excess) / (power * g / z + self.viscous);
        }
        z.powf(power).clamp(0.0, excess)
    }
}

/// What the law makes of a trial state.
pub(super) struct Update {
    /// Scaled Kirchhoff stress.
    pub stress: Sym8,
    /// Elastic strain after the return.
    pub elastic_strain: Sym8,
    /// Plastic strain gained [-].
    pub plastic: F8,
    /// Particles clamped.
    pub clamped: u32,
}

#[inline(always)]
fn product<L: Lanes>(a: &Sym8, b: &Sym8) -> Sym8 {
    let (p, q, r) = (a[3] * b[3], a[4] * b[4], a[5] * b[5]);
    [
        fused::<L>(a[0], b[0], p) + q,
        fused::<L>(a[1], b[1], p) + r,
        fused::<L>(a[2], b[2], q) + r,
        fused::<L>(a[4], b[5], fused::<L>(a[3], b[1], a[0] * b[3])),
        fused::<L>(a[4], b[2], fused::<L>(a[3], b[5], a[0] * b[4])),
        fused::<L>(a[5], b[2], fused::<L>(a[1], b[5], a[3] * b[4])),
    ]
}

/// Hencky strain `ln(I + X) / 2`, Pade [3/3]: `X (60 + 60 X + 11 X^2) (60 + 90 X + 36 X^2 + 3 X^3)^-1 / 2`.
#[inline(always)]
fn hencky<L: Lanes>(x: &Sym8) -> Sym8 {
    let x2 = product::<L>(x, x);
    let x3 = product::<L>(&x2, x);
    let (mut numerator, mut q) = (*x, *x);
    for i in 0..6 {
        numerator[i] = fused::<L>(F8::splat(5.5), x3[i], 30.0 * (x[i] + x2[i]));
        q[i] = fused::<L>(F8::splat(3.0), x3[i], fused::<L>(F8::splat(36.0), x2[i], 90.0 * x[i]));
        if i < 3 {
            q[i] = q[i] + 60.0;
        }
    }
    let minor = |a: usize, b: usize, c: usize, d: usize| fused::<L>(q[a], q[b], -(q[c] * q[d]));
    let adjugate: Sym8 =
        [minor(1, 2, 5, 5), minor(0, 2, 4, 4), minor(0, 1, 3, 3), minor(4, 5, 3, 2), minor(3, 5, 4, 1), minor(3, 4, 5, 0)];
    let determinant = fused::<L>(q[4], adjugate[4], fused::<L>(q[3], adjugate[3], q[0] * adjugate[0]));
    let inverse = F8::splat(1.0) / determinant;
    let mut h = product::<L>(&numerator, &adjugate);
    for v in &mut h {
        *v = *v * inverse;
    }
    h
}

#[inline(always)]
pub(super) fn stress_of(law: &Law, h: &Sym8) -> Sym8 {
    let trace = law.lambda * (h[0] + h[1] + h[2]);
    let mut tau = *h;
    for i in 0..6 {
        tau[i] = law.mu2 * h[i];
        if i < 3 {
            tau[i] = tau[i] + trace;
        }
    }
    tau
}

/// `exp(2 h) - I` by Taylor to the 6th order.
#[inline(always)]
fn expm1(h: &Sym8) -> Sym8 {
    let (mut y, mut t) = (*h, *h);
    for i in 0..6 {
        y[i] = 2.0 * h[i];
        t[i] = (1.0 / 720.0) * y[i];
    }
    for c in [1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0] {
        for v in &mut t[..3] {
            *v = *v + c;
        }
        t = product::<F8>(&y, &t);
    }
    t
}

/// `b_trial - I = (I + L)(I + E)(I + L)^T - I` without ever forming `I + E`; `l[c][r]` = h d v_r / d x_c.
#[inline(always)]
fn trial<L: Lanes>(l: &[[F8; 3]; 3], e: &Sym8) -> Sym8 {
    let em = [[e[0], e[3], e[4]], [e[3], e[1], e[5]], [e[4], e[5], e[2]]];
    let mut m = [[F8::ZERO; 3]; 3];
    for c in 0..3 {
        for r in 0..3 {
            let one = fused::<L>(l[0][r], em[c][0], l[c][r] + em[c][r]);
            m[c][r] = fused::<L>(l[2][r], em[c][2], fused::<L>(l[1][r], em[c][1], one));
        }
    }
    let mut x = *e;
    const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
    for i in 0..6 {
        let (r, c) = PAIRS[i];
        let one = fused::<L>(m[0][r], l[0][c], m[c][r] + l[r][c]);
        x[i] = fused::<L>(m[2][r], l[2][c], fused::<L>(m[1][r], l[1][c], one));
    }
    x
}

#[inline(always)]
fn norm2(x: &Sym8) -> F8 {
    x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + 2.0 * (x[3] * x[3] + x[4] * x[4] + x[5] * x[5])
}

#[inline(always)]
fn lane(x: &Sym8, k: usize) -> [f32; 6] {
    [x[0].0[k], x[1].0[k], x[2].0[k], x[3].0[k], x[4].0[k], x[5].0[k]]
}

/// Whether a squared norm is beyond the series' reach. A NaN is: on the eigenvalue path it stays NaN and is
/// found.
#[inline(always)]
fn is_beyond(norm2: f32) -> bool {
    norm2.is_nan() || norm2 > SERIES_MAX * SERIES_MAX
}

/// What the return makes of the Hencky strain of a trial state.
struct Return {
    hencky: Sym8,
    plastic: F8,
    yields: [bool; 8],
    any: bool,
}

/// Shortens the deviator of the Hencky strain `h` where it is beyond the yield norm.
#[inline(always)]
fn shorten(flow: &Flow, h: &Sym8, yield_norm: F8) -> Return {
    let third = (1.0 / 3.0) * (h[0] + h[1] + h[2]);
    let d = [h[0] - third, h[1] - third, h[2] - third, h[3], h[4], h[5]];
    let size2 = norm2(&d);
    let (mut yields, mut ratio, mut any) = ([false; 8], F8::splat(1.0), false);
    let mut plastic = F8::ZERO;
    for k in 0..8 {
        let (size, y) = (size2.0[k].sqrt(), yield_norm.0[k]);
        yields[k] = size > y;
        any |= yields[k];
        ratio.0[k] = (y / size).min(1.0);
        plastic.0[k] = SQRT_2_3 * (size - y).max(0.0);
    }
    if any && !flow.is_plain() {
        for k in (0..8).filter(|k| yields[*k]) {
            let size = size2.0[k].sqrt();
            let shortening = flow.shortening(size - yield_norm.0[k]);
            ratio.0[k] = (size - shortening) / size;
            plastic.0[k] = SQRT_2_3 * shortening;
        }
    }
    let hencky = [d[0] * ratio + third, d[1] * ratio + third, d[2] * ratio + third, d[3] * ratio, d[4] * ratio, d[5] * ratio];
    Return { hencky, plastic, yields, any }
}

/// Hencky strain after the return and plastic strain gained, as [`update`] has them, without the strain.
#[inline(always)]
pub(super) fn returned<L: Lanes>(flow: &Flow, l: &[[F8; 3]; 3], e: &Sym8, yield_norm: F8) -> (Sym8, F8) {
    let x = trial::<L>(l, e);
    let mut back = shorten(flow, &hencky::<L>(&x), yield_norm);
    let strain2 = norm2(&x);
    let mut beyond = false;
    for k in 0..8 {
        beyond |= is_beyond(strain2.0[k]);
    }
    for k in 0..if beyond { 8 } else { 0 } {
        if is_beyond(strain2.0[k]) {
            let unit = Law { mu2: 1.0, lambda: 0.0 };
            let exact = by_eigenvalues(&unit, flow, lane(&x, k), yield_norm.0[k]);
            for i in 0..6 {
                back.hencky[i].0[k] = exact.stress[i];
            }
            back.plastic.0[k] = exact.plastic;
        }
    }
    (back.hencky, back.plastic)
}

/// Stress and strain after one substep; `yield_norm` is the greatest |dev H| at rest,
/// `sqrt(2/3) sY / (2 mu)`.
#[inline(always)]
pub(super) fn update(law: &Law, flow: &Flow, l: &[[F8; 3]; 3], e: &Sym8, yield_norm: F8) -> Update {
    let x = trial::<F8>(l, e);
    let Return { hencky: returned, plastic, yields, any } = shorten(flow, &hencky::<F8>(&x), yield_norm);
    let mut out = Update { stress: stress_of(law, &returned), elastic_strain: x, plastic, clamped: 0 };
    if any {
        let exact = expm1(&returned);
        for i in 0..6 {
            for k in 0..8 {
                if yields[k] {
                    out.elastic_strain[i].0[k] = exact[i].0[k];
                }
            }
        }
    }
    let strain2 = norm2(&x);
    let mut beyond = false;
    for k in 0..8 {
        beyond |= is_beyond(strain2.0[k]);
    }
    if beyond {
        large_strain(law, flow, &x, yield_norm, &mut out);
    }
    out
}

/// Stress of a state already returned.
#[inline(always)]
pub(super) fn stress(law: &Law, e: &Sym8) -> Sym8 {
    let mut tau = stress_of(law, &hencky::<F8>(e));
    let strain2 = norm2(e);
    for k in 0..8 {
        if is_beyond(strain2.0[k]) {
            let exact = by_eigenvalues(law, &ELASTIC, lane(e, k), f32::INFINITY);
            for i in 0..6 {
                tau[i].0[k] = exact.stress[i];
            }
        }
    }
    tau
}

/// |H|^2 and tr H of eight particles.
pub(super) fn hencky_invariants(e: &Sym8) -> (F8, F8) {
    let h = hencky::<F8>(e);
    let (mut size2, mut trace) = (norm2(&h), h[0] + h[1] + h[2]);
    let strain2 = norm2(e);
    for k in 0..8 {
        if is_beyond(strain2.0[k]) {
            let unit = Law { mu2: 1.0, lambda: 0.0 };
            let [a, b, c, d, f, g] = by_eigenvalues(&unit, &ELASTIC, lane(e, k), f32::INFINITY).stress;
            trace.0[k] = a + b + c;
            size2.0[k] = a * a + b * b + c * c + 2.0 * (d * d + f * f + g * g);
        }
    }
    (size2, trace)
}

#[expect(clippy::cast_possible_truncation, reason = "the lanes are f32")]
const SQRT_2_3: f32 = super::super::material::SQRT_2_3 as f32;

#[inline(never)]
fn large_strain(law: &Law, flow: &Flow, x: &Sym8, yield_norm: F8, out: &mut Update) {
    let strain2 = norm2(x);
    for k in 0..8 {
        if !is_beyond(strain2.0[k]) {
            continue;
        }
        let exact = by_eigenvalues(law, flow, lane(x, k), yield_norm.0[k]);
        for i in 0..6 {
            out.stress[i].0[k] = exact.stress[i];
            out.elastic_strain[i].0[k] = exact.elastic_strain[i];
        }
        out.plastic.0[k] = exact.plastic;
        out.clamped += u32::from(exact.clamped);
    }
}

/// No flow but the yield norm's.
const ELASTIC: Flow = Flow { hardening: 0.0, viscous: 0.0, index: 1.0 };

struct Exact {
    stress: [f32; 6],
    elastic_strain: [f32; 6],
    plastic: f32,
    clamped: bool,
}

/// The law of one particle by the eigenvalues of `x = b_trial - I`, in f64.
#[expect(clippy::cast_possible_truncation, reason = "state is f32")]
fn by_eigenvalues(law: &Law, flow: &Flow, x: [f32; 6], yield_norm: f32) -> Exact {
    let (mu2, lambda, y) = (f64::from(law.mu2), f64::from(law.lambda), f64::from(yield_norm));
    let (w, q) = eigen(x.map(f64::from));
    let stretch2 = w.map(|w| (1.0 + w).clamp(STRETCH_MIN * STRETCH_MIN, STRETCH_MAX * STRETCH_MAX));
    let clamped = (0..3).any(|i| stretch2[i] != 1.0 + w[i]) && w.iter().all(|w| w.is_finite());
    let h = std::array::from_fn(|i| 0.5 * if stretch2[i] == 1.0 + w[i] { w[i].ln_1p() } else { stretch2[i].ln() });
    let [a, b, c]: [f64; 3] = h;
    let trace = a + b + c;
    let d = h.map(|h| h - trace / 3.0);
    let size = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
    let shortening = match size > y {
        false => 0.0,
        true if flow.is_plain() => size - y,
        true => f64::from(flow.shortening((size - y) as f32)),
    };
    let ratio = if shortening > 0.0 { 1.0 - shortening / size } else { 1.0 };
    let returned = d.map(|d| d * ratio + trace / 3.0);
    let back = |v: [f64; 3]| compose(&q, v).map(|v| v as f32);
    Exact {
        stress: back(returned.map(|h| mu2 * h + lambda * trace)),
        elastic_strain: back(returned.map(|h| (2.0 * h).exp_m1())),
        plastic: SQRT_2_3 * shortening as f32,
        clamped,
    }
}

/// Eigenvalues and eigenvectors (rows of the result: `q[k]` belongs to `w[k]`) of a symmetric matrix by
/// cyclic Jacobi rotations.
fn eigen(x: [f64; 6]) -> ([f64; 3], [[f64; 3]; 3]) {
    let mut a = [[x[0], x[3], x[4]], [x[3], x[1], x[5]], [x[4], x[5], x[2]]];
    let mut q = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    // Convergence is quadratic: 6 sweeps leave nothing in f64 (a test reconstructs random matrices to 1e-13).
    for _ in 0..6 {
        let (off, on) = (a[0][1].abs() + a[0][2].abs() + a[1][2].abs(), a[0][0].abs() + a[1][1].abs() + a[2][2].abs());
        if off <= 1e-17 * on {
            break;
        }
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            if a[i][j] == 0.0 {
                continue;
            }
            let theta = 0.5 * (a[j][j] - a[i][i]) / a[i][j];
            let t = 1f64.copysign(theta) / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for row in &mut a {
                (row[i], row[j]) = (c * row[i] - s * row[j], s * row[i] + c * row[j]);
            }
            for k in 0..3 {
                (a[i][k], a[j][k]) = (c * a[i][k] - s * a[j][k], s * a[i][k] + c * a[j][k]);
                (q[i][k], q[j][k]) = (c * q[i][k] - s * q[j][k], s * q[i][k] + c * q[j][k]);
            }
        }
    }
    ([a[0][0], a[1][1], a[2][2]], q)
}

fn compose(q: &[[f64; 3]; 3], w: [f64; 3]) -> [f64; 6] {
    [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|(r, c)| (0..3).map(|k| q[k][r] * w[k] * q[k][c]).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LAW: Law = Law { mu2: 0.02, lambda: 0.09 };

    fn spread(x: [f32; 6]) -> Sym8 {
        x.map(F8::splat)
    }

    /// Flows of every kind: none, hardening, linear and power-law viscosity.
    fn flows() -> impl Strategy<Value = Flow> {
        let some = |most: f32| prop_oneof![Just(0.0), (1e-5f32.ln()..most.ln()).prop_map(f32::exp)];
        (some(2.0), some(100.0), prop_oneof![Just(1.0), 0.05f32..1.0]).prop_map(|(hardening, viscous, index)| Flow {
            hardening,
            viscous,
            index,
        })
    }

    proptest! {
        /// The shortening solves its equation: what is left over is rounding of the excess.
        #[test]
        fn power_law_flow_is_solved(flow in flows(), excess in (-18f32..0.0).prop_map(f32::exp)) {
            let g = f64::from(flow.shortening(excess));
            let taken = (1.0 + f64::from(flow.hardening)) * g + f64::from(flow.viscous) * g.powf(f64::from(flow.index));
            // Below the range of f32 there is no flow.
            prop_assert!(g < 1e-30 || (taken / f64::from(excess) - 1.0).abs() < 3e-6, "{flow:?} {excess:e}: {g:e}, {taken:e}");
        }

        /// Eigenvectors are orthonormal and rebuild the matrix, repeated and zero eigenvalues included.
        #[test]
        fn eigen_rebuilds_matrix(x in prop::array::uniform6(prop_oneof![3 => -1.0..1.0, 1 => Just(0.0), 1 => Just(0.5)])) {
            let (w, q) = eigen(x);
            for (a, b) in compose(&q, w).iter().zip(x) {
                prop_assert!((a - b).abs() < 1e-13);
            }
            for i in 0..3 {
                for j in 0..3 {
                    let dot: f64 = (0..3).map(|k| q[i][k] * q[j][k]).sum();
                    prop_assert!((dot - f64::from(u8::from(i == j))).abs() < 1e-13);
                }
            }
        }

        /// Up to the switch-over, series and eigenvalues agree to f32 rounding, yielding or not; J is kept by
        /// the return.
        #[test]
        fn series_agree_with_eigenvalues(x in prop::array::uniform6(-1.0f32..1.0), size in 0.0f32..0.2499, y in 0.001f32..0.2, flow in flows()) {
            let norm = norm2(&spread(x)).0[0].sqrt().max(1e-3);
            let x = x.map(|v| v * size / norm);
            let zero = [[F8::ZERO; 3]; 3];
            let fast = update(&LAW, &flow, &zero, &spread(x), F8::splat(y));
            let exact = by_eigenvalues(&LAW, &flow, x, y);
            for i in 0..6 {
                prop_assert!((fast.stress[i].0[0] - exact.stress[i]).abs() < 1e-7 * 0.1);
                prop_assert!((fast.elastic_strain[i].0[0] - exact.elastic_strain[i]).abs() < 1e-7);
            }
            prop_assert!((fast.plastic.0[0] - exact.plastic).abs() < 1e-7);
            let j = |e: [f32; 6]| crate::sim::snapshot::Particle { elastic_strain: e, ..Default::default() }.volume_ratio();
            prop_assert!((j(lane(&fast.elastic_strain, 0)) - j(x)).abs() < 3e-7);
        }
    }

    /// A particle crushed flat is clamped, counted and finite; NaN stays visible.
    #[test]
    fn extreme_strain_is_clamped_and_nan_survives() {
        let exact = by_eigenvalues(&LAW, &ELASTIC, [-1.0, -1.5, 900.0, 0.0, 0.0, 0.0], 1.0);
        assert!(exact.clamped && exact.elastic_strain.iter().all(|v| v.is_finite()));
        let nan = update(&LAW, &ELASTIC, &[[F8::ZERO; 3]; 3], &spread([f32::NAN; 6]), F8::splat(1.0));
        assert!(nan.elastic_strain[0].0[0].is_nan() && nan.clamped == 0);
    }
}
