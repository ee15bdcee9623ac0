//! The substep's surroundings: constants of the clay, and the tools in motion.

use super::super::ahead::ClayAhead;
use super::super::frame::FramePlan;
use super::super::params::Domain;
use super::super::tool::{self, Adhesion, Blade, Motion, SPACING, Sampled, ToolPath, ToolShape};
use super::super::validation::Manufactured;
use super::particle::Particle;
use glam::{DVec3, IVec3};

/// One of the two ends of a substep.
#[derive(Clone, Copy, Debug)]
pub(super) enum Moment {
    Start,
    End,
}

/// A tool in motion over the substep. Lengths are in metres here, as in the plan.
#[derive(Clone, Debug)]
pub(super) struct MovingTool<'a> {
    /// The tool and its path.
    pub(super) path: &'a ToolPath,
    /// From the substep's start to its end.
    pub(super) motion: Motion,
    /// What parts the clay: the same as a blade, or the middle of a plate.
    pub(super) blade: Option<Blade>,
    /// The same as particles, under the methods of others that have such.
    pub(super) sampled: Option<Sampled>,
    /// Its shape at the substep's end: the tool's own, but for a growing ball.
    shape: ToolShape,
}

impl MovingTool<'_> {
    /// Whether the tool presses on particles.
    pub(super) fn is_solid(&self) -> bool {
        !self.path.tool.shape.is_blade()
    }

    /// Distance \[m\] from `world` [m]: signed for a solid tool, unsigned for a blade.
    pub(super) fn distance(&self, world: DVec3, at: Moment) -> f64 {
        let pose = match at {
            Moment::Start => self.motion.start,
            Moment::End => self.motion.end,
        };
        self.shape.distance(pose.to_local(world))
    }

    /// Signed distance \[cells\] of a node from the blade and the unit normal of the blade's front, if the
    /// node is near it.
    pub(super) fn side(&self, node: IVec3, domain: &Domain) -> Option<(f64, DVec3)> {
        if let Some(sampled) = &self.sampled {
            return sampled.side(node);
        }
        let (distance, normal) = self.blade?.within_band(domain.to_world(node.as_dvec3()))?;
        Some((distance / domain.cell_width, normal))
    }

    /// Outward normal at `world` \[m\] at the substep's end.
    pub(super) fn normal(&self, world: DVec3) -> DVec3 {
        self.motion.end.rotation * self.shape.normal(self.motion.end.to_local(world))
    }

    /// Velocity [m/s] of the tool at `world` \[m\].
    pub(super) fn velocity(&self, world: DVec3) -> DVec3 {
        self.motion.velocity_at(world)
    }
}

/// All that a substep is given besides the particles.
#[derive(Clone, Debug)]
pub(super) struct Surroundings<'a> {
    /// The room.
    pub(super) domain: &'a Domain,
    /// The frame's plan.
    pub(super) plan: &'a FramePlan,
    /// The tools of the plan, in its order.
    pub(super) tools: Vec<MovingTool<'a>>,
    /// What their edges have ahead, once that was [looked at](super::penalty::look_ahead).
    pub(super) ahead: ClayAhead,
    /// The substep's start \[s\], from the frame's.
    start: f64,
}

impl<'a> Surroundings<'a> {
    /// The surroundings in the substep that starts at `start` \[s\] of the frame.
    pub(super) fn new(domain: &'a Domain, plan: &'a FramePlan, start: f64) -> Self {
        let moving = |path: &'a ToolPath| {
            let motion = path.motion(start, start + plan.dt);
            // The methods of others know no plates.
            let divides = plan.cutting.keeps_cuts() || path.tool.shape.is_blade();
            let outline = path.outline(path.tool.shape).filter(|_| divides);
            let blade = outline.map(|outline| Blade::new(outline, motion, domain.cell_width));
            let shape = plan.validation.grown(path.tool.shape, start + plan.dt);
            let sampled = sampled(path, &motion, domain, plan);
            MovingTool { path, motion, blade, sampled, shape }
        };
        Self { domain, plan, tools: plan.tools.iter().map(moving).collect(), ahead: ClayAhead::default(), start }
    }

    /// Velocity [m/s] that gravity, and the body force of a manufactured solution, give to inertial mass at
    /// `node` in the substep: weight is not scaled with inertia.
    pub(super) fn gravity_step(&self, node: IVec3) -> DVec3 {
        let force = |case: &Manufactured| {
            case.acceleration(&self.plan.material, self.domain.to_world(node.as_dvec3()), case.time + self.start)
        };
        let body = self.plan.validation.manufactured.as_ref().map_or(DVec3::ZERO, force);
        (self.plan.gravity + body) * (self.plan.dt / self.plan.density_scale())
    }

    /// What validation damping leaves of a velocity [-].
    pub(super) fn damping_factor(&self) -> f64 {
        (-self.plan.validation.damping * self.plan.dt).exp()
    }

    /// What holds fresh clay on a sticking blade in the substep [m/s].
    pub(super) fn adhesion(&self) -> Adhesion {
        let cell_width = self.domain.cell_width;
        let velocity = self.plan.dt / (self.plan.inertial_density() * cell_width);
        Adhesion::new(&self.plan.material, velocity, 1.0 / cell_width)
    }

    /// Share of its strength at tools that a particle has lost [-].
    pub(super) fn strength_lost(&self, particle: &Particle) -> f64 {
        self.plan.material.strength_loss().of(particle.structure, particle.hardening)
    }

    /// Distance \[m\] from `position` \[cells\] to the nearest tool's surface at one end of the substep;
    /// infinite without tools.
    fn tool_distance(&self, position: DVec3, at: Moment) -> f64 {
        let world = self.domain.to_world(position);
        self.tools.iter().map(|tool| tool.distance(world, at).abs()).fold(f64::INFINITY, f64::min)
    }

    /// The particle's present yield stress [Pa]: softened by the tools as they stand then and by work,
    /// hardened.
    pub(super) fn yield_stress(&self, particle: &Particle, at: Moment) -> f64 {
        let (distance, cell_width) = (self.tool_distance(particle.position, at), self.domain.cell_width);
        self.plan.material.flow_stress_at(distance, cell_width, particle.structure, particle.hardening)
    }

    /// What multiplies the particle's stress [-], with the tools at the substep's start.
    pub(super) fn stress_factor(&self, particle: &Particle) -> f64 {
        self.plan.material.stress_factor_at(self.tool_distance(particle.position, Moment::Start), self.domain.cell_width)
    }

    /// `position` \[cells\], or the nearest point of the room where that is outside.
    pub(super) fn in_room(&self, position: DVec3) -> DVec3 {
        let (low, high) = self.domain.wall_nodes();
        position.clamp(low.as_dvec3(), high.as_dvec3())
    }
}

/// The tool as particles, in the plan's method.
fn sampled(path: &ToolPath, motion: &Motion, domain: &Domain, plan: &FramePlan) -> Option<Sampled> {
    if plan.cutting.keeps_cuts() {
        return None;
    }
    let spacing = SPACING * domain.cell_width;
    let (samples, mass) = (tool::samples(&path.tool.shape, spacing), plan.inertial_density() * spacing.powi(3));
    Sampled::new(plan.cutting, &samples, motion, mass, |x| domain.to_grid(x))
}
