//! What a step starts from: the slots of nodes, which of them move together, and what they would do without
//! stress and contact.

use super::super::super::cut::ClassKey;
use super::super::super::implicit::{ACTIVE_MASS, GUESS_FALL_MIN, GUESS_WAY_MAX};
use super::super::grid::{Grid, Tiles};
use super::super::grid_step::GridStep;
use super::super::meeting::{self, Faces, Fold, Meeting, Scratch, Ties};
use super::super::nodes::{ClassMasses, CutBlock, Nodes as Sums, bits};
use super::super::simd::in_lanes;
use super::super::state::{Run, State};
use super::eights::Class;
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
    /// A bit for each node whose clay hangs together with some that a tool or a wall touches.
    pub(super) is_held_up: Vec<u64>,
}

/// A step that begins.
pub(super) struct Begun {
    pub(super) layout: Layout,
    index: Index,
    /// The slot of each class of each block, the untagged one first; of those without particles it means
    /// nothing.
    pub(super) class_slots: Vec<Vec<u32>>,
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
        let (places, first_tagged) = places(state, grid);
        let all: Vec<_> = places.par_iter().map(|place| nodes_of(place, tiles)).collect();
        grid.nodes.clear();
        grid.nodes.extend_from_slice(&all[..state.blocks.len()]);
        for (i, cut) in grid.cut_slot.iter().enumerate().filter_map(|(i, cut)| Some((i, cut.checked_sub(1)?))) {
            let cut = &mut grid.cuts[cut as usize];
            cut.nodes.clear();
            cut.nodes.extend_from_slice(&all[first_tagged[i]..first_tagged[i] + cut.keys.len()]);
            cut.has.fill(!0);
        }
        let mut tied = ties(&first_tagged, state, grid, step, meeting);
        let class_places = class_places(&first_tagged, state, grid);
        let slots = tied.keep(&all, &state.runs, &class_places);
        let slot = |place: &usize| slots[*place].saturating_sub(1);
        let class_slots = class_places.iter().map(|places| places.iter().map(slot).collect()).collect();
        let kept = || (0..all.len()).filter(|place| slots[*place] > 0);
        let sums: Vec<_> = kept().map(|place| all[place]).collect();
        let Tied { links, folds, divided } = tied;
        let mut layout = Layout { slots: kept().map(|place| places[place]).collect(), links, ..Layout::default() };
        let mut index = Index::default();
        index.rebuild(&layout.slots);
        layout.find_neighbours(&index);
        layout.mark_links();
        let nodes = Nodes::new(&layout, &sums, &folds, step.gravity);
        let sides = Pairs::new(&divided, (&nodes.mass, &nodes.free), modulus);
        Self { layout, index, class_slots, nodes, sides }
    }

    /// Finds which clay is held up, by the classes of which something is touched as the step begins.
    pub(super) fn find_held_up(&mut self, classes: &[Class]) {
        let has: Vec<u64> = self.nodes.mass.iter().map(bits).collect();
        let mut touched: Vec<bool> = self.nodes.is_at_wall.iter().zip(&has).map(|(nodes, has)| nodes & has != 0).collect();
        for class in classes {
            touched[class.slot] |= class.is_touched;
        }
        self.nodes.is_held_up = self.layout.hanging_together(&self.index, &has, &touched);
    }
}

/// Where classes of blocks may have slots: the untagged ones of all blocks, then the tagged ones, which begin
/// there for each block.
fn places(state: &State, grid: &Grid) -> (Vec<Place>, Vec<usize>) {
    let mut places: Vec<Place> = state.blocks.iter().map(|block| Place { block: *block, key: ClassKey::FIRST }).collect();
    let mut first_tagged = vec![];
    for (i, block) in state.blocks.iter().enumerate() {
        first_tagged.push(places.len());
        places.extend(grid.keys(i).iter().map(|key| Place { block: *block, key: *key }));
    }
    (places, first_tagged)
}

/// The place of each class of each block, the untagged one first.
fn class_places(first_tagged: &[usize], state: &State, grid: &Grid) -> Vec<Vec<usize>> {
    let places = state.runs.iter().enumerate().map(|(i, run)| {
        let place = |key: &ClassKey| grid.keys(i).binary_search(key).map_or(i, |at| first_tagged[i] + at);
        std::iter::once(i).chain(run.tagged.iter().map(|(key, _)| place(key))).collect()
    });
    places.collect()
}

/// What moves together, by places until [`keep`](Self::keep).
#[derive(Default)]
struct Tied {
    links: Vec<Link>,
    /// The columns that walls fold in each slot.
    folds: Vec<(usize, Fold)>,
    /// The fields that kept cuts divide.
    divided: Vec<Divided>,
}

impl Tied {
    /// Finds slot + 1 at each place: 0 where no node has mass, or moves in place of one that has, and no
    /// particle stands. Most blocks about clay have none: of the 180 about a cube of 20^3 particles 132.
    /// Leaves out what ties nodes without mass from slot to slot, and says all by slots then.
    fn keep(&mut self, all: &[Sums], runs: &[Run], class_places: &[Vec<usize>]) -> Vec<u32> {
        let mut loaded: Vec<u64> = vec![0; all.len()];
        for_each(&mut loaded, |place, loaded| {
            *loaded = bits(&std::array::from_fn(|node| all[place][node].0[3]));
        });
        self.links.retain(|Link { from, to, .. }| {
            let is_loaded = loaded[from.0 as usize] >> from.1 & 1;
            loaded[to.0 as usize] |= is_loaded << to.1;
            is_loaded == 1 || from.0 == to.0
        });
        let mut slots: Vec<u32> = loaded.iter().map(|loaded| u32::from(*loaded != 0)).collect();
        for (places, run) in class_places.iter().zip(runs) {
            let particles = std::iter::once(run.untagged).chain(run.tagged.iter().map(|class| class.1));
            places.iter().zip(particles).for_each(|(place, particles)| slots[*place] |= u32::from(particles > 0));
        }
        slots.iter_mut().filter(|slot| **slot > 0).zip(1..).for_each(|(slot, number)| *slot = number);
        let slot_of = |place: u32| slots[place as usize].checked_sub(1);
        let slots_of = |places: [u32; 2]| Some([slot_of(places[0])?, slot_of(places[1])?]);
        self.links.retain_mut(|Link { from, to, .. }| slots_of([from.0, to.0]).map(|slots| [from.0, to.0] = slots).is_some());
        self.folds.retain_mut(|(place, _)| slot_of(*place as u32).map(|slot| *place = slot as usize).is_some());
        self.divided.retain_mut(|divided| slots_of(divided.slots).map(|slots| divided.slots = slots).is_some());
        slots
    }
}

/// Ties classes to the fields in which they move, then walls' outer nodes to the inner ones.
fn ties(first_tagged: &[usize], state: &State, grid: &Grid, step: &GridStep, meeting: &Meeting<'_>) -> Tied {
    let place_of = |i: usize, class: usize| if class == 0 { i } else { first_tagged[i] + class - 1 };
    let cut_of = |i: usize| Some(&grid.cuts[grid.cut_slot[i].checked_sub(1)? as usize]);
    let cuts: Vec<Option<&CutBlock>> = (0..state.blocks.len()).map(cut_of).collect();
    let masses = grid.cuts.par_iter().map(|cut| {
        let mut masses = ClassMasses::default();
        meeting::find_masses(&mut masses, &grid.nodes[cut.slot], cut, state.blocks[cut.slot], step, meeting);
        masses
    });
    let masses: Vec<ClassMasses> = masses.collect();
    let faces = grid.cuts.par_iter().map_init(Scratch::new, |scratch, cut| {
        let mut faces = vec![];
        meeting::find_faces(&mut faces, cut, &|n| Some(&masses[cut.neighbour(n)?]), scratch);
        faces
    });
    let faces: Vec<Vec<Faces>> = faces.collect();
    let found: Vec<Tied> = (0..state.blocks.len())
        .into_par_iter()
        .map(|i| {
            let (block, mut tied) = (state.blocks[i], Tied::default());
            if cuts[i].is_none() && !meeting.concerns(block) {
                return tied;
            }
            let place_of = |class: usize| place_of(i, class);
            let faces_of = |n: usize| Some(&faces[cuts[i]?.neighbour(n)?][..]);
            let Ties { leaders, folds, divided } = meeting::ties(&grid.nodes[i], cuts[i], block, step, meeting, &faces_of);
            tied.divided.extend(divided.into_iter().map(|(node, fields, facing)| {
                let slots = fields.map(|class| place_of(class.into()) as u32);
                Divided { slots, node: node as u8, normal: facing.normal, room: facing.room() }
            }));
            for (class, leader) in leaders.iter().enumerate() {
                for (k, leader) in leader.iter().enumerate().filter(|(_, leader)| usize::from(**leader) != class) {
                    let at = |class: usize| (place_of(class) as u32, k as u8);
                    tied.links.push(Link { from: at(class), to: at((*leader).into()), image: [1.0; 3] });
                }
            }
            for fold in &folds {
                for class in 0..leaders.len() {
                    let at = |k: usize| (place_of(class) as u32, k as u8);
                    tied.folds.push((place_of(class), *fold));
                    // A class that moves with another is tied already.
                    if usize::from(leaders[class][fold.outer]) != class {
                        continue;
                    }
                    tied.links.push(Link { from: at(fold.outer), to: at(fold.inner), image: fold.image.as_vec3().to_array() });
                }
            }
            tied
        })
        .collect();
    let mut all = Tied::default();
    for mut tied in found {
        all.links.append(&mut tied.links);
        all.folds.append(&mut tied.folds);
        all.divided.append(&mut tied.divided);
    }
    all
}

impl Nodes {
    fn new(layout: &Layout, sums: &[Sums], folds: &[(usize, Fold)], gravity: DVec3) -> Self {
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

    /// Where the unknowns start: as the clay moves already, without what walls and contact will stop. What
    /// falls, and is not held up, falls on.
    pub(super) fn guess(&self, gravity: DVec3) -> Vector {
        let weight = gravity.as_vec3().to_array();
        let falls_from = GUESS_FALL_MIN as f32 * gravity.length_squared() as f32;
        let way_max = GUESS_WAY_MAX as f32;
        let mut guess = self.velocity.clone();
        for_each(&mut guess, |i, u| {
            for k in 0..64 {
                let has_mass = self.mass[i][k] > 0.0;
                let own: [f32; 3] = std::array::from_fn(|d| if has_mass { u.0[d][k] - weight[d] } else { 0.0 });
                let is_held_up = self.is_held_up[i] >> k & 1 == 1;
                let falls = !is_held_up && own[0] * weight[0] + own[1] * weight[1] + own[2] * weight[2] > falls_from;
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

#[cfg(test)]
mod tests {
    use super::super::super::simd::Node;
    use super::*;

    /// Slots are where a node has mass, or moves in place of one that has, if only through others, and where
    /// particles stand; walls' columns stay tied, and what has no mass is tied no more.
    #[test]
    fn slots_stand_where_something_moves() {
        let mut sums: Vec<Sums> = vec![[Node::default(); 64]; 6];
        sums[4][7].0[3] = 1.0;
        let link = |from, to| Link { from, to, image: [1.0; 3] };
        let divided = |slots| Divided { slots, node: 7, normal: DVec3::X, room: 0.0 };
        let mut tied = Tied {
            links: vec![
                link((4, 7), (1, 7)),
                link((4, 8), (2, 8)),
                link((1, 7), (1, 9)),
                link((1, 9), (3, 9)),
                link((4, 5), (4, 6)),
            ],
            divided: vec![divided([1, 4]), divided([0, 4])],
            ..Tied::default()
        };
        let runs = [Run::default(), Run { untagged: 1, tagged: vec![] }];
        let slots = tied.keep(&sums, &runs, &[vec![0], vec![5]]);
        assert_eq!(slots, [0, 1, 0, 2, 3, 4]);
        let links: Vec<_> = tied.links.iter().map(|link| (link.from, link.to)).collect();
        assert_eq!(links, [((2, 7), (0, 7)), ((0, 7), (0, 9)), ((0, 9), (1, 9)), ((2, 5), (2, 6))]);
        assert_eq!(tied.divided.iter().map(|divided| divided.slots).collect::<Vec<_>>(), [[0, 2]]);
    }
}
