//! The numbers of one substep's grid update, and what it met.

use super::super::coefficients::Coefficients;
use super::super::frame::FramePlan;
use super::super::implicit::IDLE_GRAVITY;
use super::super::material::ClayMaterial;
use super::super::params::Domain;
use super::super::tool::Adhesion;
use super::super::validation::{AffineDrive, Manufactured};
use super::contact::ToolNow;
use glam::{DVec3, IVec3};

/// Constants of one substep's grid update.
#[derive(Clone, Copy, Debug)]
pub(super) struct GridStep {
    /// Gravity over inertia scaling [cells/substep^2].
    pub gravity: DVec3,
    /// The acceleration whose forces are the least that those out of balance are judged by [cells/substep^2].
    pub idle: f64,
    /// Velocity kept by validation damping [-].
    pub damping: f64,
    /// What holds fresh clay on a sticking blade [cells/substep].
    pub adhesion: Adhesion,
    /// Further inputs of validation cases; blocks take the long way where there are any.
    pub imposed: Option<Imposed>,
}

/// What validation cases ask of nodes, in cells and substeps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Imposed {
    /// Whether walls clamp their nodes and do not fold.
    pub clamped_walls: bool,
    force: Option<Manufactured>,
    drive: Option<AffineDrive>,
    domain: Domain,
    material: ClayMaterial,
    /// The substep's start, from the frame's \[s\].
    start: f64,
    /// Cells per substep in 1 m/s.
    speed: f64,
    /// Cells per squared substep in 1 m/s^2, on the inertial mass.
    acceleration: f64,
}

impl Imposed {
    /// Body acceleration [cells/substep^2] of a manufactured solution at `node`.
    fn acceleration_at(&self, node: IVec3) -> DVec3 {
        let at = |f: Manufactured| f.acceleration(&self.material, self.domain.to_world(node.as_dvec3()), f.time + self.start);
        self.force.map_or(DVec3::ZERO, at) * self.acceleration
    }

    /// Velocity [cells/substep] of a driven node.
    pub(super) fn driven_velocity(&self, node: IVec3) -> Option<DVec3> {
        Some(self.drive?.velocity_at(self.domain.to_world(node.as_dvec3()))? * self.speed)
    }
}

impl GridStep {
    /// The constants of substep `index` of a frame of substeps of `dt` \[s\].
    pub(super) fn new(coefficients: &Coefficients, plan: &FramePlan, domain: &Domain, dt: f64, index: u32) -> Self {
        let validation = &plan.validation;
        let imposed = Imposed {
            clamped_walls: validation.clamped_walls,
            force: validation.manufactured,
            drive: validation.affine_drive,
            domain: *domain,
            material: plan.material,
            start: f64::from(index) * dt,
            speed: dt / domain.cell_width,
            acceleration: coefficients.acceleration,
        };
        let is_any = imposed.clamped_walls || imposed.force.is_some() || imposed.drive.is_some();
        Self {
            gravity: coefficients.gravity,
            idle: IDLE_GRAVITY * coefficients.acceleration,
            damping: coefficients.damping,
            adhesion: coefficients.adhesion,
            imposed: is_any.then_some(imposed),
        }
    }

    /// Gravity and other body forces on the inertial mass at `node` [cells/substep^2].
    pub(super) fn acceleration_at(&self, node: IVec3) -> DVec3 {
        self.imposed.map_or(self.gravity, |imposed| self.gravity + imposed.acceleration_at(node))
    }
}

/// What the update met: sums over nodes, in cells per substep and particle mass units.
#[derive(Clone, Debug, Default)]
pub(super) struct GridReport {
    /// Greatest node speed, NaN if any is not finite.
    pub speed_max: f32,
    pub wall_impulse: DVec3,
    /// Momentum taken by validation damping.
    pub damping_impulse: DVec3,
    /// Momentum given by body forces other than gravity.
    pub body_impulse: DVec3,
    pub impulse_scale: f64,
    /// For each tool: impulse and angular impulse (about the tool's origin) of the clay on it, and contacts.
    pub tools: Vec<(DVec3, DVec3, u64)>,
    /// For each tool, in implicit steps: the work of what it gives clay, on the way that this would have gone
    /// as it came.
    pub given: Vec<f64>,
}

impl GridReport {
    /// A report of this many tools.
    pub(super) fn of_tools(count: usize) -> Self {
        Self { tools: vec![Default::default(); count], given: vec![0.0; count], ..Self::default() }
    }

    /// Gives tool `index` an impulse at `world` \[cells\].
    pub(super) fn give(&mut self, index: usize, tool: &ToolNow, world: DVec3, impulse: DVec3) {
        let sum = &mut self.tools[index];
        sum.0 += impulse;
        sum.1 += (world - tool.motion.end.position).cross(impulse);
        self.impulse_scale += impulse.length();
    }

    pub(super) fn add(&mut self, other: &Self) {
        // A NaN must win: max() would drop it.
        if other.speed_max.is_nan() || other.speed_max > self.speed_max {
            self.speed_max = other.speed_max;
        }
        self.wall_impulse += other.wall_impulse;
        self.damping_impulse += other.damping_impulse;
        self.body_impulse += other.body_impulse;
        self.impulse_scale += other.impulse_scale;
        for (sum, t) in self.tools.iter_mut().zip(&other.tools) {
            *sum = (sum.0 + t.0, sum.1 + t.1, sum.2 + t.2);
        }
        self.given.iter_mut().zip(&other.given).for_each(|(sum, given)| *sum += given);
    }
}
