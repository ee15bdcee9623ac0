//! Particles as the kernels want them, and the sort of them into 4^3 blocks.
//!
//! The fused kernel reads and writes [`Hot`] only (96 bytes). [`Cold`] moves along in the sort and is touched
//! near tools and where clay has a history. Blocks are cut by cell; a particle may stray [`MARGIN`]
//! cells from its cell before it is sorted anew.

use super::super::body::{self, Member};
use super::super::cut::{self, ClassKey, PLATE_SHEET, SheetSet};
use super::super::frame::FramePlan;
use super::super::limits::TRAVEL_LIMIT;
use super::super::params::{BLOCK, Domain};
use super::super::snapshot::{ANCHORS_MAX, Anchor, Particle, Tag};
use super::law::Sym8;
use super::simd::F8;
use super::step::Step;
use glam::{DVec3, IVec3, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// How far a particle may stray from its cell between two sorts [cells]: the 7^3 nodes of a block's tile
/// serve offsets in [-0.5, 1.5).
pub(super) const MARGIN: f32 = 0.5;

/// What every substep of a particle needs.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub(super) struct Hot {
    /// Offset from the cell's low corner \[cells\].
    pub offset: [f32; 3],
    /// Cell, 10 bits an axis.
    pub cell: u32,
    /// E = b_e - I.
    pub strain: [f32; 6],
    /// Rest volume over an eighth of a cell's: mass in units that are near 1.
    pub mass: f32,
    /// Accumulated plastic strain.
    pub hardening: f32,
    /// [m/s]; within a frame [cells/substep]: by units forth and back it would lose the same in each substep.
    pub velocity: [f32; 3],
    /// [1/s], within a frame per substep; columns.
    pub affine: [[f32; 3]; 3],
}

/// The rest of a particle.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub(super) struct Cold {
    /// By how much it moved in the last substep, where that was gathered apart; as its velocity has it
    /// where a frame starts \[cells\].
    pub way: [f32; 3],
    /// Plastic strain at the last averaging of volumes, or at the frame's start.
    pub averaged_at: f32,
    pub id: u32,
    pub tags: [Tag; 2],
    pub structure: f32,
    pub rest_volume: f32,
    pub anchors: [Anchor; ANCHORS_MAX],
    pub walls: u32,
    pub body: u32,
}

/// Elastic strains of up to eight particles, lane by lane; idle lanes are unstrained.
#[inline(always)]
pub(super) fn strains(particles: &[Hot]) -> Sym8 {
    let mut strain = [F8::ZERO; 6];
    for (k, p) in particles.iter().enumerate() {
        for i in 0..6 {
            strain[i].0[k] = p.strain[i];
        }
    }
    strain
}

impl Cold {
    /// The particle's class: whose node sums it belongs to.
    pub(super) fn key(&self) -> ClassKey {
        ClassKey::new(self.body, self.tags)
    }
}

pub(super) fn pack_cell(cell: [i32; 3]) -> u32 {
    (cell[0] | cell[1] << 10 | cell[2] << 20).cast_unsigned()
}

#[inline(always)]
pub(super) fn unpack_cell(cell: u32) -> [i32; 3] {
    [cell & 1023, cell >> 10 & 1023, cell >> 20].map(u32::cast_signed)
}

impl Hot {
    /// Its grid coordinate \[cells\].
    pub(super) fn place(&self) -> DVec3 {
        IVec3::from_array(unpack_cell(self.cell)).as_dvec3() + DVec3::from_array(self.offset.map(f64::from))
    }

    /// Moves whole cells of the offset into the cell index.
    fn normalise(&mut self) {
        let mut cell = unpack_cell(self.cell);
        for (c, x) in cell.iter_mut().zip(&mut self.offset) {
            let whole = x.floor();
            *x -= whole;
            *c += whole as i32;
            // An offset of -1e-9 has the floor -1 and rounds to 1.0, which is the next cell's 0: what is in
            // order stays as it is.
            if *x >= 1.0 {
                *x = 0.0;
                *c += 1;
            }
        }
        self.cell = pack_cell(cell);
    }
}

/// The particle as a snapshot holds it.
pub(super) fn particle(hot: &Hot, cold: &Cold) -> Particle {
    let mut h = *hot;
    h.normalise();
    Particle {
        cell: unpack_cell(h.cell),
        offset: h.offset,
        velocity: hot.velocity,
        affine: hot.affine,
        elastic_strain: h.strain,
        hardening: h.hardening,
        structure: cold.structure,
        rest_volume: cold.rest_volume,
        id: cold.id,
        tags: cold.tags,
        anchors: cold.anchors,
        walls: cold.walls,
        body: cold.body,
    }
}

/// The particles of one block, which follow those of the block before.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Run {
    /// Particles of the first body that are near no cut; they come first.
    pub untagged: usize,
    /// The particles of each other class, in the order of their keys.
    pub tagged: Vec<(ClassKey, usize)>,
}

impl Run {
    pub(super) fn len(&self) -> usize {
        self.untagged + self.tagged.iter().map(|t| t.1).sum::<usize>()
    }

    /// Whether some of the clay has a side of a plate.
    pub(super) fn is_beside_plate(&self) -> bool {
        self.tagged.iter().any(|(key, _)| key.sides().any(|side| side.0 >= PLATE_SHEET))
    }

    /// The classes, the untagged first, with their particles cut from slices of the whole run.
    pub(super) fn classes<'a>(
        &'a self,
        mut hot: &'a mut [Hot],
        mut cold: &'a mut [Cold],
    ) -> impl Iterator<Item = (ClassKey, &'a mut [Hot], &'a mut [Cold])> {
        std::iter::once((ClassKey::FIRST, self.untagged)).chain(self.tagged.iter().copied()).map(move |(key, count)| {
            let (first_hot, rest_hot) = std::mem::take(&mut hot).split_at_mut(count);
            let (first_cold, rest_cold) = std::mem::take(&mut cold).split_at_mut(count);
            (hot, cold) = (rest_hot, rest_cold);
            (key, first_hot, first_cold)
        })
    }

    /// The run of particles with these keys, in order.
    pub(super) fn of(keys: impl Iterator<Item = ClassKey>) -> Self {
        let mut run = Self::default();
        for key in keys {
            match run.tagged.last_mut() {
                _ if key.is_first() => run.untagged += 1,
                Some((last, count)) if *last == key => *count += 1,
                _ => run.tagged.push((key, 1)),
            }
        }
        run
    }
}

/// The dense table from block coordinates to slots.
#[derive(Clone, Debug)]
pub(super) struct Table {
    extent: IVec3,
    slots: Vec<u32>,
}

impl Table {
    fn index(&self, block: IVec3) -> Option<usize> {
        let inside = block.cmpge(IVec3::ZERO).all() && block.cmplt(self.extent).all();
        inside.then(|| (((block.z * self.extent.y + block.y) * self.extent.x) + block.x) as usize)
    }

    /// The slot of a block, if it has one.
    pub(super) fn slot(&self, block: IVec3) -> Option<usize> {
        self.slots[self.index(block)?].checked_sub(1).map(|s| s as usize)
    }

    fn coords(&self, index: u32) -> IVec3 {
        let (i, e) = (index.cast_signed(), self.extent);
        IVec3::new(i % e.x, i / e.x % e.y, i / e.x / e.y)
    }
}

/// All particles in block order.
#[derive(Debug)]
pub(super) struct State {
    pub hot: Vec<Hot>,
    pub cold: Vec<Cold>,
    /// Blocks with particles, in slot order.
    pub runs: Vec<Run>,
    /// Coordinates of every block with nodes: those with particles first, then their neighbours.
    pub blocks: Vec<IVec3>,
    /// Slot of each block in `blocks`.
    pub table: Arc<Table>,
    /// A cleared table, to be used by the next sort.
    spare: Option<Table>,
    /// Counts the sorts.
    pub sorts: u64,
}

/// Particles in the engine's form, in their order.
#[expect(clippy::cast_possible_truncation, reason = "mass is f32 in the kernels")]
pub(super) fn convert(domain: &Domain, particles: &[Particle]) -> (Vec<Hot>, Vec<Cold>) {
    let unit = domain.cell_width.powi(3) / 8.0;
    let hot = |p: &Particle| Hot {
        offset: p.offset,
        cell: pack_cell(p.cell),
        strain: p.elastic_strain,
        mass: (f64::from(p.rest_volume) / unit) as f32,
        hardening: p.hardening,
        velocity: p.velocity,
        affine: p.affine,
    };
    let cold = |p: &Particle| Cold {
        way: [0.0; 3],
        averaged_at: p.hardening,
        id: p.id,
        tags: p.tags,
        structure: p.structure,
        rest_volume: p.rest_volume,
        anchors: p.anchors,
        walls: p.walls,
        body: p.body,
    };
    particles.iter().map(|p| (hot(p), cold(p))).unzip()
}

impl State {
    pub(super) fn new(domain: &Domain, particles: &[Particle]) -> Self {
        let (hot, cold) = convert(domain, particles);
        let extent = domain.blocks();
        let slots = vec![0; (extent.x * extent.y * extent.z) as usize];
        let mut state =
            Self { hot, cold, runs: vec![], blocks: vec![], table: Arc::new(Table { extent, slots }), spare: None, sorts: 0 };
        state.sort();
        state
    }

    /// Drops what is left of plates that are not in the plan, if there is anything: then the next sort makes
    /// the classes anew.
    pub(super) fn drop_plates(&mut self, plan: &FramePlan) -> bool {
        let is_left = |sheet: &u8| *sheet >= PLATE_SHEET && !plan.tools.iter().any(|path| path.sheet == *sheet);
        let left: Vec<u8> = self.sheets().iter().filter(is_left).collect();
        for sheet in &left {
            self.cold.iter_mut().for_each(|cold| cut::drop(&mut cold.tags, *sheet));
        }
        !left.is_empty()
    }

    /// The sheets that particles have a side of.
    pub(super) fn sheets(&self) -> SheetSet {
        self.runs.iter().flat_map(|run| &run.tagged).flat_map(|(key, _)| key.sides()).map(|side| side.0).collect()
    }

    /// The greatest number of a body.
    pub(super) fn body_max(&self) -> u32 {
        self.runs.iter().flat_map(|run| &run.tagged).map(|(key, _)| u32::from(key.body())).max().unwrap_or(0)
    }

    /// Tells the bodies apart; `spared` are the sheets of blades in the clay.
    pub(super) fn find_bodies(&mut self, spared: SheetSet) {
        let member = |(hot, cold): (&Hot, &Cold)| Member { at: hot.place(), id: cold.id, body: cold.body, tags: cold.tags };
        let mut members: Vec<Member> = self.hot.iter().zip(&self.cold).map(member).collect();
        // An eighth of a cell weighs 1.
        let largest = self.hot.iter().map(|hot| f64::from(hot.mass)).fold(0.0, f64::max);
        body::find(&mut members, 0.5 * largest.cbrt(), spared);
        for (cold, Member { body, tags, .. }) in self.cold.iter_mut().zip(members) {
            (cold.body, cold.tags) = (body, tags);
        }
    }

    /// Whether sides of a cut, or two bodies, may meet somewhere.
    pub(super) fn may_meet(&self) -> bool {
        let bodies = |run: &Run| {
            let tagged: Vec<u16> = run.tagged.iter().map(|(key, _)| key.body()).collect();
            (run.untagged > 0).then_some(0).into_iter().chain(tagged)
        };
        let meets = |(block, run): (&IVec3, &Run)| {
            let about = NEIGHBOURS.into_iter().filter_map(|o| self.runs.get(self.table.slot(*block + o)?));
            let own = run.tagged.first().map(|(key, _)| key.body());
            run.tagged.iter().any(|(key, _)| *key != key.without_sides())
                || own.is_some_and(|own| about.flat_map(bodies).any(|body| body != own))
        };
        self.blocks.iter().zip(&self.runs).any(meets)
    }

    /// Sorts the particles by block, class, cell and id and lists the blocks anew. The order depends on
    /// nothing else, so runs repeat. Returns the table before: tiles scattered before the sort are found
    /// through it.
    pub(super) fn sort(&mut self) -> Arc<Table> {
        self.sorts += 1;
        self.hot.par_iter_mut().for_each(Hot::normalise);
        let mut table =
            self.spare.take().unwrap_or_else(|| Table { extent: self.table.extent, slots: vec![0; self.table.slots.len()] });
        let block_of = |h: &Hot| {
            let c = unpack_cell(h.cell).map(|c| c / BLOCK);
            ((c[2] * table.extent.y + c[1]) * table.extent.x + c[0]).cast_unsigned()
        };
        // Count, then place: `slots` holds counts, then running positions, then slots.
        let mut indices: Vec<u32> = self.hot.par_iter().map(block_of).collect();
        let mut touched = vec![];
        for &b in &indices {
            if table.slots[b as usize] == 0 {
                touched.push(b);
            }
            table.slots[b as usize] += 1;
        }
        touched.par_sort_unstable();
        self.runs.clear();
        let mut start = 0u32;
        for &b in &touched {
            let count = std::mem::replace(&mut table.slots[b as usize], start);
            self.runs.push(Run { untagged: count as usize, tagged: vec![] });
            start += count;
        }
        let mut order = vec![(0u64, 0u32); self.hot.len()];
        for (i, b) in indices.drain(..).enumerate() {
            let at = &mut table.slots[b as usize];
            let (h, c) = (&self.hot[i], &self.cold[i]);
            let is_tagged = u64::from(!c.key().is_first());
            order[*at as usize] = (is_tagged << 62 | u64::from(h.cell) << 32 | u64::from(c.id), i as u32);
            *at += 1;
        }
        self.permute(&mut order);
        self.list_blocks(&mut table, &touched);
        std::mem::replace(&mut self.table, Arc::new(table))
    }

    /// Orders each block's particles by class, cell and id and moves them there.
    fn permute(&mut self, order: &mut [(u64, u32)]) {
        let lengths: Vec<usize> = self.runs.iter().map(Run::len).collect();
        let (hot, cold) = (&self.hot, &self.cold);
        split(order, &lengths).into_par_iter().zip(&mut self.runs).for_each(|(block, run)| {
            // Most of them stand as they did: runs in order are merged.
            block.sort();
            let untagged = block.partition_point(|k| k.0 >> 62 == 0);
            if untagged < block.len() {
                let key = |k: &(u64, u32)| cold[k.1 as usize].key();
                block[untagged..].sort_unstable_by_key(|k| (key(k), k.0));
                *run = Run::of(block.iter().map(key));
            }
        });
        (self.hot, self.cold) = order.par_iter().map(|k| (hot[k.1 as usize], cold[k.1 as usize])).unzip();
    }

    /// Gives slots to the touched blocks, then to their neighbours that have no particles but share nodes.
    fn list_blocks(&mut self, table: &mut Table, touched: &[u32]) {
        self.blocks.clear();
        for &b in touched {
            self.blocks.push(table.coords(b));
            table.slots[b as usize] = self.blocks.len() as u32;
        }
        for i in 0..touched.len() {
            let centre = self.blocks[i];
            for offset in NEIGHBOURS {
                if let Some(k) = table.index(centre + offset)
                    && table.slots[k] == 0
                {
                    self.blocks.push(centre + offset);
                    table.slots[k] = self.blocks.len() as u32;
                }
            }
        }
    }

    /// Begins to count and keep what is within a frame, where velocities are in cells and substeps.
    pub(super) fn begin_frame(&mut self, step: &Step) {
        self.hot.par_iter_mut().zip(&mut self.cold).with_min_len(1024).for_each(|(hot, cold)| {
            hot.velocity = hot.velocity.map(|v| v / step.velocity_unit);
            hot.affine = hot.affine.map(|column| column.map(|a| a / step.rate_unit));
            cold.averaged_at = hot.hardening;
            cold.way = Vec3::from_array(hot.velocity).clamp_length_max(TRAVEL_LIMIT).to_array();
        });
    }

    /// Moves the particles by `steps` times their velocities, each by half a cell at most.
    pub(super) fn step_ahead(&mut self, steps: f32) {
        self.hot.par_iter_mut().with_min_len(1024).for_each(|hot| {
            for (x, v) in hot.offset.iter_mut().zip(hot.velocity) {
                *x += (steps * v).clamp(-MARGIN, MARGIN);
            }
        });
    }

    /// Brings velocities back to SI units.
    pub(super) fn end_frame(&mut self, step: &Step) {
        self.hot.par_iter_mut().with_min_len(1024).for_each(|hot| {
            hot.velocity = hot.velocity.map(|v| v * step.velocity_unit);
            hot.affine = hot.affine.map(|column| column.map(|a| a * step.rate_unit));
        });
    }

    /// Takes back a table no tile refers to any more.
    pub(super) fn recycle(&mut self, table: Arc<Table>) {
        if self.spare.is_none()
            && let Ok(mut table) = Arc::try_unwrap(table)
        {
            table.slots.fill(0);
            self.spare = Some(table);
        }
    }
}

/// Offsets of a block's 27 neighbours, itself included, x fastest.
pub(super) const NEIGHBOURS: [IVec3; 27] = {
    let mut out = [IVec3::ZERO; 27];
    let mut i = 0;
    while i < 27 {
        out[i] = IVec3::new(i as i32 % 3 - 1, i as i32 / 3 % 3 - 1, i as i32 / 9 - 1);
        i += 1;
    }
    out
};

/// The number of a block among its neighbours.
pub(super) const ITSELF: usize = 13;

/// Cuts a slice into consecutive parts.
pub(super) fn split<'a, T>(mut rest: &'a mut [T], lengths: &[usize]) -> Vec<&'a mut [T]> {
    lengths
        .iter()
        .map(|&n| {
            let (head, tail) = std::mem::take(&mut rest).split_at_mut(n);
            rest = tail;
            head
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a sort has put in order, the next one leaves as it is: else clay that was loaded would differ
    /// from clay that was there.
    #[test]
    fn particles_in_order_stay_as_they_are() {
        for x in [-1e-9, -0.3, 0.0, 0.25, 1.0 - f32::EPSILON / 2.0, 1.0, 1.4] {
            let mut hot = Hot { offset: [x; 3], cell: pack_cell([5; 3]), ..Hot::default() };
            hot.normalise();
            let first = (hot.offset, hot.cell);
            assert!(hot.offset.iter().all(|o| (0.0..1.0).contains(o)), "{first:?}");
            hot.normalise();
            assert_eq!(first, (hot.offset, hot.cell));
            let place = f64::from(unpack_cell(hot.cell)[0]) + f64::from(hot.offset[0]);
            assert!((place - 5.0 - f64::from(x)).abs() < 1e-7, "{x}: {place}");
        }
    }
}
