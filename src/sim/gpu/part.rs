//! Texts shared by passes.

pub(super) const STATE: &str = include_str!("state.wgsl");
pub(super) const TABLE: &str = include_str!("table.wgsl");
pub(super) const LAW: &str = include_str!("law.wgsl");
pub(super) const TOOL: &str = concat!(include_str!("tool.wgsl"), include_str!("blade.wgsl"));
pub(super) const CONTACT: &str = include_str!("contact.wgsl");
pub(super) const BETWEEN: &str = include_str!("between.wgsl");
pub(super) const MEETING: &str = include_str!("meeting.wgsl");
pub(super) const BOOKS: &str = include_str!("books.wgsl");
pub(super) const SPRINGS: &str = include_str!("springs.wgsl");
pub(super) const EDGE: &str = include_str!("edge.wgsl");
pub(super) const AHEAD: &str = include_str!("ahead.wgsl");
pub(super) const YIELD: &str = include_str!("yield.wgsl");
pub(super) const WALLS: &str = include_str!("walls.wgsl");
pub(super) const ARRIVALS: &str = include_str!("arrivals.wgsl");
/// The classes of each block, read.
pub(super) const CUTS: &str = concat!("@group(0) @binding(16) var<storage, read> cuts: array<u32>;\n", include_str!("cuts.wgsl"));
/// The same, written.
pub(super) const CUTS_WRITTEN: &str =
    concat!("@group(0) @binding(16) var<storage, read_write> cuts: array<u32>;\n", include_str!("cuts.wgsl"));
