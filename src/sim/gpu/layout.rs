//! The structs that host and device share, and the bits of the status word.

use bytemuck::Pod;

/// Tools that one plan may have: a bit each in a word.
pub const TOOLS_MAX: u32 = 32;
/// Bent blades that one plan may have: their profiles are uniforms.
pub const PROFILES_MAX: u32 = 8;
/// Fields of a particle's state, 16 bytes each.
pub(super) const FIELDS: u32 = 7;

/// Bits of the status word.
pub(super) mod flag {
    /// A node moved too far in a substep.
    pub(in super::super) const SPEED: u32 = 1;
    /// A value was not finite.
    pub(in super::super) const NON_FINITE: u32 = 1 << 1;
    /// A particle left the blocks marked for it: re-binned too seldom.
    pub(in super::super) const MARGIN: u32 = 1 << 2;
    /// More particles in a cell, or a greater speed, than the fixed point scales serve.
    pub(in super::super) const OVERFLOW: u32 = 1 << 3;
    /// More blocks than there is room for.
    pub(in super::super) const CAPACITY: u32 = 1 << 4;
    /// More classes of clay about a cut's block than there is room for.
    pub(in super::super) const CROWDED: u32 = 1 << 5;
}

/// A struct that host and device share.
pub(super) trait Twin: Pod {
    /// Its name on the device.
    #[cfg(test)]
    const NAME: &'static str;
    /// Its declaration there.
    const TEXT: &'static str;
    /// Its fields and how many bytes stand before each.
    #[cfg(test)]
    const OFFSETS: &'static [(&'static str, usize)];
}

/// Declares shared structs, once: here, and in WGSL. A test compares both, field by field.
macro_rules! twins {
    ($(#[doc = $about:literal])* $rust:ident = $wgsl:literal { $(#[doc = $doc:literal] $field:ident: $type:ty = $kind:literal,)+ }) => {
        $(#[doc = $about])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        #[repr(C)]
        pub(super) struct $rust {
            $(#[doc = $doc] pub $field: $type),+
        }

        impl $crate::sim::gpu::layout::Twin for $rust {
            #[cfg(test)]
            const NAME: &'static str = $wgsl;
            const TEXT: &'static str =
                concat!("struct ", $wgsl, " {\n", $("    ", stringify!($field), ": ", $kind, ", //", $doc, "\n",)+ "}\n");
            #[cfg(test)]
            const OFFSETS: &'static [(&'static str, usize)] =
                &[$((stringify!($field), std::mem::offset_of!($rust, $field))),+];
        }
    };
}

pub(super) use twins;

twins! {
    /// What a blade did in one frame.
    ToolCount = "ToolCount" {
        /// particles that took a side
        tagged: u32 = "atomic<u32>",
        /// particles put back
        pushed_back: u32 = "atomic<u32>",
        /// f32 bits, not negative
        depth: f32 = "atomic<u32>",
        /// sides of older cuts given up
        displaced: u32 = "atomic<u32>",
    }
}

twins! {
    /// Flags and counters of one frame.
    Status = "Status" {
        /// what stops every later pass until the host has acted on it
        flags: u32 = "atomic<u32>",
        /// greatest node speed, f32 bits
        speed: f32 = "atomic<u32>",
        /// particles clamped
        clamped: u32 = "atomic<u32>",
        /// most particles in a cell
        cell_count: u32 = "atomic<u32>",
        /// blocks with nodes
        slot_count: u32 = "atomic<u32>",
        /// of the present submission, from 1
        substep: u32 = "atomic<u32>",
        /// greatest of a node and class, fixed point
        node_mass: u32 = "atomic<u32>",
        /// whether the bound on speed was
        reach_met: u32 = "atomic<u32>",
        /// whether a key found no room in a block
        crowded: u32 = "atomic<u32>",
        /// sides of cuts that grew together
        welded: u32 = "atomic<u32>",
        /// that particles have a side of, a bit each
        sheets: [u32; 8] = "array<atomic<u32>, 8>",
        /// what each tool did
        tools: [ToolCount; TOOLS_MAX as usize] = "array<ToolCount, TOOLS_MAX>",
    }
}

twins! {
    /// Sums over the particles of one workgroup, in masses, cells and substeps.
    Total = "Total" {
        /// sum of m v
        momentum: [f32; 3] = "vec3f",
        /// sum of m |v|
        momentum_size: f32 = "f32",
        /// about params.centre, with the affine part
        angular: [f32; 3] = "vec3f",
        /// kinetic energy
        kinetic: f32 = "f32",
        /// sums of m |H|^2, m tr(H)^2, m J
        strain: [f32; 3] = "vec3f",
        /// sum of m
        mass: f32 = "f32",
        /// least and greatest J
        ratio: [f32; 2] = "vec2f",
        /// greatest |v + A d|
        reach: f32 = "f32",
        /// nothing
        spare: f32 = "f32",
    }
}
