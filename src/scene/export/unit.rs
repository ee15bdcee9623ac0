//! The unit of the files: printers take millimetres.

/// Millimetres per metre.
pub(super) const MM: f32 = 1000.0;
