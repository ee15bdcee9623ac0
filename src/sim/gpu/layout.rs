//! Rust twins of the WGSL structs. A test compares every offset with what naga computes from the text.

use super::super::cut::WeldRule;
use super::super::frame::AVERAGING_INTERVAL;
use super::super::frame::FramePlan;
use super::super::material::ClayLaw;
use super::super::params::{Domain, Wall};
use super::super::tool::{Blade, Contact, Motion, Outline, Pose, Profile, ToolPath, ToolShape};
use super::plan::Scales;
use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec3, IVec3};

/// Tools that one plan may have: a bit each in a word.
pub const TOOLS_MAX: u32 = 32;
/// Bent blades that one plan may have: their profiles are uniforms.
pub const PROFILES_MAX: u32 = 8;
/// Fields of a particle's state, 16 bytes each.
pub(super) const FIELDS: u32 = 7;

/// Bits of the status word.
pub(super) mod flag {
    /// A node moved too far in a substep.
    pub(in super::super) const SPEED: u32 = 1;
    /// A value was not finite.
    pub(in super::super) const NON_FINITE: u32 = 1 << 1;
    /// A particle left the blocks marked for it: re-binned too seldom.
    pub(in super::super) const MARGIN: u32 = 1 << 2;
    /// More particles in a cell, or a greater speed, than the fixed point scales serve.
    pub(in super::super) const OVERFLOW: u32 = 1 << 3;
    /// More blocks than there is room for.
    pub(in super::super) const CAPACITY: u32 = 1 << 4;
    /// More classes of clay about a cut's block than there is room for.
    pub(in super::super) const CROWDED: u32 = 1 << 5;
}

/// `Params` of prelude.wgsl.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Params {
    pub blocks: [i32; 3],
    pub particle_count: u32,
    pub wall_low: [i32; 3],
    pub slot_capacity: u32,
    pub wall_high: [i32; 3],
    pub tool_count: u32,
    pub gravity: [f32; 3],
    pub damping: f32,
    pub centre: [i32; 3],
    pub wall_kinds: u32,
    pub mass_scale: f32,
    pub momentum_scale: f32,
    pub reach_limit: f32,
    pub cell_count_limit: u32,
    pub mu2: f32,
    pub lambda: f32,
    pub yield_norm: f32,
    pub softening: f32,
    pub softening_length: f32,
    pub velocity_unit: f32,
    pub rate_unit: f32,
    pub mass_unit: f32,
    pub travel_limit: f32,
    pub density_unit: f32,
    pub starts_frame: u32,
    pub softens: u32,
    pub node_mass_limit: f32,
    pub hardening: f32,
    pub viscous: f32,
    pub flow_index: f32,
    pub hardening_norm: f32,
    pub work_loss: f32,
    pub work_rate: f32,
    pub work_kept: f32,
    pub averaging: f32,
    pub averaging_last: f32,
    pub averaging_last_at: u32,
    pub adhesion: f32,
    pub blades: u32,
    pub solids: u32,
    pub weld_stress: f32,
    pub weld_step: u32,
    pub profiles: [[[f32; 4]; 17]; PROFILES_MAX as usize],
}

/// What a frame's parameters are made of.
pub(super) struct ParamsInput<'a> {
    pub domain: &'a Domain,
    pub plan: &'a FramePlan,
    /// Substep used [s].
    pub dt: f64,
    /// The clay's time when the frame starts [s].
    pub start: f64,
    pub scales: Scales,
    pub particle_count: u32,
    pub slot_capacity: u32,
    /// Rest volume of mass 1 [m^3].
    pub mass_unit: f64,
    /// Substeps of the frame, and those done before this submission.
    pub steps: u32,
    pub first_step: u32,
    pub starts_frame: bool,
}

/// Greatest node travel in one substep [cells], as on the native engine.
const TRAVEL_LIMIT: f32 = 0.49;
/// The greatest yield norm, and adhesion: an elastic clay's is infinite, which shaders may not count on.
const YIELD_NORM_MAX: f32 = 1e30;

impl Params {
    #[expect(clippy::cast_possible_truncation, reason = "the device is f32")]
    pub(super) fn new(input: &ParamsInput<'_>) -> Self {
        let (domain, plan, dt) = (input.domain, input.plan, input.dt);
        let (m, dx) = (&plan.material, domain.cell_width);
        let scale = 4.0 * dt * dt / (plan.inertial_density() * dx * dx);
        let (low, high) = domain.wall_nodes();
        let kind = |w: &Wall| match w {
            Wall::Slip => 0,
            Wall::Stick => 1,
            Wall::Separate => 2u32,
        };
        let root = (2.0f64 / 3.0).sqrt();
        let (loss, rate, rest_time) = match m.law {
            ClayLaw::Worked { loss, rate, rest_time } => (loss, rate, rest_time),
            _ => (0.0, 0.0, f64::INFINITY),
        };
        let last_averaging = (input.steps - 1) / AVERAGING_INTERVAL * AVERAGING_INTERVAL;
        let weld = WeldRule::of(plan, input.start);
        let bits = |is: &dyn Fn(&ToolShape) -> bool| {
            plan.tools.iter().enumerate().map(|(i, path)| u32::from(is(&path.tool.shape)) << i).sum()
        };
        let walls = domain.walls.low.iter().chain(&domain.walls.high);
        Self {
            blocks: domain.blocks().to_array(),
            particle_count: input.particle_count,
            wall_low: low.to_array(),
            slot_capacity: input.slot_capacity,
            wall_high: high.to_array(),
            tool_count: plan.tools.len() as u32,
            gravity: (plan.gravity / plan.density_scale() * (dt * dt / dx)).as_vec3().to_array(),
            damping: (-plan.validation.damping * dt).exp() as f32,
            centre: centre(domain).to_array(),
            wall_kinds: walls.enumerate().map(|(i, w)| kind(w) << (2 * i)).sum(),
            mass_scale: input.scales.mass,
            momentum_scale: input.scales.momentum,
            reach_limit: input.scales.reach_limit,
            cell_count_limit: input.scales.cell_count_limit,
            mu2: (scale * 2.0 * m.lame_mu()) as f32,
            lambda: (scale * m.lame_lambda()) as f32,
            yield_norm: ((root * m.yield_stress / (2.0 * m.lame_mu())) as f32).min(YIELD_NORM_MAX),
            softening: m.softening as f32,
            softening_length: (m.softening_length_or_default(dx) / dx) as f32,
            velocity_unit: (dx / dt) as f32,
            rate_unit: (1.0 / dt) as f32,
            mass_unit: input.mass_unit as f32,
            travel_limit: TRAVEL_LIMIT,
            density_unit: (input.mass_unit / dx.powi(3)) as f32,
            starts_frame: u32::from(input.starts_frame),
            softens: u32::from(m.softening > 0.0 && m.yield_stress.is_finite() && !plan.tools.is_empty()),
            node_mass_limit: input.scales.node_mass_limit,
            hardening: (root * root * m.hardening_modulus / (2.0 * m.lame_mu())) as f32,
            viscous: (root * m.viscosity * (root / dt).powf(m.flow_index) / (2.0 * m.lame_mu())) as f32,
            flow_index: m.flow_index as f32,
            hardening_norm: (root * m.hardening_modulus / (2.0 * m.lame_mu())) as f32,
            work_loss: loss as f32,
            work_rate: rate as f32,
            work_kept: (-dt / rest_time).exp() as f32,
            averaging: plan.averaging_share(0, AVERAGING_INTERVAL) as f32,
            averaging_last: plan.averaging_share(last_averaging, input.steps) as f32,
            // Of an earlier submission it wraps to where no substep is.
            averaging_last_at: (last_averaging + 1).wrapping_sub(input.first_step),
            adhesion: ((m.shear_strength() * dt * dt / (plan.inertial_density() * dx * dx)) as f32).min(YIELD_NORM_MAX),
            blades: bits(&|shape| shape.is_blade() && !matches!(shape, ToolShape::Wire { .. })),
            solids: bits(&|shape| !shape.is_blade()),
            profiles: profiles(plan, dx),
            weld_stress: weld.map_or(0.0, |rule| scale * rule.stress) as f32,
            weld_step: weld.map_or(0, |rule| rule.step.into()),
        }
    }
}

/// The profiles of the plan's bent blades [cells], in the plan's order.
#[expect(clippy::cast_possible_truncation, reason = "the device is f32")]
fn profiles(plan: &FramePlan, cell_width: f64) -> [[[f32; 4]; 17]; PROFILES_MAX as usize] {
    let mut all = [[[0.0; 4]; 17]; PROFILES_MAX as usize];
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
    let profile = |(i, path): (usize, &ToolPath)| match path.tool.shape {
        ToolShape::BentBlade { profile, .. } => Some((i, profile)),
        _ => None,
    };
    tools.iter().enumerate().filter_map(profile)
}

/// The cell that angular momentum is summed about on the device: sums of f32 keep more digits about the middle.
pub(super) fn centre(domain: &Domain) -> IVec3 {
    domain.grid_cells() / 2
}

/// `Tool` of tool.wgsl. Matrices have a word of padding a column.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct GpuTool {
    pub end_cell: [i32; 3],
    pub shape: u32,
    pub end_offset: [f32; 3],
    pub contact: u32,
    pub start_cell: [i32; 3],
    pub sheet: u32,
    pub start_offset: [f32; 3],
    pub friction: f32,
    pub end_rotation: [[f32; 4]; 3],
    pub start_rotation: [[f32; 4]; 3],
    pub turn: [[f32; 4]; 3],
    pub travel: [f32; 3],
    pub radius: f32,
    pub size: [f32; 3],
    pub profile: u32,
}

impl GpuTool {
    /// The tool of `path` during the substep from `start` to `end` [s]; `profile` is the index of its profile, if it is a bent blade.
    #[expect(clippy::cast_possible_truncation, reason = "the device is f32")]
    pub(super) fn new(path: &ToolPath, domain: &Domain, start: f64, end: f64, profile: u32) -> Self {
        let in_cells = |p: Pose| Pose { position: domain.to_grid(p.position), ..p };
        let motion = path.motion(start, end);
        let motion = Motion { start: in_cells(motion.start), end: in_cells(motion.end), duration: 1.0 };
        let shape = path.tool.shape.scaled(1.0 / domain.cell_width);
        let (motion, wire) = match shape {
            ToolShape::Wire { half_length } => wire(half_length, motion),
            _ => (motion, (0.0, DVec3::ZERO)),
        };
        let [a, b] = [motion.start.position, motion.end.position];
        let [r, s] = [motion.start, motion.end].map(|p: Pose| DMat3::from_quat(p.rotation));
        let mut points = 0;
        let (shape, radius, size) = match shape {
            ToolShape::Sphere { radius } => (0, radius, DVec3::ZERO),
            ToolShape::Capsule { radius, half_length } => (1, radius, DVec3::Y * half_length),
            ToolShape::Box { half_size } => (2, 0.0, half_size),
            ToolShape::Blade { half_width, half_height } => (3, 0.0, DVec3::new(half_width, half_height, 0.0)),
            ToolShape::Cone { radius, half_height } => (4, radius, DVec3::Y * half_height),
            ToolShape::PointedBlade { half_width, half_height } => (5, 0.0, DVec3::new(half_width, half_height, 0.0)),
            ToolShape::BentBlade { profile, half_height } => {
                points = profile.points().len() as u32;
                (6, 0.0, DVec3::Y * half_height)
            }
            ToolShape::Wire { .. } => (7, wire.0, wire.1),
        };
        let (contact, friction) = match path.tool.contact {
            Contact::Stick => (0, 0.0),
            Contact::Slip => (1, 0.0),
            Contact::Separate { friction } => (2, friction),
        };
        Self {
            end_cell: cell(b).to_array(),
            shape,
            end_offset: (b - cell(b).as_dvec3()).as_vec3().to_array(),
            contact,
            start_cell: cell(a).to_array(),
            sheet: u32::from(path.sheet_id()),
            start_offset: (a - cell(a).as_dvec3()).as_vec3().to_array(),
            friction: friction as f32,
            end_rotation: columns(s),
            start_rotation: columns(r),
            turn: columns(s - r),
            travel: (b - a).as_vec3().to_array(),
            radius: radius as f32,
            size: size.as_vec3().to_array(),
            profile: profile | points << 8,
        }
    }
}

/// The motion of the strip that a wire leaves behind, where the wire stands along its Y, and the strip's half extents; those of a wire that leaves none hold nothing.
fn wire(half_length: f64, motion: Motion) -> (Motion, (f64, DVec3)) {
    let outline = Outline::Wire { half_length };
    let (strip, at) = Blade::new(outline, motion, 1.0).strip();
    match strip {
        Outline::Rectangle { half_width, half_height } => {
            let y = at.end.to_local(motion.end.position).y;
            (at, (y, DVec3::new(half_width, half_height, 0.0)))
        }
        _ => (motion, (0.0, DVec3::new(half_length, -1.0, 0.0))),
    }
}

/// The cell of a tool, which may be anywhere: far outside, its offset takes over.
fn cell(x: DVec3) -> IVec3 {
    x.floor().clamp(DVec3::splat(-1e6), DVec3::splat(1e6)).as_ivec3()
}

fn columns(m: DMat3) -> [[f32; 4]; 3] {
    let column = |c: DVec3| {
        let [x, y, z] = c.as_vec3().to_array();
        [x, y, z, 0.0]
    };
    [column(m.x_axis), column(m.y_axis), column(m.z_axis)]
}

/// `ToolCount` of prelude.wgsl.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct ToolCount {
    pub tagged: u32,
    pub pushed_back: u32,
    pub depth: f32,
    pub displaced: u32,
}

/// `Status` of prelude.wgsl.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Status {
    pub flags: u32,
    pub speed: f32,
    pub clamped: u32,
    pub cell_count: u32,
    pub slot_count: u32,
    pub substep: u32,
    pub node_mass: u32,
    pub reach_met: u32,
    pub crowded: u32,
    pub welded: u32,
    pub sheets: [u32; 8],
    pub tools: [ToolCount; TOOLS_MAX as usize],
}

/// `Total` of total.wgsl.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Total {
    pub momentum: [f32; 3],
    pub momentum_size: f32,
    pub angular: [f32; 3],
    pub kinetic: f32,
    pub strain: [f32; 3],
    pub mass: f32,
    pub ratio: [f32; 2],
    pub reach: f32,
    pub spare: f32,
}
