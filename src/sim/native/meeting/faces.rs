//! How the sides of cuts, and bodies, face each other: what each node finds by itself, for all blocks first,
//! and its mean over the nodes about one. The definition is that of [`facing`](super::super::super::facing).
//!
//! Both are sums over 27 nodes whose weights are products of one for each axis: taken axis by axis they are a
//! third of the work, on numbers that lie side by side.

use super::super::super::facing::{Between, DISPLACEMENT, Facing, TERMS, Terms, facing};
use super::super::super::params::BLOCK;
use super::super::nodes::{ClassMasses, local, offset};
use super::super::simd::in_lanes;
use super::super::state::NEIGHBOURS;
use glam::{DVec3, IVec3};

/// A number for each node of a block and one about it, in 6 x 6 rows along z. Rows begin and end with one
/// node more, which no sum takes: each fills a register.
type About = [[f32; 8]; 36];

/// Coefficients of the displacement, as the nodes are.
const DISPLACEMENT_F32: [f32; 4] = {
    let [a, b, c, d] = DISPLACEMENT;
    [a as f32, b as f32, c as f32, d as f32]
};

/// What the nodes of a block find of two sides that meet there, as it counts in a mean
/// ([`Facing::weighted`]); 0 where one of them has no clay.
pub(in super::super) struct Faces {
    between: Between,
    /// At which nodes both have clay: a bit each.
    shared: u64,
    found: [[f32; 64]; 5],
}

/// The folded masses of the classes of the block at these coordinates, if any of its clay is tagged.
pub(in super::super) type MassesOf<'a> = dyn Fn(IVec3) -> Option<&'a ClassMasses> + Sync + 'a;

/// What the block at these coordinates has found, if any of its clay is tagged.
pub(in super::super) type FacesOf<'a> = dyn Fn(IVec3) -> Option<&'a [Faces]> + Sync + 'a;

/// All that meets in a block.
pub(in super::super) fn faces<'a>(block: IVec3, masses_of: &MassesOf<'a>) -> Vec<Faces> {
    let Some(classes) = masses_of(block) else { return vec![] };
    let all = Between::all(classes.iter().map(|(key, _)| *key)).into_iter();
    let meeting: Vec<(Between, u64)> =
        all.map(|between| (between, shared_nodes(between, classes))).filter(|m| m.1 != 0).collect();
    if meeting.is_empty() {
        return vec![];
    }
    let about = NEIGHBOURS.map(|o| masses_of(block + o));
    meeting.into_iter().map(|(between, shared)| Faces::new(between, shared, &about)).collect()
}

/// At which nodes of a block any two meet: a bit each.
pub(in super::super) fn shared(faces: &[Faces]) -> u64 {
    faces.iter().fold(0, |shared, faces| shared | faces.shared)
}

/// At which nodes of a block there is clay of both sides: a bit each.
fn shared_nodes(between: Between, classes: &ClassMasses) -> u64 {
    let [mut front, mut back] = [0u64; 2];
    for (key, masses) in classes {
        let Some(is_front) = between.is_front(*key) else { continue };
        let its = masses.iter().enumerate().fold(0, |bits, (k, mass)| bits | u64::from(*mass > 0.0) << k);
        if is_front { front |= its } else { back |= its }
    }
    front & back
}

impl Faces {
    #[expect(clippy::cast_possible_truncation, reason = "nodes are f32")]
    #[expect(clippy::large_stack_arrays, reason = "25 of the 2048 KiB that a thread has")]
    fn new(between: Between, shared: u64, about: &[Option<&ClassMasses>; 27]) -> Self {
        // In front and behind, at the nodes of the block and two about it.
        let mut masses = [[0.0; 512]; 2];
        for (neighbour, classes) in NEIGHBOURS.into_iter().zip(about) {
            for (key, its) in classes.iter().flat_map(|classes| classes.iter()) {
                if let Some(is_front) = between.is_front(*key) {
                    add_about::<2>(&mut masses[usize::from(!is_front)], neighbour, its);
                }
            }
        }
        let (mut terms, mut sums) = ([[[0.0; 8]; 36]; TERMS], [[0.0; 64]; TERMS]);
        tell(&mut terms, &masses);
        sum_about(&mut sums, &terms, 0.5);
        let mut found = [[0.0; 64]; 5];
        for k in (0..64).filter(|k| shared >> k & 1 == 1) {
            let node = offset(k);
            if let Some(facing) = facing(&Terms(sums.each_ref().map(|sum| f64::from(sum[k]))), from_middle(node)) {
                let own = masses.each_ref().map(|side| f64::from(side[place::<2>(node)]));
                found.iter_mut().zip(facing.weighted(own)).for_each(|(found, value)| found[k] = value as f32);
            }
        }
        Self { between, shared, found }
    }
}

/// The place of a node from the middle of its block, which is the origin of its sums \[cells\].
fn from_middle(node: IVec3) -> DVec3 {
    node.as_dvec3() - 0.5 * f64::from(BLOCK - 1)
}

in_lanes! {
    /// What each node tells ([`Terms`]), by the masses in front and behind.
    fn tell(terms: &mut [About; TERMS], masses: &[[f32; 512]; 2]) {
        let [fronts, backs] = masses;
        let mut total = [0.0; 512];
        (0..512).for_each(|at| total[at] = fronts[at] + backs[at]);
        for row in 0..36 {
            let [x, y] = [row / 6, row % 6];
            let at = ((x + 1) * 8 + y + 1) * 8;
            let (front, back) = (&fronts[at..at + 8], &backs[at..at + 8]);
            let mut share = [0.0; 8];
            for z in (1..7).filter(|z| front[*z].min(back[*z]) > 0.0) {
                share[z] = (front[z] / back[z]).ln();
            }
            for z in 0..8 {
                let (f, b) = (front[z], back[z]);
                let is_both = f.min(b) > 0.0;
                let middle = |stride: usize| {
                    let (before, after) = (total[at + z - stride], total[at + z + stride]);
                    let c = if is_both { (after - before) / (before + 2.0 * (f + b) + after) } else { 0.0 };
                    let a = c.abs();
                    c * a * (((DISPLACEMENT_F32[0] * a + DISPLACEMENT_F32[1]) * a + DISPLACEMENT_F32[2]) * a + DISPLACEMENT_F32[3])
                };
                let node = [x as f32 - 2.5, y as f32 - 2.5, z as f32 - 3.5];
                let [px, py, pz] = [node[0] + middle(64), node[1] + middle(8), node[2] + middle(1)];
                let w = if is_both { f * b / (f + b) } else { 0.0 };
                let ws = w * share[z];
                #[rustfmt::skip]
                let told = [
                    f * node[0], f * node[1], f * node[2], f, b * node[0], b * node[1], b * node[2], b,
                    w, ws, w * px, w * py, w * pz, ws * px, ws * py, ws * pz,
                    w * px * px, w * py * py, w * pz * pz, w * px * py, w * py * pz, w * pz * px,
                ];
                for i in 0..TERMS {
                    terms[i][row][z] = told[i];
                }
            }
        }
    }
}

/// What two sides were found to be about each node of a block: sums over the 27 nodes.
pub(super) struct FacesAbout {
    pub(super) between: Between,
    sums: [[f32; 64]; 5],
}

impl FacesAbout {
    pub(super) fn new(between: Between, block: IVec3, faces_of: &FacesOf<'_>) -> Self {
        let (mut found, mut sums) = ([[[0.0; 8]; 36]; 5], [[0.0; 64]; 5]);
        for neighbour in NEIGHBOURS {
            let all = faces_of(block + neighbour).unwrap_or_default();
            let Some(faces) = all.iter().find(|faces| faces.between == between) else { continue };
            found.iter_mut().zip(&faces.found).for_each(|(to, from)| add_about::<1>(to.as_flattened_mut(), neighbour, from));
        }
        sum_about(&mut sums, &found, 1.0);
        Self { between, sums }
    }

    /// How the two face each other at node `k` of the block, in the mean over the nodes about it.
    pub(super) fn mean(&self, k: usize) -> Option<Facing> {
        Facing::mean(self.sums.each_ref().map(|sum| f64::from(sum[k])))
    }
}

in_lanes! {
    /// Sums over the 27 nodes about each node of a block; those off it count `beside` for each axis along
    /// which they are.
    fn sum_about(sums: &mut [[f32; 64]], all: &[About], beside: f32) {
        for (sums, rows) in sums.iter_mut().zip(all) {
            // Each pass takes two planes of one axis away; the last one leaves every other four.
            let (mut along_x, mut along_y, mut along_z) = ([[0.0; 8]; 24], [[0.0; 8]; 17], [[0.0; 8]; 16]);
            for i in 0..24 {
                sum_of_three(&mut along_x[i], [&rows[i], &rows[i + 6], &rows[i + 12]], beside);
            }
            for i in 0..16 {
                let at = i / 4 * 6 + i % 4;
                sum_of_three(&mut along_y[i], [&along_x[at], &along_x[at + 1], &along_x[at + 2]], beside);
            }
            let flat = along_y.as_flattened();
            for (i, sum) in along_z.as_flattened_mut().iter_mut().enumerate() {
                *sum = flat[i + 2] + beside * (flat[i + 1] + flat[i + 3]);
            }
            for (to, from) in sums.chunks_exact_mut(4).zip(&along_z) {
                to.copy_from_slice(&from[..4]);
            }
        }
    }
}

#[inline(always)]
fn sum_of_three(to: &mut [f32; 8], [before, here, after]: [&[f32; 8]; 3], beside: f32) {
    for i in 0..8 {
        to[i] = here[i] + beside * (before[i] + after[i]);
    }
}

/// Place of a node of a block, or of one of the `RING` rows about it, in rows of 8.
fn place<const RING: i32>(node: IVec3) -> usize {
    let n = (node + IVec3::new(RING, RING, 2)).as_usizevec3();
    (n.x * (BLOCK + 2 * RING) as usize + n.y) * 8 + n.z
}

/// Adds the numbers of those nodes of a neighbour that are among the `RING` nodes about a block.
fn add_about<const RING: i32>(to: &mut [f32], neighbour: IVec3, from: &[f32; 64]) {
    let range = |o: i32| match o {
        -1 => -RING..0,
        0 => 0..BLOCK,
        _ => BLOCK..BLOCK + RING,
    };
    let z = range(neighbour.z);
    for x in range(neighbour.x) {
        for y in range(neighbour.y) {
            let (at, k) = (place::<RING>(IVec3::new(x, y, z.start)), local(x & 3, y & 3, z.start & 3));
            // Of a known length, for the compiler.
            let mut add =
                |count: usize| to[at..at + count].iter_mut().zip(&from[k..k + count]).for_each(|(sum, value)| *sum += value);
            if neighbour.z == 0 { add(BLOCK as usize) } else { add(RING as usize) }
        }
    }
}
