//! Lanes for the particle kernels: [`F8`] holds one number of 8 particles, and, as [`Lanes`], the eight of
//! one [`Node`].
//!
//! `F8` is plain array arithmetic that the compiler turns into vector code; [`Wide`] is one AVX register,
//! since the gather and scatter of a particle (27 nodes each) must stay in registers whatever the compiler
//! thinks of arrays.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{
    __m256, _mm256_add_ps, _mm256_fmadd_ps, _mm256_load_ps, _mm256_loadu_ps, _mm256_mul_ps, _mm256_set1_ps, _mm256_store_ps,
    _mm256_storeu_ps, _mm256_sub_ps,
};
use std::ops::{Add, Div, Mul, Sub};

/// Eight particles' values.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C, align(32))]
pub(super) struct F8(pub [f32; 8]);

macro_rules! lanewise {
    ($trait:ident, $method:ident, $assign:tt) => {
        impl $trait for F8 {
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
lanewise!(Add, add, +=);
lanewise!(Sub, sub, -=);
lanewise!(Mul, mul, *=);
lanewise!(Div, div, /=);

impl Mul<F8> for f32 {
    type Output = F8;
    #[inline(always)]
    fn mul(self, other: F8) -> F8 {
        F8::splat(self) * other
    }
}

impl Add<f32> for F8 {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: f32) -> Self {
        self + Self::splat(other)
    }
}

impl F8 {
    pub(super) const ZERO: Self = Self([0.0; 8]);

    #[inline(always)]
    pub(super) const fn splat(value: f32) -> Self {
        Self([value; 8])
    }
}

/// A node in memory: momentum or velocity in 0 .. 3, mass in 3, in 4 .. 7 what the clay had of the first
/// before stress, tools and all else acted on it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub(super) struct Node(pub [f32; 8]);

/// The numbers of one node, in registers.
pub(super) trait Lanes: Copy {
    fn splat(v: f32) -> Self;
    fn load(node: &Node) -> Self;
    fn store(self, node: &mut Node);
    fn load_row(row: &[f32; 8]) -> Self;
    fn store_row(self, row: &mut [f32; 8]);
    fn plus(self, b: Self) -> Self;
    fn minus(self, b: Self) -> Self;
    fn times(self, b: Self) -> Self;
    /// `self * b + c`.
    fn times_plus(self, b: Self, c: Self) -> Self;
}

impl Lanes for F8 {
    #[inline(always)]
    fn splat(v: f32) -> Self {
        Self([v; 8])
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
    fn store_row(self, row: &mut [f32; 8]) {
        *row = self.0;
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
    #[inline(always)]
    fn splat(v: f32) -> Self {
        // SAFETY: kernels of this type are entered after AVX2 and FMA were detected.
        Self(unsafe { _mm256_set1_ps(v) })
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
    fn store_row(self, row: &mut [f32; 8]) {
        // SAFETY: as in `load_row`.
        unsafe { _mm256_storeu_ps(row.as_mut_ptr(), self.0) }
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
