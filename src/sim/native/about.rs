//! The clay on either side of something about the particles of a block, by the node masses of the last
//! substep.

use super::super::carry::SidesAbout;
use super::super::cut::ClassKey;
use super::super::params::BLOCK;
use super::super::spline::spline;
use super::grid::Grid;
use super::nodes::offset;
use super::state::{Hot, NEIGHBOURS, Table};
use glam::IVec3;

/// Nodes along an edge of what the particles of a block reach, from -2 on: a block's own and two about it,
/// and one more, as far as particles stray.
const REACHED: i32 = BLOCK + 5;

/// The classes of clay in a block and those about it, each once, in order.
pub(super) fn classes_about(grid: &Grid, table: &Table, block: IVec3) -> Vec<ClassKey> {
    let mut keys: Vec<ClassKey> = NEIGHBOURS.into_iter().flat_map(|o| grid.classes_at(table, block + o)).map(|c| c.0).collect();
    keys.sort_unstable();
    keys.dedup();
    keys
}

/// The sheets that clay of a body has sides of, in order.
pub(super) fn sheets(classes: &[ClassKey], body: u16) -> Vec<u8> {
    let its = classes.iter().filter(|key| key.body() == body).flat_map(|key| key.sides());
    let mut sheets: Vec<u8> = its.map(|side| side.0).collect();
    sheets.sort_unstable();
    sheets.dedup();
    sheets
}

/// The bodies of classes in order.
pub(super) fn bodies(classes: &[ClassKey]) -> Vec<u16> {
    let mut bodies: Vec<u16> = classes.iter().map(|key| key.body()).collect();
    bodies.dedup();
    bodies
}

/// Masses in front of something and behind it at the nodes that the particles of a block reach, z fastest.
pub(super) struct MassesAbout {
    low: IVec3,
    sides: Vec<[f32; 2]>,
    /// The box of the nodes that have mass of each side, from its first node to its last.
    boxes: [[IVec3; 2]; 2],
}

impl MassesAbout {
    /// Those of the classes that `is_front` places in front or behind. None where one side is missing.
    pub(super) fn new(grid: &Grid, table: &Table, block: IVec3, is_front: impl Fn(ClassKey) -> Option<bool>) -> Option<Self> {
        let low = block * BLOCK - 2;
        let mut sides = vec![[0.0; 2]; (REACHED * REACHED * REACHED) as usize];
        let mut boxes = [[IVec3::MAX, IVec3::MIN]; 2];
        for neighbour in NEIGHBOURS.map(|o| block + o) {
            for (key, nodes) in grid.classes_at(table, neighbour) {
                let Some(is_front) = is_front(key) else { continue };
                let side = usize::from(!is_front);
                for (k, node) in nodes.iter().enumerate().filter(|(_, node)| node.0[3] > 0.0) {
                    let node_at = neighbour * BLOCK + offset(k);
                    if let Some(at) = place(node_at - low) {
                        sides[at][side] += node.0[3];
                        boxes[side] = [boxes[side][0].min(node_at), boxes[side][1].max(node_at)];
                    }
                }
            }
        }
        let has = |[first, last]: [IVec3; 2]| first.cmple(last).all();
        boxes.into_iter().all(has).then_some(Self { low, sides, boxes })
    }

    /// Those about a particle; nothing where one side alone is, which has no normal.
    pub(super) fn about(&self, hot: &Hot) -> SidesAbout {
        let at = hot.place();
        let base = (at - 0.5).floor().as_ivec3();
        let mut sums = SidesAbout::default();
        let is_apart = |[first, last]: [IVec3; 2]| base.cmpgt(last).any() || (base + 2).cmplt(first).any();
        if self.boxes.into_iter().any(is_apart) {
            return sums;
        }
        for i in 0..27 {
            let node = base + IVec3::new(i / 9, i / 3 % 3, i % 3);
            let Some(masses) = place(node - self.low).map(|at| self.sides[at]) else { continue };
            if masses == [0.0; 2] {
                continue;
            }
            let arm = node.as_dvec3() - at;
            let weight = spline(arm.x) * spline(arm.y) * spline(arm.z);
            for (side, mass) in masses.into_iter().enumerate() {
                sums.masses[side] += weight * f64::from(mass);
                sums.moments[side] += weight * f64::from(mass) * arm;
            }
        }
        sums
    }
}

/// The place of a node among those reached, each coordinate from 0 on.
fn place(node: IVec3) -> Option<usize> {
    let is_reached = node.cmpge(IVec3::ZERO).all() && node.cmplt(IVec3::splat(REACHED)).all();
    is_reached.then(|| ((node.x * REACHED + node.y) * REACHED + node.z) as usize)
}
