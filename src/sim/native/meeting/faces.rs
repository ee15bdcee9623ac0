//! How the sides of cuts, and bodies, face each other: what each node finds by itself, for all blocks first,
//! and its mean over the nodes about one. The definition is that of [`facing`](super::super::super::facing).

use super::super::super::cut::ClassKey;
use super::super::super::facing::{Between, Facing};
use super::super::super::params::BLOCK;
use super::super::nodes::{ClassHere, ClassMasses, CutBlock, local};
use super::super::state::{ITSELF, NEIGHBOURS};
use super::terms::{Rows, RowsAbout, Scratch, find, sum_found};
use glam::IVec3;

/// What the nodes of a block find of two sides that meet there, as it counts in a mean
/// (`Facing::weighted`); 0 where one of them has no clay.
#[derive(Clone, Debug)]
pub(in super::super) struct Faces {
    between: Between,
    /// At which nodes both have clay: a bit each.
    shared: u64,
    found: [[f32; 64]; 5],
}

/// The folded masses of the classes of a block's neighbour of this number, if any of its clay is tagged.
pub(in super::super) type MassesOf<'a> = dyn Fn(usize) -> Option<&'a ClassMasses> + Sync + 'a;

/// What a block's neighbour of this number has found, if any of its clay is tagged.
pub(in super::super) type FacesOf<'a> = dyn Fn(usize) -> Option<&'a [Faces]> + Sync + 'a;

/// Finds all that meets in a block.
pub(in super::super) fn find_faces<'a>(all: &mut Vec<Faces>, cut: &CutBlock, masses_of: &MassesOf<'a>, scratch: &mut Scratch) {
    all.clear();
    let Some(classes) = masses_of(ITSELF).map(|all| &all.classes[..]).filter(|classes| may_meet(classes)) else { return };
    for &between in &cut.between {
        let shared = shared_nodes(between, classes);
        if shared != 0 {
            all.push(Faces { between, shared, found: [[0.0; 64]; 5] });
        }
    }
    for faces in all {
        faces.find(masses_of, scratch);
    }
}

/// At which nodes of a block any two meet: a bit each.
pub(in super::super) fn shared(faces: &[Faces]) -> u64 {
    faces.iter().fold(0, |shared, faces| shared | faces.shared)
}

/// Whether any two of the classes may face each other at a node: most blocks that tagged clay reaches have
/// such of one side alone.
pub(in super::super) fn may_meet(classes: &[ClassHere]) -> bool {
    let meets = |a: (ClassKey, u64), b: (ClassKey, u64)| a.1 & b.1 != 0 && !a.0.is_compatible(b.0);
    let of = |i: usize| (classes[i].key, classes[i].has);
    (1..classes.len()).any(|b| (0..b).any(|a| meets(of(a), of(b))))
}

/// At which nodes of a block there is clay of both sides: a bit each.
fn shared_nodes(between: Between, classes: &[ClassHere]) -> u64 {
    let [mut front, mut back] = [0u64; 2];
    for class in classes {
        match between.is_front(class.key) {
            Some(true) => front |= class.has,
            Some(false) => back |= class.has,
            None => {}
        }
    }
    front & back
}

impl Faces {
    fn find<'a>(&mut self, masses_of: &MassesOf<'a>, scratch: &mut Scratch) {
        scratch.masses = [[0.0; 512]; 2];
        let rows = RowsAbout::new(self.shared).of_masses();
        for (n, within) in WITHIN[1].iter().enumerate() {
            let Some(all) = masses_of(n) else { continue };
            for (class, masses) in all.classes.iter().zip(&all.masses).filter(|(class, _)| class.has & within != 0) {
                let Some(is_front) = self.between.is_front(class.key) else { continue };
                let to = &mut scratch.masses[usize::from(!is_front)];
                match NEIGHBOURS[n].z {
                    0 => add_masses::<4>(to, n, (rows, class.has), masses),
                    _ => add_masses::<2>(to, n, (rows, class.has), masses),
                }
            }
        }
        find(&mut self.found, scratch, self.shared);
    }
}

/// Adds what a neighbour's nodes have, `N` of each row of these.
fn add_masses<const N: usize>(to: &mut [f32; 512], neighbour: usize, (rows, has): (u64, u64), masses: &[f32; 64]) {
    for_rows::<2, N>(neighbour, (rows, has), |row, z, k| {
        if let (Some(to), Some(from)) = (to[row * 8 + z..].first_chunk_mut::<N>(), masses[k..].first_chunk::<N>()) {
            (0..N).for_each(|i| to[i] += from[i]);
        }
    });
}

/// What two sides were found to be about each node of a block: sums over the 27 nodes.
pub(super) struct FacesAbout {
    pub(super) between: Between,
    sums: [[f32; 64]; 5],
}

impl FacesAbout {
    /// About those nodes at which some meet, `shared`, a bit each.
    pub(super) fn new(between: Between, faces_of: &FacesOf<'_>, shared: u64) -> Self {
        let (mut found, mut sums): (Rows<5>, _) = ([[[0.0; 8]; 5]; 36], [[0.0; 64]; 5]);
        let rows = RowsAbout::new(shared).all;
        for (n, within) in WITHIN[0].iter().enumerate() {
            let all = faces_of(n).unwrap_or_default();
            let Some(faces) = all.iter().find(|f| f.between == between && f.shared & within != 0) else { continue };
            match NEIGHBOURS[n].z {
                0 => copy_found::<4>(&mut found, n, rows, faces),
                _ => copy_found::<1>(&mut found, n, rows, faces),
            }
        }
        sum_found(&mut sums, &found, shared);
        Self { between, sums }
    }

    /// How the two face each other at node `k` of the block, in the mean over the nodes about it.
    pub(super) fn mean(&self, k: usize) -> Option<Facing> {
        Facing::mean(self.sums.each_ref().map(|sum| f64::from(sum[k])))
    }
}

/// Copies what a neighbour's nodes have found, `N` of each row of these.
fn copy_found<const N: usize>(to: &mut Rows<5>, neighbour: usize, rows: u64, faces: &Faces) {
    for_rows::<1, N>(neighbour, (rows, faces.shared), |row, z, k| {
        for (to, from) in to[row].iter_mut().zip(&faces.found) {
            if let (Some(to), Some(from)) = (to[z..].first_chunk_mut::<N>(), from[k..].first_chunk::<N>()) {
                *to = *from;
            }
        }
    });
}

/// The nodes of each neighbour that are one or two off the block: a bit each.
const WITHIN: [[u64; 27]; 2] = [within(1), within(2)];

/// Those of a neighbour's nodes along an axis that are up to `ring` nodes off the block.
const fn range(offset: i32, ring: i32) -> (i32, i32) {
    match offset {
        -1 => (BLOCK - ring, BLOCK),
        0 => (0, BLOCK),
        _ => (0, ring),
    }
}

const fn within(ring: i32) -> [u64; 27] {
    let mut all = [0; 27];
    let mut i = 0;
    while i < 27 * 64 {
        let (n, k) = (i / 64, i as i32 % 64);
        let IVec3 { x, y, z } = NEIGHBOURS[n];
        let (x, y, z) = (range(x, ring), range(y, ring), range(z, ring));
        let (a, b, c) = (k / 16, k / 4 % 4, k % 4);
        let is_within = x.0 <= a && a < x.1 && y.0 <= b && b < y.1 && z.0 <= c && c < z.1;
        all[n] |= (is_within as u64) << k;
        i += 1;
    }
    all
}

/// Calls `each` with those of these rows along z, a bit each, of the `RING` about a block that a neighbour
/// has `N` nodes of, where it has any of these nodes: the row's number, where in rows of 8 its part begins,
/// and the first node of it.
#[inline(always)]
fn for_rows<const RING: i32, const N: usize>(
    neighbour: usize,
    (rows, nodes): (u64, u64),
    mut each: impl FnMut(usize, usize, usize),
) {
    let offset = NEIGHBOURS[neighbour];
    let [x, y, z] = offset.to_array().map(|o| range(o, RING));
    let first = (z.0 + BLOCK * offset.z + 2) as usize;
    for i in x.0..x.1 {
        for j in y.0..y.1 {
            let k = local(i, j, z.0);
            let row = (i + BLOCK * offset.x + RING) * (BLOCK + 2 * RING) + j + BLOCK * offset.y + RING;
            if rows >> row & 1 == 1 && nodes >> k & ((1 << N) - 1) != 0 {
                each(row as usize, first, k);
            }
        }
    }
}
