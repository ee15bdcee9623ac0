//! Lanes for the particle kernels: [`F8`] holds one number of 8 particles, [`V4`] one node's momentum and
//! mass.
//!
//! `F8` is plain array arithmetic that the compiler turns into vector code; `V4` maps to one SSE register
//! where there is one, since the gather and scatter of a particle (27 nodes each) must stay in registers
//! whatever the compiler thinks of arrays.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{_mm_add_ps, _mm_fmadd_ps, _mm_load_ps, _mm_mul_ps, _mm_set1_ps, _mm_setr_ps, _mm_store_ps};
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

/// One node: momentum or velocity in x, y, z and mass in w.
#[derive(Clone, Copy, Debug)]
#[repr(transparent)]
pub(super) struct V4(Lanes);

#[cfg(target_arch = "x86_64")]
type Lanes = std::arch::x86_64::__m128;
#[cfg(not(target_arch = "x86_64"))]
type Lanes = [f32; 4];

// SSE2 is part of every x86_64, so these need no detection.
#[cfg(target_arch = "x86_64")]
impl V4 {
    #[inline(always)]
    pub(super) fn new(x: f32, y: f32, z: f32, w: f32) -> Self {
        // SAFETY: SSE is part of the x86_64 baseline.
        Self(unsafe { _mm_setr_ps(x, y, z, w) })
    }

    #[inline(always)]
    pub(super) fn splat(v: f32) -> Self {
        // SAFETY: SSE is part of the x86_64 baseline.
        Self(unsafe { _mm_set1_ps(v) })
    }

    #[inline(always)]
    pub(super) fn load(node: &Node) -> Self {
        // SAFETY: a Node is 16-byte aligned and 16 bytes long; SSE is part of the x86_64 baseline.
        Self(unsafe { _mm_load_ps(node.0.as_ptr()) })
    }

    #[inline(always)]
    pub(super) fn store(self, node: &mut Node) {
        // SAFETY: a Node is 16-byte aligned and 16 bytes long; SSE is part of the x86_64 baseline.
        unsafe { _mm_store_ps(node.0.as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    pub(super) fn plus(self, b: Self) -> Self {
        // SAFETY: SSE is part of the x86_64 baseline.
        Self(unsafe { _mm_add_ps(self.0, b.0) })
    }

    #[inline(always)]
    pub(super) fn times(self, b: Self) -> Self {
        // SAFETY: SSE is part of the x86_64 baseline.
        Self(unsafe { _mm_mul_ps(self.0, b.0) })
    }

    /// `self * b + c`; fused only in kernels that were entered after FMA was detected.
    #[inline(always)]
    pub(super) fn times_plus<const FMA: bool>(self, b: Self, c: Self) -> Self {
        if FMA {
            // SAFETY: FMA = true is instantiated only inside functions with target feature fma, called
            // after detection.
            Self(unsafe { _mm_fmadd_ps(self.0, b.0, c.0) })
        } else {
            self.times(b).plus(c)
        }
    }
}

#[cfg(not(target_arch = "x86_64"))]
impl V4 {
    #[inline(always)]
    pub(super) fn new(x: f32, y: f32, z: f32, w: f32) -> Self {
        Self([x, y, z, w])
    }

    #[inline(always)]
    pub(super) fn splat(v: f32) -> Self {
        Self([v; 4])
    }

    #[inline(always)]
    pub(super) fn load(node: &Node) -> Self {
        Self(node.0)
    }

    #[inline(always)]
    pub(super) fn store(self, node: &mut Node) {
        node.0 = self.0;
    }

    #[inline(always)]
    pub(super) fn plus(mut self, b: Self) -> Self {
        for i in 0..4 {
            self.0[i] += b.0[i];
        }
        self
    }

    #[inline(always)]
    pub(super) fn times(mut self, b: Self) -> Self {
        for i in 0..4 {
            self.0[i] *= b.0[i];
        }
        self
    }

    #[inline(always)]
    pub(super) fn times_plus<const FMA: bool>(self, b: Self, c: Self) -> Self {
        self.times(b).plus(c)
    }
}

/// A node in memory: (momentum or velocity, mass).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(16))]
pub(super) struct Node(pub [f32; 4]);
