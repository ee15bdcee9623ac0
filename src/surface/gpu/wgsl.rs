//! The passes and their texts: generated constants, the shared parts, the pass itself. Plain WGSL.

use super::super::balls::{Ball, ROUND_MAX};
use super::super::cells::CROSSING_MIN;
use super::super::cells::rims::LIP_REACH;
use super::super::closure::{CLAY_CLOSED, CLAY_OPEN, FACE_SHARE, PART_SHARE, SEVERAL};
use super::super::clusters::{CLUSTER_MIN, GRAIN_DENSITY, GRAIN_FIELD};
use super::super::field::{BULK_DENSITY, DENSITY_MIN, HYSTERESIS, SURFACE_DENSITY};
use super::super::labels::CUTS_MAX;
use super::super::mc_table::table;
use super::layout::{CLOSURE_FIRST, LIST_FIRST, PAIRS_MAX, Params, Region, SHEETS_MAX, SurfaceStatus, VERTEX_WORDS, Work, flag};
use crate::sim::cut::JOINT_SHEET;
use crate::sim::gpu::layout::{SURFACE_PARTICLE, Twin};
use std::fmt::Write;

/// Units of fixed point in the inside of clay: sums of up to 128 times that, resolved to 1e-7 of it.
const FIXED_POINT: f32 = 16_777_216.0;
/// Entries of the block table that one workgroup of a prefix sum takes.
pub(super) const SCAN_CHUNK: u32 = 1024;

/// One compute pass: its name, also its file's stem, its entry point, the shared parts that it needs, its
/// text.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pass {
    pub name: &'static str,
    pub entry: &'static str,
    parts: &'static [&'static str],
    text: &'static str,
}

const PARTICLES: &str = include_str!("particles.wgsl");
const TABLE: &str = include_str!("table.wgsl");
const SUMS: &str = include_str!("sums.wgsl");
const LISTS: &str = include_str!("lists.wgsl");
const BODIES: &str = include_str!("bodies.wgsl");
const LABELS: &str = include_str!("labels.wgsl");
const TILE: &str = include_str!("tile.wgsl");
const WALK: &str = include_str!("walk.wgsl");
const VERTEX: &str = include_str!("vertex.wgsl");
const RIMS: &str = include_str!("rims.wgsl");
const BALL: &str = include_str!("ball.wgsl");

macro_rules! passes {
    ($($id:ident = $name:literal $entry:literal [$($part:ident),*];)*) => {
        /// Names a pass.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub(super) enum Id { $(#[doc = $name] $id),* }

        /// All passes, in the order of [`Id`].
        pub(super) const PASSES: &[Pass] = &[$(Pass {
            name: $name,
            entry: $entry,
            parts: &[$($part),*],
            text: include_str!(concat!("pass/", $name, ".wgsl")),
        }),*];
    };
}

passes! {
    // Blocks, of both levels.
    Mark = "mark" "mark" [PARTICLES];
    ScanSums = "scan_sums" "scan_sums" [];
    ScanChunks = "scan_chunks" "scan_chunks" [];
    ScanWrite = "scan_write" "scan_write" [];
    // Cuts and bodies.
    Survey = "survey" "survey" [PARTICLES];
    FindBodies = "find_bodies" "find_bodies" [PARTICLES, TABLE, LISTS];
    DealPages = "deal_pages" "deal_pages" [LISTS];
    Assign = "assign" "assign" [];
    // Fields.
    ScatterDensity = "scatter_density" "scatter_density" [PARTICLES, TABLE, SUMS];
    Weigh = "weigh" "weigh" [PARTICLES, TABLE, SUMS];
    Scatter = "scatter" "scatter" [PARTICLES, TABLE, SUMS, LISTS, BODIES];
    Filter = "filter" "filter_fields" [TABLE, LISTS, BODIES];
    // Grains.
    FindGrains = "find_grains" "find_grains" [PARTICLES, TABLE];
    GrainOffsets = "grain_offsets" "grain_offsets" [];
    // Whether anything has changed.
    Compare = "compare" "compare" [LISTS, BODIES];
    Decide = "decide" "decide" [];
    Collect = "collect" "collect" [];
    // Mesh.
    Take = "take" "take" [LISTS, BODIES];
    Closure = "closure" "closure" [LABELS, LISTS, BODIES];
    Label = "label" "label" [TABLE, LABELS, LISTS, BODIES, TILE];
    Bodies = "bodies" "bodies" [TABLE, LABELS, LISTS, TILE];
    Count = "count" "count" [TABLE, LISTS, TILE, WALK];
    Offsets = "offsets" "offsets" [BALL];
    Emit = "emit" "emit" [TABLE, LABELS, LISTS, BODIES, TILE, WALK, VERTEX, RIMS];
    Balls = "balls" "balls" [PARTICLES, BALL];
    Tail = "tail" "tail" [];
}

impl Id {
    /// The pass.
    pub(super) fn pass(self) -> &'static Pass {
        &PASSES[self as usize]
    }
}

/// The whole text of a pass.
pub(super) fn compose(pass: &Pass) -> String {
    let mut text = String::new();
    let unsigned = [
        ("SCAN_CHUNK", SCAN_CHUNK),
        ("SHEETS_MAX", SHEETS_MAX as u32),
        ("PAIRS_MAX", PAIRS_MAX),
        ("JOINT_SHEET", u32::from(JOINT_SHEET)),
        ("CUTS_MAX", CUTS_MAX as u32),
        ("VERTEX_WORDS", VERTEX_WORDS),
        ("CLUSTER_MIN", CLUSTER_MIN as u32),
        ("ROUND_MAX", ROUND_MAX as u32),
        ("BLOCKS_FULL", flag::BLOCKS_FULL),
        ("SHEETS_FULL", flag::SHEETS_FULL),
        ("MESH_FULL", flag::MESH_FULL),
        ("BODIES_FULL", flag::BODIES_FULL),
        ("CLOSURE_FIRST", CLOSURE_FIRST),
        ("LIST_FIRST", LIST_FIRST),
    ];
    for (name, value) in unsigned.into_iter().chain(SURFACE_PARTICLE) {
        // Writing to a string does not fail.
        let _ = writeln!(text, "const {name}: u32 = {value}u;");
    }
    let reals = [
        ("FIXED_POINT", FIXED_POINT),
        ("HYSTERESIS", HYSTERESIS),
        ("SURFACE_DENSITY", SURFACE_DENSITY),
        ("DENSITY_MIN", DENSITY_MIN),
        ("CROSSING_MIN", CROSSING_MIN as f32),
        ("LIP_REACH", LIP_REACH as f32),
        ("GRAIN_DENSITY", GRAIN_DENSITY),
        ("GRAIN_FIELD", GRAIN_FIELD),
        ("BULK_DENSITY", BULK_DENSITY),
        ("CLAY_OPEN", CLAY_OPEN),
        ("CLAY_CLOSED", CLAY_CLOSED),
        ("PART_SHARE", PART_SHARE),
        ("FACE_SHARE", FACE_SHARE),
        ("SEVERAL", SEVERAL),
        ("ICOSAHEDRON_SCALE", Ball::Icosahedron.scale()),
        ("OCTAHEDRON_SCALE", Ball::Octahedron.scale()),
    ];
    for (name, value) in reals {
        let _ = writeln!(text, "const {name}: f32 = {value:?}f;");
    }
    for declaration in [Params::TEXT, SurfaceStatus::TEXT, Region::TEXT, Work::TEXT] {
        text.push_str(declaration);
    }
    text.push_str(include_str!("prelude.wgsl"));
    pass.parts.iter().chain([&pass.text]).for_each(|part| text.push_str(part));
    text
}

/// The case table as the walk reads it: two words a case, edges of 4 bits, the number of triangles in the
/// top 4.
pub(super) fn case_words() -> Vec<u32> {
    let mut words = Vec::with_capacity(512);
    for case in table() {
        let edges = case.triangles().iter().flatten();
        let packed = edges.enumerate().fold(0u64, |bits, (i, &edge)| bits | u64::from(edge) << (4 * i));
        let packed = packed | (case.triangles().len() as u64) << 60;
        words.extend([packed as u32, (packed >> 32) as u32]);
    }
    words
}

#[cfg(test)]
mod tests {
    use super::super::super::mc_table::{EDGES, edge_axis};
    use super::*;
    use crate::sim::gpu::kernel::bindings;
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    fn validated(name: &str, text: &str) -> naga::Module {
        let module = naga::front::wgsl::parse_str(text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        validator.validate(&module).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(text)));
        module
    }

    /// Every pass is valid, has its entry point, and keeps to the limits of WebGPU's core: 8 storage buffers,
    /// 16 KiB, 256 invocations.
    #[test]
    fn passes_are_valid_and_within_the_limits_of_the_core() {
        for pass in PASSES {
            let text = compose(pass);
            let module = validated(pass.name, &text);
            let [entry] = &module.entry_points[..] else { panic!("{}: one entry point", pass.name) };
            assert_eq!(entry.name, pass.entry, "{}", pass.name);
            assert!(entry.workgroup_size.iter().product::<u32>() <= 256, "{}", pass.name);
            let all = bindings(&text);
            assert!(all.iter().filter(|b| !b.is_uniform).count() <= 8, "{}: {all:?}", pass.name);
            assert_eq!(all.len(), module.global_variables.iter().filter(|v| v.1.binding.is_some()).count(), "{}", pass.name);
            let mut layouter = naga::proc::Layouter::default();
            layouter.update(module.to_ctx()).expect("a layout");
            let shared = module.global_variables.iter().filter(|v| v.1.space == naga::AddressSpace::WorkGroup);
            let bytes: u32 = shared.map(|v| layouter[v.1.ty].size).sum();
            assert!(bytes <= 16_384, "{}: {bytes} bytes of workgroup memory", pass.name);
        }
    }

    /// The walk's edges are those of the table.
    #[test]
    fn edges_are_those_of_the_table() {
        let packed = (0..12u8).map(|e| format!("{}u", EDGES[usize::from(e)].0 | (edge_axis(e) as u8) << 3));
        let list = packed.collect::<Vec<_>>().join(", ");
        assert!(WALK.contains(&format!("array<u32, 12>({list})")), "{list}");
    }

    /// The balls' triangles are those of the processor's.
    #[test]
    fn balls_are_those_of_the_processor() {
        for ball in [Ball::Icosahedron, Ball::Octahedron] {
            let corners = ball.triangles().into_flattened();
            let word = |corners: &[u32]| corners.iter().rev().fold(0, |word, corner| word << 4 | corner);
            let words: Vec<String> = corners.chunks(8).map(|c| format!("{}u", word(c))).collect();
            let text = format!("array<u32, {}>({})", words.len(), words.join(", "));
            assert!(Id::Balls.pass().text.contains(&text), "{ball:?}: {text}");
            let (vertices, triangles) = ball.counts();
            assert!(BALL.contains(&format!("vec2u({vertices}u, {triangles}u)")));
        }
    }

    /// A shared struct has the same members at the same offsets on the device.
    fn assert_same<T: Twin>(module: &naga::Module) {
        let found = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(T::NAME)).expect("the struct");
        let naga::TypeInner::Struct { members, span } = &found.1.inner else { panic!("{} is no struct", T::NAME) };
        let theirs: Vec<_> = members.iter().map(|m| (m.name.as_deref().unwrap_or_default(), m.offset as usize)).collect();
        assert_eq!((T::OFFSETS, size_of::<T>()), (&theirs[..], *span as usize), "{}", T::NAME);
    }

    #[test]
    fn structs_are_laid_out_as_their_twins() {
        let module = validated("emit", &compose(Id::Emit.pass()));
        assert_same::<Params>(&module);
        assert_same::<SurfaceStatus>(&module);
        assert_same::<Region>(&module);
        assert_same::<Work>(&module);
    }
}
