//! A state as history has it: particles in the order of their ids, at rest, a number's column after
//! another's.

use crate::sim::snapshot::{Particle, Snapshot, Tag};

/// Words of 32 bits of a particle beside its id.
const WORDS: usize = 18;

/// The clay at one time, canonical: clay of equal bits has equal bits here, in whatever order its particles
/// are.
#[derive(Debug)]
pub(super) struct State {
    /// All but the particles.
    pub(super) head: Snapshot,
    /// Ids, rising.
    pub(super) ids: Vec<u32>,
    /// What else there is of the particles, word by word: the first word of each, the second of each, ...
    pub(super) words: Vec<u32>,
}

impl State {
    /// The state of `snapshot`, whose memory is given back. Particles of one id stay in their order.
    pub(super) fn of(snapshot: Snapshot) -> Self {
        let particles = &snapshot.particles;
        // The place as the lower half: a sort of plain numbers that keeps the order of equal ids.
        let mut order: Vec<u64> = (0..).zip(particles).map(|(place, p)| u64::from(p.id) << 32 | place).collect();
        order.sort_unstable();
        let mut state = Self::blank(&snapshot, order.iter().map(|key| (key >> 32) as u32).collect());
        let count = particles.len();
        for (i, key) in order.iter().enumerate() {
            let words = words_of(&particles[(key & u64::from(u32::MAX)) as usize]);
            words.iter().enumerate().for_each(|(column, word)| state.words[column * count + i] = *word);
        }
        state
    }

    /// A state of these ids whose columns are to be filled.
    pub(super) fn blank(of: &Snapshot, ids: Vec<u32>) -> Self {
        let words = vec![0; WORDS * ids.len()];
        Self { head: head(of), ids, words }
    }

    /// The clay for an engine to load.
    pub(super) fn snapshot(self) -> Snapshot {
        let Self { head, ids, words } = self;
        let particle = |(i, id): (usize, &u32)| particle_of(*id, std::array::from_fn(|column| words[column * ids.len() + i]));
        Snapshot { particles: ids.iter().enumerate().map(particle).collect(), ..head }
    }
}

/// All but the particles, and without what an engine forecasts of a run that went on from there.
fn head(snapshot: &Snapshot) -> Snapshot {
    Snapshot { time: snapshot.time, ..Snapshot::new(snapshot.domain, snapshot.material, vec![]) }
}

/// What is kept of a particle beside its id, bit by bit.
fn words_of(particle: &Particle) -> [u32; WORDS] {
    // Taken apart by name: a new field has to find its place here. Clay at rest clings to no tool: by the
    // time that it is back they are elsewhere.
    let Particle {
        cell,
        offset,
        velocity: _,
        affine: _,
        elastic_strain,
        hardening,
        structure,
        rest_volume,
        id: _,
        tags,
        anchors: _,
        walls,
        body,
    } = particle;
    let mut words = [0; WORDS];
    words[..3].copy_from_slice(&cell.map(i32::cast_unsigned));
    words[3..6].copy_from_slice(&offset.map(f32::to_bits));
    words[6..12].copy_from_slice(&elastic_strain.map(f32::to_bits));
    let rest = [hardening.to_bits(), structure.to_bits(), rest_volume.to_bits(), bytemuck::cast(*tags), *walls, *body];
    words[12..].copy_from_slice(&rest);
    words
}

/// The particle that [`words_of`] is of, at rest.
fn particle_of(id: u32, words: [u32; WORDS]) -> Particle {
    let [x, y, z, u, v, w, xx, yy, zz, xy, xz, yz, hardening, structure, rest_volume, tags, walls, body] = words;
    Particle {
        cell: [x, y, z].map(u32::cast_signed),
        offset: [u, v, w].map(f32::from_bits),
        velocity: [0.0; 3],
        affine: [[0.0; 3]; 3],
        elastic_strain: [xx, yy, zz, xy, xz, yz].map(f32::from_bits),
        hardening: f32::from_bits(hardening),
        structure: f32::from_bits(structure),
        rest_volume: f32::from_bits(rest_volume),
        id,
        tags: bytemuck::cast::<u32, [Tag; 2]>(tags),
        anchors: Default::default(),
        walls,
        body,
    }
}
