//! The passes: their texts, in the order in which a frame runs them. [`super::encode`] dispatches them.

use super::part::{
    AHEAD, ARRIVALS, BETWEEN, BOOKS, CONTACT, CUTS, CUTS_WRITTEN, EDGE, LAW, MEETING, SPRINGS, STATE, TABLE, TOOL, WALLS, YIELD,
};

/// One compute pass: its name, also its entry point and its file's stem, the shared texts it needs, and its
/// own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pass {
    pub name: &'static str,
    pub parts: &'static [&'static str],
    pub text: &'static str,
    /// Whether it is for clay with cuts only.
    pub is_for_cuts: bool,
}

macro_rules! passes {
    ($($id:ident = $name:literal, $cuts:literal, [$($part:ident),*];)*) => {
        /// Names a pass.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub(super) enum Id { $(#[doc = $name] $id),* }

        /// All passes, in the order of [`Id`].
        pub(super) const PASSES: &[Pass] = &[$(Pass {
            name: $name,
            parts: &[$($part),*],
            text: include_str!(concat!($name, ".wgsl")),
            is_for_cuts: $cuts,
        }),*];
    };
}

passes! {
    // Once a submission, once a frame.
    Begin = "begin", false, [];
    Load = "load", false, [STATE, LAW];
    // Re-bin, every few substeps.
    Mark = "mark", false, [STATE];
    ScanSums = "scan_sums", false, [];
    ScanChunks = "scan_chunks", false, [];
    ScanWrite = "scan_write", false, [];
    Slots = "slots", false, [TABLE];
    Count = "count", false, [STATE, TABLE];
    Place = "place", false, [];
    Order = "order", false, [STATE];
    // Substep.
    Clear = "clear", false, [];
    Averaging = "averaging", false, [STATE, LAW];
    Tags = "tags", true, [STATE, TOOL, EDGE, AHEAD];
    Classes = "classes", true, [STATE, TABLE];
    Penalty = "penalty", false, [STATE, TABLE, TOOL, SPRINGS, EDGE, AHEAD, BOOKS, ARRIVALS];
    P2g = "p2g", false, [STATE, TABLE, CUTS];
    Sides = "sides", true, [WALLS, CUTS_WRITTEN];
    Faces = "faces", true, [TABLE, CUTS_WRITTEN, BETWEEN];
    Grid = "grid", false, [TABLE, CUTS, TOOL, BOOKS, BETWEEN, CONTACT, WALLS];
    G2p = "g2p", false, [STATE, TABLE, CUTS, LAW, TOOL, YIELD];
    // Frame's end.
    Weld = "weld", true, [STATE, TABLE, CUTS, LAW, TOOL, MEETING];
    Carry = "carry", true, [STATE, TABLE, CUTS, TOOL, MEETING];
    Support = "support", false, [STATE, TABLE];
    Store = "store", false, [STATE, LAW];
    Total = "total", false, [STATE, LAW];
    Mass = "mass", false, [];
}

impl Id {
    /// The pass.
    pub(super) fn pass(self) -> &'static Pass {
        &PASSES[self as usize]
    }
}
