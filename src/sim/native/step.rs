//! The numbers of one substep as the kernels take them: [`Coefficients`] in f32.

use super::super::coefficients::{self, Coefficients, LawCoefficients};
use super::law::{Flow, Law};

/// Constants of one substep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub law: Law,
    /// What resists flow beyond the yield norm.
    pub flow: Flow,
    /// Greatest elastic |dev H| of fresh clay away from tools.
    pub yield_norm: f32,
    /// What the yield norm gains per plastic strain.
    pub hardening_norm: f32,
    /// Thixotropy, if the clay has it.
    pub working: Option<Working>,
    /// One cell per substep [m/s].
    pub velocity_unit: f32,
    /// One per substep [1/s].
    pub rate_unit: f32,
    /// Stress over its scaled form \[Pa\].
    pub stress_unit: f64,
    /// Share of what nodes do not see of a particle's velocity that stays on it [-].
    pub velocity_kept: f32,
    /// Whether AVX2 and FMA were found.
    pub fma: bool,
}

/// Thixotropy in one substep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Working {
    /// Share of the yield stress that fully worked clay loses [-].
    pub loss: f32,
    /// Working per plastic strain.
    pub rate: f32,
    /// What a substep's rest leaves of the working [-].
    pub kept: f32,
}

impl Working {
    /// The working after a substep with `plastic` strain.
    #[inline(always)]
    pub(super) fn after(&self, structure: f32, plastic: f32) -> f32 {
        (1.0 - (1.0 - structure) * (-self.rate * plastic).exp()) * self.kept
    }
}

impl Step {
    /// The coefficients as the kernels take them.
    #[expect(clippy::cast_possible_truncation, reason = "the kernels are f32")]
    pub(super) fn new(coefficients: &Coefficients, fma: bool) -> Self {
        // All by name: a number that this engine does not know fails to compile. Eq. 5 is taken from the
        // material, in f64 (`passes`).
        let LawCoefficients {
            stress_scale,
            mu2,
            lambda,
            hardening,
            viscous,
            flow_index,
            yield_norm,
            hardening_norm,
            softening: _,
            working,
        } = coefficients.law;
        let in_f32 =
            |coefficients::Working { loss, rate, kept }| Working { loss: loss as f32, rate: rate as f32, kept: kept as f32 };
        Self {
            law: Law { mu2: mu2 as f32, lambda: lambda as f32 },
            flow: Flow { hardening: hardening as f32, viscous: viscous as f32, index: flow_index as f32 },
            yield_norm: yield_norm as f32,
            hardening_norm: hardening_norm as f32,
            working: working.map(in_f32),
            velocity_unit: coefficients.velocity_unit as f32,
            rate_unit: coefficients.rate_unit as f32,
            stress_unit: 1.0 / stress_scale,
            velocity_kept: coefficients.velocity_kept as f32,
            fma,
        }
    }

    /// Whether the yield norm of a particle depends on what it went through.
    #[inline(always)]
    pub(super) fn has_history(&self) -> bool {
        self.hardening_norm > 0.0 || self.working.is_some()
    }

    /// The yield norm of a particle: `softened` is that of fresh clay at its place.
    #[inline(always)]
    pub(super) fn yield_norm_of(&self, softened: f32, hardening: f32, structure: f32) -> f32 {
        let left = self.working.map_or(1.0, |w| 1.0 - w.loss * structure);
        softened * left + self.hardening_norm * hardening
    }
}
