//! The passes of the implicit step over all blocks: from particles to nodes and back.

use super::super::super::ahead::ClayAhead;
use super::super::super::params::Domain;
use super::super::contact::Moment;
use super::super::grid::{Tiles, sum_untagged};
use super::super::grid_step::GridReport;
use super::super::kernel::{Place as Spot, Tile};
use super::super::nodes::Nodes;
use super::super::particle_step::ParticleStep;
use super::super::passes::{Work, make_room, work};
use super::super::shares::for_each_in_shares;
use super::super::simd::{F8, Node};
use super::super::state::{Cold, Hot, NEIGHBOURS, State, split};
use super::super::step::Step;
use super::super::walls::{Arrivals, NearWall};
use super::contact::Near;
use super::eights::{self, Class, Eight};
use super::kernel::{self, Evaluation, Purpose, Scratch};
use super::layout::{Layout, Place};
use super::tile::{Rows, Tile4};
use super::vectors::{Block3, for_each};
use glam::{DVec3, IVec3, Vec3};
use std::sync::atomic::{AtomicBool, Ordering};

/// What particles bring to the nodes when the step begins, in `tiles`: see [`eights::found_with`]. Makes the
/// classes; notes and marks where clay has arrived at walls. Returns what is near each block.
pub(super) fn found<'a>(
    (s, ahead): (&ParticleStep<'a>, &'a ClayAhead),
    state: &mut State,
    tiles: &mut Tiles,
    classes: &mut Vec<Class>,
    arrivals: &Arrivals,
) -> Vec<Option<Near<'a>>> {
    make_room(state, tiles);
    let counts = list(state, classes);
    let lengths: Vec<usize> = state.runs.iter().map(|run| run.tagged.len()).collect();
    let mut near: Vec<Option<Near<'a>>> = state.runs.iter().map(|_| None).collect();
    let mut tasks: Vec<_> = work(&state.blocks, &mut state.hot, &mut state.cold, &mut state.runs)
        .into_iter()
        .zip(&mut tiles.untagged)
        .zip(split(&mut tiles.tagged, &lengths))
        .zip(split(classes, &counts))
        .zip(&mut near)
        .collect();
    let load = |((((w, _), _), _), _): &((((Work<'_>, _), _), _), _)| w.hot.len();
    for_each_in_shares(&mut tasks, load, Tile::zero, |scratch, ((((w, untagged), tagged), classes), near)| {
        **near = Near::of(w.block, (s.tools, ahead), s.domain, s.springs);
        let (mut tagged, mut classes) = (tagged.iter_mut(), classes.iter_mut());
        s.at(w.block, Moment::End, |spot| {
            arrive(w.block, s.domain, spot, w.hot, w.cold, arrivals);
            for (key, hot, cold) in w.run.classes(w.hot, w.cold) {
                // Only of untagged clay there may be none.
                let Some(class) = (if hot.is_empty() { None } else { classes.next() }) else { continue };
                if key.is_first() {
                    bring_all(&s.step, spot, hot, &mut class.eights, untagged);
                } else if let Some(tile) = tagged.next() {
                    bring_all(&s.step, spot, hot, &mut class.eights, scratch);
                    tile.fill(scratch);
                }
                find_yield_norms(s, spot, (hot, cold), &mut class.eights);
                find_clearances(near.as_ref(), (hot, cold), class);
            }
        });
    });
    near
}

/// Lists the classes with particles. Returns how many each block has.
fn list(state: &State, classes: &mut Vec<Class>) -> Vec<usize> {
    let (mut count, mut first) = (0, 0);
    let mut counts = Vec::with_capacity(state.runs.len());
    for (index, run) in state.runs.iter().enumerate() {
        let before = count;
        let particles = std::iter::once(run.untagged).chain(run.tagged.iter().map(|class| class.1));
        for (class, particles) in particles.enumerate().filter(|(_, particles)| *particles > 0) {
            if classes.len() == count {
                classes.push(Class::default());
            }
            let to = &mut classes[count];
            (to.block, to.index, to.particles) = (state.blocks[index], (index, class), (first, particles));
            to.shared.clear();
            count += 1;
            first += particles;
        }
        counts.push(count - before);
    }
    classes.truncate(count);
    counts
}

/// Yield norms for the step, by the particles' places in its middle and the tools at its end.
fn find_yield_norms(s: &ParticleStep<'_>, spot: &Spot<'_>, (hot, cold): (&[Hot], &[Cold]), eights: &mut [Eight]) {
    if s.step.yield_norm.is_infinite() || (!s.step.has_history() && spot.softening.is_none()) {
        return;
    }
    for ((hot, cold), eight) in hot.chunks(8).zip(cold.chunks(8)).zip(eights) {
        let middles = eights::middles(hot, spot);
        for (k, (hot, cold)) in hot.iter().zip(cold).enumerate() {
            let softened = spot.softening.map_or(s.step.yield_norm, |softening| softening(middles[k]));
            eight.yield_norm.0[k] = s.step.yield_norm_of(softened, hot.hardening, cold.structure);
        }
    }
}

/// How far the particles of a class are from what may press on them, and whether it touches any.
fn find_clearances(near: Option<&Near<'_>>, (hot, cold): (&[Hot], &[Cold]), class: &mut Class) {
    class.is_touched = false;
    let Some(near) = near else {
        class.contact = None;
        return;
    };
    class.contact.get_or_insert_with(|| Box::new([Tile4::ZERO; 2]));
    for ((hot, cold), eight) in hot.chunks(8).zip(cold.chunks(8)).zip(&mut class.eights) {
        for (k, (hot, cold)) in hot.iter().zip(cold).enumerate() {
            eight.clear.0[k] = near.clearance(hot, cold);
            class.is_touched |= eight.clear.0[k] <= 0.0 && near.stiffness_still((hot, cold)) != [[0.0; 3]; 2];
        }
    }
}

/// Notes at which walls that hold clay particles stand as the step begins, and marks the nodes there. What
/// comes to a wall within the step meets it as one that clay can leave, and has arrived where the step ends:
/// nodes that hold it would stop it where it was.
fn arrive(block: IVec3, domain: &Domain, spot: &Spot<'_>, hot: &[Hot], cold: &mut [Cold], arrivals: &Arrivals) {
    let walls: Vec<NearWall> = NearWall::of(block, domain).into_iter().filter(|wall| !wall.is_separating()).collect();
    if walls.is_empty() {
        return;
    }
    for (hot, cold) in hot.chunks(8).zip(cold.chunks_mut(8)) {
        let middles = eights::middles(hot, spot);
        for ((hot, cold), middle) in hot.iter().zip(cold).zip(middles) {
            let start = hot.place();
            for wall in &walls {
                if wall.holds(cold.walls) || wall.has_arrived(start, f64::from(hot.mass) / 8.0, false) {
                    cold.walls |= wall.bit();
                    wall.mark(DVec3::from_array(middle), arrivals);
                }
            }
        }
    }
}

/// Notes at which walls that hold clay particles stand now.
fn settle(block: IVec3, domain: &Domain, hot: &[Hot], cold: &mut [Cold]) {
    let walls = NearWall::of(block, domain);
    for (hot, cold) in hot.iter().zip(cold) {
        let at = hot.place();
        let mut noted = 0;
        for wall in &walls {
            let was_noted = cold.walls & wall.bit() != 0;
            let is_noted =
                if wall.is_separating() { was_noted } else { wall.has_arrived(at, f64::from(hot.mass) / 8.0, was_noted) };
            noted |= if is_noted { wall.bit() } else { 0 };
        }
        cold.walls = noted;
    }
}

/// The passes of a step.
pub(super) struct Pass<'a, 'b> {
    pub(super) s: &'a ParticleStep<'b>,
    /// Plastic strain within which volumes are shared [-]; 0 for none.
    pub(super) averaging: f32,
    pub(super) layout: &'a Layout,
    /// What is near each block with particles.
    pub(super) near: Vec<Option<Near<'b>>>,
    /// Class + 1 of each slot's clay in the blocks about it; 0 if there is none.
    pub(super) sources: Vec<[u32; 27]>,
}

/// Finds the slots of the classes, and the classes about each slot.
pub(super) fn find_sources(layout: &Layout, class_slots: &[Vec<u32>], classes: &mut [Class]) -> Vec<[u32; 27]> {
    let mut of_slots = vec![0; layout.slots.len()];
    for (class, number) in classes.iter_mut().zip(1..) {
        let (block, index) = class.index;
        class.slot = class_slots[block][index] as usize;
        of_slots[class.slot] = number;
    }
    let mut sources = vec![[0; 27]; layout.slots.len()];
    for_each(&mut sources, |slot, sources| {
        for (source, seen) in sources.iter_mut().zip(&layout.neighbours[slot]) {
            let Some(seen) = seen.checked_sub(1).map(|seen| seen as usize) else { continue };
            *source = if layout.slots[seen].key == layout.slots[slot].key { of_slots[seen] } else { 0 };
        }
    });
    sources
}

impl Pass<'_, '_> {
    /// Finds the slope's particle part at `u`, class by class. Whether no cell was turned inside out comes
    /// back.
    pub(super) fn slope(&self, state: &State, classes: &mut [Class], u: &[Rows], purpose: Purpose) -> bool {
        let evaluation = Evaluation { step: self.s.step, averaging: self.averaging, purpose };
        let is_sound = AtomicBool::new(true);
        let load = |class: &Class| class.eights.len();
        for_each_in_shares(classes, load, Scratch::default, |scratch, class| {
            let (first, count) = class.particles;
            let clay = (&state.hot[first..first + count], &state.cold[first..first + count]);
            scratch.about.fill(&self.layout.neighbours[class.slot], u);
            if !slope(&evaluation, class, clay, self.near[class.index.0].as_ref(), scratch) {
                is_sound.store(false, Ordering::Relaxed);
            }
        });
        is_sound.into_inner()
    }

    /// Adds up what the classes about a slot bring.
    pub(super) fn sum<'c>(
        &self,
        slot: usize,
        classes: &'c [Class],
        tile: impl Fn(&'c Class) -> Option<&'c Tile4>,
        sum: &mut Block3,
    ) {
        let mut rows = Rows::ZERO;
        for (about, source) in self.sources[slot].iter().enumerate() {
            let class = source.checked_sub(1).map(|class| &classes[class as usize]);
            if let Some(tile) = class.and_then(&tile) {
                rows.add(about, tile);
            }
        }
        rows.copy_to(sum);
    }

    /// Ends the step at `u`. Returns particles clamped, the greatest way of one \[cells\], and what tools and
    /// separating walls felt.
    pub(super) fn end(&self, state: &mut State, classes: &mut [Class], u: &[Rows]) -> (u64, f32, GridReport) {
        let s = self.s;
        let evaluation = Evaluation { step: s.step, averaging: self.averaging, purpose: Purpose::Judge };
        let lengths: Vec<usize> = classes.iter().map(|class| class.particles.1).collect();
        let clay = split(&mut state.hot, &lengths).into_iter().zip(split(&mut state.cold, &lengths));
        let mut ended: Vec<(u32, f32, Option<GridReport>)> = vec![Default::default(); classes.len()];
        let mut tasks: Vec<_> = classes.iter_mut().zip(clay).zip(&mut ended).collect();
        let load = |((class, _), _): &((&mut Class, _), _)| class.eights.len();
        for_each_in_shares(&mut tasks, load, Scratch::default, |scratch, ((class, (hot, cold)), ended)| {
            let near = self.near[class.index.0].as_ref();
            let mut report = near.map(|_| GridReport::of_tools(s.tools.len()));
            scratch.about.fill(&self.layout.neighbours[class.slot], u);
            let clamped = s.at(class.block, Moment::End, |spot| {
                end(&evaluation, class, spot, (&mut **hot, &mut **cold), near.zip(report.as_mut()), scratch)
            });
            settle(class.block, s.domain, hot, cold);
            let way = hot.iter().map(|hot| Vec3::from_array(hot.velocity).length()).fold(0.0, f32::max);
            **ended = (clamped, way, report);
        });
        let mut felt = GridReport::of_tools(s.tools.len());
        ended.iter().filter_map(|(.., report)| report.as_ref()).for_each(|report| felt.add(report));
        let way = ended.iter().map(|ended| ended.1).fold(0.0, f32::max);
        (ended.iter().map(|ended| u64::from(ended.0)).sum(), way, felt)
    }
}

/// Adds up the tiles about a place.
pub(super) fn nodes_of(place: &Place, tiles: &Tiles) -> Nodes {
    let mut nodes: Nodes = [Node::default(); 64];
    if place.key.is_first() {
        sum_untagged(&mut nodes, tiles, place.block);
        return nodes;
    }
    for (neighbour, offset) in NEIGHBOURS.into_iter().enumerate() {
        let Some(slot) = tiles.table.slot(place.block + offset) else { continue };
        let tagged = tiles.tagged_of(slot);
        if let Ok(i) = tagged.binary_search_by_key(&place.key, |tile| tile.key) {
            tagged[i].add_to(&mut nodes, neighbour);
        }
    }
    nodes
}

/// Instantiates a kernel for AVX2 + FMA beside the plain one, and the function that chooses between them.
macro_rules! dispatch {
    ($name:ident = $module:ident::$kernel:ident / $fast:ident, ($of:ident: $given:ty => $fma:expr, $($arg:ident: $type:ty),*) -> $ret:ty) => {
        #[cfg(target_arch = "x86_64")]
        #[target_feature(enable = "avx2,fma")]
        fn $fast($of: $given, $($arg: $type),*) -> $ret {
            $module::$kernel::<super::super::simd::Wide>($of, $($arg),*)
        }

        #[inline]
        fn $name($of: $given, $($arg: $type),*) -> $ret {
            #[cfg(target_arch = "x86_64")]
            if $fma {
                // SAFETY: `fma` is set only after AVX2 and FMA were detected.
                return unsafe { $fast($of, $($arg),*) };
            }
            $module::$kernel::<F8>($of, $($arg),*)
        }
    };
}
dispatch!(bring_all = eights::found_with / found_avx2, (step: &Step => step.fma, spot: &Spot<'_>, hot: &[Hot], eights: &mut Vec<Eight>, out: &mut Tile) -> ());
dispatch!(slope = kernel::slope_with / slope_avx2, (given: &Evaluation => given.step.fma, class: &mut Class, clay: (&[Hot], &[Cold]), near: Option<&Near<'_>>, scratch: &mut Scratch) -> bool);
dispatch!(end = kernel::end_with / end_avx2, (given: &Evaluation => given.step.fma, class: &mut Class, spot: &Spot<'_>, clay: (&mut [Hot], &mut [Cold]), near: Option<(&Near<'_>, &mut GridReport)>, scratch: &mut Scratch) -> u32);
