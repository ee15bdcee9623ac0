//! Mesh and particle files, in millimetres: STL, PLY and OBJ.
//!
//! A file appears whole or not at all: it is written beside its place under another name and then renamed.

use crate::sim::params::Domain;
use crate::sim::snapshot::{Particle, Snapshot};
use crate::surface::mesh::Mesh;
use crate::surface::weld::{Repairs, print_ready};
use glam::Vec3;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Millimetres per metre.
const MM: f32 = 1000.0;

/// Why a file was not written.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The extension names no format that can be written.
    #[error("{}: unknown file extension; known are {known}", path.display())]
    UnknownFormat {
        /// The file asked for.
        path: PathBuf,
        /// The extensions that would do.
        known: &'static str,
    },
    /// The file system refused.
    #[error("{}: cannot be written: {source}", path.display())]
    Io {
        /// The file asked for.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

/// Writes a mesh as separate, closed bodies with outward triangles, vertices [mm]; the format is that of the extension: `stl` (binary),
/// `ply` (binary little-endian) or `obj`. Returns what [`print_ready`] repaired.
///
/// # Errors
/// Another extension, or a file that cannot be written; then nothing is left at `path` that was not there before.
pub fn write_mesh(path: &Path, mesh: &Mesh) -> Result<Repairs, ExportError> {
    let write = match extension(path).as_str() {
        "stl" => write_stl,
        "ply" => write_ply,
        "obj" => write_obj,
        _ => return Err(ExportError::UnknownFormat { path: path.into(), known: ".stl, .ply and .obj" }),
    };
    let (mut mesh, repairs) = print_ready(mesh);
    mesh.positions.iter_mut().flatten().for_each(|x| *x *= MM);
    write_whole(path, |out| write(out, &mesh))?;
    Ok(repairs)
}

/// Writes a snapshot's particles as a binary little-endian PLY point cloud: position x y z [mm], velocity vx vy vz [m/s], volume ratio J,
/// side of the first cut (-1, 0, 1), id.
///
/// # Errors
/// An extension other than `ply`, or a file that cannot be written.
pub fn write_particles(path: &Path, snapshot: &Snapshot) -> Result<(), ExportError> {
    if extension(path) != "ply" {
        return Err(ExportError::UnknownFormat { path: path.into(), known: ".ply" });
    }
    write_whole(path, |out| {
        let fields = ["float x", "float y", "float z", "float vx", "float vy", "float vz", "float J", "char side", "uint id"];
        write_ply_header(out, &format!("vertex {}", snapshot.particles.len()), &fields)?;
        writeln!(out, "end_header")?;
        snapshot.particles.iter().try_for_each(|p| write_particle(out, &snapshot.domain, p))
    })
}

fn extension(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

/// Writes beside `path` and renames.
fn write_whole(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<(), ExportError> {
    let error = |source| ExportError::Io { path: path.into(), source };
    let name = path.file_name().ok_or_else(|| error(io::ErrorKind::InvalidFilename.into()))?;
    let mut temporary = OsString::from(".");
    temporary.push(name);
    temporary.push(format!(".{}.tmp", std::process::id()));
    let temporary = path.with_file_name(temporary);
    let written = File::create(&temporary).and_then(|file| {
        let mut out = BufWriter::new(file);
        write(&mut out)?;
        out.into_inner()?.sync_all()?;
        fs::rename(&temporary, path)
    });
    written.map_err(|source| {
        // The first error is the one to tell; a temporary file that cannot be removed either adds nothing to it.
        let _ = fs::remove_file(&temporary);
        error(source)
    })
}

fn write_stl(out: &mut BufWriter<File>, mesh: &Mesh) -> io::Result<()> {
    let triangle = |t: &[u32; 3]| {
        let corners = t.map(|v| mesh.positions[v as usize]);
        let [a, b, c] = corners.map(Vec3::from_array);
        let normal = (b - a).cross(c - a).try_normalize().unwrap_or(Vec3::ZERO);
        stl_io::Triangle { normal: stl_io::Normal::new(normal.to_array()), vertices: corners.map(stl_io::Vertex::new) }
    };
    stl_io::write_stl(out, mesh.triangles.iter().map(triangle))
}

fn write_ply_header(out: &mut impl Write, element: &str, properties: &[&str]) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0\ncomment lengths in mm\nelement {element}")?;
    properties.iter().try_for_each(|p| writeln!(out, "property {p}"))
}

fn write_ply(out: &mut BufWriter<File>, mesh: &Mesh) -> io::Result<()> {
    write_ply_header(out, &format!("vertex {}", mesh.positions.len()), &["float x", "float y", "float z"])?;
    writeln!(out, "element face {}\nproperty list uchar uint vertex_indices\nend_header", mesh.triangles.len())?;
    for x in mesh.positions.iter().flatten() {
        out.write_all(&x.to_le_bytes())?;
    }
    for t in &mesh.triangles {
        out.write_all(&[3])?;
        t.iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))?;
    }
    Ok(())
}

fn write_obj(out: &mut BufWriter<File>, mesh: &Mesh) -> io::Result<()> {
    writeln!(out, "# lengths in mm")?;
    for [x, y, z] in &mesh.positions {
        writeln!(out, "v {x} {y} {z}")?;
    }
    mesh.triangles.iter().try_for_each(|[a, b, c]| writeln!(out, "f {} {} {}", a + 1, b + 1, c + 1))
}

fn write_particle(out: &mut impl Write, domain: &Domain, particle: &Particle) -> io::Result<()> {
    let position = MM * domain.to_world(particle.grid()).as_vec3();
    let numbers = position.to_array().into_iter().chain(particle.velocity).chain([particle.volume_ratio() as f32]);
    for x in numbers {
        out.write_all(&x.to_le_bytes())?;
    }
    out.write_all(&particle.tags[0].side.to_le_bytes())?;
    out.write_all(&particle.id.to_le_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::material::Preset;
    use crate::sim::params::Walls;
    use crate::sim::snapshot::Tag;
    use crate::surface::check::MeshCheck;
    use crate::surface::extract::extract_field;
    use crate::surface::field::Field;
    use glam::DVec3;

    /// A ball of 5 nodes radius, node spacing 1 m.
    fn ball() -> Mesh {
        let value = |i: i32| 5.2 - (glam::IVec3::new(i % 13, i / 13 % 13, i / 169) - 6).as_vec3().length();
        extract_field(&Field::from_nodes([13; 3], &(0..2197).map(value).collect::<Vec<_>>(), None), 0.0)
    }

    fn assert_same(read: &Mesh, original: &Mesh) {
        let check = MeshCheck::of(read);
        assert!(check.is_closed_manifold() && check.components == 1, "{check:?}");
        let ratio = read.volume() / original.volume() / 1e9;
        assert!((ratio - 1.0).abs() < 1e-3, "volume {ratio} of the original");
    }

    fn directory() -> tempfile::TempDir {
        tempfile::tempdir().expect("a directory")
    }

    #[test]
    fn stl_reads_back_closed_and_in_millimetres() {
        let (dir, mesh) = (directory(), ball());
        let path = dir.path().join("ball.STL");
        write_mesh(&path, &mesh).expect("written");
        let read = stl_io::read_stl(&mut File::open(&path).expect("file")).expect("an STL");
        read.validate().expect("a sound STL");
        let triangles = read.faces.iter().map(|f| f.vertices.map(|v| v as u32)).collect();
        assert_same(&Mesh::new(read.vertices.iter().map(|v| v.0).collect(), triangles), &mesh);
    }

    #[test]
    fn obj_reads_back_closed_and_in_millimetres() {
        let (dir, mesh) = (directory(), ball());
        let path = dir.path().join("ball.obj");
        write_mesh(&path, &mesh).expect("written");
        let (models, _) = tobj::load_obj(&path, &tobj::LoadOptions::default()).expect("an OBJ");
        let read = &models[0].mesh;
        let positions = read.positions.chunks(3).map(|p| [p[0], p[1], p[2]]).collect();
        assert_same(&Mesh::new(positions, read.indices.chunks(3).map(|t| [t[0], t[1], t[2]]).collect()), &mesh);
    }

    /// The PLY body after its header: counts and bytes are as the header says.
    #[test]
    fn ply_reads_back_closed_and_in_millimetres() {
        let (dir, mesh) = (directory(), ball());
        let path = dir.path().join("ball.ply");
        write_mesh(&path, &mesh).expect("written");
        let bytes = fs::read(&path).expect("file");
        let at = bytes.windows(11).position(|w| w == b"end_header\n").expect("a header") + 11;
        let header = String::from_utf8_lossy(&bytes[..at]);
        let count = |name: &str| -> usize {
            let line = header.lines().find_map(|l| l.strip_prefix(&format!("element {name} ")));
            line.and_then(|n| n.parse().ok()).expect("a count")
        };
        let (vertices, faces) = bytes[at..].split_at(12 * count("vertex"));
        assert_eq!(faces.len(), 13 * count("face"));
        let word = |b: &[u8]| <[u8; 4]>::try_from(b).expect("four bytes");
        let positions = vertices.chunks(12).map(|v| [0, 4, 8].map(|i| f32::from_le_bytes(word(&v[i..i + 4])))).collect();
        let triangles = faces.chunks(13).map(|f| [1, 5, 9].map(|i| u32::from_le_bytes(word(&f[i..i + 4])))).collect();
        assert_same(&Mesh::new(positions, triangles), &mesh);
    }

    #[test]
    fn particles_are_written_in_order_with_their_fields() {
        let domain = Domain::new(DVec3::ZERO, DVec3::splat(0.08), 0.01, Walls::default()).expect("domain");
        let mut particle = Particle::at(domain.to_grid(DVec3::new(0.01, 0.02, 0.03)), 1e-9, 77);
        particle.velocity = [1.0, 2.0, 3.0];
        particle.tags[0] = Tag { sheet: 1, side: -1 };
        let particles = vec![particle; 3];
        let snapshot = Snapshot { domain, material: Preset::SoftClay.material(), time: 0.0, particles };
        let dir = directory();
        let path = dir.path().join("particles.ply");
        write_particles(&path, &snapshot).expect("written");
        let bytes = fs::read(&path).expect("file");
        let body = &bytes[bytes.len() - 3 * 33..];
        assert!(bytes[..bytes.len() - 3 * 33].ends_with(b"property uint id\nend_header\n"));
        let number = |i: usize| f32::from_le_bytes([0, 1, 2, 3].map(|k| body[4 * i + k]));
        let expected = [10.0, 20.0, 30.0, 1.0, 2.0, 3.0, 1.0];
        (0..7).for_each(|i| assert!((number(i) - expected[i]).abs() < 1e-4, "number {i}: {}", number(i)));
        assert_eq!(body[28..33], [255, 77, 0, 0, 0]);
        let error = write_particles(&dir.path().join("p.stl"), &snapshot).expect_err("no points in STL");
        assert!(error.to_string().contains("p.stl") && error.to_string().contains(".ply"));
    }

    #[test]
    fn unknown_extension_is_an_error_that_names_file_and_formats() {
        for name in ["ball.gltf", "ball"] {
            let error = write_mesh(Path::new(name), &ball()).expect_err("an unknown format").to_string();
            assert!(error.contains(name) && error.contains(".stl, .ply and .obj"), "{error}");
        }
    }

    /// A write that fails leaves neither a file nor a temporary one, and an old file as it was.
    #[test]
    fn failed_write_leaves_nothing_behind() {
        let dir = directory();
        let path = dir.path().join("old.stl");
        fs::write(&path, "old").expect("written");
        let failing = |out: &mut BufWriter<File>| {
            out.write_all(b"half")?;
            Err(io::ErrorKind::StorageFull.into())
        };
        let error = write_whole(&path, failing).expect_err("a full disk").to_string();
        assert!(error.contains("old.stl"), "{error}");
        assert_eq!(fs::read(&path).expect("file"), b"old");
        assert_eq!(fs::read_dir(dir.path()).expect("directory").count(), 1);
        let missing = dir.path().join("no/such/ball.stl");
        assert!(write_mesh(&missing, &ball()).expect_err("no directory").to_string().contains("ball.stl"));
        // A directory in the file's place: the rename fails.
        fs::create_dir(dir.path().join("taken.stl")).expect("directory");
        write_mesh(&dir.path().join("taken.stl"), &ball()).expect_err("a directory");
        assert_eq!(fs::read_dir(dir.path()).expect("directory").count(), 2);
    }
}
