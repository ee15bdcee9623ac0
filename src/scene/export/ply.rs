//! Binary little-endian PLY: triangles of all bodies, or particles.

use super::unit::MM;
use crate::sim::params::Domain;
use crate::sim::snapshot::{Particle, Snapshot};
use crate::surface::mesh::Mesh;
use std::io::{self, Write};

fn write_header(out: &mut impl Write, element: &str, properties: &[&str]) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment lengths in mm\nelement {element}")?;
    properties.iter().try_for_each(|p| writeln!(out, "property {p}"))
}

/// Writes the triangles of all bodies.
pub(super) fn write(out: &mut impl Write, bodies: &[Mesh]) -> io::Result<()> {
    let vertices: usize = bodies.iter().map(|b| b.positions.len()).sum();
    let faces: usize = bodies.iter().map(|b| b.triangles.len()).sum();
    write_header(out, &format!("vertex {vertices}"), &["float x", "float y", "float z"])?;
    writeln!(out, "element face {faces}\nproperty list uchar uint vertex_indices\nend_header")?;
    for x in bodies.iter().flat_map(|b| b.positions.iter().flatten()) {
        out.write_all(&x.to_le_bytes())?;
    }
    let mut first = 0;
    for body in bodies {
        for t in &body.triangles {
            out.write_all(&[3])?;
            t.iter().try_for_each(|v| out.write_all(&(first + v).to_le_bytes()))?;
        }
        first += body.positions.len() as u32;
    }
    Ok(())
}

/// Writes the particles of a snapshot: see [`super::write_particles`].
pub(super) fn write_particles(out: &mut impl Write, snapshot: &Snapshot) -> io::Result<()> {
    let fields = ["float x", "float y", "float z", "float vx", "float vy", "float vz", "float J", "char side", "uint id"];
    write_header(out, &format!("vertex {}", snapshot.particles.len()), &fields)?;
    writeln!(out, "end_header")?;
    snapshot.particles.iter().try_for_each(|p| write_particle(out, &snapshot.domain, p))
}

fn write_particle(out: &mut impl Write, domain: &Domain, particle: &Particle) -> io::Result<()> {
    let position = MM * domain.to_world(particle.grid()).as_vec3();
    let numbers = position.to_array().into_iter().chain(particle.velocity).chain([particle.volume_ratio() as f32]);
    for x in numbers {
        out.write_all(&x.to_le_bytes())?;
    }
    out.write_all(&particle.tags[0].sign().to_le_bytes())?;
    out.write_all(&particle.id.to_le_bytes())
}
