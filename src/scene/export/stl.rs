//! Binary STL, by `stl_io`: all bodies one after the other, for the format knows no bodies.

use crate::surface::mesh::Mesh;
use glam::Vec3;
use std::io::{self, Write};

/// Writes the triangles of all bodies.
pub(super) fn write(out: &mut impl Write, bodies: &[Mesh]) -> io::Result<()> {
    let triangle = |mesh: &Mesh, t: [u32; 3]| {
        let corners = t.map(|v| mesh.positions[v as usize]);
        let [a, b, c] = corners.map(Vec3::from_array);
        let normal = (b - a).cross(c - a).try_normalize().unwrap_or(Vec3::ZERO);
        stl_io::Triangle { normal: stl_io::Normal::new(normal.to_array()), vertices: corners.map(stl_io::Vertex::new) }
    };
    let triangles: Vec<_> = bodies.iter().flat_map(|mesh| mesh.triangles.iter().map(|&t| triangle(mesh, t))).collect();
    stl_io::write_stl(out, triangles.iter())
}
