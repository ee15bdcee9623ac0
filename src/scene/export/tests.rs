//! Files of every format, read back.

use super::*;
use crate::scene::import::ImportedMesh;
use crate::sim::material::Preset;
use crate::sim::params::{Domain, Walls};
use crate::sim::snapshot::Particle;
use crate::sim::snapshot::Tag;
use crate::surface::check::MeshCheck;
use crate::surface::extract::extract_field;
use crate::surface::field::Field;
use glam::{DVec3, Vec3};
use std::fs;

/// A ball of 5 nodes radius, node spacing 1 m.
fn ball() -> Mesh {
    let value = |i: i32| 5.2 - (glam::IVec3::new(i % 13, i / 13 % 13, i / 169) - 6).as_vec3().length();
    extract_field(&Field::from_nodes([13; 3], &(0..2197).map(value).collect::<Vec<_>>(), None), 0.0)
}

/// A box about the origin.
fn box_mesh(edge: f32) -> Mesh {
    let positions = (0..8).map(|i| [0, 1, 2].map(|axis| edge * ((i >> axis & 1) as f32 - 0.5))).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    Mesh::new(positions, quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect())
}

/// `mesh` moved along x.
fn at(mesh: &Mesh, x: f32) -> Mesh {
    let mut mesh = mesh.clone();
    mesh.positions.iter_mut().for_each(|p| p[0] += x);
    mesh
}

/// `mesh` inside out.
fn turned(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    mesh.triangles.iter_mut().for_each(|t| t.reverse());
    mesh
}

fn joined(meshes: &[&Mesh]) -> Mesh {
    let mut all = Mesh::default();
    for mesh in meshes {
        let first = all.positions.len() as u32;
        all.positions.extend(&mesh.positions);
        all.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    all
}

/// The mesh of a file, by this crate's own reader, which merges equal positions; in metres.
fn read_back(path: &Path) -> Mesh {
    let read = ImportedMesh::load(path).expect("a mesh file");
    let unit = if extension(path) == "glb" { 1.0 } else { 1e-3 };
    Mesh::new(read.positions.iter().map(|p| (*p * unit).as_vec3().to_array()).collect(), read.triangles)
}

fn assert_same(read: &Mesh, original: &Mesh) {
    let check = MeshCheck::of(read);
    assert!(check.is_closed_manifold() && check.components == 1, "{check:?}");
    let ratio = read.volume() / original.volume();
    assert!((ratio - 1.0).abs() < 1e-3, "volume {ratio} of the original");
}

fn directory() -> tempfile::TempDir {
    tempfile::tempdir().expect("a directory")
}

#[test]
fn every_format_that_can_be_read_reads_back_closed_and_of_the_same_volume() {
    let (dir, mesh) = (directory(), ball());
    for name in ["ball.STL", "ball.ply", "ball.obj", "ball.glb"] {
        let path = dir.path().join(name);
        let report = write_mesh(&path, &mesh).expect("written");
        assert_same(&read_back(&path), &mesh);
        assert_eq!((report.files, report.bodies.len(), report.dropped_bodies), (vec![path], 1, 0));
    }
}

/// By readers of others: `stl_io`, whose check knows the format, and `tobj`.
#[test]
fn readers_of_others_read_stl_and_obj() {
    let (dir, mesh) = (directory(), ball());
    let path = dir.path().join("ball.stl");
    write_mesh(&path, &mesh).expect("written");
    let read = stl_io::read_stl(&mut File::open(&path).expect("file")).expect("an STL");
    read.validate().expect("a sound STL");
    let triangles = read.faces.iter().map(|f| f.vertices.map(|v| v as u32)).collect();
    assert_same(&Mesh::new(read.vertices.iter().map(|v| v.0.map(|x| x / MM)).collect(), triangles), &mesh);
    let path = dir.path().join("two.obj");
    write_mesh(&path, &joined(&[&mesh, &at(&box_mesh(3.0), 20.0)])).expect("written");
    let (models, _) = tobj::load_obj(&path, &tobj::LoadOptions::default()).expect("an OBJ");
    assert_eq!(models.iter().map(|m| &m.name[..]).collect::<Vec<_>>(), ["body_1", "body_2"]);
    let meshes = models.iter().map(|m| {
        let positions = m.mesh.positions.chunks(3).map(|p| [p[0], p[1], p[2]].map(|x| x / MM)).collect();
        Mesh::new(positions, m.mesh.indices.chunks(3).map(|t| [t[0], t[1], t[2]]).collect())
    });
    meshes.zip([mesh, box_mesh(3.0)]).for_each(|(read, original)| assert_same(&read, &original));
}

/// The text of a GLB holds what the specification asks for, by `gltf-json`'s own check; bounds and normals
/// are those of the vertices.
#[test]
fn glb_is_sound_and_has_a_node_per_body() {
    use gltf_json::validation::Validate;
    let dir = directory();
    let path = dir.path().join("two.glb");
    let mut ball = ball();
    ball.compute_normals();
    write_mesh(&path, &joined(&[&at(&box_mesh(3.0), 20.0), &ball])).expect("written");
    let bytes = fs::read(&path).expect("file");
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize;
    assert_eq!((word(8), bytes.len() % 4), (bytes.len(), 0));
    let text = &bytes[20..20 + word(12)];
    let root = gltf_json::Root::from_slice(text).expect("glTF");
    let mut faults = vec![];
    root.validate(&root, gltf_json::Path::new, &mut |path, error| faults.push(format!("{} {error}", path())));
    assert!(faults.is_empty(), "{faults:?}");
    let json: serde_json::Value = serde_json::from_slice(text).expect("JSON");
    assert_eq!((&json["nodes"][0]["name"], &json["nodes"][1]["name"]), (&"body_1".into(), &"body_2".into()));
    assert_eq!(json["scenes"][0]["nodes"], serde_json::json!([0, 1]));
    // The larger body, the ball, comes first; its box spans 10.4 nodes of 1 m.
    let bounds = &json["accessors"][0];
    let width = bounds["max"][1].as_f64().expect("max") - bounds["min"][1].as_f64().expect("min");
    assert!((width - 10.4).abs() < 0.2, "{width} m");
    let count = bounds["count"].as_u64().expect("count") as usize;
    let start = 28 + word(12) + json["bufferViews"][1]["byteOffset"].as_u64().expect("offset") as usize;
    for normal in bytes[start..start + 12 * count].chunks(12) {
        let n = [0, 4, 8].map(|i| f32::from_le_bytes(normal[i..i + 4].try_into().expect("four bytes")));
        assert!((Vec3::from_array(n).length() - 1.0).abs() < 1e-4, "{n:?}");
    }
}

/// The numbers of `name="..."` attributes, in order.
fn attributes(text: &str, element: &str, names: [&str; 3]) -> Vec<[f64; 3]> {
    let number = |line: &str, name: &str| line.split(&format!(" {name}=\"")).nth(1)?.split('"').next()?.parse().ok();
    let lines = text.lines().filter(|l| l.starts_with(element));
    lines.map(|line| names.map(|name| number(line, name).expect("a number"))).collect()
}

#[test]
fn threemf_is_a_package_with_an_object_per_body_in_millimetres() {
    let dir = directory();
    let path = dir.path().join("two.3mf");
    write_mesh(&path, &joined(&[&ball(), &at(&box_mesh(3.0), 20.0)])).expect("written");
    let mut package = zip::ZipArchive::new(File::open(&path).expect("file")).expect("a zip file");
    let mut part = |name: &str| {
        let mut text = String::new();
        io::Read::read_to_string(&mut package.by_name(name).expect(name), &mut text).expect("text");
        text
    };
    assert!(part("[Content_Types].xml").contains("3dmanufacturing-3dmodel+xml"));
    assert!(part("_rels/.rels").contains("Target=\"/3D/3dmodel.model\""));
    let model = part("3D/3dmodel.model");
    assert!(model.contains("<model unit=\"millimeter\""));
    let objects: Vec<&str> = model.split("<object ").skip(1).collect();
    assert_eq!((objects.len(), model.matches("<item ").count()), (2, 2));
    for (object, original) in objects.iter().zip([ball(), box_mesh(3.0)]) {
        let positions = attributes(object, "<vertex ", ["x", "y", "z"]).iter().map(|p| p.map(|x| x as f32 / MM)).collect();
        let triangles = attributes(object, "<triangle ", ["v1", "v2", "v3"]).iter().map(|t| t.map(|v| v as u32)).collect();
        assert_same(&Mesh::new(positions, triangles), &original);
    }
    // Up is +Y here and +Z there: row vectors times the item's matrix.
    let matrix = model.split("transform=\"").nth(1).and_then(|t| t.split('"').next()).expect("a transform");
    let m: Vec<i32> = matrix.split(' ').map(|x| x.parse().expect("a number")).collect();
    assert_eq!((&m[3..6], m.len()), (&[0, 0, 1][..], 12), "{matrix}");
    let columns = [0, 1, 2].map(|i| glam::IVec3::new(m[i], m[3 + i], m[6 + i]).as_vec3());
    assert_eq!(columns[0].cross(columns[1]).dot(columns[2]), 1.0, "a turn, no mirror: {matrix}");
}

/// A format's file of no clay is still one.
#[test]
fn no_clay_gives_sound_empty_files() {
    let dir = directory();
    for format in ExportFormat::ALL {
        let path = dir.path().join(format!("none.{}", format.extension()));
        assert!(write_mesh(&path, &Mesh::default()).expect("written").bodies.is_empty());
        assert!(path.exists());
    }
    let error = ImportedMesh::load(&dir.path().join("none.glb")).expect_err("nothing in it").to_string();
    assert!(error.ends_with("the mesh has no triangles"), "{error}");
    assert!(zip::ZipArchive::new(File::open(dir.path().join("none.3mf")).expect("file")).is_ok());
}

#[test]
fn particles_are_written_in_order_with_their_fields() {
    let domain = Domain::new(DVec3::ZERO, DVec3::splat(0.08), 0.01, Walls::default()).expect("domain");
    let mut particle = Particle::at(domain.to_grid(DVec3::new(0.01, 0.02, 0.03)), 1e-9, 77);
    particle.velocity = [1.0, 2.0, 3.0];
    particle.tags[0] = Tag { sheet: 1, side: -1 };
    let particles = vec![particle; 3];
    let snapshot = Snapshot::new(domain, Preset::SoftClay.material(), particles);
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
    for name in ["ball.gltf", "ball.fbx", "ball"] {
        let error = write_mesh(Path::new(name), &ball()).expect_err("an unknown format").to_string();
        assert!(error.contains(name) && error.contains(".stl, .ply, .obj, .glb or .3mf"), "{error}");
    }
}

/// A write that fails leaves neither a file nor a temporary one, and an old file as it was.
#[test]
fn failed_write_leaves_nothing_behind() {
    let dir = directory();
    let path = dir.path().join("old.stl");
    fs::write(&path, "old").expect("written");
    let failing = |out: &mut BufWriter<&File>| {
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

/// A ball of 5, a box of 3 and one of 1 \[m\], in no order.
fn three_bodies() -> Mesh {
    joined(&[&at(&box_mesh(1.0), 30.0), &ball(), &at(&box_mesh(3.0), 20.0)])
}

#[test]
fn bodies_apart_have_files_of_their_own_by_falling_volume() {
    for format in ExportFormat::ALL {
        let dir = directory();
        let path = dir.path().join(format!("clay.{}", format.extension()));
        let options = ExportOptions { bodies: BodyFiles::Apart, ..ExportOptions::default() };
        let report = write_bodies(&path, &three_bodies(), &options).expect("written");
        let names: Vec<_> = (1..=3).map(|n| dir.path().join(format!("clay-{n}.{}", format.extension()))).collect();
        assert_eq!(report.files, names);
        assert_eq!(fs::read_dir(dir.path()).expect("directory").count(), 3, "{format:?}");
        if format != ExportFormat::ThreeMf {
            let originals = [ball(), box_mesh(3.0), box_mesh(1.0)];
            report.files.iter().zip(originals).for_each(|(file, original)| assert_same(&read_back(file), &original));
        }
    }
}

#[test]
fn small_bodies_are_left_out_only_if_asked_for_and_reported() {
    let dir = directory();
    let path = dir.path().join("clay.stl");
    let report = write_mesh(&path, &three_bodies()).expect("written");
    assert_eq!((report.bodies.len(), report.dropped_bodies, report.dropped_volume), (3, 0, 0.0));
    let options = ExportOptions { volume_min: 27.5, ..ExportOptions::default() };
    let report = write_bodies(&path, &three_bodies(), &options).expect("written");
    assert_eq!((report.bodies.len(), report.dropped_bodies), (1, 2));
    assert!((report.dropped_volume - 28.0).abs() < 1e-4, "{}", report.dropped_volume);
    assert_same(&read_back(&path), &ball());
}

/// A hollow box, with a hollow ball in its hollow: two bodies of a cavity each, and every wall faces away
/// from the clay.
#[test]
fn cavities_belong_to_the_body_around_them() {
    let small = ball();
    let mut pit = box_mesh(2.0);
    pit.positions.iter_mut().flatten().for_each(|x| *x += 6.0);
    let hollow = |edge: f32| {
        let mut mesh = box_mesh(edge);
        mesh.positions.iter_mut().flatten().for_each(|x| *x += 6.0);
        mesh
    };
    let mesh = joined(&[&turned(&hollow(14.0)), &turned(&pit), &small, &hollow(16.0)]);
    let (outer, inner) = (16f64.powi(3) - 14f64.powi(3), small.volume() - 8.0);
    let dir = directory();
    let options = ExportOptions { bodies: BodyFiles::Apart, volume_min: 1.0, ..ExportOptions::default() };
    let report = write_bodies(&dir.path().join("hollow.stl"), &mesh, &options).expect("written");
    assert_eq!(report.bodies.iter().map(|b| b.cavities).collect::<Vec<_>>(), [1, 1]);
    for (file, volume) in report.files.iter().zip([outer, inner]) {
        let read = read_back(file);
        let check = MeshCheck::of(&read);
        assert!(check.is_closed_manifold() && check.components == 2, "{check:?}");
        assert!((read.volume() / volume - 1.0).abs() < 1e-3, "{}: {} of {volume}", file.display(), read.volume());
    }
    // Together the same walls stand.
    let path = dir.path().join("hollow.glb");
    write_mesh(&path, &mesh).expect("written");
    assert!((read_back(&path).volume() / (outer + inner) - 1.0).abs() < 1e-3);
}

/// A hollow ball as it is extracted: one body, whose inner wall faces the hollow, in every format.
#[test]
fn hollow_ball_stays_hollow() {
    let radius = |i: i32| (glam::IVec3::new(i % 13, i / 13 % 13, i / 169) - 6).as_vec3().length();
    let nodes: Vec<f32> = (0..2197).map(|i| 1.3 - (radius(i) - 3.7).abs()).collect();
    let mesh = extract_field(&Field::from_nodes([13; 3], &nodes, None), 0.0);
    let shells: Vec<f64> = mesh.components().iter().map(Mesh::volume).collect();
    assert!(shells.len() == 2 && shells[0] * shells[1] < 0.0, "{shells:?}");
    let dir = directory();
    for name in ["hollow.stl", "hollow.ply", "hollow.obj", "hollow.glb"] {
        let path = dir.path().join(name);
        let report = write_mesh(&path, &mesh).expect("written");
        assert_eq!((report.bodies.len(), report.bodies[0].cavities, report.repairs.was_inverted), (1, 1, false));
        let read = read_back(&path);
        assert!(MeshCheck::of(&read).is_closed_manifold());
        let read: Vec<f64> = read.components().iter().map(Mesh::volume).collect();
        assert!(read[0] > 0.0 && read[1] < 0.0, "{read:?}");
        assert!(((read[0] + read[1]) / (shells[0] + shells[1]) - 1.0).abs() < 1e-3, "{read:?}");
    }
}

/// A shell inside out that is in nothing is no cavity.
#[test]
fn body_inside_out_beside_others_is_turned() {
    let mesh = joined(&[&ball(), &turned(&at(&box_mesh(2.0), 20.0))]);
    let bodies = bodies_of(&mesh);
    assert_eq!(bodies.iter().map(|b| b.cavities).collect::<Vec<_>>(), [0, 0]);
    assert!((bodies[1].mesh.volume() - 8.0).abs() < 1e-4 && (bodies[1].volume - 8.0).abs() < 1e-4);
}

#[test]
fn options_out_of_range_are_refused_before_anything_is_written() {
    let dir = directory();
    let path = dir.path().join("clay.stl");
    for (options, name) in [
        (ExportOptions { volume_min: f64::NAN, ..ExportOptions::default() }, "volume_min"),
        (ExportOptions { volume_min: -1.0, ..ExportOptions::default() }, "volume_min"),
        (ExportOptions { simplify: Some(0.0), ..ExportOptions::default() }, "simplify"),
        (ExportOptions { simplify: Some(f64::INFINITY), ..ExportOptions::default() }, "simplify"),
    ] {
        let error = write_bodies(&path, &ball(), &options).expect_err("refused").to_string();
        assert!(error.contains(name), "{error}");
    }
    assert!(!path.exists());
}

/// One body's place is taken by a folder: the others are written, no temporary file is left, whichever body
/// it is; and so it is where two are taken.
#[test]
fn body_that_fails_costs_no_other() {
    let options = ExportOptions { bodies: BodyFiles::Apart, ..ExportOptions::default() };
    for taken in 1..=3 {
        let dir = directory();
        fs::create_dir(dir.path().join(format!("clay-{taken}.stl"))).expect("directory");
        let export = || write_bodies(&dir.path().join("clay.stl"), &three_bodies(), &options).expect_err("a directory");
        let error = export();
        let text = error.to_string();
        assert!(text.contains(&format!("clay-{taken}.stl: cannot be written: ")), "{text}");
        assert!(text.ends_with("; 2 of 3 bodies are written"), "{text}");
        let ExportError::Bodies { written, others, .. } = error else { panic!("{error}") };
        assert_eq!((written.files.len(), others.len()), (2, 0));
        let volumes = [ball().volume(), 27.0, 1.0];
        let rest = (0..3).filter(|i| i + 1 != taken);
        for ((file, body), volume) in written.files.iter().zip(&written.bodies).zip(rest.map(|i| volumes[i])) {
            assert!((body.volume / volume - 1.0).abs() < 1e-3 && (read_back(file).volume() / volume - 1.0).abs() < 1e-3);
        }
        assert_eq!(fs::read_dir(dir.path()).expect("directory").count(), 3);
        let other = dir.path().join(format!("clay-{}.stl", taken % 3 + 1));
        fs::remove_file(&other).and_then(|()| fs::create_dir(other)).expect("directory");
        let ExportError::Bodies { written, others, .. } = export() else { panic!("two are taken") };
        assert_eq!((written.files.len(), others.len()), (1, 1));
    }
}

#[test]
fn simplified_bodies_are_written_with_fewer_triangles() {
    let dir = directory();
    let path = dir.path().join("clay.ply");
    let options = ExportOptions { simplify: Some(0.05), ..ExportOptions::default() };
    let report = write_bodies(&path, &ball(), &options).expect("written");
    let body = &report.bodies[0];
    println!("{} -> {} triangles", body.triangles_extracted, body.triangles);
    assert!(body.not_simplified.is_none() && 2 * body.triangles < body.triangles_extracted, "{body:?}");
    let read = read_back(&path);
    assert_eq!(read.triangles.len(), body.triangles);
    assert_same(&read, &ball());
}

/// An open mesh cannot be shown to be closed afterwards: it is written as it is, with the reason.
#[test]
fn body_that_fails_the_check_is_written_as_it_was() {
    let dir = directory();
    let path = dir.path().join("open.ply");
    let mut mesh = ball();
    mesh.triangles.pop();
    let options = ExportOptions { simplify: Some(0.05), ..ExportOptions::default() };
    let report = write_bodies(&path, &mesh, &options).expect("written");
    let body = &report.bodies[0];
    assert!(body.not_simplified.as_ref().is_some_and(|r| r.contains("closed manifold")), "{body:?}");
    assert_eq!(read_back(&path).triangles.len(), mesh.triangles.len());
}
