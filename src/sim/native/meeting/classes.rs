//! What each class of clay brought to the nodes of a block, and what walls fold of it.

use super::super::super::cut::ClassKey;
use super::super::super::params::BLOCK;
use super::super::contact::ToolNow;
use super::super::grid_step::GridStep;
use super::super::nodes::{ClassHere, ClassMasses, CutBlock, Nodes, bits, node_masses, offset};
use super::super::simd::Node;
use super::bounds::Meeting;
use super::walls::{Column, columns, stand_in};
use glam::{DVec3, IVec3};

/// Mass and momentum, and mass times what the clay has lost of its strength at tools.
#[derive(Clone, Copy, Default)]
pub(super) struct Sum {
    pub(super) mass: f64,
    pub(super) momentum: DVec3,
    pub(super) lost: f64,
}

impl Sum {
    pub(super) fn plus(self, other: Self) -> Self {
        Self { mass: self.mass + other.mass, momentum: self.momentum + other.momentum, lost: self.lost + other.lost }
    }
}

/// The class sums of a block: as the particles brought them, and with what walls folded onto or away from
/// each node.
pub(super) struct Classes {
    /// Untagged clay of the first body, then the other classes in order.
    pub(super) keys: Vec<ClassKey>,
    pub(super) own: Vec<[Sum; 64]>,
    pub(super) folded: Vec<[Sum; 64]>,
    /// The columns that a wall acts on, in the order of folding.
    pub(super) folds: Vec<Column>,
    /// The columns of clamped walls.
    pub(super) clamps: Vec<Column>,
}

impl Classes {
    pub(super) fn new(nodes: &Nodes, cut: Option<&CutBlock>, block: IVec3, step: &GridStep, meeting: &Meeting<'_>) -> Self {
        let sum = |node: &Node| {
            let q = [0, 1, 2, 3, 7].map(|i| f64::from(node.0[i]));
            Sum { mass: q[3], momentum: DVec3::new(q[0], q[1], q[2]), lost: q[4] }
        };
        let sums = |nodes: &Nodes| std::array::from_fn(|k| sum(&nodes[k]));
        let tagged = || cut.iter().flat_map(|cut| cut.keys.iter().zip(&cut.nodes));
        let keys = std::iter::once(ClassKey::FIRST).chain(tagged().map(|t| *t.0)).collect();
        let own: Vec<[Sum; 64]> = std::iter::once(nodes).chain(tagged().map(|t| t.1)).map(sums).collect();
        let mut classes = Self { keys, folded: own.clone(), own, folds: vec![], clamps: vec![] };
        let is_clamped = step.imposed.is_some_and(|imposed| imposed.clamped_walls);
        for column in columns(block, meeting.domain) {
            if is_clamped {
                classes.clamps.push(column);
            } else if meeting.arrivals.holds(column.number, block * BLOCK + offset(column.wall)) {
                classes.fold(column);
            }
        }
        classes
    }

    fn fold(&mut self, column: Column) {
        for class in &mut self.folded {
            let outer = std::mem::take(&mut class[column.outer]);
            class[column.inner] = class[column.inner].plus(Sum { momentum: column.reflect(outer.momentum), ..outer });
        }
        self.folds.push(column);
    }

    /// The sheets of the classes and of the blades, each once, in order.
    pub(super) fn sheets(&self, tools: &[ToolNow]) -> Vec<u8> {
        let of_blades = tools.iter().filter(|t| t.blade.is_some()).map(|t| t.sheet);
        let mut sheets: Vec<u8> = self.keys.iter().flat_map(|key| key.sides()).map(|s| s.0).chain(of_blades).collect();
        sheets.sort_unstable();
        sheets.dedup();
        sheets
    }
}

/// Finds the folded masses of the classes that have clay at the nodes of a block: what the normals of cuts
/// are made of.
#[expect(clippy::cast_possible_truncation, reason = "nodes are f32")]
pub(in super::super) fn find_masses(
    all: &mut ClassMasses,
    nodes: &Nodes,
    cut: &CutBlock,
    block: IVec3,
    step: &GridStep,
    meeting: &Meeting<'_>,
) {
    all.classes.clear();
    all.masses.clear();
    let mut add = |class: usize, key: ClassKey, masses: [f32; 64]| {
        let has = bits(&masses);
        if has != 0 {
            all.classes.push(ClassHere { key, class: class as u32, has });
            all.masses.push(masses);
        }
    };
    let untagged = node_masses(nodes);
    if bits(&untagged) == 0 && cut.has.iter().all(|has| *has == 0) {
        return;
    }
    if !stand_in(block, meeting.domain) {
        add(0, ClassKey::FIRST, untagged);
        for (i, (key, nodes)) in cut.keys.iter().zip(&cut.nodes).enumerate().filter(|(i, _)| cut.has[*i] != 0) {
            add(i + 1, *key, node_masses(nodes));
        }
        return;
    }
    let Classes { keys, folded, .. } = Classes::new(nodes, Some(cut), block, step, meeting);
    keys.into_iter().zip(folded).enumerate().for_each(|(i, (key, sums))| add(i, key, sums.map(|sum| sum.mass as f32)));
}
