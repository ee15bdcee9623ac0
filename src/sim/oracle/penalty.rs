//! Clay against solid tools, the edges of blades and separating walls: the [law of
//! contact](super::super::penalty), particle by particle.
//!
//! For each particle at its place of `t`, and each solid tool of the plan in order at its pose of `t + h`:
//! `g = s(x) - r` with the shape's signed distance and [`reach`] of the rest volume in cells^3, n the
//! shape's outward normal at x. [`Springs`] have `M = lambda + 2 mu` of the plan's material: per cell `A
//! kappa M / dx`, `A k_t M / dx`, and `k A` of the fresh clay's shear strength k, `A` = [`area`] in m^2.
//! The anchor is a place in the tool's frame, kept from substep to substep for as long as they touch; a
//! particle keeps at most [`ANCHORS_MAX`] of them, those of the first tools in the plan's order, and a tool
//! beyond these presses without friction or bond. What is found in several comes out of them in their
//! order. The impulse `h F` goes to the nodes with the particle's own momentum ([`p2g`](super::p2g)),
//! before walls fold; the tool feels `-h F` at x, about its origin at `t + h`. [Walls](super::walls::touch)
//! come after the tools. A growing ball of validation cases has its radius of `t + h`.
//!
//! A blade, a wire, presses by its edge on particles without a side of its sheet that are
//! [ahead](super::super::tool::EDGE_REACH) of it as they stand at `t` and it at `t + h`, with the share K
//! there: along the edge's outward normal m by [`Springs::cut`], its advance `m . (a - x)` from the anchor a,
//! or from where x stood before the tool at `t`, and at most `R V_p K / dx^2`, of what it has
//! [to part](super::super::ahead) there. Anchors of a wire are in the frame of the strip that it leaves; a
//! wire that stands has no edge.

use super::super::ahead::ClayAhead;
use super::super::cutting::CuttingMethod;
use super::super::frame::FrameReport;
use super::super::penalty::{NORMAL_STIFFNESS, STICK_FRICTION, Springs, Surface, TANGENTIAL_STIFFNESS, area, reach};
use super::super::snapshot::ANCHORS_MAX;
use super::super::tool::Blade;
use super::particle::Particle;
use super::tools::{Moment, MovingTool, Surroundings};
use super::walls;
use glam::{DMat3, DVec3};

/// The impulse \[N s\] of solid tools and walls on each particle in the substep; moves the anchors and gives
/// the tools the opposite.
pub(super) fn press(particles: &mut [Particle], around: &Surroundings, frame: &mut FrameReport) -> Vec<DVec3> {
    let presses = match around.plan.cutting {
        CuttingMethod::TwoFields | CuttingMethod::Published | CuttingMethod::RigidParticles => true,
        CuttingMethod::InteractiveParticles => false,
    };
    let press = |p: &mut Particle| {
        let springs = springs(p.rest_volume, around);
        let impulse = if presses { press_on(p, &springs, around, frame) } else { DVec3::ZERO };
        impulse + walls::touch(p, &springs, impulse, around, frame)
    };
    particles.iter_mut().map(press).collect()
}

fn press_on(particle: &mut Particle, springs: &Springs, around: &Surroundings, frame: &mut FrameReport) -> DVec3 {
    let cell_width = around.domain.cell_width;
    let world = around.domain.to_world(particle.position);
    let volume = particle.rest_volume / cell_width.powi(3);
    let mass = around.plan.inertial_density() * particle.rest_volume;
    let (mut impulse, mut anchors) = (DVec3::ZERO, vec![]);
    for ((index, tool), felt) in around.tools.iter().enumerate().zip(&mut frame.tools) {
        let mut book = |given: DVec3| {
            felt.impulse -= given;
            felt.angular_impulse -= (world - tool.motion.end.position).cross(given);
            felt.contacts += 1;
            frame.impulse_scale += given.length();
        };
        if !tool.is_solid() {
            let Some(held) = hold_off(particle, (index, tool), [world; 2], springs, around) else { continue };
            anchors.push((tool.path.id, held.anchor));
            impulse += held.force * around.plan.dt;
            if held.force != DVec3::ZERO {
                book(held.force * around.plan.dt);
            }
            continue;
        }
        let (pose, id) = (tool.motion.end, tool.path.id);
        let gap = tool.distance(world, Moment::End) - reach(volume) * cell_width;
        let normal = tool.normal(world);
        let leaving = normal.dot(particle.velocity + impulse / mass - tool.velocity(world));
        let surface = Surface { contact: tool.path.tool.contact, gap, normal, leaving };
        let before = particle.anchors.iter().flatten().find(|anchor| anchor.0 == id);
        let Some(touch) = springs.touch(&surface, world, before.map(|anchor| pose.to_world(anchor.1 * cell_width))) else {
            continue;
        };
        anchors.extend(touch.anchor.map(|at| (id, pose.to_local(at) / cell_width)));
        let given = touch.force * around.plan.dt;
        impulse += given;
        book(given);
    }
    particle.anchors = std::array::from_fn::<_, ANCHORS_MAX, _>(|i| anchors.get(i).copied());
    impulse
}

/// What the edges of the substep's blades have ahead, of particles that have taken their sides.
pub(super) fn look_ahead(particles: &[Particle], around: &Surroundings) -> ClayAhead {
    let mut ahead = ClayAhead::default();
    for (index, tool) in around.tools.iter().enumerate().filter(|(_, tool)| !tool.is_solid()) {
        let (Some(blade), sheet) = (&tool.blade, tool.path.sheet_id()) else { continue };
        for particle in particles.iter().filter(|p| p.key().side(sheet) == 0) {
            if let Some(edge) = blade.edge(around.domain.to_world(particle.position)) {
                let volume = particle.rest_volume / around.domain.cell_width.powi(3);
                ahead.see((index, particle.key()), volume, edge.share, edge.beside);
            }
        }
    }
    ahead
}

/// What the edge of a blade does to a particle.
pub(super) struct Held {
    /// Force on the particle \[N\].
    pub(super) force: DVec3,
    /// Minus its slope [N/m].
    pub(super) stiffness: DMat3,
    /// Where it clings to the blade: a place in its frame \[cells\].
    pub(super) anchor: DVec3,
}

/// How the edge of a blade holds off a particle that has come from the first place \[m\] to the second in the
/// step.
pub(super) fn hold_off(
    particle: &Particle,
    (index, tool): (usize, &MovingTool),
    [start, at]: [DVec3; 2],
    springs: &Springs,
    around: &Surroundings,
) -> Option<Held> {
    let cell_width = around.domain.cell_width;
    // The methods of others know no toughness.
    let resists = around.plan.cutting.keeps_cuts() && springs.toughness > 0.0;
    let is_whole = particle.key().side(tool.path.sheet_id()) == 0;
    let blade: &Blade = tool.blade.as_ref().filter(|_| resists && is_whole)?;
    let edge = blade.edge(start)?;
    let share = edge.share * around.ahead.wholeness(index, particle.key());
    let kept = particle.anchors.iter().flatten().find(|anchor| anchor.0 == tool.path.id);
    let advance = blade.advance(&edge, at, kept.map(|anchor| anchor.1 * cell_width));
    let (force, left) = springs.cut(share, advance);
    Some(Held {
        force: edge.direction * force,
        stiffness: Springs::cut_stiffness(edge.direction, force, advance),
        anchor: blade.edge_anchor(&edge, at, left) / cell_width,
    })
}

/// Those of a particle on the flank of a blade: the clay's present strength, and what viscosity adds where
/// the cell beside it shears.
pub(super) fn on_flank(particle: &Particle, springs: &Springs, around: &Surroundings) -> Springs {
    let (material, cell_width) = (&around.plan.material, around.domain.cell_width);
    let area = area(particle.rest_volume / cell_width.powi(3)) * cell_width * cell_width;
    let left = (1.0 - around.strength_lost(particle)).max(0.0);
    let viscous = material.viscous_shear_stress(1.0 / cell_width) * area;
    springs.of_blade(material.shear_strength_at_tool() * left * area, [viscous, material.flow_index])
}

/// The springs of a particle of rest volume `volume` [m^3], in SI units.
pub(super) fn springs(volume: f64, around: &Surroundings) -> Springs {
    let (material, cell_width) = (&around.plan.material, around.domain.cell_width);
    let modulus = material.lame_lambda() + 2.0 * material.lame_mu();
    let area = area(volume / cell_width.powi(3)) * cell_width * cell_width;
    Springs {
        normal: NORMAL_STIFFNESS * modulus * area / cell_width,
        tangential: TANGENTIAL_STIFFNESS * modulus * area / cell_width,
        strength: material.shear_strength() * area,
        toughness: material.toughness * volume / (cell_width * cell_width),
        grip: STICK_FRICTION,
        viscous: [0.0, 1.0],
        inertia: around.plan.inertial_density() * volume / around.plan.dt,
        cell: cell_width,
        speed: cell_width / around.plan.dt,
    }
}
