//! What a step starts from: the slots of nodes, which of them move together, and what they would do without
//! stress and contact.

use super::super::super::cut::CutKey;
use super::super::super::implicit::{ACTIVE_MASS, GUESS_FALL_MAX, GUESS_WAY_MAX};
use super::super::grid::{Grid, Tiles};
use super::super::grid_step::GridStep;
use super::super::meeting::{self, Fold, Meeting};
use super::super::nodes::CutBlock;
use super::super::state::State;
use super::layout::{Index, Layout, Link, Place};
use super::slope::nodes_of;
use super::vectors::{Block3, Vector};
use glam::DVec3;
use rayon::prelude::*;

/// The nodes of a step.
#[derive(Debug, Default)]
pub(super) struct Nodes {
    /// `[p, m]` of each class's own clay at each node of each slot.
    pub(super) own: Vec<[[f32; 4]; 64]>,
    /// Mass of what moves with each node.
    pub(super) mass: Vec<[f32; 64]>,
    /// Velocity without stress and contact, with gravity [cells/step].
    pub(super) velocity: Vector,
    /// 1 where an unknown is to be found, else 0.
    pub(super) free: Vector,
    /// 0 where a wall holds a component, else 1.
    held: Vector,
    /// The splines' diagonal.
    pub(super) diagonal: Vector,
    /// How full the cell is whose low corner the node is.
    pub(super) fill: Vec<[f32; 64]>,
    /// A bit for each node of a column that a wall folds.
    pub(super) is_at_wall: Vec<u64>,
}

/// A step that begins.
pub(super) struct Begun {
    pub(super) layout: Layout,
    pub(super) tagged_slots: Vec<Vec<u32>>,
    pub(super) nodes: Nodes,
}

impl Begun {
    /// Sums what the particles brought.
    pub(super) fn new(state: &State, grid: &mut Grid, tiles: &Tiles, step: &GridStep, meeting: &Meeting<'_>) -> Self {
        grid.find_cuts(state, tiles);
        let mut slots: Vec<Place> = state.blocks.iter().map(|block| Place { block: *block, key: CutKey::UNTAGGED }).collect();
        let mut first_tagged = vec![];
        for (i, block) in state.blocks.iter().enumerate() {
            first_tagged.push(slots.len());
            let keys = grid.cut_slot[i].checked_sub(1).map_or(&[][..], |cut| &grid.cuts[cut as usize].keys);
            slots.extend(keys.iter().map(|key| Place { block: *block, key: *key }));
        }
        let tagged_slots = state.runs.iter().enumerate().map(|(i, run)| {
            let keys = grid.cut_slot[i].checked_sub(1).map_or(&[][..], |cut| &grid.cuts[cut as usize].keys);
            let slot = |key: &CutKey| keys.binary_search(key).map_or(i as u32, |at| (first_tagged[i] + at) as u32);
            run.tagged.iter().map(|(key, _)| slot(key)).collect()
        });
        let tagged_slots = tagged_slots.collect();
        let mut index = Index::default();
        index.rebuild(&slots);
        let mut layout = Layout { slots, ..Layout::default() };
        layout.find_neighbours(&index);
        let sums: Vec<_> = (0..layout.slots.len()).into_par_iter().map(|slot| nodes_of(&layout, tiles, slot)).collect();
        let folds = ties(&mut layout, &sums, state, grid, &first_tagged, step, meeting);
        let nodes = Nodes::new(&layout, &sums, &folds, step.gravity);
        Self { layout, tagged_slots, nodes }
    }
}

/// The ties of a block's slots, and the columns that walls fold in them.
type Ties = (Vec<Link>, Vec<(usize, Fold)>);

/// Ties classes to the fields in which they move, then walls' outer nodes to the inner ones. Returns the
/// columns folded in each slot.
fn ties(
    layout: &mut Layout,
    sums: &[super::super::nodes::Nodes],
    state: &State,
    grid: &Grid,
    first_tagged: &[usize],
    step: &GridStep,
    meeting: &Meeting<'_>,
) -> Vec<(usize, Fold)> {
    let found: Vec<Ties> = (0..state.blocks.len())
        .into_par_iter()
        .map(|i| {
            let block = state.blocks[i];
            let cut = grid.cut_slot[i].checked_sub(1).map(|cut| &grid.cuts[cut as usize].keys);
            let (mut links, mut folds) = (vec![], vec![]);
            if cut.is_none() && !meeting.concerns(block) {
                return (links, folds);
            }
            let slot_of = |class: usize| if class == 0 { i } else { first_tagged[i] + class - 1 };
            let cut = cut.map(|keys| {
                let nodes = (0..keys.len()).map(|k| sums[slot_of(k + 1)]).collect();
                CutBlock { keys: keys.clone(), nodes, ghosts: vec![] }
            });
            let (leaders, columns) = meeting::fields(&sums[i], cut.as_ref(), block, step, meeting, &|_| None);
            for (class, leader) in leaders.iter().enumerate() {
                for (k, leader) in leader.iter().enumerate().filter(|(_, leader)| usize::from(**leader) != class) {
                    let at = |class: usize| (slot_of(class) as u32, k as u8);
                    links.push(Link { from: at(class), to: at((*leader).into()), image: [1.0; 3] });
                }
            }
            for fold in &columns {
                for class in 0..leaders.len() {
                    let at = |k: usize| (slot_of(class) as u32, k as u8);
                    folds.push((slot_of(class), *fold));
                    // A class that moves with another is tied already.
                    if usize::from(leaders[class][fold.outer]) != class {
                        continue;
                    }
                    links.push(Link { from: at(fold.outer), to: at(fold.inner), image: fold.image.as_vec3().to_array() });
                }
            }
            (links, folds)
        })
        .collect();
    let (links, folds): (Vec<_>, Vec<_>) = found.into_iter().unzip();
    layout.links = links.concat();
    folds.concat()
}

impl Nodes {
    fn new(layout: &Layout, sums: &[super::super::nodes::Nodes], folds: &[(usize, Fold)], gravity: DVec3) -> Self {
        let count = sums.len();
        let mut nodes = Self { held: vec![Block3([[1.0; 64]; 3]); count], is_at_wall: vec![0; count], ..Self::default() };
        let (mut momentum, mut mass, mut diagonal) =
            (vec![Block3::ZERO; count], vec![Block3::ZERO; count], vec![Block3::ZERO; count]);
        nodes.fill = vec![[0.0; 64]; count];
        for (i, sums) in sums.iter().enumerate() {
            nodes.own.push(std::array::from_fn(|k| [0, 1, 2, 3].map(|d| sums[k].0[d])));
            for (k, node) in sums.iter().enumerate() {
                for d in 0..3 {
                    momentum[i].0[d][k] = node.0[d];
                    diagonal[i].0[d][k] = node.0[4 + d];
                }
                mass[i].0[0][k] = node.0[3];
                nodes.fill[i][k] = node.0[7];
            }
        }
        layout.fold(&mut momentum);
        layout.fold_diagonal(&mut mass);
        layout.fold_diagonal(&mut diagonal);
        for (slot, fold) in folds {
            for d in 0..3 {
                nodes.held[*slot].0[d][fold.wall] *= 0.5 * (fold.image[d] as f32 + 1.0);
            }
            nodes.is_at_wall[*slot] |= 1 << fold.outer | 1 << fold.wall | 1 << fold.inner;
        }
        let g = gravity.as_vec3().to_array();
        let mut is_linked = vec![0u64; count];
        layout.links.iter().for_each(|link| is_linked[link.from.0 as usize] |= 1 << link.from.1);
        for i in 0..count {
            let (mut velocity, mut free) = (Block3::ZERO, Block3::ZERO);
            for k in 0..64 {
                let m = mass[i].0[0][k];
                for d in 0..3 {
                    velocity.0[d][k] = if m > 0.0 { momentum[i].0[d][k] / m + g[d] } else { 0.0 };
                    let is_free = m > 8.0 * ACTIVE_MASS as f32 && is_linked[i] >> k & 1 == 0;
                    free.0[d][k] = if is_free { nodes.held[i].0[d][k] } else { 0.0 };
                }
            }
            nodes.velocity.push(velocity);
            nodes.free.push(free);
        }
        (nodes.mass, nodes.diagonal) = (mass.iter().map(|m| m.0[0]).collect(), diagonal);
        nodes
    }

    /// Where the unknowns start: as the clay moves already, without what walls and contact will stop.
    pub(super) fn guess(&self, gravity: DVec3) -> Vector {
        let weight = if gravity.length() < GUESS_FALL_MAX { [0.0; 3] } else { gravity.as_vec3().to_array() };
        let way_max = GUESS_WAY_MAX as f32;
        let mut guess = self.velocity.clone();
        for (i, u) in guess.iter_mut().enumerate() {
            for k in 0..64 {
                let has_mass = self.mass[i][k] > 0.0;
                let way: [f32; 3] = std::array::from_fn(|d| if has_mass { u.0[d][k] - weight[d] } else { 0.0 });
                let length = (way[0] * way[0] + way[1] * way[1] + way[2] * way[2]).sqrt();
                let kept = if length > way_max { way_max / length } else { 1.0 };
                for d in 0..3 {
                    u.0[d][k] = self.held[i].0[d][k] * kept * way[d];
                }
            }
        }
        guess
    }
}
