//! The grid update of a block where walls, tools or the two sides of a cut meet. In f64, one node after the
//! other.
//!
//! The order is that of the substep's definition: fold, sides, velocity, two sides, solid tools, walls.

mod compared;
mod walls;

use super::super::cut::{self, CutKey};
use super::super::cutting::CuttingMethod;
use super::super::params::{BLOCK, Domain, WALL_TOUCH, Wall};
use super::super::tool::{self, CONTACT_OFFSET, CUT_FRICTION};
use super::contact::ToolNow;
use super::ghost::Ghosts;
use super::grid::{ClassMasses, CutBlock, GridReport, GridStep, Nodes, local};
use super::sides::{Divisions, Fields};
use super::simd::Node;
use super::state::NEIGHBOURS;
use super::touching::Touching;
use glam::{DVec3, IVec3};
use walls::{Column, columns};

/// Walls and tools of one substep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meeting<'a> {
    pub domain: &'a Domain,
    pub tools: &'a [ToolNow],
    /// How tools act on the clay.
    pub cutting: CuttingMethod,
    /// Where separating tools touch.
    pub touching: &'a Touching,
}

impl Meeting<'_> {
    /// Whether a wall stands in the block or a tool is near it.
    pub(super) fn concerns(&self, block: IVec3) -> bool {
        let (low, high) = self.domain.wall_nodes();
        let is_at_wall = |w: IVec3| (w / BLOCK).cmpeq(block).any();
        is_at_wall(low) || is_at_wall(high) || self.tools.iter().any(|t| t.is_near_block(block))
    }
}

/// Mass and momentum.
#[derive(Clone, Copy, Default)]
struct Sum {
    mass: f64,
    momentum: DVec3,
}

impl Sum {
    fn plus(self, other: Self) -> Self {
        Self { mass: self.mass + other.mass, momentum: self.momentum + other.momentum }
    }
}

/// The class sums of a block: as the particles brought them, and with what walls folded onto or away from
/// each node.
struct Classes {
    /// Untagged clay first, then the tagged classes in order.
    keys: Vec<CutKey>,
    own: Vec<[Sum; 64]>,
    folded: Vec<[Sum; 64]>,
    /// The columns that a wall acts on, in the order of folding.
    folds: Vec<Column>,
    /// The columns of clamped walls.
    clamps: Vec<Column>,
}

impl Classes {
    fn new(nodes: &Nodes, cut: Option<&CutBlock>, block: IVec3, step: &GridStep, domain: &Domain) -> Self {
        let sum = |node: &Node| {
            let q = node.0.map(f64::from);
            Sum { mass: q[3], momentum: DVec3::new(q[0], q[1], q[2]) }
        };
        let sums = |nodes: &Nodes| std::array::from_fn(|k| sum(&nodes[k]));
        let tagged = || cut.iter().flat_map(|cut| cut.keys.iter().zip(&cut.nodes));
        let keys = std::iter::once(CutKey::UNTAGGED).chain(tagged().map(|t| *t.0)).collect();
        let own: Vec<[Sum; 64]> = std::iter::once(nodes).chain(tagged().map(|t| t.1)).map(sums).collect();
        let mut classes = Self { keys, folded: own.clone(), own, folds: vec![], clamps: vec![] };
        let is_clamped = step.imposed.is_some_and(|imposed| imposed.clamped_walls);
        for column in columns(block, domain) {
            if is_clamped {
                classes.clamps.push(column);
            } else if column.kind != Wall::Separate || classes.reaction(&column, block, step) > 0.0 {
                classes.fold(column);
            }
        }
        classes
    }

    /// Normal impulse of the wall on the clay if it folded this column; 0 while no clay reaches the outer
    /// node.
    fn reaction(&self, c: &Column, block: IVec3, step: &GridStep) -> f64 {
        let total = |k: usize| {
            let sum = self.folded.iter().fold(Sum::default(), |s, class| s.plus(class[k]));
            (sum.mass, sum.momentum[c.axis] * c.inward)
        };
        let ((m_outer, outer), (m_wall, wall), (m_inner, inner)) = (total(c.outer), total(c.wall), total(c.inner));
        // Clay further than half a cell from the wall only shares the wall's node with its image: it does not
        // touch yet.
        if m_outer <= WALL_TOUCH * (m_outer + m_wall + m_inner) {
            return 0.0;
        }
        let gravity = step.acceleration_at(block * BLOCK + offset(c.wall))[c.axis] * c.inward;
        let mass = m_inner + m_outer;
        let velocity = if mass > 0.0 { (inner - outer) / mass + gravity } else { 0.0 };
        (m_inner - m_outer) * velocity - (inner + wall + outer) - (mass + m_wall) * gravity
    }

    fn fold(&mut self, column: Column) {
        for class in &mut self.folded {
            let outer = std::mem::take(&mut class[column.outer]);
            class[column.inner] = class[column.inner].plus(Sum { momentum: column.reflect(outer.momentum), ..outer });
        }
        self.folds.push(column);
    }

    /// The sheets of the classes and of the blades, each once, in order.
    fn sheets(&self, tools: &[ToolNow]) -> Vec<u8> {
        let of_blades = tools.iter().filter(|t| t.blade.is_some()).map(|t| t.sheet);
        let mut sheets: Vec<u8> = self.keys.iter().flat_map(|key| key.sides()).map(|s| s.0).chain(of_blades).collect();
        sheets.sort_unstable();
        sheets.dedup();
        sheets
    }
}

/// Folded masses of the tagged classes at the nodes of a block: what the normals of cuts are made of.
#[expect(clippy::cast_possible_truncation, reason = "nodes are f32")]
pub(super) fn folded_masses(nodes: &Nodes, cut: &CutBlock, block: IVec3, step: &GridStep, domain: &Domain) -> ClassMasses {
    if columns(block, domain).is_empty() {
        return cut.keys.iter().zip(&cut.nodes).map(|(key, nodes)| (*key, nodes.map(|node| node.0[3]))).collect();
    }
    let classes = Classes::new(nodes, Some(cut), block, step, domain);
    let tagged = classes.keys.iter().zip(&classes.folded).skip(1);
    tagged.map(|(key, sums)| (*key, sums.map(|sum| sum.mass as f32))).collect()
}

/// The 64 nodes.
struct Block<'a> {
    classes: Classes,
    divisions: [Divisions; 64],
    fields: [Fields; 64],
    /// The first class of the field in which each class moves: fields stand in its place.
    leader: Vec<[u8; 64]>,
    /// Folded sums of the fields.
    field: Vec<[Sum; 64]>,
    velocity: Vec<[DVec3; 64]>,
    /// Impulse of tools and of other fields on the node.
    pushed: [DVec3; 64],
    is_outer: [bool; 64],
    /// Where nodes are incompatible with each class, under the methods that know such; else none.
    ghosts: Vec<Ghosts>,
    /// Masses of the clay that touches separating tools.
    touching: [f32; 64],
    /// Gravity and other body forces at each node.
    gravity: [DVec3; 64],
    /// The masses about the block on either side of each sheet that divides one of its nodes in two.
    about: Vec<SheetMasses>,
    masses_of: &'a MassesOf<'a>,
    block: IVec3,
    report: GridReport,
}

/// The folded masses of the tagged classes of the block at these coordinates, if there are any.
pub(super) type MassesOf<'a> = dyn Fn(IVec3) -> Option<&'a ClassMasses> + Sync + 'a;

/// Nodes along an edge of the block and one around it.
const ABOUT: usize = BLOCK as usize + 2;

/// Masses in front of a sheet and behind it at the nodes of a block and those around it, z fastest.
struct SheetMasses {
    sheet: u8,
    sides: [[f32; 2]; ABOUT * ABOUT * ABOUT],
}

impl SheetMasses {
    fn new(sheet: u8, block: IVec3, masses_of: &MassesOf<'_>) -> Self {
        let mut sides = [[0.0; 2]; ABOUT * ABOUT * ABOUT];
        for offset in NEIGHBOURS {
            let Some(classes) = masses_of(block + offset) else { continue };
            // Our coordinates from -1 on, and what to add for the neighbour's own.
            let range = |o: i32| match o {
                -1 => (-1, 0, BLOCK),
                0 => (0, BLOCK, 0),
                _ => (BLOCK, BLOCK + 1, -BLOCK),
            };
            let (x, y, z) = (range(offset.x), range(offset.y), range(offset.z));
            for (key, masses) in classes {
                let side = match key.side(sheet) {
                    0 => continue,
                    1 => 0,
                    _ => 1,
                };
                for i in x.0..x.1 {
                    for j in y.0..y.1 {
                        for k in z.0..z.1 {
                            sides[Self::at(IVec3::new(i, j, k))][side] += masses[local(i + x.2, j + y.2, k + z.2)];
                        }
                    }
                }
            }
        }
        Self { sheet, sides }
    }

    /// Place of a node, relative to the block, each coordinate in -1 ..= 4.
    fn at(node: IVec3) -> usize {
        let n = (node + 1).as_usizevec3();
        (n.x * ABOUT + n.y) * ABOUT + n.z
    }

    /// Unit normal of the cut at a node of the block, from back to front.
    fn normal(&self, node: IVec3) -> Option<DVec3> {
        let about = (0..27).map(|i| IVec3::new(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1));
        cut::fitted_normal(about.map(|o| {
            let [front, back] = self.sides[Self::at(node + o)].map(f64::from);
            (o, front, back)
        }))
    }
}

/// Updates `nodes` (untagged, or all clay) and those of the tagged classes from sums to velocities; masses
/// stay as they were summed.
pub(super) fn update<'a>(
    nodes: &mut Nodes,
    cut: Option<&mut CutBlock>,
    block: IVec3,
    step: &GridStep,
    meeting: &Meeting<'_>,
    masses_of: &'a MassesOf<'a>,
) -> GridReport {
    let classes = Classes::new(nodes, cut.as_deref(), block, step, meeting.domain);
    let mut b = Block::new(classes, block, step, meeting, masses_of);
    for k in (0..64).filter(|k| !b.is_outer[*k]).collect::<Vec<_>>() {
        b.meet(k, block * BLOCK + offset(k), step, meeting);
    }
    b.unfold(block, step);
    b.book_withheld(block, meeting);
    b.store(nodes, cut);
    b.report
}

/// Position in the block of node `k`.
fn offset(k: usize) -> IVec3 {
    let k = k as i32;
    IVec3::new(k / 16, k / 4 % 4, k % 4)
}

impl<'a> Block<'a> {
    /// Tells the sides apart and makes momentum velocity.
    fn new(classes: Classes, block: IVec3, step: &GridStep, meeting: &Meeting<'_>, masses_of: &'a MassesOf<'a>) -> Self {
        let mut gravity = [step.gravity; 64];
        if step.imposed.is_some() {
            // A manufactured solution's body force is dear: none where there is no clay.
            let is_used = |k: usize| classes.own.iter().chain(&classes.folded).any(|class| class[k].mass != 0.0);
            gravity =
                std::array::from_fn(|k| if is_used(k) { step.acceleration_at(block * BLOCK + offset(k)) } else { DVec3::ZERO });
        }
        let (count, sheets) = (classes.keys.len(), classes.sheets(meeting.tools));
        let divisions = |k: usize| {
            let mass = |class: usize| classes.folded[class][k].mass;
            Divisions::new(block * BLOCK + offset(k), &classes.keys, &sheets, mass, meeting)
        };
        let divisions: [Divisions; 64] = std::array::from_fn(divisions);
        let mut fields = [Fields::default(); 64];
        let mut leader = vec![[0u8; 64]; count];
        let mut field = vec![[Sum::default(); 64]; count];
        let mut velocity = vec![[DVec3::ZERO; 64]; count];
        let ghosts = compared::ghosts(&classes.keys, &divisions, block, meeting);
        for k in 0..64 {
            for c in 0..count {
                if compared::is_incompatible(&ghosts, c, k) {
                    // In no field, and without a velocity.
                    leader[c][k] = c as u8;
                    continue;
                }
                leader[c][k] = fields[k].leader(divisions[k].beyond(classes.keys[c]), c as u8);
                let sum = &mut field[usize::from(leader[c][k])][k];
                *sum = sum.plus(classes.folded[c][k]);
            }
            for &(_, f) in fields[k].as_slice() {
                let sum = field[usize::from(f)][k];
                // A NaN mass must show.
                if sum.mass > 0.0 || sum.mass.is_nan() {
                    velocity[usize::from(f)][k] = (sum.momentum / sum.mass + gravity[k]) * step.damping;
                }
            }
        }
        let mut is_outer = [false; 64];
        classes.folds.iter().for_each(|c| is_outer[c.outer] = true);
        let mut report = GridReport::of_tools(meeting.tools.len());
        if step.damping != 1.0 || step.imposed.is_some() {
            let own = || (0..64).flat_map(|k| classes.own.iter().map(move |class| class[k]).zip(std::iter::repeat(gravity[k])));
            report.damping_impulse = own().map(|(s, g)| s.momentum + s.mass * g).sum::<DVec3>() * (step.damping - 1.0);
            report.body_impulse = own().map(|(s, g)| s.mass * (g - step.gravity)).sum();
        }
        let (pushed, touching) = ([DVec3::ZERO; 64], meeting.touching.of_block(block));
        Self {
            classes,
            divisions,
            fields,
            leader,
            field,
            velocity,
            pushed,
            is_outer,
            ghosts,
            touching,
            gravity,
            about: vec![],
            masses_of,
            block,
            report,
        }
    }

    /// One node: blades, the fields that kept cuts divide, then the solid tools in order.
    fn meet(&mut self, k: usize, node: IVec3, step: &GridStep, meeting: &Meeting<'_>) {
        match meeting.cutting {
            CuttingMethod::TwoFields => {
                self.between_sides(k, node, step, meeting);
                self.with_solid_tools(k, node, meeting);
            }
            CuttingMethod::Published | CuttingMethod::RigidParticles => self.with_solid_tools(k, node, meeting),
            CuttingMethod::InteractiveParticles => self.take_along(k, node, meeting),
        }
    }

    /// Blades, then the fields that kept cuts divide.
    fn between_sides(&mut self, k: usize, node: IVec3, step: &GridStep, meeting: &Meeting<'_>) {
        let (world, divisions, fields) = (node.as_dvec3(), self.divisions[k], self.fields[k]);
        for (index, tool) in meeting.tools.iter().enumerate().filter(|(_, t)| t.blade.is_some()) {
            let Some(i) = divisions.of_blade(index) else { continue };
            let Some((distance, front)) = tool.blade.and_then(|blade| blade.within_band(world)) else { continue };
            // Each field is bounded by the blade where it reaches beyond it; a sticking blade takes it along.
            for &(beyond, f) in fields.as_slice() {
                let sign = f64::from(divisions.side(beyond, i));
                let (field, normal, distance) = (usize::from(f), front * sign, distance * sign);
                if tool.contact.sticks() {
                    let surface = tool.motion.velocity_at(world);
                    let after = tool::stick(self.velocity[field][k], surface, normal, distance, step.adhesion);
                    self.push(k, field, (index, tool), world, after);
                } else if distance <= CONTACT_OFFSET {
                    self.touch(k, field, (index, tool), world, normal, 1.0);
                }
            }
        }
        for b in 1..fields.as_slice().len() {
            for a in 0..b {
                let [from, to] = [a, b].map(|i| fields.as_slice()[i]);
                if let Some(normal) = divisions.pair_normal(from.0, to.0, |sheet| self.cut_normal(node, sheet)) {
                    self.exchange(k, from.1.into(), to.1.into(), normal);
                }
            }
        }
    }

    /// The solid tools in order.
    fn with_solid_tools(&mut self, k: usize, node: IVec3, meeting: &Meeting<'_>) {
        let (world, fields) = (node.as_dvec3(), self.fields[k]);
        for (index, tool) in meeting.tools.iter().enumerate() {
            if let Some((distance, normal)) = tool.touch(world) {
                let share = if tool.separates() { tool::closed_share(f64::from(self.touching[k]) / 8.0, distance) } else { 1.0 };
                for &(_, field) in fields.as_slice() {
                    self.touch(k, field.into(), (index, tool), world, normal, share);
                }
            }
        }
    }

    /// Unit normal of a kept cut at a node, from back to front.
    fn cut_normal(&mut self, node: IVec3, sheet: u8) -> Option<DVec3> {
        let at = self.about.iter().position(|about| about.sheet == sheet).unwrap_or_else(|| {
            self.about.push(SheetMasses::new(sheet, self.block, self.masses_of));
            self.about.len() - 1
        });
        self.about[at].normal(node - self.block * BLOCK)
    }

    /// A share of a tool's contact on one field.
    fn touch(&mut self, k: usize, field: usize, (index, tool): (usize, &ToolNow), world: DVec3, normal: DVec3, share: f64) {
        let before = self.velocity[field][k];
        let after = before + share * (tool.apply(before, world, normal) - before);
        self.push(k, field, (index, tool), world, after);
    }

    /// A tool brings one field to the velocity `after`, and feels the opposite impulse.
    fn push(&mut self, k: usize, field: usize, (index, tool): (usize, &ToolNow), world: DVec3, after: DVec3) {
        let mass = self.field[field][k].mass;
        if mass <= 0.0 {
            return;
        }
        let before = self.velocity[field][k];
        let impulse = mass * (after - before);
        self.velocity[field][k] = after;
        self.pushed[k] += impulse;
        self.report.impulse_scale += impulse.length();
        let sum = &mut self.report.tools[index];
        sum.0 -= impulse;
        sum.1 -= (world - tool.motion.end.position).cross(impulse);
        sum.2 += u64::from(after != before);
    }

    /// Two fields exchange momentum while they approach along `n`, from a to b.
    fn exchange(&mut self, k: usize, a: usize, b: usize, n: DVec3) {
        let (m_a, m_b) = (self.field[a][k].mass, self.field[b][k].mass);
        if m_a <= 0.0 || m_b <= 0.0 {
            return;
        }
        let relative = self.velocity[b][k] - self.velocity[a][k];
        let approach = relative.dot(n);
        if approach >= 0.0 {
            return;
        }
        let slide = relative - approach * n;
        let stop = slide.length().min(-approach * CUT_FRICTION);
        let impulse = m_a * m_b / (m_a + m_b) * (-approach * n - slide.normalize_or_zero() * stop);
        self.velocity[b][k] += impulse / m_b;
        self.velocity[a][k] -= impulse / m_a;
    }

    /// Wall nodes stand still across the wall, outer nodes move as images, the last fold first; nodes of
    /// validation cases do as they are told. Books the walls' impulse, and that of whatever drives nodes.
    fn unfold(&mut self, block: IVec3, step: &GridStep) {
        let mut is_at_wall = [false; 64];
        for c in self.classes.folds.iter().rev() {
            self.leader.iter_mut().for_each(|leader| leader[c.outer] = leader[c.inner]);
            self.ghosts.iter_mut().for_each(|ghosts| ghosts[c.outer] = ghosts[c.inner]);
            for velocity in &mut self.velocity {
                velocity[c.outer] = c.reflect(velocity[c.inner]);
                velocity[c.wall] = 0.5 * (velocity[c.wall] + c.reflect(velocity[c.wall]));
            }
            [c.outer, c.wall, c.inner].into_iter().for_each(|k| is_at_wall[k] = true);
        }
        for c in &self.classes.clamps {
            for k in [c.outer, c.wall] {
                self.velocity.iter_mut().for_each(|velocity| velocity[k] = c.clamp(velocity[k]));
                is_at_wall[k] = true;
            }
        }
        for k in (0..64).filter(|k| self.classes.own.iter().any(|class| class[*k].mass > 0.0)) {
            if let Some(v) = step.imposed.and_then(|imposed| imposed.driven_velocity(block * BLOCK + offset(k))) {
                self.velocity.iter_mut().for_each(|velocity| velocity[k] = v);
                is_at_wall[k] = true;
            }
        }
        for k in (0..64).filter(|k| is_at_wall[*k]) {
            let mut impulse = -self.pushed[k];
            for (class, (own, leader)) in self.classes.own.iter().zip(&self.leader).enumerate() {
                if compared::is_incompatible(&self.ghosts, class, k) {
                    continue;
                }
                let Sum { mass, momentum } = own[k];
                let free = step.damping * (momentum + mass * self.gravity[k]);
                impulse += mass * self.velocity[usize::from(leader[k])][k] - free;
            }
            self.report.wall_impulse += impulse;
            self.report.impulse_scale += impulse.length();
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "nodes are f32")]
    fn store(&mut self, nodes: &mut Nodes, mut cut: Option<&mut CutBlock>) {
        if let Some(cut) = &mut cut {
            cut.ghosts = self.ghosts.split_off(self.ghosts.len().min(1));
        }
        let tagged = cut.into_iter().flat_map(|cut| &mut cut.nodes);
        for (nodes, leader) in std::iter::once(nodes).chain(tagged).zip(&self.leader) {
            for k in 0..64 {
                let v = self.velocity[usize::from(leader[k])][k];
                nodes[k].0[..3].copy_from_slice(&v.as_vec3().to_array());
            }
        }
        let squares = || self.velocity.iter().flatten().map(|v| v.length_squared());
        let (greatest, all) = (squares().fold(0.0, f64::max), squares().sum::<f64>());
        self.report.speed_max = if all.is_finite() { greatest.sqrt() as f32 } else { f32::NAN };
    }
}
