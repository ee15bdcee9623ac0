//! Solid tools and separating walls press on particles at the step's end: the explicit step's
//! [law](super::super::super::penalty), at the places that the unknowns give.
//!
//! The particle stands at `x + u`, the tools at their poses of `t + h`. A particle that comes to a tool which
//! it can leave is anchored where it stood at `t`, moved with the tool: its friction is that of the step's
//! way, and Coulomb's bound caps it.

use super::super::super::frame::FrameReport;
use super::super::super::params::Wall;
use super::super::super::penalty::{FOUND_DEPTH, Springs, Surface, reach};
use super::super::super::snapshot::ANCHORS_MAX;
use super::super::super::tool::Contact;
use super::super::particle::Particle;
use super::super::penalty::springs;
use super::super::tools::{Moment, Surroundings};
use super::super::walls::is_arrived;
use glam::DVec3;

/// What tools and walls do to a particle at a place.
#[derive(Clone, Debug, Default)]
pub(super) struct Press {
    /// Force on the particle \[N\].
    pub(super) force: DVec3,
    /// The diagonal of minus its slope [N/m].
    pub(super) stiffness: DVec3,
    /// Tools that touch it, by index, with their forces on it.
    tools: Vec<(usize, DVec3)>,
    /// Force of walls \[N\].
    on_walls: DVec3,
    anchors: Vec<(u32, DVec3)>,
    /// Separating walls that it touches, a bit each.
    walls: u32,
}

/// What presses on a particle that has moved from `start` \[m\] by `moved` \[m\].
pub(super) fn press(particle: &Particle, moved: DVec3, around: &Surroundings) -> Press {
    let start = around.domain.to_world(particle.position);
    let at = start + moved;
    let springs = springs(particle.rest_volume, around);
    let mut press = Press::default();
    press.by_tools(particle, [start, at], &springs, around);
    press.by_walls(particle, [start, at], &springs, around);
    press
}

impl Press {
    fn by_tools(&mut self, particle: &Particle, [start, at]: [DVec3; 2], springs: &Springs, around: &Surroundings) {
        let cell_width = around.domain.cell_width;
        let reach = reach(particle.rest_volume / cell_width.powi(3)) * cell_width;
        for (index, tool) in around.tools.iter().enumerate().filter(|(_, tool)| tool.is_solid()) {
            let (pose, id) = (tool.motion.end, tool.path.id);
            let gap = tool.distance(at, Moment::End) - reach;
            let gap_before = tool.distance(start, Moment::Start) - reach;
            let contact = tool.path.tool.contact;
            let surface = Surface { contact, gap, normal: tool.normal(at), leaving: (gap - gap_before) / around.plan.dt };
            let kept = particle.anchors.iter().flatten().find(|anchor| anchor.0 == id);
            let comes = gap < 0.0 && gap_before >= -FOUND_DEPTH * cell_width && contact.can_part();
            let anchor = match kept {
                Some(anchor) => Some(pose.to_world(anchor.1 * cell_width)),
                None => comes.then(|| pose.to_world(tool.motion.start.to_local(start))),
            };
            let Some(touch) = springs.touch(&surface, at, anchor) else { continue };
            self.force += touch.force;
            self.stiffness += springs.stiffness(&surface, at, anchor, touch.force);
            self.tools.push((index, touch.force));
            self.anchors.extend(touch.anchor.map(|anchor| (id, pose.to_local(anchor) / cell_width)));
        }
    }

    fn by_walls(&mut self, particle: &Particle, [start, at]: [DVec3; 2], springs: &Springs, around: &Surroundings) {
        let domain = around.domain;
        if around.plan.validation.clamped_walls {
            return;
        }
        let reach = reach(particle.rest_volume / domain.cell_width.powi(3)) * domain.cell_width;
        let (low, high) = domain.corners();
        for (number, kind) in domain.walls.low.into_iter().chain(domain.walls.high).enumerate() {
            let axis = number % 3;
            let (face, normal) = if number < 3 { (low, DVec3::AXES[axis]) } else { (high, -DVec3::AXES[axis]) };
            if kind != Wall::Separate {
                continue;
            }
            let [gap_before, gap] = [start, at].map(|x| (x - face).dot(normal) - reach);
            let contact = Contact::Separate { friction: 0.0 };
            let surface = Surface { contact, gap, normal, leaving: (gap - gap_before) / around.plan.dt };
            let anchor = (particle.walls >> number & 1 == 1).then_some(at);
            let Some(touch) = springs.touch(&surface, at, anchor) else { continue };
            self.force += touch.force;
            self.stiffness += springs.stiffness(&surface, at, anchor, touch.force);
            self.on_walls += touch.force;
            self.walls |= u32::from(touch.anchor.is_some()) << number;
        }
    }

    /// Keeps the anchors and the walls, and gives tools and walls the step's impulses.
    pub(super) fn settle(&self, particle: &mut Particle, world: DVec3, around: &Surroundings, frame: &mut FrameReport) {
        particle.anchors = std::array::from_fn::<_, ANCHORS_MAX, _>(|i| self.anchors.get(i).copied());
        for (index, force) in &self.tools {
            let (felt, given) = (&mut frame.tools[*index], *force * around.plan.dt);
            felt.impulse -= given;
            felt.angular_impulse -= (world - around.tools[*index].motion.end.position).cross(given);
            felt.contacts += 1;
            frame.impulse_scale += given.length();
        }
        frame.wall_impulse += self.on_walls * around.plan.dt;
        frame.impulse_scale += self.on_walls.length() * around.plan.dt;
        particle.walls = self.walls | is_arrived(particle, particle.position, around);
    }
}
