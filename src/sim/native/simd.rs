//! Lanes for the particle kernels: [`F8`] holds one number of 8 particles, and, as [`Lanes`], the eight of
//! one [`Node`].
//!
//! `F8` is plain array arithmetic that the compiler turns into vector code; [`Wide`] is one AVX register,
//! since the gather and scatter of a particle (27 nodes each) must stay in registers whatever the compiler
//! thinks of arrays.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{
    __m256, _mm_add_ps, _mm_load_ps, _mm_loadu_ps, _mm_set_ss, _mm_set1_ps, _mm_store_ps, _mm_storeu_ps, _mm256_add_ps,
    _mm256_blend_ps, _mm256_castps128_ps256, _mm256_castps256_ps128, _mm256_extractf128_ps, _mm256_fmadd_ps, _mm256_load_ps,
    _mm256_loadu_ps, _mm256_mul_ps, _mm256_permute_ps, _mm256_permutevar8x32_ps, _mm256_set_m128, _mm256_set1_ps,
    _mm256_setr_epi32, _mm256_setzero_ps, _mm256_shuffle_ps, _mm256_store_ps, _mm256_sub_ps, _mm256_unpackhi_ps,
    _mm256_unpacklo_ps,
};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Eight particles' values.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(32))]
pub(super) struct F8(pub [f32; 8]);

/// The same in double precision.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(super) struct D8(pub [f64; 8]);

macro_rules! lanewise {
    ($type:ident, $trait:ident, $method:ident, $assign:tt) => {
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for i in 0..8 {
                    self.0[i] $assign other.0[i];
                }
                self
            }
        }
    };
}
macro_rules! lanes_of {
    ($type:ident, $number:ident) => {
        lanewise!($type, Add, add, +=);
        lanewise!($type, Sub, sub, -=);
        lanewise!($type, Mul, mul, *=);
        lanewise!($type, Div, div, /=);

        impl Neg for $type {
            type Output = Self;
            #[inline(always)]
            fn neg(mut self) -> Self {
                for i in 0..8 {
                    self.0[i] = -self.0[i];
                }
                self
            }
        }

        impl Mul<$type> for $number {
            type Output = $type;
            #[inline(always)]
            fn mul(self, other: $type) -> $type {
                $type::splat(self) * other
            }
        }

        impl Add<$number> for $type {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: $number) -> Self {
                self + Self::splat(other)
            }
        }

        impl $type {
            pub(super) const ZERO: Self = Self([0.0; 8]);

            #[inline(always)]
            pub(super) const fn splat(value: $number) -> Self {
                Self([value; 8])
            }
        }
    };
}
lanes_of!(F8, f32);
lanes_of!(D8, f64);

/// A node in memory: momentum or velocity in 0 .. 3, mass in 3, in 4 .. 7 what the clay had of the first
/// before stress, tools and all else acted on it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub(super) struct Node(pub [f32; 8]);

/// The numbers of one node, in registers.
pub(super) trait Lanes: Copy {
    fn splat(v: f32) -> Self;
    /// The first in the lower four lanes, the second in the upper.
    fn halves(low: f32, high: f32) -> Self;
    fn load(node: &Node) -> Self;
    fn store(self, node: &mut Node);
    fn load_row(row: &[f32; 8]) -> Self;
    /// A row of four between its neighbours, one after another in the lanes: from the one before on, and from
    /// the first of the four on. 0 comes after them.
    fn load_between(low: f32, row: &[f32; 4], high: f32) -> [Self; 2];
    /// Each lane moved down by one, the first to the end.
    fn rotated_down(self) -> Self;
    /// Adds the lower four lanes to a row.
    fn add_low_to(self, row: &mut [f32; 4]);
    fn plus(self, b: Self) -> Self;
    fn minus(self, b: Self) -> Self;
    fn times(self, b: Self) -> Self;
    /// `self * b + c`.
    fn times_plus(self, b: Self, c: Self) -> Self;
    /// Whether that is rounded once.
    const IS_FUSED: bool;
}

/// `a b + c` of eight particles, rounded as in the registers `L`.
#[inline(always)]
pub(super) fn fused<L: Lanes>(a: F8, b: F8, c: F8) -> F8 {
    if !L::IS_FUSED {
        return a * b + c;
    }
    let mut out = c;
    for i in 0..8 {
        out.0[i] = a.0[i].mul_add(b.0[i], c.0[i]);
    }
    out
}

impl Lanes for F8 {
    const IS_FUSED: bool = false;

    #[inline(always)]
    fn splat(v: f32) -> Self {
        Self([v; 8])
    }

    #[inline(always)]
    fn halves(low: f32, high: f32) -> Self {
        Self([low, low, low, low, high, high, high, high])
    }

    #[inline(always)]
    fn load(node: &Node) -> Self {
        Self(node.0)
    }

    #[inline(always)]
    fn store(self, node: &mut Node) {
        node.0 = self.0;
    }

    #[inline(always)]
    fn load_row(row: &[f32; 8]) -> Self {
        Self(*row)
    }

    #[inline(always)]
    fn load_between(low: f32, row: &[f32; 4], high: f32) -> [Self; 2] {
        let [p, q, r, s] = *row;
        [Self([low, p, q, r, s, high, 0.0, 0.0]), Self([p, q, r, s, high, 0.0, 0.0, 0.0])]
    }

    #[inline(always)]
    fn rotated_down(self) -> Self {
        let [first, rest @ ..] = self.0;
        let [b, c, d, e, f, g, h] = rest;
        Self([b, c, d, e, f, g, h, first])
    }

    #[inline(always)]
    fn add_low_to(self, row: &mut [f32; 4]) {
        row.iter_mut().zip(self.0).for_each(|(to, own)| *to += own);
    }

    #[inline(always)]
    fn plus(self, b: Self) -> Self {
        self + b
    }

    #[inline(always)]
    fn minus(self, b: Self) -> Self {
        self - b
    }

    #[inline(always)]
    fn times(self, b: Self) -> Self {
        self * b
    }

    #[inline(always)]
    fn times_plus(self, b: Self, c: Self) -> Self {
        self * b + c
    }
}

/// One AVX register: only in kernels that were entered after AVX2 and FMA were detected.
#[cfg(target_arch = "x86_64")]
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(super) struct Wide(__m256);

#[cfg(target_arch = "x86_64")]
impl Lanes for Wide {
    const IS_FUSED: bool = true;

    #[inline(always)]
    fn splat(v: f32) -> Self {
        // SAFETY: kernels of this type are entered after AVX2 and FMA were detected.
        Self(unsafe { _mm256_set1_ps(v) })
    }

    #[inline(always)]
    fn halves(low: f32, high: f32) -> Self {
        // SAFETY: as in `splat`.
        Self(unsafe { _mm256_set_m128(_mm_set1_ps(high), _mm_set1_ps(low)) })
    }

    #[inline(always)]
    fn load(node: &Node) -> Self {
        // SAFETY: as in `splat`; a Node is 32-byte aligned and 32 bytes long.
        Self(unsafe { _mm256_load_ps(node.0.as_ptr()) })
    }

    #[inline(always)]
    fn store(self, node: &mut Node) {
        // SAFETY: as in `load`.
        unsafe { _mm256_store_ps(node.0.as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn load_row(row: &[f32; 8]) -> Self {
        // SAFETY: as in `splat`; the row is 32 bytes long.
        Self(unsafe { _mm256_loadu_ps(row.as_ptr()) })
    }

    #[inline(always)]
    fn load_between(low: f32, row: &[f32; 4], high: f32) -> [Self; 2] {
        // SAFETY: as in `splat`; the row is 16 bytes long.
        unsafe {
            let from_first = _mm256_set_m128(_mm_set_ss(high), _mm_loadu_ps(row.as_ptr()));
            let up = _mm256_permutevar8x32_ps(from_first, _mm256_setr_epi32(7, 0, 1, 2, 3, 4, 5, 6));
            let from_before = _mm256_blend_ps::<1>(up, _mm256_castps128_ps256(_mm_set_ss(low)));
            [Self(from_before), Self(from_first)]
        }
    }

    #[inline(always)]
    fn rotated_down(self) -> Self {
        // SAFETY: as in `splat`.
        Self(unsafe { _mm256_permutevar8x32_ps(self.0, _mm256_setr_epi32(1, 2, 3, 4, 5, 6, 7, 0)) })
    }

    #[inline(always)]
    fn add_low_to(self, row: &mut [f32; 4]) {
        // SAFETY: as in `load_between`.
        unsafe { _mm_storeu_ps(row.as_mut_ptr(), _mm_add_ps(_mm_loadu_ps(row.as_ptr()), _mm256_castps256_ps128(self.0))) }
    }

    #[inline(always)]
    fn plus(self, b: Self) -> Self {
        // SAFETY: as in `splat`.
        Self(unsafe { _mm256_add_ps(self.0, b.0) })
    }

    #[inline(always)]
    fn minus(self, b: Self) -> Self {
        // SAFETY: as in `splat`.
        Self(unsafe { _mm256_sub_ps(self.0, b.0) })
    }

    #[inline(always)]
    fn times(self, b: Self) -> Self {
        // SAFETY: as in `splat`.
        Self(unsafe { _mm256_mul_ps(self.0, b.0) })
    }

    #[inline(always)]
    fn times_plus(self, b: Self, c: Self) -> Self {
        // SAFETY: as in `splat`.
        Self(unsafe { _mm256_fmadd_ps(self.0, b.0, c.0) })
    }
}

/// A node of which three numbers are used.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(16))]
pub(super) struct Node4(pub [f32; 4]);

/// Two particles at a time, each with the four numbers of one of its nodes: of eight particles `K` and
/// `K + 4`, which stand in the halves of an [`F8`] at the same place.
pub(super) trait Pairs: Lanes {
    /// The numbers of two nodes.
    fn load_nodes(low: &Node4, high: &Node4) -> Self;
    /// To two nodes, which are not the same.
    fn store_nodes(self, low: &mut Node4, high: &mut Node4);
    /// Adds both particles' numbers to one node.
    fn add_both(self, node: &mut Node4);
    /// What particles `K` and `K + 4` have, for all four numbers of a node.
    fn twins<const K: usize>(of: &F8) -> Self;
    /// Three numbers of the pairs 0 .. 4, each as that of eight particles.
    fn to_eight(pairs: [Self; 4]) -> [F8; 3];
    /// The same back; the fourth number is 0.
    fn from_eight(numbers: &[F8; 3]) -> [Self; 4];
}

impl Pairs for F8 {
    #[inline(always)]
    fn load_nodes(low: &Node4, high: &Node4) -> Self {
        let ([a, b, c, d], [e, f, g, h]) = (low.0, high.0);
        Self([a, b, c, d, e, f, g, h])
    }

    #[inline(always)]
    fn store_nodes(self, low: &mut Node4, high: &mut Node4) {
        for d in 0..4 {
            (low.0[d], high.0[d]) = (self.0[d], self.0[4 + d]);
        }
    }

    #[inline(always)]
    fn add_both(self, node: &mut Node4) {
        for d in 0..4 {
            node.0[d] += self.0[d] + self.0[4 + d];
        }
    }

    #[inline(always)]
    fn twins<const K: usize>(of: &F8) -> Self {
        let (low, high) = (of.0[K], of.0[4 + K]);
        Self([low, low, low, low, high, high, high, high])
    }

    #[inline(always)]
    fn to_eight(pairs: [Self; 4]) -> [F8; 3] {
        let mut out = [Self::ZERO; 3];
        for k in 0..4 {
            for d in 0..3 {
                (out[d].0[k], out[d].0[4 + k]) = (pairs[k].0[d], pairs[k].0[4 + d]);
            }
        }
        out
    }

    #[inline(always)]
    fn from_eight(numbers: &[F8; 3]) -> [Self; 4] {
        let mut out = [Self::ZERO; 4];
        for k in 0..4 {
            for d in 0..3 {
                (out[k].0[d], out[k].0[4 + d]) = (numbers[d].0[k], numbers[d].0[4 + k]);
            }
        }
        out
    }
}

#[cfg(target_arch = "x86_64")]
impl Pairs for Wide {
    #[inline(always)]
    fn load_nodes(low: &Node4, high: &Node4) -> Self {
        // SAFETY: as in `splat`; a node is 16-byte aligned and 16 bytes long.
        Self(unsafe { _mm256_set_m128(_mm_load_ps(high.0.as_ptr()), _mm_load_ps(low.0.as_ptr())) })
    }

    #[inline(always)]
    fn store_nodes(self, low: &mut Node4, high: &mut Node4) {
        // SAFETY: as in `load_nodes`.
        unsafe {
            _mm_store_ps(low.0.as_mut_ptr(), _mm256_castps256_ps128(self.0));
            _mm_store_ps(high.0.as_mut_ptr(), _mm256_extractf128_ps::<1>(self.0));
        }
    }

    #[inline(always)]
    fn add_both(self, node: &mut Node4) {
        // SAFETY: as in `load_nodes`.
        unsafe {
            let both = _mm_add_ps(_mm256_castps256_ps128(self.0), _mm256_extractf128_ps::<1>(self.0));
            _mm_store_ps(node.0.as_mut_ptr(), _mm_add_ps(_mm_load_ps(node.0.as_ptr()), both));
        }
    }

    #[inline(always)]
    fn twins<const K: usize>(of: &F8) -> Self {
        // SAFETY: as in `splat`; an F8 is 32-byte aligned and 32 bytes long.
        unsafe {
            let v = _mm256_load_ps(of.0.as_ptr());
            Self(match K {
                0 => _mm256_permute_ps::<0x00>(v),
                1 => _mm256_permute_ps::<0x55>(v),
                2 => _mm256_permute_ps::<0xaa>(v),
                _ => _mm256_permute_ps::<0xff>(v),
            })
        }
    }

    #[inline(always)]
    fn to_eight([p, q, r, s]: [Self; 4]) -> [F8; 3] {
        let mut out = [F8::ZERO; 3];
        // SAFETY: as in `twins`.
        unsafe {
            // x of the first two, then y; the same of the other two; then z.
            let (xy, other_xy) = (_mm256_unpacklo_ps(p.0, q.0), _mm256_unpacklo_ps(r.0, s.0));
            let (z, other_z) = (_mm256_unpackhi_ps(p.0, q.0), _mm256_unpackhi_ps(r.0, s.0));
            _mm256_store_ps(out[0].0.as_mut_ptr(), _mm256_shuffle_ps::<0x44>(xy, other_xy));
            _mm256_store_ps(out[1].0.as_mut_ptr(), _mm256_shuffle_ps::<0xee>(xy, other_xy));
            _mm256_store_ps(out[2].0.as_mut_ptr(), _mm256_shuffle_ps::<0x44>(z, other_z));
        }
        out
    }

    #[inline(always)]
    fn from_eight(numbers: &[F8; 3]) -> [Self; 4] {
        // SAFETY: as in `twins`.
        unsafe {
            let (x, y) = (_mm256_load_ps(numbers[0].0.as_ptr()), _mm256_load_ps(numbers[1].0.as_ptr()));
            let z = _mm256_load_ps(numbers[2].0.as_ptr());
            let zero = _mm256_setzero_ps();
            let (xy, z0) = (_mm256_unpacklo_ps(x, y), _mm256_unpacklo_ps(z, zero));
            let (other_xy, other_z) = (_mm256_unpackhi_ps(x, y), _mm256_unpackhi_ps(z, zero));
            [
                Self(_mm256_shuffle_ps::<0x44>(xy, z0)),
                Self(_mm256_shuffle_ps::<0xee>(xy, z0)),
                Self(_mm256_shuffle_ps::<0x44>(other_xy, other_z)),
                Self(_mm256_shuffle_ps::<0xee>(other_xy, other_z)),
            ]
        }
    }
}

/// Whether this processor has AVX2, FMA and POPCNT.
pub(super) fn has_fma() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::is_x86_feature_detected as detected;
        detected!("avx2") && detected!("fma") && detected!("popcnt")
    }
    #[cfg(not(target_arch = "x86_64"))]
    false
}

/// Defines functions whose loops over nodes run in registers of eight numbers where the processor has such.
macro_rules! in_lanes {
    ($(#[$doc:meta])* $vis:vis fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $ret:ty)? $body:block) => {
        $(#[$doc])*
        #[inline]
        $vis fn $name($($arg: $type),*) $(-> $ret)? {
            #[inline(always)]
            fn plain($($arg: $type),*) $(-> $ret)? $body

            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma,popcnt")]
            fn wide($($arg: $type),*) $(-> $ret)? {
                plain($($arg),*)
            }

            #[cfg(target_arch = "x86_64")]
            if $crate::sim::native::simd::has_fma() {
                // SAFETY: AVX2, FMA and POPCNT were detected.
                return unsafe { wide($($arg),*) };
            }
            plain($($arg),*)
        }
    };
}
pub(super) use in_lanes;
