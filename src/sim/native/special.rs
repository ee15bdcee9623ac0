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

/// A column of nodes across a wall while the wall acts on it.
struct Fold {
    axis: usize,
    ghost: usize,
    wall: usize,
    mirror: usize,
    kind: Wall,
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

const UNTAGGED: usize = 0;
const FRONT: usize = 1;
const BACK: usize = 2;

/// The sums of the three classes at the 64 nodes, gravity's impulse included: as scattered, and folded. The image of a particle in a wall
/// falls the other way, so gravity folds with the rest.
struct Block {
    raw: [[Sum; 3]; 64],
    folded: [[Sum; 3]; 64],
    velocity: [[DVec3; 3]; 64],
    /// Impulse of the tools on the clay at each node.
    pushed: [DVec3; 64],
    report: GridReport,
}

/// Updates `nodes` (untagged, or all clay) and `sides` (front and back) from sums to velocities; masses stay as they were summed.
/// `gradient` is that of front minus back mass.
pub(super) fn update(
    nodes: &mut Nodes,
    sides: Option<&mut [Nodes; 2]>,
    block: IVec3,
    step: &GridStep,
    meeting: &Meeting<'_>,
    gradient: &dyn Fn(IVec3) -> DVec3,
) -> GridReport {
    let mut b = Block::load(nodes, sides.as_deref(), step);
    b.report.tools = vec![Default::default(); meeting.tools.len()];
    let folds = b.fold(block, meeting.domain);
    let mut is_ghost = [false; 64];
    folds.iter().for_each(|f| is_ghost[f.ghost] = true);
    for k in (0..64).filter(|k| !is_ghost[*k]) {
        let node = block * BLOCK + IVec3::new(k as i32 / 16, k as i32 / 4 % 4, k as i32 % 4);
        b.node(k, node, step, meeting, gradient);
    }
    b.walls(&folds, step);
    b.store(nodes, sides);
    b.report
}

impl Block {
    fn load(nodes: &Nodes, sides: Option<&[Nodes; 2]>, step: &GridStep) -> Self {
        let sum = |n: &Nodes, k: usize| {
            let q = n[k].0.map(f64::from);
            Sum { mass: q[3], momentum: DVec3::new(q[0], q[1], q[2]) + q[3] * step.gravity }
        };
        let raw = std::array::from_fn(|k| {
            let side = |s: usize| sides.map_or(Sum::default(), |sides| sum(&sides[s], k));
            [sum(nodes, k), side(0), side(1)]
        });
        Self { raw, folded: raw, velocity: [[DVec3::ZERO; 3]; 64], pushed: [DVec3::ZERO; 64], report: GridReport::default() }
    }

    /// Folds ghost nodes onto their mirrors, axis by axis; returns the columns that a wall acts on.
    fn fold(&mut self, block: IVec3, domain: &Domain) -> Vec<Fold> {
        let mut folds = vec![];
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
                    let fold = Fold { axis, ghost: at(w - inward), wall: at(w), mirror: at(w + inward), kind };
                    if self.fold_column(&fold, f64::from(inward)) {
                        folds.push(fold);
                    }
                }
            }
        }
        folds
    }

    /// Folds one column unless its wall is a separating one that would have to pull.
    fn fold_column(&mut self, f: &Fold, inward: f64) -> bool {
        let total = |k: usize| self.folded[k].iter().fold(Sum::default(), |s, c| s.plus(*c));
        if f.kind == Wall::Separate {
            let normal = |s: Sum| s.momentum[f.axis] * inward;
            let (plus, zero, minus) = (total(f.mirror), total(f.wall), total(f.ghost));
            let (p, o, m) = (normal(plus), normal(zero), normal(minus));
            let mass = plus.mass + minus.mass;
            let folded = if mass > 0.0 { (plus.mass - minus.mass) / mass * (p - m) } else { 0.0 };
            if folded - (p + o + m) <= 0.0 {
                return false;
            }
        }
        for class in 0..3 {
            let ghost = std::mem::take(&mut self.folded[f.ghost][class]);
            let mirror = &mut self.folded[f.mirror][class];
            *mirror = mirror.plus(Sum { momentum: f.reflect(ghost.momentum), ..ghost });
        }
        true
    }

    /// One node: sides, velocity, two sides, solid tools.
    fn node(&mut self, k: usize, node: IVec3, step: &GridStep, meeting: &Meeting<'_>, gradient: &dyn Fn(IVec3) -> DVec3) {
        let world = node.as_dvec3();
        let [u, f, b] = self.folded[k];
        let total = u.mass + f.mass + b.mass;
        // A NaN mass goes on: it must show in the speed.
        if total == 0.0 && (u.momentum + f.momentum + b.momentum) == DVec3::ZERO {
            return;
        }
        let blade = meeting.tools.iter().position(|t| t.blade.is_some_and(|b| b.distance_within_band(world).is_some()));
        let distance = blade.and_then(|i| meeting.tools[i].blade?.distance_within_band(world));
        let owner = match distance {
            Some(d) if d >= 0.0 => Some(FRONT),
            Some(_) => Some(BACK),
            None if f.mass + b.mass > 0.5 * total => Some(if f.mass >= b.mass { FRONT } else { BACK }),
            None => None,
        };
        let raw = self.raw[k].map(|c| c.mass);
        let Some(owner) = owner else {
            let mut v = velocity(u.plus(f).plus(b), step);
            self.touch(k, world, meeting, raw.iter().sum(), &mut v);
            self.velocity[k] = [v; 3];
            return;
        };
        let mut field = [Sum::default(), f, b];
        field[owner] = field[owner].plus(u);
        let mut field_raw = raw;
        field_raw[owner] += raw[UNTAGGED];
        let mut v = field.map(|f| velocity(f, step));
        match (blade, distance) {
            (Some(tool), Some(d)) => self.bound_by_blade(k, (tool, &meeting.tools[tool]), world, d, &field_raw, &mut v),
            _ => exchange(&field, &mut v, gradient(node)),
        }
        for side in [FRONT, BACK] {
            self.touch(k, world, meeting, field_raw[side], &mut v[side]);
        }
        v[UNTAGGED] = v[owner];
        self.velocity[k] = v;
    }

    /// Each side's field is bounded by the blade at the nodes it reaches beyond it.
    fn bound_by_blade(
        &mut self,
        k: usize,
        (index, tool): (usize, &ToolNow),
        world: DVec3,
        distance: f64,
        mass: &[f64; 3],
        v: &mut [DVec3; 3],
    ) {
        let normal = tool.motion.end.rotation * DVec3::Z;
        for (side, sign) in [(FRONT, 1.0), (BACK, -1.0)] {
            if mass[side] > 0.0 && distance * sign <= CONTACT_OFFSET {
                let after = tool.apply(v[side], world, normal * sign);
                self.push(k, index, tool, world, mass[side] * (after - v[side]));
                v[side] = after;
            }
        }
    }

    /// Solid tools, in order.
    fn touch(&mut self, k: usize, world: DVec3, meeting: &Meeting<'_>, mass: f64, v: &mut DVec3) {
        for (index, tool) in meeting.tools.iter().enumerate() {
            if let Some(normal) = tool.touch(world)
                && mass > 0.0
            {
                let after = tool.apply(*v, world, normal);
                self.push(k, index, tool, world, mass * (after - *v));
                *v = after;
            }
        }
    }

    /// Books an impulse of a tool on the clay.
    fn push(&mut self, k: usize, index: usize, tool: &ToolNow, world: DVec3, impulse: DVec3) {
        self.pushed[k] += impulse;
        self.report.impulse_scale += impulse.length();
        let sum = &mut self.report.tools[index];
        sum.0 -= impulse;
        sum.1 -= (world - tool.motion.end.position).cross(impulse);
        sum.2 += 1;
    }

    /// Wall nodes stand still across the wall, ghosts mirror; books the walls' impulse.
    fn walls(&mut self, folds: &[Fold], step: &GridStep) {
        for f in folds {
            for v in &mut self.velocity[f.wall] {
                if f.kind == Wall::Stick { *v = DVec3::ZERO } else { v[f.axis] = 0.0 }
            }
        }
        for f in folds.iter().rev() {
            self.velocity[f.ghost] = self.velocity[f.mirror].map(|v| f.reflect(v));
        }
        let mut is_at_wall = [false; 64];
        folds.iter().for_each(|f| [f.ghost, f.wall, f.mirror].into_iter().for_each(|k| is_at_wall[k] = true));
        for k in (0..64).filter(|k| is_at_wall[*k]) {
            let mut impulse = -self.pushed[k];
            for (class, v) in self.raw[k].iter().zip(self.velocity[k]) {
                impulse += class.mass * v - step.damping * class.momentum;
            }
            self.report.wall_impulse += impulse;
            self.report.impulse_scale += impulse.length();
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "nodes are f32")]
    fn store(&mut self, nodes: &mut Nodes, mut sides: Option<&mut [Nodes; 2]>) {
        let mut greatest = 0.0f64;
        let mut all = 0.0;
        for (k, v) in self.velocity.iter().enumerate() {
            let set = |node: &mut super::simd::Node, v: DVec3| node.0[..3].copy_from_slice(&v.as_vec3().to_array());
            set(&mut nodes[k], v[UNTAGGED]);
            if let Some(sides) = sides.as_deref_mut() {
                set(&mut sides[0][k], v[FRONT]);
                set(&mut sides[1][k], v[BACK]);
            }
            for v in v {
                greatest = greatest.max(v.length_squared());
                all += v.length_squared();
            }
        }
        self.report.speed_max = if all.is_finite() { greatest.sqrt() as f32 } else { f32::NAN };
    }
}

impl Fold {
    /// Reverses the folded components.
    fn reflect(&self, mut v: DVec3) -> DVec3 {
        if self.kind == Wall::Stick {
            return -v;
        }
        v[self.axis] = -v[self.axis];
        v
    }
}

fn velocity(sum: Sum, step: &GridStep) -> DVec3 {
    // A NaN mass must show.
    if sum.mass > 0.0 || sum.mass.is_nan() { sum.momentum / sum.mass * step.damping } else { DVec3::ZERO }
}

/// The two sides of a kept cut exchange momentum while they approach; `gradient` points from back to front.
fn exchange(field: &[Sum; 3], v: &mut [DVec3; 3], gradient: DVec3) {
    let (f, b) = (field[FRONT].mass, field[BACK].mass);
    let Some(n) = gradient.try_normalize().filter(|_| f > 0.0 && b > 0.0) else { return };
    let relative = v[FRONT] - v[BACK];
    let approach = relative.dot(n);
    if approach >= 0.0 {
        return;
    }
    let reduced = f * b / (f + b);
    let slide = relative - approach * n;
    let stop = slide.length().min(-approach * CUT_FRICTION);
    let impulse = reduced * (-approach * n - slide.normalize_or_zero() * stop);
    v[FRONT] += impulse / f;
    v[BACK] -= impulse / b;
}
