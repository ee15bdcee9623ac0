//! What came of an export.

use crate::surface::stitch::Repairs;
use std::path::PathBuf;

/// What an export did.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ExportReport {
    /// What [`print_ready`](crate::surface::stitch::print_ready) repaired.
    pub repairs: Repairs,
    /// The files written.
    pub files: Vec<PathBuf>,
    /// The bodies written, by falling volume.
    pub bodies: Vec<BodyReport>,
    /// Bodies left out because they are smaller than
    /// [`ExportOptions::volume_min`](super::ExportOptions::volume_min).
    pub dropped_bodies: usize,
    /// Sum of their volumes [m^3].
    pub dropped_volume: f64,
}

/// A body as it was written.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct BodyReport {
    /// Volume [m^3], its cavities taken off.
    pub volume: f64,
    /// Hollows without a way out.
    pub cavities: usize,
    /// Triangles before simplification.
    pub triangles_extracted: usize,
    /// Triangles written.
    pub triangles: usize,
    /// Why the body was written as it was although simplification was asked for.
    pub not_simplified: Option<String>,
}
