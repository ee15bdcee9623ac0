//! The grid update of a block where walls, tools or the two sides of a cut meet. In f64, one node after the other.
//!
//! The order is that of the substep's definition: fold, sides, velocity, two sides, solid tools, walls.

use super::super::params::{BLOCK, Domain, WALL_TOUCH, Wall};
use super::super::tool::{self, CONTACT_OFFSET, CUT_FRICTION, Contact};
use super::contact::ToolNow;
use super::grid::{GridReport, GridStep, Nodes, local};
use super::touching::Touching;
use glam::{DVec3, IVec3};

/// Walls and tools of one substep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meeting<'a> {
    pub domain: &'a Domain,
    pub tools: &'a [ToolNow],
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

/// The classes of particles, as indices.
const UNTAGGED: usize = 0;
const FRONT: usize = 1;
const BACK: usize = 2;

/// The fields of a node, as indices: untagged clay and the owner's class, and the other class.
const MAIN: usize = 0;
const OTHER: usize = 1;

/// Whether and how a node has two fields.
#[derive(Clone, Copy, Default)]
struct Division {
    /// The class that moves with untagged clay; none at a whole node, where all classes move together.
    owner: Option<usize>,
    /// The blade in whose band the node stands: its index and the signed distance [cells].
    blade: Option<(usize, f64)>,
}

impl Division {
    fn field_of(&self, class: usize) -> usize {
        if self.owner.is_some_and(|owner| class != UNTAGGED && class != owner) { OTHER } else { MAIN }
    }
}

/// A column of nodes across a wall.
struct Column {
    axis: usize,
    ghost: usize,
    wall: usize,
    mirror: usize,
    kind: Wall,
    /// Direction away from the wall along the axis.
    inward: f64,
}

impl Column {
    /// Reverses the components that the image of clay in this wall has reversed.
    fn reflect(&self, mut v: DVec3) -> DVec3 {
        if self.kind == Wall::Stick {
            return -v;
        }
        v[self.axis] = -v[self.axis];
        v
    }

    /// What a clamped wall leaves of a velocity: none at a stick wall, else none along the axis, or, of a separating wall, none into it.
    fn clamp(&self, mut v: DVec3) -> DVec3 {
        if self.kind == Wall::Stick {
            return DVec3::ZERO;
        }
        if self.kind == Wall::Slip || v[self.axis] * self.inward < 0.0 {
            v[self.axis] = 0.0;
        }
        v
    }
}

/// The columns of the walls that stand in the block, axis by axis.
fn columns(block: IVec3, domain: &Domain) -> Vec<Column> {
    let mut columns = vec![];
    let (low, high) = domain.wall_nodes();
    for axis in 0..3 {
        for (wall, kind, inward) in [(low[axis], domain.walls.low[axis], 1), (high[axis], domain.walls.high[axis], -1)] {
            if wall / BLOCK != block[axis] {
                continue;
            }
            for column in 0..16 {
                let at = |w: i32| {
                    let mut c = [column / 4, column % 4, 0];
                    c.rotate_right((axis + 1) % 3);
                    c[axis] = w;
                    local(c[0], c[1], c[2])
                };
                let w = wall % BLOCK;
                let (ghost, wall, mirror) = (at(w - inward), at(w), at(w + inward));
                columns.push(Column { axis, ghost, wall, mirror, kind, inward: f64::from(inward) });
            }
        }
    }
    columns
}

/// The class sums of a block: as the particles brought them, and with what walls folded onto or away from each node.
struct Classes {
    own: [[Sum; 3]; 64],
    folded: [[Sum; 3]; 64],
    /// The columns that a wall acts on, in the order of folding.
    folds: Vec<Column>,
    /// The columns of clamped walls.
    clamps: Vec<Column>,
}

impl Classes {
    fn new(nodes: &Nodes, sides: Option<&[Nodes; 2]>, block: IVec3, step: &GridStep, domain: &Domain) -> Self {
        let class = |k: usize, class: usize| {
            let q = match (class, sides) {
                (UNTAGGED, _) => nodes[k].0,
                (_, Some(sides)) => sides[class - 1][k].0,
                (_, None) => return Sum::default(),
            };
            let q = q.map(f64::from);
            Sum { mass: q[3], momentum: DVec3::new(q[0], q[1], q[2]) }
        };
        let own = std::array::from_fn(|k| std::array::from_fn(|c| class(k, c)));
        let mut classes = Self { own, folded: own, folds: vec![], clamps: vec![] };
        let is_clamped = step.special.is_some_and(|special| special.clamped_walls);
        for column in columns(block, domain) {
            if is_clamped {
                classes.clamps.push(column);
            } else if column.kind != Wall::Separate || classes.reaction(&column, block, step) > 0.0 {
                classes.fold(column);
            }
        }
        classes
    }

    /// Normal impulse of the wall on the clay if it folded this column; 0 while no clay reaches the ghost.
    fn reaction(&self, c: &Column, block: IVec3, step: &GridStep) -> f64 {
        let total = |k: usize| {
            let sum = self.folded[k].iter().fold(Sum::default(), |s, c| s.plus(*c));
            (sum.mass, sum.momentum[c.axis] * c.inward)
        };
        let ((m_ghost, ghost), (m_wall, wall), (m_mirror, mirror)) = (total(c.ghost), total(c.wall), total(c.mirror));
        // Clay further than half a cell from the wall only shares the wall's node with its image: it does not touch yet.
        if m_ghost <= WALL_TOUCH * (m_ghost + m_wall + m_mirror) {
            return 0.0;
        }
        let gravity = step.acceleration_at(block * BLOCK + offset(c.wall))[c.axis] * c.inward;
        let mass = m_mirror + m_ghost;
        let velocity = if mass > 0.0 { (mirror - ghost) / mass + gravity } else { 0.0 };
        (m_mirror - m_ghost) * velocity - (mirror + wall + ghost) - (mass + m_wall) * gravity
    }

    fn fold(&mut self, column: Column) {
        let ghost = std::mem::take(&mut self.folded[column.ghost]);
        for (mirror, ghost) in self.folded[column.mirror].iter_mut().zip(ghost) {
            *mirror = mirror.plus(Sum { momentum: column.reflect(ghost.momentum), ..ghost });
        }
        self.folds.push(column);
    }
}

/// Folded masses of front and back clay at the nodes of a block: what the normal of a cut is made of.
#[expect(clippy::cast_possible_truncation, reason = "nodes are f32")]
pub(super) fn side_masses(nodes: &Nodes, sides: &[Nodes; 2], block: IVec3, step: &GridStep, domain: &Domain) -> [[f32; 64]; 2] {
    let classes = Classes::new(nodes, Some(sides), block, step, domain);
    [FRONT, BACK].map(|class| std::array::from_fn(|k| classes.folded[k][class].mass as f32))
}

/// The 64 nodes.
struct Block {
    classes: Classes,
    division: [Division; 64],
    /// Folded sums of the fields.
    field: [[Sum; 2]; 64],
    velocity: [[DVec3; 2]; 64],
    /// Impulse of tools and of the other side on the node.
    pushed: [DVec3; 64],
    is_ghost: [bool; 64],
    /// Masses of the clay that touches separating tools.
    touching: [f32; 64],
    /// Gravity and other body forces at each node.
    gravity: [DVec3; 64],
    report: GridReport,
}

/// Updates `nodes` (untagged, or all clay) and `sides` (front and back) from sums to velocities; masses stay as they were summed.
/// `gradients` are those of front and back mass at a node.
pub(super) fn update(
    nodes: &mut Nodes,
    sides: Option<&mut [Nodes; 2]>,
    block: IVec3,
    step: &GridStep,
    meeting: &Meeting<'_>,
    gradients: &dyn Fn(IVec3) -> [DVec3; 2],
) -> GridReport {
    let classes = Classes::new(nodes, sides.as_deref(), block, step, meeting.domain);
    let mut b = Block::new(classes, block, step, meeting);
    for k in (0..64).filter(|k| !b.is_ghost[*k]).collect::<Vec<_>>() {
        b.meet(k, block * BLOCK + offset(k), step, meeting, gradients);
    }
    b.unfold(block, step);
    b.store(nodes, sides);
    b.report
}

/// Position in the block of node `k`.
fn offset(k: usize) -> IVec3 {
    let k = k as i32;
    IVec3::new(k / 16, k / 4 % 4, k % 4)
}

impl Block {
    /// Tells the sides apart and makes momentum velocity.
    fn new(classes: Classes, block: IVec3, step: &GridStep, meeting: &Meeting<'_>) -> Self {
        // A manufactured solution's body force is dear: none where there is no clay.
        let is_used = |k: usize| classes.own[k].iter().chain(&classes.folded[k]).any(|sum| sum.mass != 0.0);
        let acceleration = |k: usize| if is_used(k) { step.acceleration_at(block * BLOCK + offset(k)) } else { DVec3::ZERO };
        let gravity: [DVec3; 64] = std::array::from_fn(acceleration);
        let division = std::array::from_fn(|k| divide(block * BLOCK + offset(k), &classes.folded[k], meeting));
        let mut field = [[Sum::default(); 2]; 64];
        let mut velocity = [[DVec3::ZERO; 2]; 64];
        for k in 0..64 {
            for c in [UNTAGGED, FRONT, BACK] {
                let sum = &mut field[k][division[k].field_of(c)];
                *sum = sum.plus(classes.folded[k][c]);
            }
            for (v, sum) in velocity[k].iter_mut().zip(field[k]) {
                // A NaN mass must show.
                if sum.mass > 0.0 || sum.mass.is_nan() {
                    *v = (sum.momentum / sum.mass + gravity[k]) * step.damping;
                }
            }
        }
        let mut is_ghost = [false; 64];
        classes.folds.iter().for_each(|c| is_ghost[c.ghost] = true);
        let own = || classes.own.iter().zip(&gravity).flat_map(|(sums, g)| sums.iter().map(move |s| (s, *g)));
        let free: DVec3 = own().map(|(s, g)| s.momentum + s.mass * g).sum();
        let report = GridReport {
            tools: vec![Default::default(); meeting.tools.len()],
            damping_impulse: free * (step.damping - 1.0),
            body_impulse: own().map(|(s, g)| s.mass * (g - step.gravity)).sum(),
            ..GridReport::default()
        };
        Self {
            classes,
            division,
            field,
            velocity,
            pushed: [DVec3::ZERO; 64],
            is_ghost,
            gravity,
            report,
            touching: meeting.touching.of_block(block),
        }
    }

    /// One node: the two sides, then the solid tools in order.
    fn meet(&mut self, k: usize, node: IVec3, step: &GridStep, meeting: &Meeting<'_>, gradients: &dyn Fn(IVec3) -> [DVec3; 2]) {
        let world = node.as_dvec3();
        let division = self.division[k];
        match (division.owner, division.blade) {
            (Some(_), Some((index, distance))) => {
                let tool = &meeting.tools[index];
                let normal = tool.motion.end.rotation * DVec3::Z;
                // Each side is bounded by the blade where it reaches beyond it; a sticking blade takes it along.
                for (class, sign) in [(FRONT, 1.0), (BACK, -1.0)] {
                    let (field, normal, distance) = (division.field_of(class), normal * sign, distance * sign);
                    if tool.contact == Contact::Stick {
                        let surface = tool.motion.velocity_at(world);
                        let after = tool::stick(self.velocity[k][field], surface, normal, distance, step.adhesion);
                        self.push(k, field, (index, tool), world, after);
                    } else if distance <= CONTACT_OFFSET {
                        self.touch(k, field, (index, tool), world, normal, 1.0);
                    }
                }
            }
            (Some(_), None) => self.exchange(k, gradients(node)),
            _ => {}
        }
        for (index, tool) in meeting.tools.iter().enumerate() {
            if let Some((distance, normal)) = tool.touch(world) {
                let share = if tool.separates() { tool::closed_share(f64::from(self.touching[k]) / 8.0, distance) } else { 1.0 };
                for field in [MAIN, OTHER] {
                    self.touch(k, field, (index, tool), world, normal, share);
                }
            }
        }
    }

    /// A share of a tool's contact on one field.
    fn touch(&mut self, k: usize, field: usize, (index, tool): (usize, &ToolNow), world: DVec3, normal: DVec3, share: f64) {
        let before = self.velocity[k][field];
        let after = before + share * (tool.apply(before, world, normal) - before);
        self.push(k, field, (index, tool), world, after);
    }

    /// A tool brings one field to the velocity `after`, and feels the opposite impulse.
    fn push(&mut self, k: usize, field: usize, (index, tool): (usize, &ToolNow), world: DVec3, after: DVec3) {
        let mass = self.field[k][field].mass;
        if mass <= 0.0 {
            return;
        }
        let before = self.velocity[k][field];
        let impulse = mass * (after - before);
        self.velocity[k][field] = after;
        self.pushed[k] += impulse;
        self.report.impulse_scale += impulse.length();
        let sum = &mut self.report.tools[index];
        sum.0 -= impulse;
        sum.1 -= (world - tool.motion.end.position).cross(impulse);
        sum.2 += u64::from(after != before);
    }

    /// The two sides of a kept cut exchange momentum while they approach. The normal, from back to front, is the gradient of the front's share of
    /// the mass, `m_B grad m_F - m_F grad m_B` up to scale: where both thin out alike, at a free surface or the rim of the tagged
    /// layer, it stays the cut's.
    fn exchange(&mut self, k: usize, [front_gradient, back_gradient]: [DVec3; 2]) {
        let [_, front, back] = self.classes.folded[k].map(|s| s.mass);
        let total = front + back;
        let normal = ((back / total) * front_gradient - (front / total) * back_gradient).try_normalize();
        let (f, b) = (self.division[k].field_of(FRONT), self.division[k].field_of(BACK));
        let (m_f, m_b) = (self.field[k][f].mass, self.field[k][b].mass);
        let Some(n) = normal.filter(|_| m_f > 0.0 && m_b > 0.0) else { return };
        let relative = self.velocity[k][f] - self.velocity[k][b];
        let approach = relative.dot(n);
        if approach >= 0.0 {
            return;
        }
        let slide = relative - approach * n;
        let stop = slide.length().min(-approach * CUT_FRICTION);
        let impulse = m_f * m_b / (m_f + m_b) * (-approach * n - slide.normalize_or_zero() * stop);
        self.velocity[k][f] += impulse / m_f;
        self.velocity[k][b] -= impulse / m_b;
    }

    /// Wall nodes stand still across the wall, ghosts move as images, the last fold first; nodes of validation cases do as they are told. Books the
    /// walls' impulse, and that of whatever drives nodes.
    fn unfold(&mut self, block: IVec3, step: &GridStep) {
        let mut is_at_wall = [false; 64];
        for c in self.classes.folds.iter().rev() {
            self.division[c.ghost] = self.division[c.mirror];
            for field in [MAIN, OTHER] {
                self.velocity[c.ghost][field] = c.reflect(self.velocity[c.mirror][field]);
                let at_wall = &mut self.velocity[c.wall][field];
                *at_wall = 0.5 * (*at_wall + c.reflect(*at_wall));
            }
            [c.ghost, c.wall, c.mirror].into_iter().for_each(|k| is_at_wall[k] = true);
        }
        for c in &self.classes.clamps {
            for k in [c.ghost, c.wall] {
                self.velocity[k] = self.velocity[k].map(|v| c.clamp(v));
                is_at_wall[k] = true;
            }
        }
        for k in (0..64).filter(|k| self.classes.own[*k].iter().any(|sum| sum.mass > 0.0)) {
            if let Some(v) = step.special.and_then(|special| special.driven_velocity(block * BLOCK + offset(k))) {
                self.velocity[k] = [v; 2];
                is_at_wall[k] = true;
            }
        }
        for k in (0..64).filter(|k| is_at_wall[*k]) {
            let mut impulse = -self.pushed[k];
            for class in [UNTAGGED, FRONT, BACK] {
                let Sum { mass, momentum } = self.classes.own[k][class];
                let free = step.damping * (momentum + mass * self.gravity[k]);
                impulse += mass * self.velocity[k][self.division[k].field_of(class)] - free;
            }
            self.report.wall_impulse += impulse;
            self.report.impulse_scale += impulse.length();
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "nodes are f32")]
    fn store(&mut self, nodes: &mut Nodes, mut sides: Option<&mut [Nodes; 2]>) {
        let (mut greatest, mut all) = (0.0f64, 0.0);
        for k in 0..64 {
            let velocity = |class: usize| self.velocity[k][self.division[k].field_of(class)];
            let set = |node: &mut super::simd::Node, v: DVec3| node.0[..3].copy_from_slice(&v.as_vec3().to_array());
            set(&mut nodes[k], velocity(UNTAGGED));
            if let Some(sides) = sides.as_deref_mut() {
                set(&mut sides[0][k], velocity(FRONT));
                set(&mut sides[1][k], velocity(BACK));
            }
            for v in self.velocity[k] {
                greatest = greatest.max(v.length_squared());
                all += v.length_squared();
            }
        }
        self.report.speed_max = if all.is_finite() { greatest.sqrt() as f32 } else { f32::NAN };
    }
}

/// Whether the node at `node` is split: by the first blade in whose band it stands, else where most of its mass is tagged.
fn divide(node: IVec3, classes: &[Sum; 3], meeting: &Meeting<'_>) -> Division {
    let [untagged, front, back] = classes.map(|c| c.mass);
    let world = node.as_dvec3();
    let blade = meeting.tools.iter().enumerate().find_map(|(i, t)| Some((i, t.blade?.distance_within_band(world)?)));
    let owner = match blade {
        Some((_, distance)) => Some(if distance < 0.0 { BACK } else { FRONT }),
        None if front + back > 0.5 * (untagged + front + back) => Some(if front >= back { FRONT } else { BACK }),
        None => None,
    };
    Division { owner, blade }
}
