//! What engines make of a plan: the numbers of its substeps, scaled to cells and substeps, once for all of
//! them.
//!
//! In f64; an engine makes of them what it computes in. It takes [`LawCoefficients`] apart field by field, so
//! that a number which it does not know fails to compile there. The oracle has none of this: it computes in
//! SI, from the plan.

use super::frame::FramePlan;
use super::material::{ClayLaw, SQRT_2_3};
use super::params::Domain;
use super::penalty::{NORMAL_STIFFNESS, TANGENTIAL_STIFFNESS};
use super::strength::StrengthLoss;
use super::tool::Adhesion;
use glam::DVec3;

/// The numbers of one substep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Coefficients {
    /// Of the clay law.
    pub(crate) law: LawCoefficients,
    /// Of contact with solid tools.
    pub(crate) contact: ContactCoefficients,
    /// Gravity over inertia scaling [cells/substep^2].
    pub(crate) gravity: DVec3,
    /// Cells per squared substep in 1 m/s^2, on the inertial mass.
    pub(crate) acceleration: f64,
    /// Share of what nodes do not see of a particle's velocity that stays on it [-].
    pub(crate) velocity_kept: f64,
    /// What validation damping leaves of a velocity [-].
    pub(crate) damping: f64,
    /// What holds fresh clay on a sticking blade [cells/substep].
    pub(crate) adhesion: Adhesion,
    /// One cell per substep [m/s].
    pub(crate) velocity_unit: f64,
    /// One per substep [1/s].
    pub(crate) rate_unit: f64,
}

/// The springs of contact in one substep, of a particle that bears with one cell^2: impulses in cells per
/// substep and eighths of a full cell's mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ContactCoefficients {
    /// Per cell of depth.
    pub(crate) normal: f64,
    /// Per cell of slip.
    pub(crate) tangential: f64,
    /// Of the clay's shear strength.
    pub(crate) strength: f64,
    /// Of an edge per share of it, of clay that fills a cell; 0 where no edge resists.
    pub(crate) toughness: f64,
    /// Of fresh clay's strength on the flanks of a blade, what viscosity adds to it at a slide of a cell a
    /// substep, and the power with which that goes.
    pub(crate) flank: [f64; 3],
    /// How that falls with what clay has gone through.
    pub(crate) loss: StrengthLoss,
}

/// The clay law in one substep. Stress is scaled by [`Self::stress_scale`], the form in which it enters the
/// affine momentum in cells and substeps; flow is in norms of the Hencky deviator: shortening it by g takes
/// `hardening g + viscous g^flow_index` of its excess over the yield norm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LawCoefficients {
    /// `4 h^2 / (rho_s dx^2)` [1/Pa].
    pub(crate) stress_scale: f64,
    /// 2 mu, scaled.
    pub(crate) mu2: f64,
    /// lambda, scaled.
    pub(crate) lambda: f64,
    /// `(2/3) H / (2 mu)`.
    pub(crate) hardening: f64,
    /// `sqrt(2/3) eta (sqrt(2/3) / h)^n / (2 mu)`.
    pub(crate) viscous: f64,
    /// n.
    pub(crate) flow_index: f64,
    /// Greatest |dev H| at rest of fresh clay away from tools, `sqrt(2/3) sY / (2 mu)`; infinite for elastic
    /// clay and under the laws as published.
    pub(crate) yield_norm: f64,
    /// What the yield norm gains per plastic strain.
    pub(crate) hardening_norm: f64,
    /// Eq. 5, if tools soften the clay.
    pub(crate) softening: Option<Softening>,
    /// Thixotropy, if the clay has it.
    pub(crate) working: Option<Working>,
}

/// Eq. 5 in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Softening {
    /// Share s of the yield stress that clay near a tool loses [-].
    pub(crate) share: f64,
    /// tau \[cells\].
    pub(crate) length: f64,
}

/// Thixotropy in one substep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Working {
    /// Share of the yield stress that fully worked clay loses [-].
    pub(crate) loss: f64,
    /// Working per plastic strain.
    pub(crate) rate: f64,
    /// What the substep's rest leaves of the working [-].
    pub(crate) kept: f64,
}

impl Coefficients {
    /// The numbers of substeps of `dt` \[s\] of a plan.
    pub(crate) fn new(plan: &FramePlan, domain: &Domain, dt: f64) -> Self {
        let (material, cell_width) = (&plan.material, domain.cell_width);
        let acceleration = dt * dt / cell_width / plan.density_scale();
        let law = LawCoefficients::new(plan, cell_width, dt);
        // `h F` over `rho_s dx^3 / 8` and `dx / h`: twice the stress, scaled, times the area.
        let modulus = 2.0 * (law.lambda + law.mu2);
        Self {
            contact: ContactCoefficients {
                normal: NORMAL_STIFFNESS * modulus,
                tangential: TANGENTIAL_STIFFNESS * modulus,
                strength: 2.0 * law.stress_scale * material.shear_strength(),
                flank: [
                    2.0 * law.stress_scale * material.shear_strength_at_tool(),
                    2.0 * law.stress_scale * material.viscous_shear_stress(1.0 / dt),
                    material.flow_index,
                ],
                loss: material.strength_loss(),
                // The methods of others know none.
                toughness: if plan.cutting.keeps_cuts() { 2.0 * law.stress_scale * material.toughness / cell_width } else { 0.0 },
            },
            law,
            gravity: plan.gravity * acceleration,
            acceleration,
            velocity_kept: plan.velocity_kept(cell_width, dt),
            damping: (-plan.validation.damping * dt).exp(),
            adhesion: Adhesion::new(material, acceleration / (material.density * cell_width), 1.0 / dt),
            velocity_unit: cell_width / dt,
            rate_unit: 1.0 / dt,
        }
    }
}

impl LawCoefficients {
    fn new(plan: &FramePlan, cell_width: f64, dt: f64) -> Self {
        let material = &plan.material;
        let stress_scale = 4.0 * dt * dt / (plan.inertial_density() * cell_width * cell_width);
        let mu2 = 2.0 * material.lame_mu();
        let yield_norm = SQRT_2_3 * material.yield_stress_at(f64::INFINITY, cell_width) / mu2;
        Self {
            stress_scale,
            mu2: stress_scale * mu2,
            lambda: stress_scale * material.lame_lambda(),
            hardening: SQRT_2_3 * SQRT_2_3 * material.hardening_modulus / mu2,
            viscous: SQRT_2_3 * material.viscosity * (SQRT_2_3 / dt).powf(material.flow_index) / mu2,
            flow_index: material.flow_index,
            yield_norm,
            hardening_norm: SQRT_2_3 * material.hardening_modulus / mu2,
            softening: (material.softening > 0.0 && yield_norm.is_finite()).then(|| Softening {
                share: material.softening,
                length: material.softening_length_or_default(cell_width) / cell_width,
            }),
            working: match material.law {
                ClayLaw::Worked { loss, rate, rest_time } => Some(Working { loss, rate, kept: (-dt / rest_time).exp() }),
                ClayLaw::Softened | ClayLaw::AsPublished | ClayLaw::AsPublishedDefaultD => None,
            },
        }
    }
}
