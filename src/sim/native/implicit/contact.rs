//! Solid tools and separating walls press on particles at the step's end, in cells, steps and eighths of a
//! full cell's mass; in f64, one particle after the other.

use super::super::super::coefficients::ContactCoefficients;
use super::super::super::params::Domain;
use super::super::super::penalty::{FOUND_DEPTH, Surface, reach};
use super::super::super::snapshot::{ANCHORS_MAX, Anchor};
use super::super::super::tool::Contact;
use super::super::contact::ToolNow;
use super::super::grid_step::GridReport;
use super::super::state::{Cold, Hot, unpack_cell};
use super::super::walls::NearWall;
use glam::{DVec3, IVec3};

/// The solid tools and the separating walls near a block.
#[derive(Debug)]
pub(super) struct Near<'a> {
    tools: Vec<(usize, &'a ToolNow)>,
    walls: Vec<NearWall>,
    springs: ContactCoefficients,
}

/// What tools and walls do to a particle at a place.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Press {
    /// Impulse of the step over the particle's mass [cells/step].
    pub(super) velocity: [f32; 3],
    /// The diagonal of minus its slope, over the mass [1/step].
    pub(super) stiffness: [f32; 3],
}

impl<'a> Near<'a> {
    /// Those near `block`, if there are any.
    pub(super) fn of(block: IVec3, tools: &'a [ToolNow], domain: &Domain, springs: ContactCoefficients) -> Option<Self> {
        let is_near = |t: &(usize, &ToolNow)| t.1.is_solid() && t.1.is_near_block(block);
        let tools: Vec<_> = tools.iter().enumerate().filter(is_near).collect();
        let walls: Vec<_> = NearWall::of(block, domain).into_iter().filter(NearWall::is_separating).collect();
        (!tools.is_empty() || !walls.is_empty()).then_some(Self { tools, walls, springs })
    }

    /// What presses on a particle that has moved by `moved` \[cells\]; with a report the step ends so: anchors
    /// and walls are kept, tools and walls get their impulses.
    pub(super) fn press(&self, hot: &Hot, cold: &Cold, moved: DVec3, end: Option<(&mut Cold, &mut GridReport)>) -> Press {
        let cell = IVec3::from_array(unpack_cell(hot.cell)).as_dvec3();
        let start = cell + DVec3::from_array(hot.offset.map(f64::from));
        let mass = f64::from(hot.mass);
        let mut sum = Sum { volume: mass / 8.0, ..Sum::default() };
        self.by_tools(cold, [start, start + moved], &mut sum);
        self.by_walls(cold, [start, start + moved], &mut sum);
        if let Some((kept, report)) = end {
            kept.anchors = sum.anchors;
            kept.walls = kept.walls & !separating(&self.walls) | sum.walls;
            for (index, force) in &sum.tools {
                let Some((_, tool)) = self.tools.iter().find(|t| t.0 == *index) else { continue };
                report.give(*index, tool, start + moved, -*force);
                report.tools[*index].2 += 1;
            }
            if sum.on_walls != DVec3::ZERO {
                report.push_by_wall(sum.on_walls);
            }
        }
        Press { velocity: (sum.force / mass).as_vec3().to_array(), stiffness: (sum.stiffness / mass).as_vec3().to_array() }
    }

    fn by_tools(&self, cold: &Cold, [start, at]: [DVec3; 2], sum: &mut Sum) {
        let reach = reach(sum.volume);
        let mut count = 0;
        for &(index, tool) in &self.tools {
            let (from, to) = (tool.motion.start, tool.motion.end);
            let local = to.to_local(at);
            let gap = tool.shape.distance(local) - reach;
            if gap >= super::super::super::penalty::BOND_REACH {
                continue;
            }
            let gap_before = tool.shape.distance(from.to_local(start)) - reach;
            let normal = to.rotation * tool.shape.normal(local);
            let surface = Surface { contact: tool.contact, gap, normal, leaving: gap - gap_before };
            let kept = cold.anchors.iter().find_map(|anchor| anchor.get().filter(|anchor| anchor.0 == tool.id));
            let comes = gap < 0.0 && gap_before >= -FOUND_DEPTH && tool.contact.can_part();
            let anchor = match kept {
                Some(anchor) => Some(to.to_world(anchor.1)),
                None => comes.then(|| to.to_world(from.to_local(start))),
            };
            let springs = self.springs.of(sum.volume);
            let Some(touch) = springs.touch(&surface, at, anchor) else { continue };
            sum.force += touch.force;
            sum.stiffness += springs.stiffness(&surface, at, anchor, touch.force);
            sum.tools.push((index, touch.force));
            if let (Some(seat), Some(anchor)) = (sum.anchors.get_mut(count), touch.anchor) {
                *seat = Anchor::on(tool.id, to.to_local(anchor));
                count += 1;
            }
        }
    }

    fn by_walls(&self, cold: &Cold, [start, at]: [DVec3; 2], sum: &mut Sum) {
        let reach = reach(sum.volume);
        for wall in &self.walls {
            let [gap_before, gap] = [start, at].map(|x| wall.distance(x) - reach);
            let contact = Contact::Separate { friction: 0.0 };
            let surface = Surface { contact, gap, normal: wall.normal(), leaving: gap - gap_before };
            let springs = self.springs.of(sum.volume);
            let anchor = (cold.walls & wall.bit() != 0).then_some(at);
            let Some(touch) = springs.touch(&surface, at, anchor) else { continue };
            sum.force += touch.force;
            sum.stiffness += springs.stiffness(&surface, at, anchor, touch.force);
            sum.on_walls += touch.force;
            sum.walls |= if touch.anchor.is_some() { wall.bit() } else { 0 };
        }
    }
}

/// Bits of these walls.
fn separating(walls: &[NearWall]) -> u32 {
    walls.iter().map(NearWall::bit).sum()
}

/// What a particle gets, in the engine's units.
#[derive(Default)]
struct Sum {
    /// Rest volume [cells^3].
    volume: f64,
    force: DVec3,
    stiffness: DVec3,
    tools: Vec<(usize, DVec3)>,
    on_walls: DVec3,
    anchors: [Anchor; ANCHORS_MAX],
    walls: u32,
}
