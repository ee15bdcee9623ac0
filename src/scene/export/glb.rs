//! Binary glTF 2.0: a mesh and a node per body, lengths in metres, Y up.

use crate::surface::mesh::Mesh;
use serde_json::{Value, json};
use std::io::{self, Write};

/// `glTF`, as a little-endian word.
const MAGIC: u32 = 0x4654_6c67;
/// Type of the chunk of text, `JSON`.
const JSON: u32 = 0x4e4f_534a;
/// Type of the chunk of numbers, `BIN`.
const BIN: u32 = 0x004e_4942;
/// glTF's codes of component types and of what a buffer view holds.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// The text and the numbers of a file as they grow.
#[derive(Default)]
struct Content {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Content {
    /// Adds an accessor of `count` elements over 4-byte words and the view it reads; returns its index.
    fn push(&mut self, words: impl Iterator<Item = [u8; 4]>, target: u32, mut accessor: Value) -> usize {
        let start = self.bytes.len();
        words.for_each(|w| self.bytes.extend(w));
        let view = json!({"buffer": 0, "byteOffset": start, "byteLength": self.bytes.len() - start, "target": target});
        accessor["bufferView"] = self.views.len().into();
        self.views.push(view);
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds vectors, one per vertex.
    fn push_vectors(&mut self, vectors: &[[f32; 3]], mut accessor: Value) -> usize {
        accessor["componentType"] = FLOAT.into();
        accessor["type"] = "VEC3".into();
        accessor["count"] = vectors.len().into();
        self.push(vectors.iter().flatten().map(|x| x.to_le_bytes()), ARRAY_BUFFER, accessor)
    }

    /// Adds a body's positions, normals and indices; returns its mesh.
    fn push_body(&mut self, mesh: &Mesh, name: &str) -> Value {
        let shaded = || {
            let mut copy = mesh.clone();
            copy.compute_normals();
            copy.normals.unwrap_or_default()
        };
        let normals = mesh.normals.clone().unwrap_or_else(shaded);
        let fold = |start: f32, pick: fn(f32, f32) -> f32| {
            [0, 1, 2].map(|axis| mesh.positions.iter().map(|p| p[axis]).fold(start, pick))
        };
        let bounds = json!({"min": fold(f32::INFINITY, f32::min), "max": fold(f32::NEG_INFINITY, f32::max)});
        let position = self.push_vectors(&mesh.positions, bounds);
        let normal = self.push_vectors(&normals, json!({}));
        let accessor = json!({"componentType": UNSIGNED_INT, "type": "SCALAR", "count": 3 * mesh.triangles.len()});
        let indices = self.push(mesh.triangles.iter().flatten().map(|v| v.to_le_bytes()), ELEMENT_ARRAY_BUFFER, accessor);
        let attributes = json!({"POSITION": position, "NORMAL": normal});
        json!({"name": name, "primitives": [{"attributes": attributes, "indices": indices, "material": 0}]})
    }
}

/// Writes the bodies as nodes and meshes `body_1`, `body_2`, ...
pub(super) fn write(out: &mut impl Write, bodies: &[Mesh]) -> io::Result<()> {
    let mut content = Content::default();
    let names: Vec<String> = (1..=bodies.len()).map(|n| format!("body_{n}")).collect();
    let meshes: Vec<Value> = bodies.iter().zip(&names).map(|(body, name)| content.push_body(body, name)).collect();
    let nodes: Vec<Value> = names.iter().enumerate().map(|(i, name)| json!({"name": name, "mesh": i})).collect();
    let mut root = json!({
        "asset": {"version": "2.0", "generator": concat!("bevy_clay ", env!("CARGO_PKG_VERSION"))},
    });
    // The specification allows no empty lists.
    if !bodies.is_empty() {
        root["scene"] = 0.into();
        root["scenes"] = json!([{"name": "clay", "nodes": (0..bodies.len()).collect::<Vec<_>>()}]);
        root["nodes"] = nodes.into();
        root["meshes"] = meshes.into();
        // Without one, clay would be a mirror: the default material is bare metal.
        root["materials"] = json!([{"name": "clay", "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.8}}]);
        root["accessors"] = content.accessors.into();
        root["bufferViews"] = content.views.into();
        root["buffers"] = json!([{"byteLength": content.bytes.len()}]);
    }
    let mut text = serde_json::to_vec(&root)?;
    text.resize(text.len().next_multiple_of(4), b' ');
    let chunks: &[(u32, &[u8])] = match bodies {
        [] => &[(JSON, &text)],
        _ => &[(JSON, &text), (BIN, &content.bytes)],
    };
    let too_long = |_| io::Error::new(io::ErrorKind::FileTooLarge, "a GLB file holds at most 4 GiB");
    let length = 12 + chunks.iter().map(|(_, bytes)| 8 + bytes.len()).sum::<usize>();
    let length = u32::try_from(length).map_err(too_long)?;
    [MAGIC, 2, length].iter().try_for_each(|word| out.write_all(&word.to_le_bytes()))?;
    for (kind, bytes) in chunks {
        let length = u32::try_from(bytes.len()).map_err(too_long)?;
        [length, *kind].iter().try_for_each(|word| out.write_all(&word.to_le_bytes()))?;
        out.write_all(bytes)?;
    }
    Ok(())
}
