//! The grid update of a block where walls, tools or the two sides of a cut meet. In f64, one node after the other.
//!
//! The order is that of the substep's definition: fold, sides, velocity, two sides, solid tools, walls.

use super::super::params::{BLOCK, Domain, Wall};
use super::super::tool::{CONTACT_OFFSET, CUT_FRICTION};
use super::contact::ToolNow;
use super::grid::{GridReport, GridStep, Nodes, local};
use glam::{DVec3, IVec3};

/// Walls and tools of one substep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meeting<'a> {
    pub domain: &'a Domain,
    pub tools: &'a [ToolNow],
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

/// A column of nodes across a wall while the wall acts on one of its fields.
struct Fold {
    axis: usize,
    ghost: usize,
    wall: usize,
    mirror: usize,
    kind: Wall,
    field: usize,
}

impl Fold {
    /// Reverses the components that the image of clay in this wall has reversed.
    fn reflect(&self, mut v: DVec3) -> DVec3 {
        if self.kind == Wall::Stick {
            return -v;
        }
        v[self.axis] = -v[self.axis];
        v
    }
}

/// The 64 nodes.
struct Block {
    class_mass: [[f64; 3]; 64],
    division: [Division; 64],
    /// What the particles brought, field by field.
    own: [[Sum; 2]; 64],
    /// The same with what walls folded onto or away from the node.
    folded: [[Sum; 2]; 64],
    velocity: [[DVec3; 2]; 64],
    /// Impulse of tools and of the other side on each field.
    pushed: [[DVec3; 2]; 64],
    is_at_wall: [[bool; 2]; 64],
    is_ghost: [[bool; 2]; 64],
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
    let columns = columns(block, meeting.domain);
    let mut b = Block::load(nodes, sides.as_deref(), block, step, meeting, &columns);
    let folds = b.fold(columns, step);
    b.move_fields(step);
    for k in 0..64 {
        let node = block * BLOCK + offset(k);
        b.meet(k, node, meeting, gradients);
    }
    b.unfold(&folds, step);
    b.store(nodes, sides);
    b.report
}

/// Position in the block of node `k`.
fn offset(k: usize) -> IVec3 {
    let k = k as i32;
    IVec3::new(k / 16, k / 4 % 4, k % 4)
}

/// The columns of nodes across the walls that stand in the block, axis by axis, with the inward direction.
fn columns(block: IVec3, domain: &Domain) -> Vec<(Fold, f64)> {
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
                let fold = Fold { axis, ghost: at(w - inward), wall: at(w), mirror: at(w + inward), kind, field: MAIN };
                columns.push((fold, f64::from(inward)));
            }
        }
    }
    columns
}

impl Block {
    fn load(
        nodes: &Nodes,
        sides: Option<&[Nodes; 2]>,
        block: IVec3,
        step: &GridStep,
        meeting: &Meeting<'_>,
        columns: &[(Fold, f64)],
    ) -> Self {
        let class = |k: usize, class: usize| {
            let q = match (class, sides) {
                (UNTAGGED, _) => nodes[k].0,
                (_, Some(sides)) => sides[class - 1][k].0,
                (_, None) => return Sum::default(),
            };
            let q = q.map(f64::from);
            Sum { mass: q[3], momentum: DVec3::new(q[0], q[1], q[2]) }
        };
        let class_mass: [[f64; 3]; 64] = std::array::from_fn(|k| std::array::from_fn(|c| class(k, c).mass));
        // A ghost is its mirror's image and divided as that is, so that folding never mixes two sides.
        let mut image: [usize; 64] = std::array::from_fn(|k| k);
        for (c, _) in columns {
            image[c.ghost] = image[c.mirror];
        }
        let mut own = [[Sum::default(); 2]; 64];
        let division = std::array::from_fn(|k| divide(block * BLOCK + offset(image[k]), &class_mass[image[k]], meeting));
        for k in 0..64 {
            for c in [UNTAGGED, FRONT, BACK] {
                let field = &mut own[k][division[k].field_of(c)];
                *field = field.plus(class(k, c));
            }
        }
        let free = own.iter().flatten().fold(DVec3::ZERO, |p, f| p + f.momentum + f.mass * step.gravity);
        let report = GridReport {
            tools: vec![Default::default(); meeting.tools.len()],
            damping_impulse: free * (step.damping - 1.0),
            ..GridReport::default()
        };
        let (velocity, pushed) = ([[DVec3::ZERO; 2]; 64], [[DVec3::ZERO; 2]; 64]);
        let (is_at_wall, is_ghost) = ([[false; 2]; 64], [[false; 2]; 64]);
        Self { class_mass, division, own, folded: own, velocity, pushed, is_at_wall, is_ghost, report }
    }

    /// Folds ghost nodes onto their mirrors, axis by axis; returns the columns that a wall acts on.
    fn fold(&mut self, columns: Vec<(Fold, f64)>, step: &GridStep) -> Vec<Fold> {
        let mut folds = vec![];
        for (column, inward) in columns {
            for field in [MAIN, OTHER] {
                let fold = Fold { field, ..column };
                if fold.kind == Wall::Separate && self.reaction(&fold, inward, step) <= 0.0 {
                    continue;
                }
                let ghost = std::mem::take(&mut self.folded[fold.ghost][field]);
                let mirror = &mut self.folded[fold.mirror][field];
                *mirror = mirror.plus(Sum { momentum: fold.reflect(ghost.momentum), ..ghost });
                self.is_ghost[fold.ghost][field] = true;
                [fold.ghost, fold.wall, fold.mirror].into_iter().for_each(|k| self.is_at_wall[k][field] = true);
                folds.push(fold);
            }
        }
        folds
    }

    /// Normal impulse of the wall on the clay if it folded this column.
    fn reaction(&self, f: &Fold, inward: f64, step: &GridStep) -> f64 {
        let part = |k: usize| {
            let sum = self.folded[k][f.field];
            (sum.mass, sum.momentum[f.axis] * inward)
        };
        let ((m_ghost, ghost), (m_wall, wall), (m_mirror, mirror)) = (part(f.ghost), part(f.wall), part(f.mirror));
        let gravity = step.gravity[f.axis] * inward;
        let mass = m_mirror + m_ghost;
        let velocity = if mass > 0.0 { (mirror - ghost) / mass + gravity } else { 0.0 };
        (m_mirror - m_ghost) * velocity - (mirror + wall + ghost) - (mass + m_wall) * gravity
    }

    fn move_fields(&mut self, step: &GridStep) {
        for (velocity, folded) in self.velocity.iter_mut().flatten().zip(self.folded.iter().flatten()) {
            // A NaN mass must show.
            if folded.mass > 0.0 || folded.mass.is_nan() {
                *velocity = (folded.momentum / folded.mass + step.gravity) * step.damping;
            }
        }
    }

    /// Whether contact acts on a field: there is clay, and it is not the image of clay elsewhere.
    fn takes_contact(&self, k: usize, field: usize) -> bool {
        self.folded[k][field].mass > 0.0 && !self.is_ghost[k][field]
    }

    /// One node: the two sides, then the solid tools in order.
    fn meet(&mut self, k: usize, node: IVec3, meeting: &Meeting<'_>, gradients: &dyn Fn(IVec3) -> [DVec3; 2]) {
        let world = node.as_dvec3();
        let division = self.division[k];
        match (division.owner, division.blade) {
            (Some(_), Some((index, distance))) => {
                let tool = &meeting.tools[index];
                let normal = tool.motion.end.rotation * DVec3::Z;
                // Each side is bounded by the blade where it reaches beyond it.
                for (class, sign) in [(FRONT, 1.0), (BACK, -1.0)] {
                    if distance * sign <= CONTACT_OFFSET {
                        self.touch(k, division.field_of(class), (index, tool), world, normal * sign);
                    }
                }
            }
            (Some(_), None) => self.exchange(k, gradients(node)),
            _ => {}
        }
        for (index, tool) in meeting.tools.iter().enumerate() {
            if let Some(normal) = tool.touch(world) {
                for field in [MAIN, OTHER] {
                    self.touch(k, field, (index, tool), world, normal);
                }
            }
        }
    }

    /// A tool's contact on one field; the tool feels the opposite impulse.
    fn touch(&mut self, k: usize, field: usize, (index, tool): (usize, &ToolNow), world: DVec3, normal: DVec3) {
        if !self.takes_contact(k, field) {
            return;
        }
        let before = self.velocity[k][field];
        let after = tool.apply(before, world, normal);
        let impulse = self.own[k][field].mass * (after - before);
        self.velocity[k][field] = after;
        self.pushed[k][field] += impulse;
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
        let [_, m_front, m_back] = self.class_mass[k];
        let total = m_front + m_back;
        let normal = ((m_back / total) * front_gradient - (m_front / total) * back_gradient).try_normalize();
        let (f, b) = (self.division[k].field_of(FRONT), self.division[k].field_of(BACK));
        let (Some(n), true) = (normal, self.takes_contact(k, f) && self.takes_contact(k, b)) else { return };
        let relative = self.velocity[k][f] - self.velocity[k][b];
        let approach = relative.dot(n);
        if approach >= 0.0 {
            return;
        }
        let (m_f, m_b) = (self.folded[k][f].mass, self.folded[k][b].mass);
        let slide = relative - approach * n;
        let stop = slide.length().min(-approach * CUT_FRICTION);
        let impulse = m_f * m_b / (m_f + m_b) * (-approach * n - slide.normalize_or_zero() * stop);
        for (field, impulse, mass) in [(f, impulse, m_f), (b, -impulse, m_b)] {
            self.velocity[k][field] += impulse / mass;
            self.pushed[k][field] += impulse;
        }
    }

    /// Wall nodes stand still across the wall, ghosts move as images, the last fold first; books the walls' impulse.
    fn unfold(&mut self, folds: &[Fold], step: &GridStep) {
        for f in folds.iter().rev() {
            self.velocity[f.ghost][f.field] = f.reflect(self.velocity[f.mirror][f.field]);
            let at_wall = &mut self.velocity[f.wall][f.field];
            *at_wall = 0.5 * (*at_wall + f.reflect(*at_wall));
        }
        for k in 0..64 {
            for field in [MAIN, OTHER] {
                if self.is_at_wall[k][field] {
                    let own = self.own[k][field];
                    let free = step.damping * (own.momentum + own.mass * step.gravity);
                    let impulse = own.mass * self.velocity[k][field] - free - self.pushed[k][field];
                    self.report.wall_impulse += impulse;
                    self.report.impulse_scale += impulse.length();
                }
            }
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
fn divide(node: IVec3, &[untagged, front, back]: &[f64; 3], meeting: &Meeting<'_>) -> Division {
    let world = node.as_dvec3();
    let blade = meeting.tools.iter().enumerate().find_map(|(i, t)| Some((i, t.blade?.distance_within_band(world)?)));
    let owner = match blade {
        Some((_, distance)) => Some(if distance < 0.0 { BACK } else { FRONT }),
        None if front + back > 0.5 * (untagged + front + back) => Some(if front >= back { FRONT } else { BACK }),
        None => None,
    };
    Division { owner, blade }
}
