//! Tools, and walls that do not hold it, press on clay at the step's end, in cells, steps and eighths of a
//! full cell's mass; in f64, one particle after the other.

use super::super::super::ahead::ClayAhead;
use super::super::super::coefficients::ContactCoefficients;
use super::super::super::cut::ClassKey;
use super::super::super::params::Domain;
use super::super::super::penalty::{BOND_REACH, FOUND_DEPTH, Springs, Surface, reach};
use super::super::super::snapshot::{ANCHORS_MAX, Anchor};
use super::super::super::tool::{Blade, Contact};
use super::super::contact::ToolNow;
use super::super::grid_step::GridReport;
use super::super::state::{Cold, Hot};
use super::super::walls::NearWall;
use glam::{DMat3, DVec3, IVec3};

/// Of a clearance [cells]: coordinates of some hundred cells are f32.
const ROUNDING: f64 = 1e-3;

/// The tools and the walls near a block.
#[derive(Debug)]
pub(super) struct Near<'a> {
    /// The solid ones.
    tools: Vec<(usize, &'a ToolNow)>,
    /// Those that hold clay off on either side, or by their edge.
    blades: Vec<(usize, &'a ToolNow, Blade)>,
    walls: Vec<NearWall>,
    springs: ContactCoefficients,
    /// What the edges of all tools have ahead.
    ahead: &'a ClayAhead,
}

/// What tools and walls do to a particle at a place.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Press {
    /// Impulse of the step over the particle's mass [cells/step].
    pub(super) velocity: [f32; 3],
    /// Minus its slope, over the mass [1/step]: the diagonal, and what is beside it.
    pub(super) stiffness: [[f32; 3]; 2],
}

impl<'a> Near<'a> {
    /// Those near `block`, if there are any.
    pub(super) fn of(
        block: IVec3,
        (all, ahead): (&'a [ToolNow], &'a ClayAhead),
        domain: &Domain,
        springs: ContactCoefficients,
    ) -> Option<Self> {
        let is_near = |t: &(usize, &ToolNow)| t.1.is_solid() && t.1.is_near_block(block);
        let tools: Vec<_> = all.iter().enumerate().filter(is_near).collect();
        let blade = |(index, tool): (usize, &'a ToolNow)| {
            let acts = |blade: &Blade| blade.holds || springs.toughness > 0.0;
            let blade = tool.blade.filter(|blade| acts(blade) && !tool.is_solid() && tool.is_near_block(block))?;
            Some((index, tool, blade))
        };
        let blades: Vec<_> = all.iter().enumerate().filter_map(blade).collect();
        let walls = NearWall::of(block, domain);
        let is_any = !tools.is_empty() || !blades.is_empty() || !walls.is_empty();
        is_any.then_some(Self { tools, blades, walls, springs, ahead })
    }

    /// By how much a particle can move before anything here touches it \[cells\]: a distance changes by the
    /// way at most, and what clings is touched until it lets go.
    #[expect(clippy::cast_possible_truncation, reason = "a bound, with room for rounding")]
    pub(super) fn clearance(&self, hot: &Hot, cold: &Cold) -> f32 {
        let start = hot.place();
        let reach = reach(f64::from(hot.mass) / 8.0);
        let bond = if cold.anchors.iter().any(|anchor| anchor.get().is_some()) { BOND_REACH } else { 0.0 };
        let tools = self.tools.iter().map(|(_, tool)| tool.shape.distance(tool.motion.end.to_local(start)) - reach - bond);
        let blades = self.blades.iter().map(|(_, tool, blade)| match cold.key().side(tool.sheet) {
            // An edge is known by where a step begins.
            0 if self.springs.toughness > 0.0 && blade.edge(start).is_some() => f64::NEG_INFINITY,
            0 => f64::INFINITY,
            // What an edge had is held as far off as it came beside it.
            side => {
                let kept = cold.anchors.iter().find_map(|anchor| anchor.get().filter(|anchor| anchor.0 == tool.id));
                let reach = kept.map_or(reach, |anchor| blade.distance_of(side, anchor.1).max(reach));
                blade.distance_least(side, start) - reach - bond
            }
        });
        let walls = self.walls.iter().filter(|wall| !wall.holds(cold.walls)).map(|wall| wall.distance(start) - reach);
        (tools.chain(blades).chain(walls).fold(f64::INFINITY, f64::min) - ROUNDING) as f32
    }

    /// What presses on a particle that has moved by `moved` \[cells\], and if that is asked for how stiffly;
    /// with a report the step ends so: anchors and walls are kept, and tools and walls get the impulses.
    pub(super) fn press(
        &self,
        (hot, cold): (&Hot, &Cold),
        moved: DVec3,
        is_stiffness_asked: bool,
        end: Option<(&mut Cold, &mut GridReport)>,
    ) -> Press {
        let start = hot.place();
        let mass = f64::from(hot.mass);
        let asked = match (is_stiffness_asked, &end) {
            (true, _) => Asked::Stiffness,
            (false, Some(_)) => Asked::Tools,
            (false, None) => Asked::Force,
        };
        let sum = self.at(mass / 8.0, (cold, hot.hardening), [start, start + moved], asked);
        if let Some((kept, report)) = end {
            let came = DVec3::from_array(hot.velocity.map(f64::from));
            kept.anchors = sum.anchors;
            kept.walls = kept.walls & !separating(&self.walls) | sum.walls;
            for (index, tool, force) in &sum.tools {
                report.give(*index, tool, start + moved, -*force);
                report.tools[*index].2 += 1;
                report.given[*index] += force.dot(came);
            }
            if sum.on_walls != DVec3::ZERO {
                report.push_by_wall(sum.on_walls);
            }
        }
        Press { velocity: (sum.force / mass).as_vec3().to_array(), stiffness: sum.stiffness_over(mass) }
    }

    /// How stiffly tools and walls press on a particle where it stands [1/step].
    pub(super) fn stiffness_still(&self, (hot, cold): (&Hot, &Cold)) -> [[f32; 3]; 2] {
        let start = hot.place();
        let mass = f64::from(hot.mass);
        let mut sum = Sum { volume: mass / 8.0, asked: Asked::Stiffness, stiffness: DMat3::ZERO, ..Sum::default() };
        self.by_tools(cold, [start; 2], &mut sum);
        self.by_blades(cold, hot.hardening, [start; 2], &mut sum);
        self.by_walls(cold, [start; 2], &mut sum);
        sum.stiffness_over(mass)
    }

    /// A particle ends the step away from everything.
    pub(super) fn leave(&self, kept: &mut Cold) {
        kept.anchors = Default::default();
        kept.walls &= !separating(&self.walls);
    }

    /// What acts on a particle of this rest volume [cells^3] that has come from the first place to the
    /// second.
    fn at(&self, volume: f64, (cold, hardening): (&Cold, f32), way: [DVec3; 2], asked: Asked) -> Sum<'a> {
        // A matrix is the identity by default.
        let mut sum = Sum { volume, asked, stiffness: DMat3::ZERO, ..Sum::default() };
        self.by_tools(cold, way, &mut sum);
        self.by_blades(cold, hardening, way, &mut sum);
        self.by_walls(cold, way, &mut sum);
        sum
    }

    fn by_tools(&self, cold: &Cold, [start, at]: [DVec3; 2], sum: &mut Sum<'a>) {
        let reach = reach(sum.volume);
        for &(index, tool) in &self.tools {
            let (from, to) = (tool.motion.start, tool.motion.end);
            let local = to.to_local(at);
            let gap = tool.shape.distance(local) - reach;
            if gap >= BOND_REACH {
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
            let springs = self.springs.of(sum.volume).in_implicit_step();
            sum.by_tool((index, tool), &springs, &surface, at, anchor, |anchor| anchor);
        }
    }

    fn by_blades(&self, cold: &Cold, hardening: f32, [start, at]: [DVec3; 2], sum: &mut Sum<'a>) {
        for (index, tool, blade) in &self.blades {
            let side = cold.key().side(tool.sheet);
            let kept = cold.anchors.iter().find_map(|anchor| anchor.get().filter(|anchor| anchor.0 == tool.id));
            if side == 0 {
                self.by_edge((*index, *tool, cold.key()), blade, [start, at], kept.map(|anchor| anchor.1), sum);
                continue;
            }
            let Some((distance, normal)) = blade.flank(side, start, at) else { continue };
            let (from, to) = (tool.motion.start, tool.motion.end);
            let reach = match kept {
                Some((_, anchor)) => blade.distance_of(side, anchor).max(0.0),
                None => blade.distance_before(side, start).clamp(0.0, reach(sum.volume)),
            };
            let gap = distance - reach;
            // It never is found in the blade: it is cut.
            let surface = Surface { contact: tool.contact, gap, normal, leaving: gap };
            let anchor = match kept {
                Some((_, anchor)) => Some(to.to_world(anchor)),
                None => (gap < 0.0 && tool.contact.can_part()).then(|| to.to_world(from.to_local(start))),
            };
            let place = |anchor| blade.at_distance(side, anchor, reach);
            let springs = self.springs.on_flank(sum.volume, cold.structure.into(), hardening.into());
            sum.by_tool((*index, *tool), &springs, &surface, at, anchor, place);
        }
    }

    /// What the edge of a blade does to clay that has no side of it, by the anchor in the blade's frame.
    fn by_edge(
        &self,
        (index, tool, key): (usize, &'a ToolNow, ClassKey),
        blade: &Blade,
        [start, at]: [DVec3; 2],
        kept: Option<DVec3>,
        sum: &mut Sum<'a>,
    ) {
        let Some(edge) = (if self.springs.toughness > 0.0 { blade.edge(start) } else { None }) else { return };
        let advance = blade.advance(&edge, at, kept);
        let share = edge.share * self.ahead.wholeness(index, key);
        let (force, left) = self.springs.of(sum.volume).cut(share, advance);
        sum.force += edge.direction * force;
        match sum.asked {
            Asked::Force => {}
            Asked::Stiffness => sum.stiffness += Springs::cut_stiffness(edge.direction, force, advance),
            Asked::Tools if force > 0.0 => sum.tools.push((index, tool, edge.direction * force)),
            Asked::Tools => {}
        }
        sum.keep(Anchor::on(tool.id, blade.edge_anchor(&edge, at, left)));
    }

    fn by_walls(&self, cold: &Cold, [start, at]: [DVec3; 2], sum: &mut Sum<'a>) {
        let reach = reach(sum.volume);
        for wall in self.walls.iter().filter(|wall| !wall.holds(cold.walls)) {
            let [gap_before, gap] = [start, at].map(|x| wall.distance(x) - reach);
            let contact = Contact::Separate { friction: 0.0 };
            let surface = Surface { contact, gap, normal: wall.normal(), leaving: gap - gap_before };
            let springs = self.springs.of(sum.volume).in_implicit_step();
            let anchor = (cold.walls & wall.bit() != 0).then_some(at);
            let Some(touch) = springs.touch(&surface, at, anchor) else { continue };
            sum.force += touch.force;
            sum.add_stiffness(&springs, &surface, at, anchor, touch.force);
            sum.on_walls += touch.force;
            sum.walls |= if wall.is_separating() && touch.anchor.is_some() { wall.bit() } else { 0 };
        }
    }
}

/// Bits of those of these walls that clay can leave.
fn separating(walls: &[NearWall]) -> u32 {
    walls.iter().filter(|wall| wall.is_separating()).map(NearWall::bit).sum()
}

/// What is to be found: the force alone, how stiff it is too, or by which tools it is. Most evaluations need
/// no more than the first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Asked {
    #[default]
    Force,
    Stiffness,
    Tools,
}

/// What a particle gets, in the engine's units.
#[derive(Default)]
struct Sum<'a> {
    asked: Asked,
    /// Rest volume [cells^3].
    volume: f64,
    force: DVec3,
    stiffness: DMat3,
    tools: Vec<(usize, &'a ToolNow, DVec3)>,
    on_walls: DVec3,
    anchors: [Anchor; ANCHORS_MAX],
    /// How many of them are taken.
    count: usize,
    walls: u32,
}

impl<'a> Sum<'a> {
    /// The stiffness over a mass: its diagonal, and what is beside it.
    fn stiffness_over(&self, mass: f64) -> [[f32; 3]; 2] {
        let [x, y, z] = [self.stiffness.x_axis, self.stiffness.y_axis, self.stiffness.z_axis];
        [DVec3::new(x.x, y.y, z.z), DVec3::new(y.z, z.x, x.y)].map(|of| (of / mass).as_vec3().to_array())
    }

    fn add_stiffness(&mut self, springs: &Springs, surface: &Surface, at: DVec3, anchor: Option<DVec3>, force: DVec3) {
        if self.asked == Asked::Stiffness {
            self.stiffness += springs.stiffness(surface, at, anchor, force);
        }
    }

    /// What a tool does to the particle at `at` that clings to it by `anchor`; `place` is where in the tool's
    /// frame the anchor is kept.
    fn by_tool(
        &mut self,
        (index, tool): (usize, &'a ToolNow),
        springs: &Springs,
        surface: &Surface,
        at: DVec3,
        anchor: Option<DVec3>,
        place: impl Fn(DVec3) -> DVec3,
    ) {
        let Some(touch) = springs.touch(surface, at, anchor) else { return };
        self.force += touch.force;
        self.add_stiffness(springs, surface, at, anchor, touch.force);
        if self.asked == Asked::Tools {
            self.tools.push((index, tool, touch.force));
        }
        if let Some(anchor) = touch.anchor {
            self.keep(Anchor::on(tool.id, place(tool.motion.end.to_local(anchor))));
        }
    }

    /// Keeps an anchor, if there is a seat for it.
    fn keep(&mut self, anchor: Anchor) {
        if let Some(seat) = self.anchors.get_mut(self.count) {
            *seat = anchor;
            self.count += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::super::params::Walls;
    use super::super::super::super::snapshot::Tag;
    use super::super::super::super::strength::StrengthLoss;
    use super::super::super::super::tool::{Pose, PoseSample, Profile, Tool, ToolPath, ToolShape};
    use super::super::super::super::validation::Validation;
    use super::super::super::state::pack_cell;
    use super::*;
    use glam::{DQuat, DVec2};

    const SPRINGS: ContactCoefficients = ContactCoefficients {
        normal: 4.0,
        tangential: 2.0,
        strength: 0.02,
        toughness: 0.05,
        flank: [0.02, 0.0, 1.0],
        loss: StrengthLoss { loss: 0.0, gain: 0.0 },
    };

    /// What is touched, of particles about a tool, and what is clear of it although the block is near: each
    /// stays clear as far as it says, clings to nothing then, and keeps what it clung to where it is not.
    fn touched_and_clear(shape: ToolShape, contact: Contact) -> [u32; 2] {
        let domain = Domain::new(DVec3::ZERO, DVec3::splat(24.0), 1.0, Walls::default()).expect("a room");
        let middle = DVec3::splat(12.0);
        let pose = |at: f64| Pose {
            position: middle + DVec3::new(0.1, 0.2, -0.1) * at,
            rotation: DQuat::from_rotation_x(0.4 + 0.05 * at),
        };
        let samples = [0.0, 1.0].map(|time| PoseSample { time, pose: pose(time) }).to_vec();
        let path = ToolPath { id: 3, tool: Tool { shape, contact }, sheet: 0, samples };
        let tools = [ToolNow::new(&path, &domain, &Validation::default(), 0.0, 1.0)];
        let mut random = 7u64;
        let mut any = |width: f64| {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            width * ((random >> 33) as f64 / (1u64 << 31) as f64 - 0.5)
        };
        let mut counts = [0; 2];
        for i in 0..4000 {
            let (at, moved) =
                (domain.to_grid(middle) + DVec3::new(any(6.0), any(6.0), any(6.0)), DVec3::new(any(1.0), any(1.0), any(1.0)));
            let cell = at.floor().as_ivec3();
            let hot = Hot {
                offset: (at - cell.as_dvec3()).as_vec3().to_array(),
                cell: pack_cell(cell.to_array()),
                mass: [1.0, 0.6, 1.3][i % 3],
                ..Hot::default()
            };
            let mut cold = Cold::default();
            let side = tools[0].blade.map_or(0, |blade| if blade.distance_before(1, at) < 0.0 { -1 } else { 1 });
            if i % 2 == 0 {
                cold.tags[0] = Tag { sheet: tools[0].sheet, side };
            }
            if i % 4 > 1 {
                let local = tools[0].motion.start.to_local(at);
                cold.anchors[0] =
                    Anchor::on(3, tools[0].blade.map_or(local, |blade| blade.at_distance(side, local, any(2.0).abs())));
            }
            let mut ahead = ClayAhead::default();
            [-0.3, 0.3].iter().for_each(|beside| ahead.see((0, cold.key()), 0.125, 1.0, *beside));
            let Some(near) = Near::of(cell.div_euclid(IVec3::splat(4)), (&tools, &ahead), &domain, SPRINGS) else { continue };
            let clear = near.clearance(&hot, &cold);
            let (mut kept, mut report) = (cold, GridReport::of_tools(1));
            let press = near.press((&hot, &cold), moved, true, Some((&mut kept, &mut report)));
            let is_touched = press.velocity != [0.0; 3] || press.stiffness != [[0.0; 3]; 2] || kept.anchors[0].get().is_some();
            assert!(
                !(is_touched && f64::from(clear) > moved.length()),
                "{shape:?}, {contact:?}: {at} by {moved}, clear by {clear}"
            );
            // Where it stands, whatever it moves by.
            let [still, pressed] =
                [near.stiffness_still((&hot, &cold)), near.press((&hot, &cold), DVec3::ZERO, true, None).stiffness];
            assert_eq!(still, pressed, "{shape:?}, {contact:?}: {at}");
            counts[0] += u32::from(is_touched);
            counts[1] += u32::from(f64::from(clear) > moved.length());
        }
        counts
    }

    #[test]
    fn what_is_clear_is_not_touched() {
        let bend = Profile::new(&[DVec2::new(-2.0, 1.0), DVec2::ZERO, DVec2::new(2.0, 1.0)]).expect("a profile");
        let blade = ToolShape::Blade { half_width: 2.0, half_height: 2.0 };
        let shapes = [
            (ToolShape::Sphere { radius: 1.5 }, true),
            (ToolShape::Box { half_size: DVec3::new(1.5, 1.0, 0.5) }, true),
            (blade, true),
            (ToolShape::PointedBlade { half_width: 2.0, half_height: 2.0 }, true),
            (ToolShape::Wire { half_length: 2.0 }, true),
            // Of flanks that are bent nothing is known before.
            (ToolShape::BentBlade { profile: bend, half_height: 2.0 }, false),
        ];
        for (shape, is_known) in shapes {
            for contact in [Contact::Slip, Contact::Stick, Contact::Separate { friction: 0.3 }] {
                let [touched, clear] = touched_and_clear(shape, contact);
                assert!(touched > 10 && clear > if is_known { 1000 } else { 100 }, "{shape:?}, {contact:?}: {touched}, {clear}");
            }
        }
    }
}
