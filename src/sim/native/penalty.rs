//! Solid tools and walls press on the particles of a block, beside its scatter: the [law of
//! contact](super::super::penalty) in cells, substeps and eighths of a full cell's mass. In f64, one particle
//! after the other.

use super::super::coefficients::ContactCoefficients;
use super::super::cutting::CuttingMethod;
use super::super::params::Domain;
use super::super::penalty::{BOND_REACH, STICK_FRICTION, Springs, Surface, area, reach};
use super::super::snapshot::{ANCHORS_MAX, Anchor};
use super::contact::ToolNow;
use super::grid_step::GridReport;
use super::state::{Cold, Hot, unpack_cell};
use super::walls::{Arrivals, NearWall};
use glam::{DVec3, IVec3};

/// The solid tools and the walls of a substep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Presses<'a> {
    pub tools: &'a [ToolNow],
    pub cutting: CuttingMethod,
    pub springs: ContactCoefficients,
    pub domain: &'a Domain,
    /// None where walls clamp their nodes.
    pub arrivals: Option<&'a Arrivals>,
}

impl<'a> Presses<'a> {
    /// The press of the tools and walls near `block`, if there are any.
    pub(super) fn near(&self, block: IVec3) -> Option<Press<'a>> {
        let presses = match self.cutting {
            CuttingMethod::TwoFields | CuttingMethod::Published | CuttingMethod::RigidParticles => true,
            CuttingMethod::InteractiveParticles => false,
        };
        let is_near = |t: &&(usize, &'a ToolNow)| presses && t.1.is_solid() && t.1.is_near_block(block);
        let tools: Vec<_> = self.tools.iter().enumerate().filter(|t| is_near(&t)).collect();
        let walls = self.arrivals.map(|arrivals| (NearWall::of(block, self.domain), arrivals)).filter(|w| !w.0.is_empty());
        let report = || GridReport::of_tools(self.tools.len());
        let is_any = !tools.is_empty() || walls.is_some();
        is_any.then(|| Press { tools, walls, springs: self.springs, report: report() })
    }
}

/// The solid tools and walls near a block, and what they felt of it.
#[derive(Debug)]
pub(super) struct Press<'a> {
    tools: Vec<(usize, &'a ToolNow)>,
    walls: Option<(Vec<NearWall>, &'a Arrivals)>,
    springs: ContactCoefficients,
    pub report: GridReport,
}

impl Press<'_> {
    /// The velocity [cells/substep] that tools and walls give to a particle with `velocity`; moves its
    /// anchors, notes the walls that it touches or has arrived at.
    pub(super) fn on(&mut self, hot: &Hot, cold: &mut Cold, velocity: DVec3) -> [f32; 3] {
        let cell = IVec3::from_array(unpack_cell(hot.cell));
        let at = cell.as_dvec3() + DVec3::from_array(hot.offset.map(f64::from));
        // A particle's mass is its rest volume over an eighth of a cell.
        let mass = f64::from(hot.mass);
        let volume = mass / 8.0;
        let reach = reach(volume);
        let mut sum = [0.0f32; 3];
        let (mut anchors, mut count) = ([Anchor::default(); ANCHORS_MAX], 0);
        let mut springs = None;
        for &(index, tool) in &self.tools {
            let pose = tool.motion.end;
            let local = pose.to_local(at);
            let gap = tool.shape.distance(local) - reach;
            if gap >= BOND_REACH {
                continue;
            }
            let springs = springs.get_or_insert_with(|| self.springs.of(volume));
            let normal = pose.rotation * tool.shape.normal(local);
            let leaving = normal.dot(velocity + DVec3::from_array(sum.map(f64::from)) - tool.motion.velocity_at(at));
            let surface = Surface { contact: tool.contact, gap, normal, leaving };
            let before = cold.anchors.iter().find_map(|anchor| anchor.get().filter(|anchor| anchor.0 == tool.id));
            let Some(touch) = springs.touch(&surface, at, before.map(|anchor| pose.to_world(anchor.1))) else { continue };
            if let (Some(to), Some(anchor)) = (anchors.get_mut(count), touch.anchor) {
                *to = Anchor::on(tool.id, pose.to_local(anchor));
                count += 1;
            }
            // What the tool feels is what the clay gets, to the last bit.
            let given = (touch.force / mass).as_vec3();
            sum = std::array::from_fn(|d| sum[d] + given[d]);
            self.report.give(index, tool, at, -mass * given.as_dvec3());
            self.report.tools[index].2 += 1;
        }
        cold.anchors = anchors;
        let noted = std::mem::take(&mut cold.walls);
        let Some((walls, arrivals)) = &self.walls else { return sum };
        for wall in walls {
            let springs = || springs.unwrap_or_else(|| self.springs.of(volume));
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
}

impl ContactCoefficients {
    /// The springs of a particle of rest volume `volume` [cells^3].
    pub(super) fn of(&self, volume: f64) -> Springs {
        let area = area(volume);
        Springs {
            normal: self.normal * area,
            tangential: self.tangential * area,
            strength: self.strength * area,
            grip: STICK_FRICTION,
            inertia: 8.0 * volume,
            cell: 1.0,
            speed: 1.0,
        }
    }
}
