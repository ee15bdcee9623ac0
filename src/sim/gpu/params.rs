//! A submission's numbers from its plan: [`Coefficients`] in f32, the room, the fixed point scales.

use super::super::coefficients::{Coefficients, LawCoefficients};
use super::super::cut::PLATE_SHEET;
use super::super::cutting::CuttingMethod;
use super::super::frame::FramePlan;
use super::super::integrator::Integrator;
use super::super::limits::TRAVEL_LIMIT;
use super::super::material::ClayLaw;
use super::super::params::{Domain, ParamsError};
use super::super::support::bearing_walls;
use super::super::tool::{Outline, Profile, ToolPath};
use super::super::weld::WeldRule;
use super::layout::{PROFILE_PAIRS, PROFILES_MAX, twins};
use super::scales::Scales;
use glam::IVec3;

twins! {
    /// The numbers of one submission.
    pub(super) Params = "Params" {
        /// of the grid along each axis
        pub blocks: [i32; 3] = "vec3i",
        /// particles
        pub particle_count: u32 = "u32",
        /// wall nodes
        pub wall_low: [i32; 3] = "vec3i",
        /// blocks that there is room for
        pub slot_capacity: u32 = "u32",
        /// high wall nodes
        pub wall_high: [i32; 3] = "vec3i",
        /// tools
        pub tool_count: u32 = "u32",
        /// over inertia scaling [cells/substep^2]
        pub gravity: [f32; 3] = "vec3f",
        /// velocity kept by validation damping [-]
        pub damping: f32 = "f32",
        /// the cell that angular momentum is summed about
        pub centre: [i32; 3] = "vec3i",
        /// 2 bits each: low x y z, high x y z; from bit 16 on, those that bear clay under gravity
        pub wall_kinds: u32 = "u32",
        /// fixed point: mass to i32, a power of two
        pub mass_scale: f32 = "f32",
        /// momentum to i32, a power of two
        pub momentum_scale: f32 = "f32",
        /// greatest |v + A d| [cells/substep] that momentum_scale serves
        pub reach_limit: f32 = "f32",
        /// greatest number of particles in a cell that both scales serve
        pub cell_count_limit: u32 = "u32",
        /// 2 mu, scaled by 4 h^2 / (rho_s dx^2)
        pub mu2: f32 = "f32",
        /// lambda, scaled
        pub lambda: f32 = "f32",
        /// greatest |dev H| of unworked clay
        pub yield_norm: f32 = "f32",
        /// s of Eq. 5
        pub softening: f32 = "f32",
        /// tau of Eq. 5 \[cells\]
        pub softening_length: f32 = "f32",
        /// one cell per substep [m/s]
        pub velocity_unit: f32 = "f32",
        /// 1 / h [1/s]
        pub rate_unit: f32 = "f32",
        /// rest volume of mass 1, a power of two [m^3]
        pub mass_unit: f32 = "f32",
        /// greatest node speed [cells/substep]
        pub travel_limit: f32 = "f32",
        /// mass 1 over the mass of a full cell [-]
        pub density_unit: f32 = "f32",
        /// whether this submission is a frame's first
        pub starts_frame: u32 = "u32",
        /// whether Eq. 5 is on
        pub softens: u32 = "u32",
        /// greatest mass of a node that momentum_scale serves
        pub node_mass_limit: f32 = "f32",
        /// what flow stress gains per shortening of the Hencky deviator
        pub hardening: f32 = "f32",
        /// what viscosity adds to it: viscous * shortening ^ flow_index
        pub viscous: f32 = "f32",
        /// n of Herschel-Bulkley flow
        pub flow_index: f32 = "f32",
        /// what the yield norm gains per plastic strain
        pub hardening_norm: f32 = "f32",
        /// share of the yield norm that fully worked clay loses
        pub work_loss: f32 = "f32",
        /// working per plastic strain
        pub work_rate: f32 = "f32",
        /// working that a substep's rest leaves
        pub work_kept: f32 = "f32",
        /// plastic strain in which ln J comes to its cell's mean by all but 1/e
        pub averaging: f32 = "f32",
        /// share of what nodes do not see of a particle's velocity that stays on it
        pub velocity_kept: f32 = "f32",
        /// what the shear strength of fresh clay gives to clay one cell deep, k h / (rho_s dx)
        /// [cells/substep]
        pub adhesion: f32 = "f32",
        /// which tools are blades that hold clay off, or plates, a bit each
        pub dividers: u32 = "u32",
        /// which tools press on particles, solid ones and by their edge, a bit each
        pub pressing: u32 = "u32",
        /// what a tool gives per cell^2 and cell of depth, in eighths of a full cell's mass
        pub normal_spring: f32 = "f32",
        /// the same per cell of slip
        pub tangential_spring: f32 = "f32",
        /// the same of the clay's shear strength
        pub contact_strength: f32 = "f32",
        /// compression across a cut at which its sides grow together, as the stress is scaled
        pub weld_stress: f32 = "f32",
        /// what a frame adds to the count of a pressed tag
        pub weld_step: u32 = "u32",
        /// the sheets of plates that the plan has, a bit each from `PLATE_SHEET` on
        pub plates: u32 = "u32",
        /// what an edge gives at most per share of it, of clay that fills a cell
        pub toughness: f32 = "f32",
        /// what viscosity adds to adhesion at a slide of a cell a substep
        pub viscous_adhesion: f32 = "f32",
        /// share of its strength at tools that clay gains per plastic strain
        pub strength_gain: f32 = "f32",
        /// whether blades have to know what clay has lost of its strength
        pub remembers: u32 = "u32",
        /// nothing
        pub spare: u32 = "u32",
        /// of bent blades: two points (x, z) of the XZ plane each
        pub profiles: [[[f32; 4]; PROFILE_PAIRS]; PROFILES_MAX as usize] = "array<array<vec4f, PROFILE_PAIRS>, PROFILES_MAX>",
    }
}

/// What a frame's parameters are made of.
pub(super) struct ParamsInput<'a> {
    pub domain: &'a Domain,
    pub plan: &'a FramePlan,
    /// Substep used \[s\].
    pub dt: f64,
    /// The clay's time when the frame starts \[s\].
    pub start: f64,
    pub scales: Scales,
    pub particle_count: u32,
    pub slot_capacity: u32,
    /// Rest volume of mass 1 [m^3].
    pub mass_unit: f64,
    pub starts_frame: bool,
}

/// Checks that this engine has what the plan asks for.
///
/// # Errors
/// A law or a method that is kept for comparison, or an input of a validation case, by name.
pub(super) fn refuse_unknown(plan: &FramePlan) -> Result<(), ParamsError> {
    let refusal = |name, value| Err(ParamsError::new(name, value, "is kept for comparison, on the native engine only"));
    match plan.material.law {
        ClayLaw::Softened | ClayLaw::Worked { .. } => {}
        law @ (ClayLaw::AsPublished | ClayLaw::AsPublishedDefaultD) => return refusal("law", law.identifier()),
    }
    match plan.cutting {
        CuttingMethod::TwoFields => {}
        method @ (CuttingMethod::Published | CuttingMethod::RigidParticles | CuttingMethod::InteractiveParticles) => {
            return refusal("cutting", method.identifier());
        }
    }
    if let Integrator::Implicit { .. } = plan.integrator {
        return Err(ParamsError::new("integrator", "Implicit", "is of the native engine only; plan explicit steps for this one"));
    }
    match plan.validation.input_beyond_damping() {
        Some(name) => Err(ParamsError::new(name, "set", "is a validation input of the native engine only")),
        None => Ok(()),
    }
}

/// The greatest yield norm, adhesion and strength: an elastic clay's is infinite, which shaders may not count
/// on.
const YIELD_NORM_MAX: f32 = 1e30;

impl Params {
    #[expect(clippy::cast_possible_truncation, reason = "the device is f32")]
    pub(super) fn new(input: &ParamsInput<'_>) -> Self {
        let (domain, plan) = (input.domain, input.plan);
        let coefficients = Coefficients::new(plan, domain, input.dt);
        let (low, high) = domain.wall_nodes();
        let weld = WeldRule::of(plan, input.start);
        let loss = coefficients.contact.loss;
        let weakens = |path: &ToolPath| path.tool.shape.is_blade() && path.tool.contact.sticks() && loss.is_any();
        let bits = |is: &dyn Fn(&ToolPath) -> bool| plan.tools.iter().enumerate().map(|(i, path)| u32::from(is(path)) << i).sum();
        let walls = domain.walls.low.iter().chain(&domain.walls.high);
        Self {
            blocks: domain.blocks().to_array(),
            particle_count: input.particle_count,
            wall_low: low.to_array(),
            slot_capacity: input.slot_capacity,
            wall_high: high.to_array(),
            tool_count: plan.tools.len() as u32,
            gravity: coefficients.gravity.as_vec3().to_array(),
            damping: coefficients.damping as f32,
            centre: centre(domain).to_array(),
            wall_kinds: walls.enumerate().map(|(i, w)| w.number() << (2 * i)).sum::<u32>()
                | bearing_walls(&domain.walls, plan.gravity) << 16,
            mass_scale: input.scales.mass,
            momentum_scale: input.scales.momentum,
            reach_limit: input.scales.reach_limit,
            cell_count_limit: input.scales.cell_count_limit,
            velocity_unit: coefficients.velocity_unit as f32,
            rate_unit: coefficients.rate_unit as f32,
            mass_unit: input.mass_unit as f32,
            travel_limit: TRAVEL_LIMIT,
            density_unit: (input.mass_unit / domain.cell_width.powi(3)) as f32,
            starts_frame: u32::from(input.starts_frame),
            node_mass_limit: input.scales.node_mass_limit,
            averaging: plan.volume_averaging as f32,
            velocity_kept: coefficients.velocity_kept as f32,
            adhesion: (coefficients.adhesion.strength as f32).min(YIELD_NORM_MAX),
            viscous_adhesion: coefficients.adhesion.viscous as f32,
            strength_gain: coefficients.contact.loss.gain as f32,
            remembers: plan.tools.iter().any(weakens).into(),
            dividers: bits(&|path| path.divides() && !path.tool.shape.is_wire()),
            pressing: bits(&|path| !path.tool.shape.is_blade() || coefficients.contact.toughness > 0.0 || weakens(path)),
            toughness: coefficients.contact.toughness as f32,
            plates: plan.tools.iter().filter(|path| path.sheet >= PLATE_SHEET).map(|path| 1 << (path.sheet - PLATE_SHEET)).sum(),
            profiles: profiles(plan, domain.cell_width),
            normal_spring: coefficients.contact.normal as f32,
            tangential_spring: coefficients.contact.tangential as f32,
            contact_strength: (coefficients.contact.strength as f32).min(YIELD_NORM_MAX),
            weld_stress: weld.map_or(0.0, |rule| coefficients.law.stress_scale * rule.stress) as f32,
            weld_step: weld.map_or(0, |rule| rule.step.into()),
            ..Self::of_law(&coefficients.law, !plan.tools.is_empty())
        }
    }

    /// The numbers of the clay law, and nothing else.
    #[expect(clippy::cast_possible_truncation, reason = "the device is f32")]
    fn of_law(law: &LawCoefficients, has_tools: bool) -> Self {
        // All by name: a number that this engine does not know fails to compile.
        let LawCoefficients {
            stress_scale: _,
            mu2,
            lambda,
            hardening,
            viscous,
            flow_index,
            yield_norm,
            hardening_norm,
            softening,
            working,
        } = *law;
        Self {
            mu2: mu2 as f32,
            lambda: lambda as f32,
            yield_norm: (yield_norm as f32).min(YIELD_NORM_MAX),
            softening: softening.map_or(0.0, |s| s.share) as f32,
            softening_length: softening.map_or(1.0, |s| s.length) as f32,
            softens: u32::from(softening.is_some() && has_tools),
            hardening: hardening as f32,
            viscous: viscous as f32,
            flow_index: flow_index as f32,
            hardening_norm: hardening_norm as f32,
            work_loss: working.map_or(0.0, |w| w.loss) as f32,
            work_rate: working.map_or(0.0, |w| w.rate) as f32,
            work_kept: working.map_or(1.0, |w| w.kept) as f32,
            ..Self::default()
        }
    }
}

/// The profiles of the plan's bent blades \[cells\], in the plan's order.
#[expect(clippy::cast_possible_truncation, reason = "the device is f32")]
fn profiles(plan: &FramePlan, cell_width: f64) -> [[[f32; 4]; PROFILE_PAIRS]; PROFILES_MAX as usize] {
    let mut all = [[[0.0; 4]; PROFILE_PAIRS]; PROFILES_MAX as usize];
    for (to, (_, profile)) in all.iter_mut().zip(bent_blades(&plan.tools)) {
        for (i, point) in profile.points().iter().enumerate() {
            let [x, z] = (*point / cell_width).to_array();
            to[i / 2][2 * (i % 2)..2 * (i % 2) + 2].copy_from_slice(&[x as f32, z as f32]);
        }
    }
    all
}

/// The bent blades among the tools: index and profile of each.
pub(super) fn bent_blades(tools: &[ToolPath]) -> impl Iterator<Item = (usize, Profile)> {
    let profile = |(i, path): (usize, &ToolPath)| match path.tool.shape.outline()? {
        Outline::Strip { profile, .. } => Some((i, profile)),
        Outline::Rectangle { .. } | Outline::Triangle { .. } | Outline::Plate { .. } | Outline::Wire { .. } => None,
    };
    tools.iter().enumerate().filter_map(profile)
}

/// The cell that angular momentum is summed about on the device: sums of f32 keep more digits about the
/// middle.
pub(super) fn centre(domain: &Domain) -> IVec3 {
    domain.grid_cells() / 2
}

#[cfg(test)]
mod tests {
    use super::super::super::material::ClayMaterial;
    use super::super::super::planner::StepLimits;
    use super::*;

    /// Laws and methods that are kept for comparison are refused by name, and so is the implicit step; the
    /// others are not.
    #[test]
    fn comparisons_are_refused() {
        let fresh = StepLimits::default().frame(&ClayMaterial::default(), 0.01, 0.01, &[]);
        for law in ClayLaw::ALL {
            let plan = FramePlan { material: ClayMaterial { law, ..fresh.material }, ..fresh.clone() };
            let refused = refuse_unknown(&plan).err().map(|e| (e.name, e.value));
            assert_eq!(refused, law.is_as_published().then(|| ("law", law.identifier().into())));
        }
        for cutting in CuttingMethod::ALL {
            let refused = refuse_unknown(&FramePlan { cutting, ..fresh.clone() }).err().map(|e| (e.name, e.value));
            assert_eq!(refused, (!cutting.keeps_cuts()).then(|| ("cutting", cutting.identifier().into())));
        }
        let implicit = FramePlan { integrator: Integrator::Implicit { passes: 10 }, ..fresh };
        assert_eq!(refuse_unknown(&implicit).err().map(|e| e.name), Some("integrator"));
    }
}
