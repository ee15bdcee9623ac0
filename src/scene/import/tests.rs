//! Readers on good, damaged and random bytes.

use super::super::solid::tests::icosphere;
use super::*;
use proptest::prelude::*;
use std::fmt::Write;

/// A mesh in every variant of every format.
fn files(mesh: &ImportedMesh) -> Vec<(&'static str, MeshFormat, Vec<u8>)> {
    let mut files = vec![("obj", MeshFormat::Obj, obj_text(mesh).into_bytes())];
    files.push(("ascii stl", MeshFormat::Stl, stl_text(mesh).into_bytes()));
    files.push(("binary stl", MeshFormat::Stl, stl_binary(mesh, *b"binary")));
    // A trap: binary, but its header begins as an ASCII file does.
    files.push(("binary stl of solid", MeshFormat::Stl, stl_binary(mesh, *b"solid ")));
    files.push(("ascii ply", MeshFormat::Ply, ply_bytes(mesh, "ascii")));
    files.push(("little ply", MeshFormat::Ply, ply_bytes(mesh, "binary_little_endian")));
    files.push(("big ply", MeshFormat::Ply, ply_bytes(mesh, "binary_big_endian")));
    files.push(("glb", MeshFormat::Gltf, gltf::tests::glb(mesh)));
    files.push(("gltf", MeshFormat::Gltf, gltf::tests::gltf(mesh)));
    files
}

fn obj_text(mesh: &ImportedMesh) -> String {
    let mut text = String::from("# comment\nmtllib none.mtl\no thing\n");
    mesh.positions.iter().for_each(|p| writeln!(text, "v {} {} {} 0.5 0.5 0.5", p.x, p.y, p.z).expect("write"));
    text += "vn 0 1 0\nusemtl none\n";
    mesh.triangles.iter().for_each(|t| writeln!(text, "f {}//1 {}//1 {}//1", t[0] + 1, t[1] + 1, t[2] + 1).expect("write"));
    text
}

fn stl_text(mesh: &ImportedMesh) -> String {
    let mut text = String::from("solid thing\n");
    for corners in mesh.corners() {
        text += "facet normal 0 0 0\nouter loop\n";
        corners.iter().for_each(|p| writeln!(text, "vertex {:e} {:e} {:e}", p.x, p.y, p.z).expect("write"));
        text += "endloop\nendfacet\n";
    }
    text + "endsolid thing\n"
}

fn stl_binary(mesh: &ImportedMesh, start: [u8; 6]) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes[..6].copy_from_slice(&start);
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for corners in mesh.corners() {
        bytes.extend([0; 12]);
        corners.iter().flat_map(|p| p.as_vec3().to_array()).for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

/// Vertices with a byte between their coordinates and faces with a list besides the indices: both to be
/// skipped.
fn ply_bytes(mesh: &ImportedMesh, encoding: &str) -> Vec<u8> {
    let (vertices, faces) = (mesh.positions.len(), mesh.triangles.len());
    let header = format!(
        "ply\nformat {encoding} 1.0\ncomment c\nelement vertex {vertices}\nproperty float x\nproperty uchar red\nproperty double y\n\
         property float z\nelement face {faces}\nproperty list uchar float uv\nproperty list uchar int vertex_indices\nend_header\n"
    );
    let mut bytes = header.into_bytes();
    let is_big = encoding.ends_with("big_endian");
    let put = |bytes: &mut Vec<u8>, number: &[u8]| match is_big {
        true => bytes.extend(number.iter().rev()),
        false => bytes.extend(number),
    };
    for p in &mesh.positions {
        if encoding == "ascii" {
            bytes.extend(format!("{} 7 {} {}\n", p.x, p.y, p.z).bytes());
        } else {
            put(&mut bytes, &(p.x as f32).to_le_bytes());
            put(&mut bytes, &[7]);
            put(&mut bytes, &p.y.to_le_bytes());
            put(&mut bytes, &(p.z as f32).to_le_bytes());
        }
    }
    for t in &mesh.triangles {
        if encoding == "ascii" {
            bytes.extend(format!("1 0.5 3 {} {} {}\n", t[0], t[1], t[2]).bytes());
        } else {
            put(&mut bytes, &[1]);
            put(&mut bytes, &0.5f32.to_le_bytes());
            put(&mut bytes, &[3]);
            t.iter().for_each(|i| put(&mut bytes, &i.to_le_bytes()));
        }
    }
    bytes
}

fn error_of(bytes: &[u8], format: MeshFormat) -> String {
    let text = ImportedMesh::from_bytes(bytes, format, "mesh.x").expect_err("a damaged mesh").to_string();
    assert!(text.starts_with("mesh.x:") && !text.contains('\n') && text.len() < 300, "{text}");
    text
}

#[test]
fn every_format_gives_the_same_mesh() {
    let mesh = icosphere(2, 0.5);
    for (name, format, bytes) in files(&mesh) {
        let read = ImportedMesh::from_bytes(&bytes, format, name).expect(name);
        assert_eq!((read.positions.len(), read.triangles.len()), (mesh.positions.len(), mesh.triangles.len()), "{name}");
        assert_eq!(read.open_edges(), OpenEdges::default(), "{name}");
        assert!((read.volume() / mesh.volume() - 1.0).abs() < 1e-6, "{name}");
    }
}

#[test]
fn polygons_become_fans() {
    let cube = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
                f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf -4 -8 -5 -1\n";
    let mut mesh = ImportedMesh::from_bytes(cube.as_bytes(), MeshFormat::Obj, "cube").expect("cube");
    assert_eq!((mesh.triangles.len(), mesh.open_edges().count), (12, 4), "the last face is turned on purpose");
    mesh = ImportedMesh::from_bytes(cube.replace("-4 -8 -5 -1", "1 5 8 4").as_bytes(), MeshFormat::Obj, "cube").expect("cube");
    assert_eq!((mesh.triangles.len(), mesh.open_edges().count, mesh.volume()), (12, 0, 1.0));
}

#[test]
fn malformed_meshes_are_refused_with_their_line() {
    use MeshFormat::{Obj, Ply, Stl};
    let ply = |body: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n{body}"
        )
    };
    let facet = |vertex: &str| {
        format!("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n{vertex}\nendloop\nendfacet\nendsolid a\n")
    };
    let cases = [
        (Obj, "v 0 0 0\nv 1 0 zero\n".to_string(), ":2: position"),
        (Obj, "v 0 0 0\nv 1 0\n".into(), ":2: position"),
        (Obj, "v 0 0 0\nv nan 0 0\n".into(), ":2: a vertex is not finite"),
        (Obj, "v 0 0 0\nv 1 0 0\nv 1 1 inf\nf 1 2 3\n".into(), ":3: a vertex is not finite"),
        (Obj, "v 0 0 0\nv 1 0 0\nv 1 1 0\n\nf 1 2 4\n".into(), ":5: a face refers to vertex 4, but there are 3"),
        (Obj, "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 0\n".into(), ":4: a face refers to vertex 0"),
        (Obj, "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 x\n".into(), ":4: face parse"),
        (Obj, String::new(), ": the mesh has no triangles"),
        (Stl, String::new(), ": 0 bytes are too few"),
        (Stl, "solid a\nendsolid a\n".into(), ": the mesh has no triangles"),
        (Stl, facet("vertex 1 nan 0"), ": expected finite f32"),
        (Stl, facet("vertex 1 0"), ": vertex f32 f32 f32"),
        (Stl, facet("vortex 1 0 0"), "vortex"),
        (Ply, "plx\n".into(), ":1: a PLY file begins with `ply`"),
        (Ply, "ply\nelement vertex many\n".into(), ":2: `element vertex many`"),
        (Ply, "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nend_header\n".into(), "`vertex` has no property `y`"),
        (Ply, ply("0 0 0\n1 0 0\n1 nan 0\n3 0 1 2\n"), ":12: vertex 3 is not finite"),
        (Ply, ply("0 0 0\n1 0 0\n1 1 0\n3 0 1 3\n"), ":13: a face refers to vertex 4, but there are 3"),
        (Ply, ply("0 0 0\n1 0 0\n1 1 0\n3 0 1\n"), ":13: expected a number for `vertex_indices`"),
        (Ply, ply("0 0 0\n1 0\n"), ":11: expected a number for `z`"),
        (Ply, ply("0 0 0\n1 0 0\n"), ":11: the file ends before all of its 3 `vertex`"),
        (Ply, ply("0 0 0\n1 0 0\n1 1 0\n3 0 0 1\n"), ": the mesh has no triangles"),
    ];
    for (format, text, part) in cases {
        let error = error_of(text.as_bytes(), format);
        assert!(error.contains(part), "`{error}` lacks `{part}`");
    }
}

#[test]
fn binary_meshes_cut_short_or_not_finite_are_refused() {
    let mesh = icosphere(0, 0.5);
    for (name, format, mut bytes) in files(&mesh).into_iter().filter(|f| f.0.starts_with("binary") || f.0.ends_with("le ply")) {
        let error = error_of(&bytes[..bytes.len() - 20], format);
        assert!(error.contains("cut short"), "{name}: {error}");
        let first = match format {
            MeshFormat::Stl => 84 + 12,
            _ => bytes.windows(11).position(|w| w == b"end_header\n").expect("header") + 11,
        };
        bytes[first..first + 4].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(error_of(&bytes, format).contains("not finite"), "{name}");
    }
}

#[test]
fn missing_file_and_unknown_format_are_named() {
    let error = ImportedMesh::load(Path::new("nowhere/thing.obj")).expect_err("missing").to_string();
    assert!(error.starts_with("nowhere/thing.obj: "), "{error}");
    let error = ImportedMesh::load(Path::new("thing.fbx")).expect_err("unknown").to_string();
    assert_eq!(error, "thing.fbx: unknown mesh format; known are .obj, .stl, .ply, .glb and .gltf");
}

#[test]
fn open_edges_count_holes_and_their_size() {
    let mut mesh = icosphere(3, 1.0);
    let far = |t: &[u32; 3], axis: DVec3| !t.iter().any(|i| icosphere(3, 1.0).positions[*i as usize].dot(axis) > 0.97);
    let whole = mesh.triangles.len();
    mesh.triangles.retain(|t| far(t, DVec3::Y) && far(t, DVec3::NEG_X));
    let open = mesh.open_edges();
    assert!(mesh.triangles.len() < whole - 10 && open.holes == 2, "{open:?}");
    assert!(open.count >= 12 && (0.4..1.2).contains(&open.largest), "{open:?}");
}

/// Every truncation and single-byte damage of every valid file gives a mesh or an error, and never a panic.
#[test]
fn damaged_files_never_panic() {
    let mesh = icosphere(0, 0.5);
    for (name, format, bytes) in files(&mesh) {
        for length in 0..bytes.len() {
            let result = ImportedMesh::from_bytes(&bytes[..length], format, name);
            assert!(length >= 100 || result.is_err(), "{name} cut to {length}");
        }
        for at in 0..bytes.len() {
            for flip in [0x01, 0x10, 0x80, 0xff] {
                let mut changed = bytes.clone();
                changed[at] ^= flip;
                drop(ImportedMesh::from_bytes(&changed, format, name));
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        for format in [MeshFormat::Obj, MeshFormat::Stl, MeshFormat::Ply, MeshFormat::Gltf] {
            drop(ImportedMesh::from_bytes(&bytes, format, "random"));
        }
    }

    /// Words of the formats in any order reach deeper than bytes.
    #[test]
    fn random_words_never_panic(words in proptest::collection::vec(0usize..36, 0..80)) {
        const WORDS: [&str; 36] = [
            "v", "f", "\n", "1", "-1", "0", "2/1", "3//9223372036854775807", "-9223372036854775808", "nan", "1e39", "vn", "vt", "solid", "facet",
            "normal", "outer", "loop", "vertex", "endloop", "endfacet", "endsolid", "ply\n", "format ascii 1.0\n", "format binary_little_endian 1.0\n",
            "element vertex 3\n", "element face 18446744073709551615\n", "property float x\n", "property list uchar int vertex_indices\n",
            "property double y\n", "property char z\n", "end_header\n", "\u{0}\u{1}", "255", "4294967295", "g",
        ];
        let text = words.iter().map(|w| WORDS[*w]).collect::<Vec<_>>().join(" ");
        for (format, start) in [(MeshFormat::Obj, ""), (MeshFormat::Stl, "solid a\n"), (MeshFormat::Ply, "ply\n")] {
            drop(ImportedMesh::from_bytes(format!("{start}{text}").as_bytes(), format, "random"));
        }
    }
}
