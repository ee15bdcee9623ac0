//! What the readers of mesh files are given beside bytes, and hand on: vertices and triangles, or a fault.

use crate::scene::stamp::FileStamp;
use glam::DVec3;
use std::path::Path;

/// The longest mesh file [bytes]: ten million triangles in binary STL, more than the finest grid, of 1024
/// cells along an edge, tells apart.
pub(super) const BYTES_MAX: u64 = 512 << 20;

/// What a reader found wrong, before the file's name is known to it.
#[derive(Debug)]
pub(super) struct Fault {
    pub(super) line: Option<usize>,
    pub(super) reason: String,
}

impl Fault {
    pub(super) fn new(reason: impl Into<String>) -> Self {
        Self { line: None, reason: reason.into() }
    }

    pub(super) fn at(line: usize, reason: impl Into<String>) -> Self {
        Self { line: Some(line), reason: reason.into() }
    }
}

/// Where the files that a mesh file names are.
pub(super) struct Beside<'a> {
    /// The mesh file's folder, if it has a place at all.
    pub(super) folder: Option<&'a Path>,
    /// The files that were read.
    pub(super) stamps: &'a mut Vec<FileStamp>,
}

/// Vertices and triangles as a file gives them; indices are in range and coordinates finite.
#[derive(Debug, Default)]
pub(super) struct Soup {
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Soup {
    /// Adds a vertex, unless a coordinate is not a finite f32: larger ones would overflow the sums over a
    /// mesh.
    pub(super) fn push_position(&mut self, position: DVec3) -> Result<(), String> {
        if !position.as_vec3().is_finite() {
            return Err(format!("vertex {} is not finite: {position}", self.positions.len() + 1));
        }
        self.positions.push(position);
        Ok(())
    }

    /// Adds a convex polygon as a fan of triangles.
    pub(super) fn push_polygon(&mut self, polygon: &[u64]) -> Result<(), String> {
        let index = |i: &u64| match u32::try_from(*i) {
            Ok(i) if (i as usize) < self.positions.len() => Ok(i),
            _ => Err(format!("a face refers to vertex {}, but there are {}", i.saturating_add(1), self.positions.len())),
        };
        let corners = polygon.iter().map(index).collect::<Result<Vec<_>, _>>()?;
        if let [first, rest @ ..] = corners.as_slice() {
            self.triangles.extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
        }
        Ok(())
    }
}
