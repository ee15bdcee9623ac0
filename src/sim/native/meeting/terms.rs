//! What the nodes about a block tell of two sides that meet in it, and what each of its nodes finds of them
//! by itself: [`facing`](super::super::super::facing) for eight nodes at a time.
//!
//! Sums over 27 nodes have weights that are products of one for each axis: taken axis by axis they are a
//! third of the work, on numbers that lie side by side.

use super::super::super::facing::{DISPLACEMENT, FACE_DISTANCE, NORMAL_REGULARISATION, OBLIQUE_GAP, SLOPE_MIN, TERMS};
use super::super::simd::{D8, F8, in_lanes};

/// `N` numbers of each node of a block and of those one about it, in 6 x 6 rows along z. Rows begin and end
/// with one node more, which no sum takes: each fills a register.
pub(super) type Rows<const N: usize> = [[[f32; 8]; N]; 36];

/// Sums of [`Rows`] along x.
type AlongX<const N: usize> = [[[f32; 8]; N]; 24];

/// Coefficients of the displacement, as the nodes are.
const DISPLACEMENT_F32: [f32; 4] = {
    let [a, b, c, d] = DISPLACEMENT;
    [a as f32, b as f32, c as f32, d as f32]
};

/// Room for the numbers of one block.
#[derive(Clone, Debug)]
pub(in super::super) struct Scratch {
    /// In front and behind, at the nodes of the block and two about it, in 8 x 8 rows.
    pub(super) masses: [[f32; 512]; 2],
    /// Of the rows that stand along x of each other.
    terms: [[[f32; 8]; TERMS]; 6],
    along_x: AlongX<TERMS>,
    sums: [[f32; 64]; TERMS],
}

impl Scratch {
    #[expect(clippy::large_stack_arrays, reason = "31 of the 2048 KiB that a thread has, once")]
    pub(in super::super) fn new() -> Box<Self> {
        Box::new(Self {
            masses: [[0.0; 512]; 2],
            terms: [[[0.0; 8]; TERMS]; 6],
            along_x: [[[0.0; 8]; TERMS]; 24],
            sums: [[0.0; 64]; TERMS],
        })
    }
}

in_lanes! {
    /// What those nodes find at which both sides have clay, `shared`, a bit each, as it counts in a mean
    /// (`Facing::weighted`), by the masses in `scratch`.
    pub(super) fn find(found: &mut [[f32; 64]; 5], scratch: &mut Scratch, shared: u64) {
        let about = RowsAbout::new(shared);
        // Along x row by row, while what they tell is at hand.
        for y in 0..6 {
            for x in 0..6 {
                if about.all >> (6 * x + y) & 1 == 1 {
                    tell(&mut scratch.terms[x], &scratch.masses, 6 * x + y);
                }
            }
            for x in 0..4 {
                if about.along_x >> (6 * x + y) & 1 == 1 {
                    let [before, here, after] = [0, 1, 2].map(|i| &scratch.terms[x + i]);
                    sum_of_three(&mut scratch.along_x[6 * x + y], [before, here, after], 0.5);
                }
            }
        }
        sum_along_others(&mut scratch.sums, &scratch.along_x, &about, 0.5);
        for first in [0, 8, 16, 24, 32, 40, 48, 56] {
            let its = shared >> first & 0xff;
            if its != 0 {
                find_eight(found, scratch, first, its);
            }
        }
    }
}

in_lanes! {
    /// Sums of what nodes have found over the 27 about each of the `shared`.
    pub(super) fn sum_found(sums: &mut [[f32; 64]; 5], found: &Rows<5>, shared: u64) {
        let (about, mut along_x) = (RowsAbout::new(shared), [[[0.0; 8]; 5]; 24]);
        for row in 0..24 {
            if about.along_x >> row & 1 == 1 {
                sum_of_three(&mut along_x[row], [&found[row], &found[row + 6], &found[row + 12]], 1.0);
            }
        }
        sum_along_others(sums, &along_x, &about, 1.0);
    }
}

/// Which rows the sums at some nodes take: a bit each.
pub(super) struct RowsAbout {
    /// Of the 4 x 4 of the block.
    own: u64,
    /// Of the 4 x 6 sums along x.
    along_x: u64,
    /// Of all 6 x 6.
    pub(super) all: u64,
}

impl RowsAbout {
    #[inline(always)]
    pub(super) fn new(nodes: u64) -> Self {
        let mut about = Self { own: 0, along_x: 0, all: 0 };
        for row in 0..16 {
            if nodes >> (4 * row) & 15 != 0 {
                about.own |= 1 << row;
                about.along_x |= 0b111 << (row / 4 * 6 + row % 4);
            }
        }
        about.all = about.along_x | about.along_x << 6 | about.along_x << 12;
        about
    }

    /// Of the 8 x 8 rows whose masses those of all 6 x 6 tell by: them and those beside them.
    pub(super) fn of_masses(&self) -> u64 {
        let mut own = 0;
        for x in 0..6 {
            own |= (self.all >> (6 * x) & 0x3f) << (8 * x + 9);
        }
        own | own << 1 | own >> 1 | own << 8 | own >> 8
    }
}

/// Numbers where the bits are set, else 0. A choice would have each of them worked out by itself.
#[inline(always)]
fn masked(bits: &[u32; 8], mut of: F8) -> F8 {
    for z in 0..8 {
        of.0[z] = f32::from_bits(of.0[z].to_bits() & bits[z]);
    }
    of
}

/// What each node of a row tells (`Terms` of the definition), by the masses in front and behind.
#[inline(always)]
fn tell(terms: &mut [[f32; 8]; TERMS], masses: &[[f32; 512]; 2], row: usize) {
    const Z: F8 = F8([-3.5, -2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 3.5]);
    let (x, y) = ((row / 6) as f32 - 2.5, (row % 6) as f32 - 2.5);
    let at = ((row / 6 + 1) * 8 + row % 6 + 1) * 8;
    let (f, b) = (eight(&masses[0], at), eight(&masses[1], at));
    let told = [x * f, y * f, Z * f, f, x * b, y * b, Z * b, b];
    for i in 0..8 {
        terms[i] = told[i].0;
    }
    // All bits where both sides have clay.
    let (mut both, mut any) = ([0; 8], 0);
    for z in 0..8 {
        both[z] = if f.0[z].min(b.0[z]) > 0.0 { !0 } else { 0 };
        any |= both[z];
    }
    // Of most rows about a cut one side alone has clay.
    if any == 0 {
        terms[8..].fill([0.0; 8]);
        return;
    }
    let px = masked(&both, middle(masses, at, 64)) + x;
    let py = masked(&both, middle(masses, at, 8)) + y;
    let pz = masked(&both, middle(masses, at, 1)) + Z;
    let w = masked(&both, f * b / (f + b));
    let mut share = F8::ZERO;
    for z in (1..7).filter(|z| both[*z] != 0) {
        share.0[z] = (f.0[z] / b.0[z]).ln();
    }
    let ws = w * share;
    let (wx, wy, wz) = (w * px, w * py, w * pz);
    #[rustfmt::skip]
    let told = [
        w, ws, wx, wy, wz, ws * px, ws * py, ws * pz, wx * px, wy * py, wz * pz, wx * py, wy * pz, wz * px,
    ];
    for i in 0..14 {
        terms[8 + i] = told[i].0;
    }
}

#[inline(always)]
fn eight(of: &[f32], at: usize) -> F8 {
    let mut out = F8::ZERO;
    out.0.copy_from_slice(&of[at..at + 8]);
    out
}

#[inline(always)]
fn total([fronts, backs]: &[[f32; 512]; 2], at: usize) -> F8 {
    eight(fronts, at) + eight(backs, at)
}

/// How far along an axis the middle of the clay of the nodes from `at` on is off them, by the masses `stride`
/// before and after.
#[inline(always)]
fn middle(masses: &[[f32; 512]; 2], at: usize, stride: usize) -> F8 {
    let (before, here, after) = (total(masses, at - stride), total(masses, at), total(masses, at + stride));
    let c = (after - before) / (before + 2.0 * here + after);
    let mut a = c;
    for z in 0..8 {
        a.0[z] = a.0[z].abs();
    }
    let [p, q, r, s] = DISPLACEMENT_F32;
    c * a * (a * (a * (p * a + q) + r) + s)
}

/// Sums along y and z of those along x: over the 27 nodes about each node of some rows of a block. Those off
/// it count `beside` for each axis along which they are.
#[inline(always)]
fn sum_along_others<const N: usize>(sums: &mut [[f32; 64]; N], along_x: &AlongX<N>, about: &RowsAbout, beside: f32) {
    // Each pass takes two planes of one axis away; the last one leaves every other four.
    let mut along_y = [[0.0; 8]; N];
    for row in 0..16 {
        if about.own >> row & 1 == 0 {
            continue;
        }
        let at = row / 4 * 6 + row % 4;
        sum_of_three(&mut along_y, [&along_x[at], &along_x[at + 1], &along_x[at + 2]], beside);
        for n in 0..N {
            let from = &along_y[n];
            for z in 0..4 {
                sums[n][4 * row + z] = from[z + 2] + beside * (from[z + 1] + from[z + 3]);
            }
        }
    }
}

#[inline(always)]
fn sum_of_three<const N: usize>(to: &mut [[f32; 8]; N], [before, here, after]: [&[[f32; 8]; N]; 3], beside: f32) {
    for n in 0..N {
        for i in 0..8 {
            to[n][i] = here[n][i] + beside * (before[n][i] + after[n][i]);
        }
    }
}

/// What eight nodes from `first` on find, of which the bits say where both sides have clay: `facing` of the
/// sums by the definition. In f64: of moments the square of the mean is taken away, and what is left is
/// divided by.
#[inline(always)]
fn find_eight(found: &mut [[f32; 64]; 5], scratch: &Scratch, first: usize, shared: u64) {
    const Y: D8 = D8([0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]);
    const Z: D8 = D8([-1.5, -0.5, 0.5, 1.5, -1.5, -0.5, 0.5, 1.5]);
    let place = [D8::splat((first / 16) as f64 - 1.5), Y + ((first / 4 % 4) as f64 - 1.5), Z];
    let own = ((first / 16 + 2) * 8 + first / 4 % 4 + 2) * 8 + 2;
    let mut t = [D8::ZERO; TERMS];
    for i in 0..TERMS {
        t[i] = eight_in_f64(&scratch.sums[i], first);
    }
    let (mut f, mut b) = (D8::ZERO, D8::ZERO);
    for k in 0..8 {
        f.0[k] = f64::from(scratch.masses[0][own + k / 4 * 8 + k % 4]);
        b.0[k] = f64::from(scratch.masses[1][own + k / 4 * 8 + k % 4]);
    }
    let (front, back) = (centre(&t, 0, &place), centre(&t, 4, &place));
    let mut along = slope(&t);
    let steepness = dot(&along, &along);
    for d in 0..3 {
        let between = front[d] - back[d];
        for k in 0..8 {
            // What is no number is not steep either.
            along[d].0[k] = if steepness.0[k] >= SLOPE_MIN * SLOPE_MIN { along[d].0[k] } else { between.0[k] };
        }
    }
    let mut each = dot(&along, &along);
    for k in 0..8 {
        each.0[k] = 1.0 / each.0[k].sqrt();
    }
    let n = [along[0] * each, along[1] * each, along[2] * each];
    let square = [n[0] * n[0], n[1] * n[1], n[2] * n[2]];
    let gap =
        face_distance(dot(&front, &n)) + face_distance(-dot(&back, &n)) + OBLIQUE_GAP * (D8::splat(1.0) - dot(&square, &square));
    let mass = f * b / (f + b);
    let told = [mass * n[0], mass * n[1], mass * n[2], mass * gap, mass];
    for i in 0..5 {
        for k in 0..8 {
            let is_found = each.0[k] > 0.0 && each.0[k] < f64::INFINITY && shared >> k & 1 == 1;
            found[i][first + k] = if is_found { told[i].0[k] as f32 } else { 0.0 };
        }
    }
}

#[inline(always)]
fn eight_in_f64(of: &[f32], at: usize) -> D8 {
    let (from, mut out) = (eight(of, at), D8::ZERO);
    for k in 0..8 {
        out.0[k] = f64::from(from.0[k]);
    }
    out
}

#[inline(always)]
fn dot(a: &[D8; 3], b: &[D8; 3]) -> D8 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The centre of mass of a side, whose terms begin at `side`, from the nodes.
#[inline(always)]
fn centre(t: &[D8; TERMS], side: usize, place: &[D8; 3]) -> [D8; 3] {
    let each = D8::splat(1.0) / t[side + 3];
    [t[side] * each - place[0], t[side + 1] * each - place[1], t[side + 2] * each - place[2]]
}

/// The slope of the logarithm; no number where that is not known.
#[inline(always)]
fn slope(t: &[D8; TERMS]) -> [D8; 3] {
    let each = D8::splat(1.0) / t[8];
    let (mx, my, mz) = (t[10] * each, t[11] * each, t[12] * each);
    let (xx, yy, zz) = (t[16] - mx * t[10], t[17] - my * t[11], t[18] - mz * t[12]);
    let (xy, yz, zx) = (t[19] - mx * t[11], t[20] - my * t[12], t[21] - mz * t[10]);
    let regular = NORMAL_REGULARISATION * (xx + yy + zz);
    let (xx, yy, zz) = (xx + regular, yy + regular, zz + regular);
    let right = [t[13] - mx * t[9], t[14] - my * t[9], t[15] - mz * t[9]];
    let first = [yy * zz - yz * yz, yz * zx - xy * zz, xy * yz - yy * zx];
    let second = [first[1], xx * zz - zx * zx, xy * zx - xx * yz];
    let third = [first[2], second[2], xx * yy - xy * xy];
    let each = D8::splat(1.0) / dot(&[xx, xy, zx], &first);
    [dot(&first, &right) * each, dot(&second, &right) * each, dot(&third, &right) * each]
}

/// Distance of a face: that of [`facing`](super::super::super::facing).
#[inline(always)]
fn face_distance(centre: D8) -> D8 {
    let (mut c, mut sum) = (centre, D8::ZERO);
    for k in 0..8 {
        c.0[k] = if c.0[k] > 0.0 { c.0[k] } else { 0.0 };
        c.0[k] = if c.0[k] < 1.0 { c.0[k] } else { 1.0 };
    }
    for a in FACE_DISTANCE {
        sum = sum * c + a;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::super::super::super::facing::definition::{Terms, facing};
    use super::*;
    use glam::DVec3;

    /// Eight nodes at a time find what each does by the definition.
    #[test]
    fn eight_nodes_find_what_one_does() {
        let mut scratch = Scratch::new();
        for (case, normal) in [DVec3::X, DVec3::new(0.3, -1.0, 0.2), DVec3::ONE].into_iter().enumerate() {
            let normal = normal.normalize();
            for at in 0..512i32 {
                let place = DVec3::new(f64::from(at / 64), f64::from(at / 8 % 8), f64::from(at % 8)) - 3.5;
                let d = normal.dot(place) - 0.2 * case as f64;
                let share = |d: f64| (0.5 + 0.4 * d).clamp(0.0, 1.0) as f32;
                (scratch.masses[0][at as usize], scratch.masses[1][at as usize]) = (share(d), share(-d));
            }
            let place = |k: usize| DVec3::new((k / 16) as f64, (k / 4 % 4) as f64, (k % 4) as f64) - 1.5;
            let own = |k: usize| {
                let at = ((k / 16 + 2) * 8 + k / 4 % 4 + 2) * 8 + k % 4 + 2;
                scratch.masses.each_ref().map(|side| side[at])
            };
            let shared = (0..64).filter(|k| own(*k).iter().all(|mass| *mass > 0.0)).fold(0u64, |bits, k| bits | 1 << k);
            let masses: Vec<[f64; 2]> = (0..64).map(|k| own(k).map(f64::from)).collect();
            let mut found = [[7.0; 64]; 5];
            find(&mut found, &mut scratch, shared);
            assert!(shared.count_ones() > 10);
            for k in (0..64).filter(|k| shared >> k & 1 == 1) {
                let sums = Terms(scratch.sums.each_ref().map(|sum| f64::from(sum[k])));
                let expected = facing(&sums, place(k)).expect("two sides").weighted(masses[k]);
                for i in 0..5 {
                    assert!((f64::from(found[i][k]) - expected[i]).abs() < 1e-7, "{k}: {} {expected:?}", found[i][k]);
                }
            }
        }
    }
}
