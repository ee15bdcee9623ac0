//! glTF files made by hand: what is read, and what is refused by name.

use super::super::{ImportedMesh, MeshFormat};
use super::*;
use crate::scene::solid::tests::icosphere;
use proptest::prelude::*;
use serde_json::{Value, json};

/// The text of a mesh's scene and its numbers: f32 positions, then u32 indices.
fn scene_of(mesh: &ImportedMesh) -> (Value, Vec<u8>) {
    let mut bytes: Vec<u8> = mesh.positions.iter().flat_map(|p| p.as_vec3().to_array()).flat_map(f32::to_le_bytes).collect();
    let positions = bytes.len();
    bytes.extend(mesh.triangles.iter().flatten().flat_map(|v| v.to_le_bytes()));
    let root = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": mesh.positions.len()},
            {"bufferView": 1, "componentType": 5125, "type": "SCALAR", "count": 3 * mesh.triangles.len()},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": positions},
            {"buffer": 0, "byteOffset": positions, "byteLength": bytes.len() - positions},
        ],
        "buffers": [{"byteLength": bytes.len()}],
    });
    (root, bytes)
}

fn glb_of(root: &Value, numbers: &[u8]) -> Vec<u8> {
    let mut text = root.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let word = |n: usize| (n as u32).to_le_bytes();
    let length = 12 + 8 + text.len() + 8 + numbers.len();
    [MAGIC, &word(2), &word(length), &word(text.len()), JSON, &text, &word(numbers.len()), BIN, numbers].concat()
}

/// A mesh as a binary file.
pub(in crate::scene::import) fn glb(mesh: &ImportedMesh) -> Vec<u8> {
    let (root, numbers) = scene_of(mesh);
    glb_of(&root, &numbers)
}

/// A mesh as a text file with its numbers within.
pub(in crate::scene::import) fn gltf(mesh: &ImportedMesh) -> Vec<u8> {
    let (mut root, numbers) = scene_of(mesh);
    root["buffers"][0]["uri"] = format!("data:application/octet-stream;base64,{}", BASE64_STANDARD.encode(numbers)).into();
    root.to_string().into_bytes()
}

fn load(root: &Value, numbers: &[u8]) -> Result<ImportedMesh, String> {
    ImportedMesh::from_bytes(&glb_of(root, numbers), MeshFormat::Gltf, "a.glb").map_err(|e| e.to_string())
}

/// A tetrahedron of volume 1/6.
fn tetrahedron() -> ImportedMesh {
    let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    ImportedMesh { positions, triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], doubled: 0 }
}

fn assert_sound(mesh: &ImportedMesh, volume: f64) {
    assert_eq!(mesh.open_edges().count, 0);
    assert!((mesh.volume() - volume).abs() < 1e-6 * volume, "{} of {volume}", mesh.volume());
}

#[test]
fn nodes_place_their_meshes() {
    let (mut root, numbers) = scene_of(&tetrahedron());
    // Twice as large and moved; mirrored below it, so that the triangles have to be turned; a node of another
    // scene.
    root["nodes"] = json!([
        {"scale": [2, 2, 2], "rotation": [0, 0.707_106_77, 0, 0.707_106_77], "translation": [10, 0, 0], "mesh": 0, "children": [1]},
        {"matrix": [1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, -5, 0, 1], "mesh": 0},
        {"mesh": 0, "translation": [100, 0, 0]},
    ]);
    root["scenes"] = json!([{"nodes": [2]}, {"nodes": [0]}]);
    root["scene"] = json!(1);
    let mesh = load(&root, &numbers).expect("two tetrahedra");
    assert_eq!(mesh.triangles.len(), 8);
    assert_sound(&mesh, 2.0 * 8.0 / 6.0);
    let (low, high) = mesh.bounds();
    // A quarter turn about y takes x to -z and z to x.
    assert!(
        low.distance(DVec3::new(10.0, -12.0, -2.0)) < 1e-5 && high.distance(DVec3::new(12.0, 2.0, 0.0)) < 1e-5,
        "{low} {high}"
    );
    // No default scene: the first one. No scene at all: the nodes that are nobody's children.
    root.as_object_mut().expect("object").remove("scene");
    assert_eq!(load(&root, &numbers).expect("one").bounds().0.x, 100.0);
    root.as_object_mut().expect("object").remove("scenes");
    assert_eq!(load(&root, &numbers).expect("three").triangles.len(), 12);
}

/// Primitives that share their numbers make many triangles out of a small file, whichever way they pass them;
/// they are refused before there are so many.
#[test]
fn scene_of_too_many_triangles_is_refused() {
    let (mut root, numbers) = scene_of(&tetrahedron());
    for (mode, each) in [(4, 4), (5, 10), (6, 10)] {
        let primitive = json!({"attributes": {"POSITION": 0}, "indices": 1, "mode": mode});
        root["meshes"][0]["primitives"] = vec![primitive; 1000].into();
        let read = |vertices, triangles| {
            read_at_most(&glb_of(&root, &numbers), &mut Beside { folder: None, stamps: &mut vec![] }, (vertices, triangles))
        };
        assert_eq!(
            read(4000, 1000 * each).map(|soup| soup.triangles.len() as u64).map_err(|f| f.reason),
            Ok(1000 * each),
            "mode {mode}"
        );
        let reason = |result: Result<Soup, Fault>| result.err().map(|fault| fault.reason).unwrap_or_default();
        let expected = format!("mesh 0, primitive 7: with it the scene has {} triangles, more than {}", 8 * each, 8 * each - 1);
        assert_eq!(reason(read(4000, 8 * each - 1)), expected);
        assert_eq!(reason(read(7, 99_999)), "mesh 0, primitive 1: with it the scene has 8 vertices, more than 7");
    }
    assert!(check_counts(VERTICES_MAX, TRIANGLES_MAX, (VERTICES_MAX, TRIANGLES_MAX)).is_ok());
    assert!(check_counts(0, 3_000_000_000, (VERTICES_MAX, TRIANGLES_MAX)).is_err());
}

#[test]
fn strips_fans_and_bare_vertices_are_triangles() {
    let corners = tetrahedron().positions;
    let numbers = |order: &[usize]| -> Vec<u8> {
        order.iter().flat_map(|&i| corners[i].as_vec3().to_array()).flat_map(f32::to_le_bytes).collect()
    };
    let primitive = |mode: u32, count: usize, offset: usize| {
        let accessor = json!({"bufferView": 0, "byteOffset": offset, "componentType": 5126, "type": "VEC3", "count": count});
        (json!({"attributes": {"POSITION": 0}, "mode": mode}), accessor)
    };
    // A strip around a tetrahedron passes all four faces; a fan about a corner passes the three at it.
    for (mode, order, triangles) in
        [(5, vec![0, 1, 3, 2, 0, 1], 4), (6, vec![3, 0, 1, 2, 0], 3), (4, vec![0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3], 4)]
    {
        let bytes = numbers(&order);
        let (primitive, accessor) = primitive(mode, order.len(), 0);
        let root = json!({
            "asset": {"version": "2.0"}, "nodes": [{"mesh": 0}], "meshes": [{"primitives": [primitive]}], "accessors": [accessor],
            "bufferViews": [{"buffer": 0, "byteLength": bytes.len()}], "buffers": [{"byteLength": bytes.len()}],
        });
        let mesh = load(&root, &bytes).expect("triangles");
        assert_eq!(mesh.triangles.len(), triangles, "mode {mode}");
        if triangles == 4 {
            assert_sound(&mesh, 1.0 / 6.0);
        } else {
            // Two right triangles and an equilateral one of edge sqrt 2.
            let error = mesh.area() - (1.0 + 3f64.sqrt() / 2.0);
            assert!(error.abs() < 1e-6 && mesh.open_edges().holes == 1, "{error}");
        }
    }
}

/// Interleaved vertices, small indices, positions of whole numbers.
#[test]
fn strides_and_component_types_are_followed() {
    let mesh = tetrahedron();
    let mut bytes = vec![];
    for p in &mesh.positions {
        bytes.extend([0xff; 4]);
        p.to_array().iter().for_each(|x| bytes.extend((*x as i16 * i16::MAX).to_le_bytes()));
        bytes.extend([0xff; 2]);
    }
    let start = bytes.len();
    bytes.extend(mesh.triangles.iter().flatten().map(|v| *v as u8));
    let (mut root, _) = scene_of(&mesh);
    root["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    root["bufferViews"] =
        json!([{"buffer": 0, "byteLength": start, "byteStride": 12}, {"buffer": 0, "byteOffset": start, "byteLength": 12}]);
    root["accessors"][0] =
        json!({"bufferView": 0, "byteOffset": 4, "componentType": 5122, "normalized": true, "type": "VEC3", "count": 4});
    root["accessors"][1]["componentType"] = json!(5121);
    root["buffers"][0]["byteLength"] = json!(bytes.len());
    assert_sound(&load(&root, &bytes).expect("a tetrahedron"), 1.0 / 6.0);
    root["accessors"][0]["normalized"] = json!(false);
    assert_sound(&load(&root, &bytes).expect("a large tetrahedron"), f64::from(i16::MAX).powi(3) / 6.0);
}

#[test]
fn side_car_buffers_are_found_beside_the_file() {
    let dir = tempfile::tempdir().expect("a directory");
    let (mut root, numbers) = scene_of(&tetrahedron());
    root["buffers"][0]["uri"] = "my%20numbers.bin".into();
    let path = dir.path().join("a.gltf");
    std::fs::write(&path, root.to_string()).expect("written");
    let error = ImportedMesh::load(&path).expect_err("no side-car file").to_string();
    assert!(error.contains("a.gltf") && error.contains("my numbers.bin"), "{error}");
    std::fs::write(dir.path().join("my numbers.bin"), &numbers).expect("written");
    let mut read = vec![];
    assert_sound(&ImportedMesh::load_stamped(&path, &mut read).expect("a tetrahedron"), 1.0 / 6.0);
    assert_eq!(read.iter().map(FileStamp::path).collect::<Vec<_>>(), [&path, &dir.path().join("my numbers.bin")]);
    let alone = ImportedMesh::from_bytes(root.to_string().as_bytes(), MeshFormat::Gltf, "a.gltf").expect_err("no folder");
    assert!(alone.to_string().contains("side-car"), "{alone}");
    for uri in ["/etc/hostname", "https://example.com/a.bin", "C:\\a.bin"] {
        root["buffers"][0]["uri"] = uri.into();
        std::fs::write(&path, root.to_string()).expect("written");
        let error = ImportedMesh::load(&path).expect_err("elsewhere").to_string();
        assert!(error.contains("no path beside the file"), "{error}");
    }
}

/// Each case changes a sound file in one place and is refused for that.
#[test]
fn what_is_not_read_is_refused_by_name() {
    let (root, numbers) = scene_of(&tetrahedron());
    assert_sound(&load(&root, &numbers).expect("sound as it is"), 1.0 / 6.0);
    let cases: [(&str, Value, &str); 24] = [
        ("/extensionsRequired", json!(["KHR_draco_mesh_compression"]), "compressed by KHR_draco_mesh_compression"),
        ("/extensionsRequired", json!(["EXT_meshopt_compression"]), "compressed by EXT_meshopt_compression"),
        ("/extensionsRequired", json!(["EXT_mesh_gpu_instancing"]), "requires the glTF extension EXT_mesh_gpu_instancing"),
        ("/meshes/0/primitives/0/mode", json!(0), "mesh 0, primitive 0: points"),
        ("/meshes/0/primitives/0/mode", json!(3), "mesh 0, primitive 0: lines"),
        ("/meshes/0/primitives/0/mode", json!(9), "unknown kind of primitive"),
        ("/meshes/0/primitives/0/attributes", json!({}), "no positions"),
        ("/meshes/0/primitives/0/indices", json!(7), "accessor 7 is not there"),
        ("/meshes/0/primitives/0/indices", json!(0), "which are no indices"),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(1), "which are no positions"),
        ("/accessors/0/bufferView", json!(null), "holds no data (compressed"),
        ("/accessors/0/bufferView", json!(9), "no buffer view 9"),
        ("/accessors/0/count", json!(5), "reaches beyond its buffer view"),
        ("/accessors/0/count", json!(u64::MAX), "reaches beyond its buffer view"),
        ("/accessors/0/byteOffset", json!(u64::MAX), "reaches beyond its buffer view"),
        ("/accessors/0/componentType", json!(77), "unknown type"),
        (
            "/accessors/0/sparse",
            json!({"count": 1, "indices": {"bufferView": 1, "componentType": 5125}, "values": {"bufferView": 0}}),
            "sparse",
        ),
        ("/bufferViews/0/byteLength", json!(1000), "reaches beyond the buffer"),
        ("/bufferViews/0/buffer", json!(1), "reaches beyond the buffer"),
        ("/buffers/0/byteLength", json!(1000), "buffer 0: cut short"),
        ("/nodes/0/mesh", json!(4), "mesh 4 is not there"),
        ("/nodes/0/children", json!([0]), "node 0 is in the scene twice"),
        ("/scenes/0/nodes", json!([3]), "node 3 is not there"),
        ("/scene", json!(2), "the default scene 2 is not there"),
    ];
    for (pointer, value, part) in cases {
        let mut changed = root.clone();
        let (parent, name) = pointer.rsplit_once('/').expect("a pointer");
        changed.pointer_mut(parent).expect(pointer)[name] = value;
        let error = load(&changed, &numbers).expect_err(pointer);
        assert!(error.starts_with("a.glb: ") && error.contains(part), "`{error}` lacks `{part}`");
    }
    let mut bytes = glb_of(&root, &numbers);
    let last = bytes.len() - 4;
    bytes[last..].copy_from_slice(&9u32.to_le_bytes());
    let error = ImportedMesh::from_bytes(&bytes, MeshFormat::Gltf, "a.glb").expect_err("an index").to_string();
    assert!(error.contains("an index refers to vertex 9, but there are 4"), "{error}");
}

#[test]
fn damaged_containers_are_refused() {
    let bytes = glb(&icosphere(0, 0.5));
    let change = |at: usize, to: u8| {
        let mut bytes = bytes.clone();
        bytes[at] = to;
        ImportedMesh::from_bytes(&bytes, MeshFormat::Gltf, "a.glb").expect_err("damaged").to_string()
    };
    assert!(change(4, 1).contains("glTF version 1"));
    assert!(change(9, 0xff).contains("cut short"));
    assert!(change(13, 0xff).contains("reaches beyond the file"));
    assert!(change(16, b'X').contains("no chunk of JSON"));
    let text = ImportedMesh::from_bytes(b"{\n\"asset\": 3\n}", MeshFormat::Gltf, "a.gltf").expect_err("damaged").to_string();
    assert!(text.starts_with("a.gltf:2: "), "{text}");
}

/// Every place in a JSON text, as pointers.
fn places(value: &Value, at: &str, all: &mut Vec<String>) {
    all.push(at.to_string());
    match value {
        Value::Object(map) => map.iter().for_each(|(name, value)| places(value, &format!("{at}/{name}"), all)),
        Value::Array(list) => list.iter().enumerate().for_each(|(i, value)| places(value, &format!("{at}/{i}"), all)),
        _ => {}
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Sound JSON with values that do not fit, up to three at a time, gives a mesh or an error of one line.
    #[test]
    fn unfit_values_never_panic(changes in proptest::collection::vec((any::<prop::sample::Index>(), 0usize..20), 1..4)) {
        let (mut root, numbers) = scene_of(&tetrahedron());
        root["bufferViews"][0]["byteStride"] = json!(12);
        root["accessors"][0]["byteOffset"] = json!(0);
        root["accessors"][0]["normalized"] = json!(false);
        root["nodes"][0] = json!({"mesh": 0, "matrix": DMat4::IDENTITY.to_cols_array(), "children": [1]});
        root["nodes"].as_array_mut().expect("nodes").push(json!({"mesh": 0, "translation": [5, 0, 0], "rotation": [0, 0, 0, 1], "scale": [1, 1, 1]}));
        let values = json!([
            null, true, -1, 0, 1, 2, 3, 7, 0.5, 1e300, u64::MAX, u32::MAX, 5120, 5121, 5123, 5125, "VEC4", "", [], {},
        ]);
        for (place, value) in changes {
            let mut all = vec![];
            places(&root, "", &mut all);
            if let Some(target) = root.pointer_mut(place.get(&all).as_str()) {
                *target = values[value].clone();
            }
        }
        if let Err(error) = load(&root, &numbers) {
            prop_assert!(error.starts_with("a.glb:") && !error.contains('\n'), "{error}");
        }
    }
}
