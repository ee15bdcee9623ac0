//! What a step starts from: the slots of nodes, which of them move together, and what they would do without
//! stress and contact.

use super::super::super::cut::ClassKey;
use super::super::super::implicit::{ACTIVE_MASS, GUESS_FALL_MIN, GUESS_WAY_MAX};
use super::super::grid::{Grid, Tiles};
use super::super::grid_step::GridStep;
use super::super::meeting::{self, Faces, Fold, Meeting, Scratch, Ties};
use super::super::nodes::{ClassMasses, CutBlock};
use super::super::simd::in_lanes;
use super::super::state::State;
use super::layout::{Index, Layout, Link, Place};
use super::pairs::{Divided, Pairs};
use super::slope::nodes_of;
use super::vectors::{Block3, Vector, for_each, for_each_pair};
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
    /// 1 where the preconditioner has an unknown, however light; -1 where a wall holds clay.
    pub(super) live: Vector,
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
    pub(super) sides: Pairs,
}

impl Begun {
    /// Sums what the particles brought; `modulus` is that of the clay's P-waves.
    pub(super) fn new(
        state: &State,
        grid: &mut Grid,
        tiles: &Tiles,
        step: &GridStep,
        meeting: &Meeting<'_>,
        modulus: f64,
    ) -> Self {
        grid.find_cuts(state, tiles);
        let mut slots: Vec<Place> = state.blocks.iter().map(|block| Place { block: *block, key: ClassKey::FIRST }).collect();
        let mut first_tagged = vec![];
        for (i, block) in state.blocks.iter().enumerate() {
            first_tagged.push(slots.len());
            let keys = grid.cut_slot[i].checked_sub(1).map_or(&[][..], |cut| &grid.cuts[cut as usize].keys);
            slots.extend(keys.iter().map(|key| Place { block: *block, key: *key }));
        }
        let tagged_slots = state.runs.iter().enumerate().map(|(i, run)| {
            let keys = grid.cut_slot[i].checked_sub(1).map_or(&[][..], |cut| &grid.cuts[cut as usize].keys);
            let slot = |key: &ClassKey| keys.binary_search(key).map_or(i as u32, |at| (first_tagged[i] + at) as u32);
            run.tagged.iter().map(|(key, _)| slot(key)).collect()
        });
        let tagged_slots = tagged_slots.collect();
        let mut index = Index::default();
        index.rebuild(&slots);
        let mut layout = Layout { slots, ..Layout::default() };
        layout.find_neighbours(&index);
        let sums: Vec<_> = (0..layout.slots.len()).into_par_iter().map(|slot| nodes_of(&layout, tiles, slot)).collect();
        grid.nodes.clear();
        grid.nodes.extend_from_slice(&sums[..state.blocks.len()]);
        for (i, cut) in grid.cut_slot.iter().enumerate().filter_map(|(i, cut)| Some((i, cut.checked_sub(1)?))) {
            let cut = &mut grid.cuts[cut as usize];
            cut.nodes.clear();
            cut.nodes.extend_from_slice(&sums[first_tagged[i]..first_tagged[i] + cut.keys.len()]);
            cut.has.fill(!0);
        }
        let (folds, divided) = ties(&mut layout, &sums, state, grid, &first_tagged, step, meeting);
        layout.mark_links();
        let nodes = Nodes::new(&layout, &sums, &folds, step.gravity);
        let sides = Pairs::new(&divided, (&nodes.mass, &nodes.free), modulus);
        Self { layout, tagged_slots, nodes, sides }
    }
}

/// The ties of a block's slots, the columns that walls fold in them, and the fields that kept cuts divide.
type Found = (Vec<Link>, (Vec<(usize, Fold)>, Vec<Divided>));

/// Ties classes to the fields in which they move, then walls' outer nodes to the inner ones. Returns the
/// columns folded in each slot, and the fields that kept cuts divide.
fn ties(
    layout: &mut Layout,
    sums: &[super::super::nodes::Nodes],
    state: &State,
    grid: &Grid,
    first_tagged: &[usize],
    step: &GridStep,
    meeting: &Meeting<'_>,
) -> (Vec<(usize, Fold)>, Vec<Divided>) {
    let slot_of = |i: usize, class: usize| if class == 0 { i } else { first_tagged[i] + class - 1 };
    let cut_of = |i: usize| Some(&grid.cuts[grid.cut_slot[i].checked_sub(1)? as usize]);
    let cuts: Vec<Option<&CutBlock>> = (0..state.blocks.len()).map(cut_of).collect();
    let masses = grid.cuts.par_iter().map(|cut| {
        let mut masses = ClassMasses::default();
        meeting::find_masses(&mut masses, &sums[cut.slot], cut, state.blocks[cut.slot], step, meeting);
        masses
    });
    let masses: Vec<ClassMasses> = masses.collect();
    let faces = grid.cuts.par_iter().map_init(Scratch::new, |scratch, cut| {
        let mut faces = vec![];
        meeting::find_faces(&mut faces, cut, &|n| Some(&masses[cut.neighbour(n)?]), scratch);
        faces
    });
    let faces: Vec<Vec<Faces>> = faces.collect();
    let found: Vec<Found> = (0..state.blocks.len())
        .into_par_iter()
        .map(|i| {
            let block = state.blocks[i];
            let (mut links, mut folds) = (vec![], vec![]);
            if cuts[i].is_none() && !meeting.concerns(block) {
                return (links, (folds, vec![]));
            }
            let slot_of = |class: usize| slot_of(i, class);
            let faces_of = |n: usize| Some(&faces[cuts[i]?.neighbour(n)?][..]);
            let Ties { leaders, folds: columns, divided } = meeting::ties(&sums[i], cuts[i], block, step, meeting, &faces_of);
            let divided = divided.into_iter().map(|(node, fields, facing)| {
                let slots = fields.map(|class| slot_of(class.into()) as u32);
                Divided { slots, node: node as u8, normal: facing.normal, room: facing.room() }
            });
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
            (links, (folds, divided.collect()))
        })
        .collect();
    let (links, found): (Vec<_>, Vec<_>) = found.into_iter().unzip();
    layout.links = links.concat();
    let (folds, divided): (Vec<_>, Vec<_>) = found.into_iter().unzip();
    (folds.concat(), divided.concat())
}

impl Nodes {
    fn new(layout: &Layout, sums: &[super::super::nodes::Nodes], folds: &[(usize, Fold)], gravity: DVec3) -> Self {
        let count = sums.len();
        let mut nodes = Self { held: vec![Block3([[1.0; 64]; 3]); count], is_at_wall: vec![0; count], ..Self::default() };
        let [mut momentum, mut mass, mut diagonal, mut velocity, mut free] = std::array::from_fn(|_| vec![Block3::ZERO; count]);
        (nodes.own, nodes.fill, nodes.mass) = (vec![[[0.0; 4]; 64]; count], vec![[0.0; 64]; count], vec![[0.0; 64]; count]);
        for_each_pair(&mut momentum, &mut diagonal, |i, momentum, diagonal| {
            for (k, node) in sums[i].iter().enumerate() {
                for d in 0..3 {
                    momentum.0[d][k] = node.0[d];
                    diagonal.0[d][k] = node.0[4 + d];
                }
            }
        });
        for_each_pair(&mut nodes.own, &mut nodes.fill, |i, own, fill| {
            for (k, node) in sums[i].iter().enumerate() {
                own[k] = [0, 1, 2, 3].map(|d| node.0[d]);
                fill[k] = node.0[7];
            }
        });
        for_each(&mut mass, |i, mass| sums[i].iter().enumerate().for_each(|(k, node)| mass.0[0][k] = node.0[3]));
        layout.fold(&mut momentum);
        layout.fold_diagonal(&mut mass);
        layout.fold_diagonal(&mut diagonal);
        for (slot, fold) in folds {
            for d in 0..3 {
                nodes.held[*slot].0[d][fold.wall] *= 0.5 * (fold.image[d] as f32 + 1.0);
            }
            nodes.is_at_wall[*slot] |= 1 << fold.outer | 1 << fold.wall | 1 << fold.inner;
        }
        nodes.fold_fill(folds);
        nodes.find_live(layout, &mass);
        let mut is_linked = vec![0u64; count];
        layout.links.iter().for_each(|link| is_linked[link.from.0 as usize] |= 1 << link.from.1);
        let g = gravity.as_vec3().to_array();
        for_each_pair(&mut velocity, &mut free, |i, velocity, free| {
            for k in 0..64 {
                let m = mass[i].0[0][k];
                for d in 0..3 {
                    velocity.0[d][k] = if m > 0.0 { momentum[i].0[d][k] / m + g[d] } else { 0.0 };
                    let is_free = m > 8.0 * ACTIVE_MASS as f32 && is_linked[i] >> k & 1 == 0;
                    free.0[d][k] = if is_free { nodes.held[i].0[d][k] } else { 0.0 };
                }
            }
        });
        for_each(&mut nodes.mass, |i, own| *own = mass[i].0[0]);
        Self { velocity, free, diagonal, ..nodes }
    }

    /// Where clay moves for the cycle however light it is, where walls hold it.
    fn find_live(&mut self, layout: &Layout, mass: &[Block3]) {
        self.live = vec![Block3::ZERO; mass.len()];
        let held = &self.held;
        for_each(&mut self.live, |i, live| {
            for k in 0..64 {
                for d in 0..3 {
                    let sign = 2.0 * held[i].0[d][k] - 1.0;
                    live.0[d][k] = if mass[i].0[0][k] > 0.0 { sign } else { 0.0 };
                }
            }
        });
        for Link { from, to, image } in &layout.links {
            for d in 0..3 {
                let is_held = from.0 == to.0 && image[d] <= 0.0 && mass[to.0 as usize].0[0][usize::from(to.1)] > 0.0;
                self.live[from.0 as usize].0[d][usize::from(from.1)] = if is_held { -1.0 } else { 0.0 };
            }
        }
    }

    /// Brings the fill of cells beyond walls to their images.
    fn fold_fill(&mut self, folds: &[(usize, Fold)]) {
        for stride in [16, 4, 1] {
            for (slot, fold) in folds.iter().filter(|(_, fold)| fold.outer.abs_diff(fold.wall) == stride) {
                let (from, to) = if fold.outer < fold.wall { (fold.outer, fold.wall) } else { (fold.wall, fold.inner) };
                let got = std::mem::take(&mut self.fill[*slot][from]);
                self.fill[*slot][to] += got;
            }
        }
    }

    /// Makes of what acts on a slot's nodes the residual: inertia less that, where something is free.
    pub(super) fn subtract_from_inertia(&self, slot: usize, u: &Block3, acting: &mut Block3) {
        subtract(&self.mass[slot], &self.velocity[slot], &self.free[slot], u, acting);
    }

    /// Where the unknowns start: as the clay moves already, without what walls and contact will stop.
    pub(super) fn guess(&self, gravity: DVec3) -> Vector {
        let weight = gravity.as_vec3().to_array();
        let falls_from = GUESS_FALL_MIN as f32 * gravity.length_squared() as f32;
        let way_max = GUESS_WAY_MAX as f32;
        let mut guess = self.velocity.clone();
        for_each(&mut guess, |i, u| {
            for k in 0..64 {
                let has_mass = self.mass[i][k] > 0.0;
                let own: [f32; 3] = std::array::from_fn(|d| if has_mass { u.0[d][k] - weight[d] } else { 0.0 });
                let falls = own[0] * weight[0] + own[1] * weight[1] + own[2] * weight[2] > falls_from;
                let way: [f32; 3] = std::array::from_fn(|d| if falls { u.0[d][k] } else { own[d] });
                let length = (way[0] * way[0] + way[1] * way[1] + way[2] * way[2]).sqrt();
                let kept = if length > way_max { way_max / length } else { 1.0 };
                for d in 0..3 {
                    u.0[d][k] = self.held[i].0[d][k] * kept * way[d];
                }
            }
        });
        guess
    }
}

in_lanes! {
    fn subtract(mass: &[f32; 64], velocity: &Block3, free: &Block3, u: &Block3, acting: &mut Block3) {
        for d in 0..3 {
            for k in 0..64 {
                let inertia = mass[k] * (u.0[d][k] - velocity.0[d][k]);
                acting.0[d][k] = free.0[d][k] * (inertia - acting.0[d][k]);
            }
        }
    }
}
