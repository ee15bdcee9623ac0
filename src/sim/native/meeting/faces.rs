//! How the sides of cuts, and bodies, face each other: what each node finds by itself, for all blocks first,
//! and its mean over the nodes about one. The definition is that of [`facing`](super::super::super::facing).

use super::super::super::cut::ClassKey;
use super::super::super::facing::{Between, Facing};
use super::super::super::params::BLOCK;
use super::super::nodes::{ClassHere, ClassMasses, CutBlock, local};
use super::super::state::{ITSELF, NEIGHBOURS};
use super::terms::{Rows, Scratch, find, sum_found};
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
        for (n, within) in WITHIN[1].iter().enumerate() {
            let Some(all) = masses_of(n) else { continue };
            for (class, masses) in all.classes.iter().zip(&all.masses).filter(|(class, _)| class.has & within != 0) {
                if let Some(is_front) = self.between.is_front(class.key) {
                    let to = &mut scratch.masses[usize::from(!is_front)];
                    for_rows::<2>(n, class.has, |row, z, k, count| {
                        let (to, from) = (&mut to[row * 8 + z..][..count], &masses[k..][..count]);
                        to.iter_mut().zip(from).for_each(|(sum, mass)| *sum += mass);
                    });
                }
            }
        }
        find(&mut self.found, scratch, self.shared);
    }
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
        for (n, within) in WITHIN[0].iter().enumerate() {
            let all = faces_of(n).unwrap_or_default();
            let Some(faces) = all.iter().find(|f| f.between == between && f.shared & within != 0) else { continue };
            for_rows::<1>(n, faces.shared, |row, z, k, count| {
                for (to, from) in found[row].iter_mut().zip(&faces.found) {
                    to[z..][..count].copy_from_slice(&from[k..][..count]);
                }
            });
        }
        sum_found(&mut sums, &found, shared);
        Self { between, sums }
    }

    /// How the two face each other at node `k` of the block, in the mean over the nodes about it.
    pub(super) fn mean(&self, k: usize) -> Option<Facing> {
        Facing::mean(self.sums.each_ref().map(|sum| f64::from(sum[k])))
    }
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

/// Calls `each` with the rows along z of a neighbour that are among the `RING` about a block and have any of
/// these nodes: the row's number in the block and those about it, where in rows of 8 it begins, the first
/// node, and how many follow it.
#[inline(always)]
fn for_rows<const RING: i32>(neighbour: usize, nodes: u64, mut each: impl FnMut(usize, usize, usize, usize)) {
    let offset = NEIGHBOURS[neighbour];
    let [x, y, z] = offset.to_array().map(|o| range(o, RING));
    let first = (z.0 + BLOCK * offset.z + 2) as usize;
    for i in x.0..x.1 {
        for j in y.0..y.1 {
            let k = local(i, j, z.0);
            let row = (i + BLOCK * offset.x + RING) * (BLOCK + 2 * RING) + j + BLOCK * offset.y + RING;
            // Of a known length, for the compiler.
            if offset.z == 0 {
                if nodes >> k & 15 != 0 {
                    each(row as usize, first, k, BLOCK as usize);
                }
            } else if nodes >> k & ((1 << RING) - 1) != 0 {
                each(row as usize, first, k, RING as usize);
            }
        }
    }
}
