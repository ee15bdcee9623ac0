//! The surface in files: written in every format, read back by this crate's readers, and sculpted from again.

use crate::lab::{Size, block, room};
use crate::report::Row;
use bevy_clay::scene::prelude::{ClayScene, ExportOptions, ImportedMesh, MeshFormat, write_bodies, write_mesh};
use bevy_clay::scene::resample::surface_source;
use bevy_clay::sim::prelude::*;
use bevy_clay::surface::check::MeshCheck;
use bevy_clay::surface::extract::extract;
use bevy_clay::surface::field::SurfaceSettings;
use bevy_clay::surface::mesh::Mesh;
use glam::{DVec3, IVec3};
use std::path::Path;

/// The demonstration mesh, so that the program needs no folder to run from.
const BUNNY: &[u8] = include_bytes!("../../../../assets/meshes/bunny.obj");
/// How high it is made [m].
const HEIGHT: f64 = 0.08;
/// Formats that this crate reads too, with their units per metre.
const READ_BACK: [(&str, f64); 4] = [("stl", 1e3), ("ply", 1e3), ("obj", 1e3), ("glb", 1.0)];
/// Distance of the simplification [m]: a twentieth of a line of 0.4 mm from a printer's nozzle.
const SIMPLIFY: f64 = 2e-5;

/// The displayed mesh of clay that is filled from a mesh of `folder`, in the words of a scene file.
fn displayed(folder: &Path, body: &str, cell_width: f64) -> Mesh {
    let text = format!("(clay: [Mesh({body})], cell_width: {cell_width})");
    let built = ClayScene::from_ron(&text).and_then(|scene| scene.build(folder)).expect("a sound scene");
    extract(&surface_source(&built.snapshot.domain, &built.snapshot.particles), &SurfaceSettings::default())
}

/// The displayed mesh of the bunny, which is put into `folder` first.
pub fn bunny(folder: &Path, cell_width: f64) -> Mesh {
    std::fs::write(folder.join("bunny.obj"), BUNNY).expect("a writable folder");
    displayed(folder, &format!("path: \"bunny.obj\", height: {HEIGHT}"), cell_width)
}

/// The displayed mesh of a block cut in two by an oblique cut of no width.
pub fn cut_block() -> Mesh {
    let domain = room([20; 3], Wall::Separate);
    let (middle, normal) = (DVec3::splat(10.2), DVec3::new(1.0, 0.3, 0.2).normalize());
    let mut particles = block(DVec3::splat(4.0), IVec3::splat(12));
    for p in &mut particles {
        let distance = (crate::lab::place(p) - middle).dot(normal);
        if distance.abs() < 3.0 {
            p.tags[0] = Tag { sheet: 1, side: if distance < 0.0 { -1 } else { 1 } };
        }
    }
    extract(&surface_source(&domain, &particles), &SurfaceSettings::default())
}

fn read(path: &Path, unit: f64) -> Mesh {
    let mesh = ImportedMesh::load(path).expect("the file just written");
    Mesh::new(mesh.positions.iter().map(|p| (*p / unit).as_vec3().to_array()).collect(), mesh.triangles)
}

/// What keeps a mesh from being as many closed bodies.
fn defects(mesh: &Mesh, bodies: usize) -> f64 {
    let check = MeshCheck::of(mesh);
    let edges = check.open_edges + check.nonmanifold_edges + check.misoriented_edges;
    (edges + check.nonmanifold_vertices + check.components.abs_diff(bodies)) as f64
}

/// Percent by which a volume is off another.
fn percent(volume: f64, of: f64) -> f64 {
    100.0 * (volume / of - 1.0).abs()
}

/// Export -> import in every format, simplification, and mesh -> clay -> mesh -> clay -> mesh.
pub fn round_trips(size: Size) -> Vec<Row> {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let folder = folder.path();
    let cell_width = size.pick(0.0025, 0.002, 0.001);
    let mut rows = vec![];
    let shown = bunny(folder, cell_width);
    for (name, mesh, bodies) in [("bunny", &shown, 1), ("cut block", &cut_block(), 2)] {
        for (format, unit) in READ_BACK {
            let path = folder.join(format!("out.{format}"));
            write_mesh(&path, mesh).expect("a writable folder");
            let back = read(&path, unit);
            let case = format!("{name} as {format}, read back");
            rows.push(Row::at_most(format!("{case}: defects"), defects(&back, bodies), "count", 0.0));
            rows.push(Row::at_most(format!("{case}: volume off"), percent(back.volume(), mesh.volume()), "%", 0.1));
        }
    }
    let path = folder.join("simple.stl");
    let options = ExportOptions { simplify: Some(SIMPLIFY), ..ExportOptions::default() };
    let report = write_bodies(&path, &shown, &options).expect("a writable folder");
    let refused = report.bodies.iter().filter(|b| b.not_simplified.is_some()).count();
    let back = read(&path, 1e3);
    rows.push(Row::at_most("bunny simplified: defects", defects(&back, 1) + refused as f64, "count", 0.0));
    rows.push(Row::at_most("bunny simplified: volume off", percent(back.volume(), shown.volume()), "%", 0.1));
    // From file to file. The bunny that the file holds, at its size as clay:
    let source = ImportedMesh::from_bytes(BUNNY, MeshFormat::Obj, "bunny.obj").expect("the bunny");
    let (low, high) = source.bounds();
    let mut volume = source.volume() * (HEIGHT / (high - low).y).powi(3);
    let mut mesh = shown;
    for trip in 1..=2 {
        let path = folder.join(format!("trip_{trip}.glb"));
        write_mesh(&path, &mesh).expect("a writable folder");
        let written = read(&path, 1.0);
        rows.push(Row::at_most(
            format!("file to clay to file, trip {trip}: volume"),
            percent(written.volume(), volume),
            "%",
            1.0,
        ));
        volume = written.volume();
        if trip == 1 {
            // As it stands, not made as high as the first again.
            mesh = displayed(folder, "path: \"trip_1.glb\"", cell_width);
        }
    }
    rows
}
