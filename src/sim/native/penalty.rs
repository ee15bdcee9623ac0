//! Solid tools, edges of blades and walls press on the particles of a block, beside its scatter: the [law of
//! contact](super::super::penalty) in cells, substeps and eighths of a full cell's mass. In f64, one particle
//! after the other.

use super::super::ahead::ClayAhead;
use super::super::coefficients::ContactCoefficients;
use super::super::cutting::CuttingMethod;
use super::super::params::Domain;
use super::super::penalty::{BOND_REACH, STICK_FRICTION, Springs, Surface, area, reach};
use super::super::snapshot::{ANCHORS_MAX, Anchor};
use super::super::tool::Blade;
use super::contact::ToolNow;
use super::grid_step::GridReport;
use super::state::{Cold, Hot};
use super::walls::{Arrivals, NearWall};
use glam::{DVec3, IVec3};

/// The tools that press on particles and the walls of a substep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Presses<'a> {
    pub tools: &'a [ToolNow],
    pub cutting: CuttingMethod,
    pub springs: ContactCoefficients,
    pub domain: &'a Domain,
    /// None where walls clamp their nodes.
    pub arrivals: Option<&'a Arrivals>,
    /// What the edges of the tools have ahead.
    pub ahead: &'a ClayAhead,
}

impl<'a> Presses<'a> {
    /// The press of the tools and walls near `block`, if there are any.
    pub(super) fn near(&self, block: IVec3) -> Option<Press<'a>> {
        let tools: Vec<_> = self.tools.iter().enumerate().filter(|t| self.acts(t.1) && t.1.is_near_block(block)).collect();
        let walls = self.arrivals.map(|arrivals| (NearWall::of(block, self.domain), arrivals)).filter(|w| !w.0.is_empty());
        let report = || GridReport::of_tools(self.tools.len());
        let is_any = !tools.is_empty() || walls.is_some();
        let weakens = tools.iter().any(|(_, tool)| self.weakens(tool));
        is_any.then(|| Press { tools, walls, springs: self.springs, weakens, ahead: self.ahead, report: report() })
    }

    /// Whether a tool presses on particles: as a solid one, or by its edge.
    fn acts(&self, tool: &ToolNow) -> bool {
        match self.cutting {
            CuttingMethod::TwoFields => tool.is_solid() || self.springs.toughness > 0.0 || self.weakens(tool),
            CuttingMethod::Published | CuttingMethod::RigidParticles => tool.is_solid(),
            CuttingMethod::InteractiveParticles => false,
        }
    }
}

impl Presses<'_> {
    /// Whether a blade holds clay by a strength that depends on what the clay has gone through.
    fn weakens(&self, tool: &ToolNow) -> bool {
        !tool.is_solid() && tool.contact.sticks() && self.springs.loss.is_any()
    }
}

/// What a tool does to a particle, and where that clings to it.
type Given = (DVec3, Option<DVec3>);

/// The tools and walls near a block, and what they felt of it.
#[derive(Debug)]
pub(super) struct Press<'a> {
    tools: Vec<(usize, &'a ToolNow)>,
    walls: Option<(Vec<NearWall>, &'a Arrivals)>,
    springs: ContactCoefficients,
    /// Whether nodes have to know what clay has lost of its strength.
    weakens: bool,
    ahead: &'a ClayAhead,
    pub report: GridReport,
}

impl Press<'_> {
    /// The velocity [cells/substep] that tools and walls give to a particle with `velocity`; moves its
    /// anchors, notes the walls that it touches or has arrived at.
    pub(super) fn on(&mut self, hot: &Hot, cold: &mut Cold, velocity: DVec3) -> [f32; 3] {
        let at = hot.place();
        // A particle's mass is its rest volume over an eighth of a cell.
        let mass = f64::from(hot.mass);
        let volume = mass / 8.0;
        let mut sum = [0.0f32; 3];
        let (mut anchors, mut count) = ([Anchor::default(); ANCHORS_MAX], 0);
        for &(index, tool) in &self.tools {
            let before = cold.anchors.iter().find_map(|anchor| anchor.get().filter(|anchor| anchor.0 == tool.id));
            let before = before.map(|anchor| anchor.1);
            let own = velocity + DVec3::from_array(sum.map(f64::from));
            let is_whole = || cold.key().side(tool.sheet) == 0;
            let found = match tool.blade.filter(|_| !tool.is_solid()) {
                Some(blade) if is_whole() => {
                    let wholeness = || self.ahead.wholeness(index, cold.key());
                    self.springs.hold_off(&blade, (volume, wholeness), [at; 2], before)
                }
                Some(_) => None,
                None => self.press(tool, (at, own, volume), before),
            };
            let Some((force, anchor)) = found else { continue };
            if let (Some(to), Some(anchor)) = (anchors.get_mut(count), anchor) {
                *to = Anchor::on(tool.id, anchor);
                count += 1;
            }
            if force == DVec3::ZERO && !tool.is_solid() {
                continue;
            }
            // What the tool feels is what the clay gets, to the last bit.
            let given = (force / mass).as_vec3();
            sum = std::array::from_fn(|d| sum[d] + given[d]);
            self.report.give(index, tool, at, -mass * given.as_dvec3());
            self.report.tools[index].2 += 1;
        }
        cold.anchors = anchors;
        let noted = std::mem::take(&mut cold.walls);
        let Some((walls, arrivals)) = &self.walls else { return sum };
        for wall in walls {
            let springs = || self.springs.of(volume);
            let own = velocity + DVec3::from_array(sum.map(f64::from));
            let (given, is_noted) = wall.touch((at, own, volume), springs, noted & wall.bit() != 0, arrivals);
            if given != DVec3::ZERO {
                let given = given.as_vec3();
                sum = std::array::from_fn(|d| sum[d] + given[d]);
                self.report.push_by_wall(mass * given.as_dvec3());
            }
            cold.walls |= if is_noted { wall.bit() } else { 0 };
        }
        sum
    }

    /// What a particle has lost of its strength at tools, where nodes have to know [-].
    #[expect(clippy::cast_possible_truncation, reason = "nodes are f32")]
    pub(super) fn strength_lost(&self, hot: &Hot, cold: &Cold) -> f32 {
        if self.weakens { self.springs.loss.of(cold.structure.into(), hot.hardening.into()) as f32 } else { 0.0 }
    }

    /// What a solid tool does to a particle at `at` that moves so and clings to it there, and where it clings
    /// now, in the tool's frame.
    fn press(&self, tool: &ToolNow, (at, velocity, volume): (DVec3, DVec3, f64), before: Option<DVec3>) -> Option<Given> {
        let pose = tool.motion.end;
        let local = pose.to_local(at);
        let gap = tool.shape.distance(local) - reach(volume);
        if gap >= BOND_REACH {
            return None;
        }
        let normal = pose.rotation * tool.shape.normal(local);
        let leaving = normal.dot(velocity - tool.motion.velocity_at(at));
        let surface = Surface { contact: tool.contact, gap, normal, leaving };
        let touch = self.springs.of(volume).touch(&surface, at, before.map(|anchor| pose.to_world(anchor)))?;
        Some((touch.force, touch.anchor.map(|anchor| pose.to_local(anchor))))
    }
}

impl ContactCoefficients {
    /// What the edge of a blade does to a particle without a side of it, of clay that is so whole, that has
    /// come from the first place to the second in the step and clings to it there, and where it clings now,
    /// in the blade's frame.
    fn hold_off(
        &self,
        blade: &Blade,
        (volume, wholeness): (f64, impl Fn() -> f64),
        [start, at]: [DVec3; 2],
        before: Option<DVec3>,
    ) -> Option<Given> {
        let edge = if self.toughness > 0.0 { blade.edge(start)? } else { return None };
        let (force, left) = self.of(volume).cut(edge.share * wholeness(), blade.advance(&edge, at, before));
        Some((edge.direction * force, Some(blade.edge_anchor(&edge, at, left))))
    }

    /// Those of one that was worked to D = `structure` and has the plastic strain `hardening`, on the flank
    /// of a blade.
    pub(super) fn on_flank(&self, volume: f64, structure: f64, hardening: f64) -> Springs {
        let [strength, viscous, flow_index] = self.flank;
        let left = (1.0 - self.loss.of(structure, hardening)).max(0.0);
        self.of(volume).of_blade(strength * left * area(volume), [viscous * area(volume), flow_index])
    }

    /// The springs of a particle of rest volume `volume` [cells^3].
    pub(super) fn of(&self, volume: f64) -> Springs {
        let area = area(volume);
        Springs {
            normal: self.normal * area,
            tangential: self.tangential * area,
            strength: self.strength * area,
            toughness: self.toughness * volume,
            grip: STICK_FRICTION,
            viscous: [0.0, 1.0],
            inertia: 8.0 * volume,
            cell: 1.0,
            speed: 1.0,
        }
    }
}
