//! Tools and separating walls press on particles at the step's end: the explicit step's
//! [law](super::super::super::penalty), at the places that the unknowns give.
//!
//! The particle stands at `x + u`, the tools at their poses of `t + h`. A particle that comes to a tool which
//! it can leave is anchored where it stood at `t`, moved with the tool: its friction is that of the step's
//! way, and Coulomb's bound caps it.
//!
//! A blade presses on a particle that has a side s of its sheet with the gap `s d - r`, d its signed
//! distance and `s n` its normal, where the foot is inside its outline; not on what came behind it round
//! the rim ([`Blade::flank`](super::super::super::tool::Blade::flank)). Clay that it cuts is continuous up
//! to it: what takes a side with `0 <= s d < 2 r` at `t` is anchored where it stands, and its distance then
//! is its r, kept as its anchor's own distance from the blade. Of a particle without an anchor r is
//! [`reach`], or `s d` at `t` where that is less. So a blade opens no gap where it cuts. Its edge holds off
//! what has no side as in the explicit step, by the advance to `x + u`.
//!
//! What sticks to a flank it bears along by the particle's own present strength, `k (1 - l) A`, and where
//! that slides by what viscosity adds at the shear rate of the slide over h and dx.

use super::super::super::cut::ClassKey;
use super::super::super::frame::FrameReport;
use super::super::super::implicit::Work;
use super::super::super::params::Wall;
use super::super::super::penalty::{FOUND_DEPTH, Springs, Surface, reach};
use super::super::super::snapshot::ANCHORS_MAX;
use super::super::super::tool::Contact;
use super::super::particle::Particle;
use super::super::penalty::{hold_off, on_flank, springs};
use super::super::tools::{Moment, MovingTool, Surroundings};
use super::super::walls::is_arrived;
use glam::{DMat3, DVec3};

/// What tools and walls do to a particle at a place.
#[derive(Clone, Debug, Default)]
pub(super) struct Press {
    /// Force on the particle \[N\].
    pub(super) force: DVec3,
    /// Minus its slope [N/m].
    pub(super) stiffness: DMat3,
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
    let springs = springs(particle.rest_volume, around).in_implicit_step();
    // A matrix is the identity by default.
    let mut press = Press { stiffness: DMat3::ZERO, ..Press::default() };
    press.by_tools(particle, [start, at], &springs, around);
    press.by_blades(particle, [start, at], &springs, around);
    press.by_walls(particle, [start, at], &springs, around);
    press
}

/// How stiffly tools and walls press on a particle where it stands as the step begins [N/m].
pub(super) fn stiffness_still(particle: &Particle, around: &Surroundings) -> DMat3 {
    let start = around.domain.to_world(particle.position);
    let springs = springs(particle.rest_volume, around).in_implicit_step();
    let mut press = Press { stiffness: DMat3::ZERO, ..Press::default() };
    press.by_tools(particle, [start; 2], &springs, around);
    press.by_blades(particle, [start; 2], &springs, around);
    press.by_walls(particle, [start; 2], &springs, around);
    press.stiffness
}

/// Anchors to the blades the clay that they have just cut: a particle whose class was `before`, where it
/// stands as the step begins.
pub(super) fn cling(particle: &mut Particle, before: ClassKey, around: &Surroundings) {
    let (cell_width, start) = (around.domain.cell_width, around.domain.to_world(particle.position));
    let edge = 2.0 * reach(particle.rest_volume / cell_width.powi(3)) * cell_width;
    for tool in around.tools.iter().filter(|tool| !tool.is_solid()) {
        let sheet = tool.path.sheet_id();
        let side = particle.key().side(sheet);
        let Some(blade) = tool.blade.filter(|blade| blade.holds && side != before.side(sheet)) else { continue };
        let is_cut = (0.0..edge).contains(&blade.distance_before(side, start));
        let anchor = is_cut.then(|| (tool.path.id, tool.motion.start.to_local(start) / cell_width));
        let is_its = |kept: &Option<(u32, DVec3)>| kept.is_none_or(|kept| kept.0 == tool.path.id);
        if let Some(seat) = particle.anchors.iter().position(is_its) {
            particle.anchors[seat] = anchor;
        }
    }
}

impl Press {
    /// Books the work \[J\] of each tool on a way \[m\] of the particle.
    pub(super) fn book_work(&self, way: DVec3, works: &mut [Work]) {
        self.tools.iter().for_each(|(index, force)| works[*index].given += force.dot(way));
    }

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

    fn by_blades(&mut self, particle: &Particle, [start, at]: [DVec3; 2], springs: &Springs, around: &Surroundings) {
        let (cell_width, of_flank) = (around.domain.cell_width, on_flank(particle, springs, around));
        let reach = reach(particle.rest_volume / cell_width.powi(3)) * cell_width;
        for (index, tool) in around.tools.iter().enumerate().filter(|(_, tool)| !tool.is_solid()) {
            let side = particle.key().side(tool.path.sheet_id());
            if side == 0 {
                self.by_edge(particle, (index, tool), [start, at], springs, around);
                continue;
            }
            let Some(blade) = tool.blade else { continue };
            let Some((distance, normal)) = blade.flank(side, start, at) else { continue };
            let (from, to, id, contact) = (tool.motion.start, tool.motion.end, tool.path.id, tool.path.tool.contact);
            let kept = particle.anchors.iter().flatten().find(|anchor| anchor.0 == id).map(|anchor| anchor.1 * cell_width);
            let reach = match kept {
                Some(anchor) => blade.distance_of(side, anchor).max(0.0),
                None => blade.distance_before(side, start).clamp(0.0, reach),
            };
            let gap = distance - reach;
            // It never is found in the blade: it is cut.
            let surface = Surface { contact, gap, normal, leaving: gap / around.plan.dt };
            let anchor = match kept {
                Some(anchor) => Some(to.to_world(anchor)),
                None => (gap < 0.0 && contact.can_part()).then(|| to.to_world(from.to_local(start))),
            };
            let Some(touch) = of_flank.touch(&surface, at, anchor) else { continue };
            self.force += touch.force;
            self.stiffness += of_flank.stiffness(&surface, at, anchor, touch.force);
            self.tools.push((index, touch.force));
            let place = |anchor| blade.at_distance(side, to.to_local(anchor), reach);
            self.anchors.extend(touch.anchor.map(|anchor| (id, place(anchor) / cell_width)));
        }
    }

    fn by_edge(
        &mut self,
        particle: &Particle,
        (index, tool): (usize, &MovingTool),
        way: [DVec3; 2],
        springs: &Springs,
        around: &Surroundings,
    ) {
        let Some(held) = hold_off(particle, (index, tool), way, springs, around) else { return };
        self.force += held.force;
        self.stiffness += held.stiffness;
        self.anchors.push((tool.path.id, held.anchor));
        if held.force != DVec3::ZERO {
            self.tools.push((index, held.force));
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
            let (can_leave, was_noted) = (kind == Wall::Separate, particle.walls >> number & 1 == 1);
            if !can_leave && was_noted {
                continue;
            }
            let [gap_before, gap] = [start, at].map(|x| (x - face).dot(normal) - reach);
            let contact = Contact::Separate { friction: 0.0 };
            let surface = Surface { contact, gap, normal, leaving: (gap - gap_before) / around.plan.dt };
            let anchor = was_noted.then_some(at);
            let Some(touch) = springs.touch(&surface, at, anchor) else { continue };
            self.force += touch.force;
            self.stiffness += springs.stiffness(&surface, at, anchor, touch.force);
            self.on_walls += touch.force;
            self.walls |= u32::from(can_leave && touch.anchor.is_some()) << number;
        }
    }

    /// Keeps the anchors and the walls.
    pub(super) fn settle(&self, particle: &mut Particle, around: &Surroundings) {
        particle.anchors = std::array::from_fn::<_, ANCHORS_MAX, _>(|i| self.anchors.get(i).copied());
        particle.walls = self.walls | is_arrived(particle, particle.position, around);
    }

    /// Gives tools and walls the step's impulses, of a particle at `world` \[m\].
    pub(super) fn book(&self, world: DVec3, around: &Surroundings, frame: &mut FrameReport) {
        for (index, force) in &self.tools {
            let (felt, given) = (&mut frame.tools[*index], *force * around.plan.dt);
            felt.impulse -= given;
            felt.angular_impulse -= (world - around.tools[*index].motion.end.position).cross(given);
            felt.contacts += 1;
            frame.impulse_scale += given.length();
        }
        frame.wall_impulse += self.on_walls * around.plan.dt;
        frame.impulse_scale += self.on_walls.length() * around.plan.dt;
    }
}
