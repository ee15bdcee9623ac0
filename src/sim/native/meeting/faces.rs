//! How the sides of cuts, and bodies, face each other: what each node finds by itself, for all blocks first,
//! and its mean over the nodes about one.

use super::super::super::facing::{Between, Facing, Sample, facing, offsets};
use super::super::super::params::BLOCK;
use super::super::nodes::{ClassMasses, local, offset};
use super::super::state::NEIGHBOURS;
use glam::IVec3;

/// What the nodes of a block find of two sides that meet there, as it counts in a mean
/// ([`Facing::weighted`]); 0 where one of them has no clay.
pub(in super::super) struct Faces {
    between: Between,
    found: [[f32; 5]; 64],
}

/// The folded masses of the classes of the block at these coordinates, if any of its clay is tagged.
pub(in super::super) type MassesOf<'a> = dyn Fn(IVec3) -> Option<&'a ClassMasses> + Sync + 'a;

/// What the block at these coordinates has found, if any of its clay is tagged.
pub(in super::super) type FacesOf<'a> = dyn Fn(IVec3) -> Option<&'a [Faces]> + Sync + 'a;

/// All that meets in a block.
pub(in super::super) fn faces<'a>(block: IVec3, masses_of: &MassesOf<'a>) -> Vec<Faces> {
    let Some(classes) = masses_of(block) else { return vec![] };
    let all = Between::all(classes.iter().map(|(key, _)| *key));
    all.into_iter().filter_map(|between| Faces::new(between, block, classes, masses_of)).collect()
}

impl Faces {
    /// None where the two share no node of the block.
    #[expect(clippy::cast_possible_truncation, reason = "nodes are f32")]
    fn new<'a>(between: Between, block: IVec3, classes: &ClassMasses, masses_of: &MassesOf<'a>) -> Option<Self> {
        let [mut front, mut back] = [0u64; 2];
        for (key, masses) in classes {
            let Some(is_front) = between.is_front(*key) else { continue };
            let its = masses.iter().enumerate().fold(0, |bits, (k, mass)| bits | u64::from(*mass > 0.0) << k);
            if is_front { front |= its } else { back |= its }
        }
        let shared = front & back;
        if shared == 0 {
            return None;
        }
        let masses = masses_about(between, block, masses_of);
        let at = |node: IVec3| masses[place(node, 2)].map(f64::from);
        let samples: Vec<Sample> = (0..216).map(|i| Sample::new(IVec3::new(i / 36, i / 6 % 6, i % 6) - 1, at)).collect();
        let mut found = [[0.0; 5]; 64];
        for k in (0..64).filter(|k| shared >> k & 1 == 1) {
            let node = offset(k);
            if let Some(facing) = facing(offsets().map(|o| (o, samples[place(node + o, 1)]))) {
                found[k] = facing.weighted(at(node)).map(|value| value as f32);
            }
        }
        Some(Self { between, found })
    }
}

/// Masses in front and behind at the nodes of a block and two about it.
fn masses_about<'a>(between: Between, block: IVec3, masses_of: &MassesOf<'a>) -> Vec<[f32; 2]> {
    let mut about = vec![[0.0; 2]; 512];
    for neighbour in NEIGHBOURS {
        for (key, masses) in masses_of(block + neighbour).into_iter().flatten() {
            let Some(is_front) = between.is_front(*key) else { continue };
            let side = usize::from(!is_front);
            for_nodes_about(2, neighbour, |at, k| about[at][side] += masses[k]);
        }
    }
    about
}

/// What two sides were found to be at the nodes of a block and those about it.
pub(super) struct FacesAbout {
    pub(super) between: Between,
    found: [[f32; 5]; 216],
}

impl FacesAbout {
    pub(super) fn new(between: Between, block: IVec3, faces_of: &FacesOf<'_>) -> Self {
        let mut found = [[0.0; 5]; 216];
        for neighbour in NEIGHBOURS {
            let all = faces_of(block + neighbour).unwrap_or_default();
            let Some(faces) = all.iter().find(|faces| faces.between == between) else { continue };
            for_nodes_about(1, neighbour, |at, k| found[at] = faces.found[k]);
        }
        Self { between, found }
    }

    /// How the two face each other at a node of the block, in the mean over the nodes about it.
    pub(super) fn mean(&self, node: IVec3) -> Option<Facing> {
        Facing::mean(offsets().map(|o| self.found[place(node + o, 1)].map(f64::from)))
    }
}

/// Place of a node of a block, or of one of the `ring` nodes about it, among all of them, z fastest.
fn place(node: IVec3, ring: i32) -> usize {
    let (n, edge) = ((node + ring).as_usizevec3(), (BLOCK + 2 * ring) as usize);
    (n.x * edge + n.y) * edge + n.z
}

/// Calls `each` with the places, about the block and in its own, of the nodes of a neighbour that are among
/// the `ring` nodes about the block.
fn for_nodes_about(ring: i32, neighbour: IVec3, mut each: impl FnMut(usize, usize)) {
    let range = |o: i32| match o {
        -1 => -ring..0,
        0 => 0..BLOCK,
        _ => BLOCK..BLOCK + ring,
    };
    for x in range(neighbour.x) {
        for y in range(neighbour.y) {
            for z in range(neighbour.z) {
                each(place(IVec3::new(x, y, z), ring), local(x & 3, y & 3, z & 3));
            }
        }
    }
}
