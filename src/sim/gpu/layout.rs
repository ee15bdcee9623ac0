//! The structs that host and device share, and the bits of the status word.

use super::super::frame::SurfaceParticle;
use super::super::snapshot::{ANCHORS_MAX, Particle};
use super::super::tool::PROFILE_POINTS;
use bytemuck::Pod;

/// Tools that one plan may have: a bit each in a word.
pub const TOOLS_MAX: u32 = 32;
/// Bent blades that one plan may have: their profiles are uniforms.
pub const PROFILES_MAX: u32 = 8;
/// Classes ahead of a blade's edge that are told apart: the table of `ahead.wgsl`, whose hash has five bits.
pub(super) const AHEAD_PLACES: usize = 32;
/// Fields of a particle's state, 16 bytes each: the last are its anchors.
pub(super) const FIELDS: u32 = 10 + ANCHORS_MAX as u32;
/// Pairs of points of a bent blade's profile.
pub(super) const PROFILE_PAIRS: usize = PROFILE_POINTS.div_ceil(2);

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

/// Names the words at which the fields of a particle begin in a buffer of words, and its length. All fields
/// by name: one that shaders do not know fails to compile.
macro_rules! words {
    ($type:ident as $words:literal { $($field:ident = $name:literal,)+ }) => {{
        const _: fn($type) = |$type { $($field: _),+ }| ();
        [($words, size_of::<$type>() as u32 / 4), $(($name, std::mem::offset_of!($type, $field) as u32 / 4)),+]
    }};
}

/// Where a record, a [`Particle`] of a snapshot, has its fields.
pub(super) const RECORD: [(&str, u32); 14] = words!(Particle as "RECORD_WORDS" {
    cell = "RECORD_CELL",
    offset = "RECORD_OFFSET",
    velocity = "RECORD_VELOCITY",
    affine = "RECORD_AFFINE",
    elastic_strain = "RECORD_STRAIN",
    hardening = "RECORD_HARDENING",
    structure = "RECORD_STRUCTURE",
    rest_volume = "RECORD_REST_VOLUME",
    id = "RECORD_ID",
    tags = "RECORD_TAGS",
    anchors = "RECORD_ANCHORS",
    walls = "RECORD_WALLS",
    body = "RECORD_BODY",
});

/// Where a [`SurfaceParticle`] has its fields.
pub(crate) const SURFACE_PARTICLE: [(&str, u32); 6] = words!(SurfaceParticle as "SURFACE_PARTICLE_WORDS" {
    position = "SURFACE_PARTICLE_POSITION",
    volume_ratio = "SURFACE_PARTICLE_VOLUME_RATIO",
    density_weight = "SURFACE_PARTICLE_DENSITY_WEIGHT",
    tags = "SURFACE_PARTICLE_TAGS",
    body = "SURFACE_PARTICLE_BODY",
});

/// A struct that host and device share.
pub(crate) trait Twin: Pod {
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
    ($(#[doc = $about:literal])* $vis:vis $rust:ident = $wgsl:literal {
        $($(#[doc = $doc:literal])+ $field_vis:vis $field:ident: $type:ty = $kind:literal,)+
    }) => {
        $(#[doc = $about])*
        #[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        #[repr(C)]
        $vis struct $rust {
            $($(#[doc = $doc])+ $field_vis $field: $type),+
        }

        impl Default for $rust {
            fn default() -> Self {
                bytemuck::Zeroable::zeroed()
            }
        }

        impl $crate::sim::gpu::layout::Twin for $rust {
            #[cfg(test)]
            const NAME: &'static str = $wgsl;
            const TEXT: &'static str =
                concat!("struct ", $wgsl, " {\n", $("    ", stringify!($field), ": ", $kind, ",", $(" //", $doc,)+ "\n",)+ "}\n");
            #[cfg(test)]
            const OFFSETS: &'static [(&'static str, usize)] =
                &[$((stringify!($field), std::mem::offset_of!($rust, $field))),+];
        }
    };
}

pub(crate) use twins;

twins! {
    /// What a blade did in one frame.
    pub(super) ToolCount = "ToolCount" {
        /// particles that took a side
        pub tagged: u32 = "atomic<u32>",
        /// particles put back
        pub pushed_back: u32 = "atomic<u32>",
        /// f32 bits, not negative
        pub depth: f32 = "atomic<u32>",
        /// sides of older cuts given up
        pub displaced: u32 = "atomic<u32>",
        /// classes ahead of its edge in the present substep, key + 1, from where their keys have their place
        pub ahead: [u32; AHEAD_PLACES] = "array<atomic<u32>, AHEAD_PLACES>",
        /// what they have behind its surface, fixed point
        pub behind: [u32; AHEAD_PLACES] = "array<atomic<u32>, AHEAD_PLACES>",
        /// and before it
        pub before: [u32; AHEAD_PLACES] = "array<atomic<u32>, AHEAD_PLACES>",
    }
}

twins! {
    /// Flags and counters of one frame.
    pub(super) Status = "Status" {
        /// what stops every later pass until the host has acted on it
        pub flags: u32 = "atomic<u32>",
        /// greatest node speed, f32 bits
        pub speed: f32 = "atomic<u32>",
        /// particles clamped
        pub clamped: u32 = "atomic<u32>",
        /// most particles in a cell
        pub cell_count: u32 = "atomic<u32>",
        /// blocks with nodes
        pub slot_count: u32 = "atomic<u32>",
        /// of the present submission, from 1
        pub substep: u32 = "atomic<u32>",
        /// greatest of a node and class, fixed point
        pub node_mass: u32 = "atomic<u32>",
        /// whether the bound on speed was
        pub reach_met: u32 = "atomic<u32>",
        /// whether a key found no room in a block
        pub crowded: u32 = "atomic<u32>",
        /// sides of cuts that grew together
        pub welded: u32 = "atomic<u32>",
        /// those among them that grew together with another body
        pub joined: u32 = "atomic<u32>",
        /// sides of cuts that clay took from the clay about it
        pub carried: u32 = "atomic<u32>",
        /// greatest number of a body
        pub body_max: u32 = "atomic<u32>",
        /// that particles have a side of, a bit each
        pub sheets: [u32; 8] = "array<atomic<u32>, 8>",
        /// what each tool did
        pub tools: [ToolCount; TOOLS_MAX as usize] = "array<ToolCount, TOOLS_MAX>",
    }
}

twins! {
    /// Sums over the particles of one workgroup, in masses, cells and substeps.
    pub(super) Total = "Total" {
        /// sum of m v
        pub momentum: [f32; 3] = "vec3f",
        /// sum of m |v|
        pub momentum_size: f32 = "f32",
        /// about params.centre, with the affine part
        pub angular: [f32; 3] = "vec3f",
        /// kinetic energy
        pub kinetic: f32 = "f32",
        /// sums of m |H|^2, m tr(H)^2, m J
        pub strain: [f32; 3] = "vec3f",
        /// sum of m
        pub mass: f32 = "f32",
        /// least and greatest J
        pub ratio: [f32; 2] = "vec2f",
        /// greatest |v + A d|
        pub reach: f32 = "f32",
        /// nothing
        pub spare: f32 = "f32",
    }
}
