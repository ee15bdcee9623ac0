//! OBJ: an object per body.

use crate::surface::mesh::Mesh;
use std::io::{self, Write};

/// Writes the bodies as `body_1`, `body_2`, ...
pub(super) fn write(out: &mut impl Write, bodies: &[Mesh]) -> io::Result<()> {
    writeln!(out, "# lengths in mm")?;
    // Indices count from 1 over the whole file.
    let mut first = 1;
    for (number, body) in (1..).zip(bodies) {
        writeln!(out, "o body_{number}")?;
        for [x, y, z] in &body.positions {
            writeln!(out, "v {x} {y} {z}")?;
        }
        body.triangles.iter().try_for_each(|t| {
            let [a, b, c] = t.map(|v| v as usize + first);
            writeln!(out, "f {a} {b} {c}")
        })?;
        first += body.positions.len();
    }
    Ok(())
}
