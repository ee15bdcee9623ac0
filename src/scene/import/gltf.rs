//! glTF 2.0, binary (`.glb`) and text (`.gltf`) with embedded or side-car buffers: the triangles of the
//! default scene, in metres.
//!
//! `gltf-json` reads the text; data are read here, every index and range checked, since the `gltf` crate
//! takes files for valid. Skins, morph targets and animations are left at their start: the mesh is read as
//! its nodes place it.

use super::super::stamp::FileStamp;
use super::super::text::read_bytes;
use super::soup::{BYTES_MAX, Beside, Fault, Soup};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use glam::{DMat4, DQuat, DVec3};
use gltf_json::accessor::{ComponentType, Type};
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::validation::Checked::{self, Valid};
use gltf_json::{Accessor, Buffer, Index, Node, Root, buffer};
use std::borrow::Cow;
use std::path::{Component, Path};

/// First bytes of a binary file.
const MAGIC: &[u8] = b"glTF";
/// Types of a binary file's chunks.
const JSON: &[u8] = b"JSON";
const BIN: &[u8] = b"BIN\0";
/// Extensions that hide geometry in a compressed form.
const COMPRESSIONS: [&str; 3] = ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];
/// Beginnings of the names of extensions that say nothing about geometry, and of the one that lets it be
/// whole numbers, which are read.
const HARMLESS: [&str; 6] =
    ["KHR_mesh_quantization", "KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "KHR_animation_pointer"];

/// Most vertices of a scene, 3 GiB of them: nodes that place a mesh again and again make many out of a small
/// file.
const VERTICES_MAX: u64 = 1 << 27;
/// Most triangles of a scene, 3 GiB of them: two for each of as many vertices, as closed meshes have.
/// Primitives that share their indices make many out of a small file.
const TRIANGLES_MAX: u64 = 1 << 28;

/// Refuses a scene of more vertices or triangles than `most`, before there are so many.
fn check_counts(vertices: u64, triangles: u64, most: (u64, u64)) -> Result<(), String> {
    for (count, most, what) in [(vertices, most.0, "vertices"), (triangles, most.1, "triangles")] {
        if count > most {
            return Err(format!("with it the scene has {count} {what}, more than {most}"));
        }
    }
    Ok(())
}

/// A binary file's text and numbers; a text file as it is.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), Fault> {
    if !bytes.starts_with(MAGIC) {
        return Ok((bytes, None));
    }
    let word = |at: usize| {
        let word = bytes.get(at..at + 4).and_then(|b| <[u8; 4]>::try_from(b).ok());
        word.map(u32::from_le_bytes).ok_or_else(|| Fault::new("the file is cut short within its header"))
    };
    if word(4)? != 2 {
        return Err(Fault::new(format!("glTF version {}: only 2 is read", word(4)?)));
    }
    let (mut at, length) = (12, word(8)? as usize);
    if length > bytes.len() {
        return Err(Fault::new(format!("the file is cut short: {length} bytes announced, {} there", bytes.len())));
    }
    let (mut text, mut numbers) = (None, None);
    while at + 8 <= length {
        let (size, kind) = (word(at)? as usize, &bytes[at + 4..at + 8]);
        let data = bytes[..length].get(at + 8..).and_then(|rest| rest.get(..size));
        let data = data.ok_or_else(|| Fault::new(format!("a chunk of {size} bytes reaches beyond the file")))?;
        match kind {
            JSON if text.is_none() => text = Some(data),
            BIN if numbers.is_none() => numbers = Some(data),
            // Chunks of other kinds are to be skipped.
            _ => {}
        }
        at += 8 + size.next_multiple_of(4);
    }
    text.map(|text| (text, numbers)).ok_or_else(|| Fault::new("the file has no chunk of JSON"))
}

/// Reads the triangles of a glTF file and of the files `beside` it.
pub(super) fn read(bytes: &[u8], beside: &mut Beside) -> Result<Soup, Fault> {
    read_at_most(bytes, beside, (VERTICES_MAX, TRIANGLES_MAX))
}

/// [`read`] with other bounds of vertices and triangles.
fn read_at_most(bytes: &[u8], beside: &mut Beside, most: (u64, u64)) -> Result<Soup, Fault> {
    let (text, numbers) = chunks(bytes)?;
    let is_text = !bytes.starts_with(MAGIC);
    let root = Root::from_slice(text).map_err(|e| Fault { line: is_text.then_some(e.line()), reason: e.to_string() })?;
    for name in &root.extensions_required {
        if COMPRESSIONS.contains(&name.as_str()) {
            return Err(Fault::new(format!(
                "the mesh is compressed by {name}, which is not read; export it without compression"
            )));
        }
        if !HARMLESS.iter().any(|start| name.starts_with(start)) {
            return Err(Fault::new(format!("the file requires the glTF extension {name}, which is not read")));
        }
    }
    let buffer = |(i, b): (usize, &Buffer)| load_buffer(b, numbers.filter(|_| i == 0), beside, i);
    let buffers = root.buffers.iter().enumerate().map(buffer).collect::<Result<_, _>>()?;
    let mut reader = Reader { root: &root, buffers, most, soup: Soup::default() };
    reader.read_scene()?;
    Ok(reader.soup)
}

/// The bytes of a buffer: the binary chunk's, those in its URI, or a file's.
fn load_buffer<'a>(buffer: &Buffer, chunk: Option<&'a [u8]>, beside: &mut Beside, index: usize) -> Result<Cow<'a, [u8]>, Fault> {
    let fault = |reason: String| Fault::new(format!("buffer {index}: {reason}"));
    let bytes = match (&buffer.uri, chunk) {
        (None, Some(chunk)) => Cow::Borrowed(chunk),
        // Nothing reads a buffer without data but a fallback of a compression.
        (None, None) => return Ok(Cow::default()),
        (Some(uri), _) => match uri.strip_prefix("data:") {
            Some(data) => {
                let (_, text) = data.split_once(";base64,").ok_or_else(|| fault("a data URI that is not base64".into()))?;
                Cow::Owned(BASE64_STANDARD.decode(text).map_err(|e| fault(e.to_string()))?)
            }
            None => {
                let folder = beside.folder.ok_or_else(|| fault(format!("the side-car file {uri} has no folder to be in")))?;
                let name = percent_decoded(uri);
                let is_plain = |c: Component| matches!(c, Component::Normal(_) | Component::ParentDir | Component::CurDir);
                if name.contains(':') || !Path::new(&name).components().all(is_plain) {
                    return Err(fault(format!("`{uri}` is no path beside the file")));
                }
                let path = folder.join(&name);
                beside.stamps.push(FileStamp::of(&path));
                Cow::Owned(read_bytes(&path, BYTES_MAX, "mesh").map_err(|e| fault(e.to_string()))?)
            }
        },
    };
    if (bytes.len() as u64) < buffer.byte_length.0 {
        return Err(fault(format!("cut short: {} bytes announced, {} there", buffer.byte_length.0, bytes.len())));
    }
    Ok(bytes)
}

/// A URI's path with `%20` and the like as the characters they stand for.
fn percent_decoded(uri: &str) -> String {
    let digit = |b: Option<&u8>| b.and_then(|b| char::from(*b).to_digit(16));
    let (bytes, mut out, mut i) = (uri.as_bytes(), Vec::new(), 0);
    while let Some(&byte) = bytes.get(i) {
        match (byte, digit(bytes.get(i + 1)), digit(bytes.get(i + 2))) {
            (b'%', Some(high), Some(low)) => {
                out.push((16 * high + low) as u8);
                i += 3;
            }
            _ => {
                out.push(byte);
                i += 1;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

/// A node's place in its parent.
fn transform(node: &Node) -> DMat4 {
    match node.matrix {
        Some(matrix) => DMat4::from_cols_array(&matrix.map(f64::from)),
        None => {
            let vector = |v: Option<[f32; 3]>, or: f32| DVec3::from_array(v.unwrap_or([or; 3]).map(f64::from));
            let rotation = DQuat::from_array(node.rotation.unwrap_or_default().0.map(f64::from));
            // A rotation of no length turns nothing.
            let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
            DMat4::from_scale_rotation_translation(vector(node.scale, 1.0), rotation, vector(node.translation, 0.0))
        }
    }
}

/// A glTF file under way.
struct Reader<'a> {
    root: &'a Root,
    buffers: Vec<Cow<'a, [u8]>>,
    /// Most vertices and triangles.
    most: (u64, u64),
    soup: Soup,
}

impl Reader<'_> {
    /// The default scene; else the first; else every node that is nobody's child.
    fn read_scene(&mut self) -> Result<(), Fault> {
        let root = self.root;
        let children = |node: &Node| node.children.clone().unwrap_or_default();
        let scene = match root.scene {
            Some(index) => Some(root.get(index).ok_or_else(|| missing("the default scene", index.value()))?),
            None => root.scenes.first(),
        };
        let tops: Vec<usize> = match scene {
            Some(scene) => scene.nodes.iter().map(Index::value).collect(),
            None => {
                let mut is_child = vec![false; root.nodes.len()];
                let all = root.nodes.iter().flat_map(children).map(|i| i.value());
                all.filter(|&i| i < root.nodes.len()).for_each(|i| is_child[i] = true);
                (0..root.nodes.len()).filter(|&i| !is_child[i]).collect()
            }
        };
        let mut is_seen = vec![false; root.nodes.len()];
        let mut waiting: Vec<(usize, DMat4)> = tops.into_iter().rev().map(|i| (i, DMat4::IDENTITY)).collect();
        while let Some((index, parent)) = waiting.pop() {
            let node = root.nodes.get(index).ok_or_else(|| missing("node", index))?;
            // Nodes form trees; a loop would never end.
            if std::mem::replace(&mut is_seen[index], true) {
                return Err(Fault::new(format!("node {index} is in the scene twice")));
            }
            let place = parent * transform(node);
            if let Some(mesh) = node.mesh {
                self.read_mesh(mesh.value(), place)?;
            }
            waiting.extend(children(node).iter().rev().map(|child| (child.value(), place)));
        }
        Ok(())
    }

    fn read_mesh(&mut self, index: usize, place: DMat4) -> Result<(), Fault> {
        let mesh = self.root.meshes.get(index).ok_or_else(|| missing("mesh", index))?;
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            let fault = |reason: String| Fault::new(format!("mesh {index}, primitive {number}: {reason}"));
            self.read_primitive(primitive, place).map_err(fault)?;
        }
        Ok(())
    }

    fn read_primitive(&mut self, primitive: &Primitive, place: DMat4) -> Result<(), String> {
        let mode = match primitive.mode {
            Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
            Valid(Mode::Points) => return Err("points enclose nothing; only triangles are read".into()),
            Valid(_) => return Err("lines enclose nothing; only triangles are read".into()),
            Checked::Invalid => return Err("an unknown kind of primitive".into()),
        };
        let positions = primitive.attributes.get(&Valid(Semantic::Positions)).ok_or("no positions")?;
        let positions = self.numbers(*positions, Type::Vec3)?;
        let first = self.soup.positions.len() as u64;
        let count = (positions.len() / 3) as u64;
        let triangles = self.soup.triangles.len() as u64;
        check_counts(first + count, triangles, self.most)?;
        for p in positions.chunks_exact(3) {
            self.soup.push_position(place.transform_point3(DVec3::new(p[0], p[1], p[2])))?;
        }
        let indices: Vec<u64> = match primitive.indices {
            // A number that is no index is beyond any vertex.
            Some(indices) => self.numbers(indices, Type::Scalar)?.into_iter().map(|i| i as u64).collect(),
            None => (0..count).collect(),
        };
        if let Some(index) = indices.iter().find(|i| **i >= count) {
            return Err(format!("an index refers to vertex {index}, but there are {count}"));
        }
        let corners = indices.len() as u64;
        let added = if mode == Mode::Triangles { corners / 3 } else { corners.saturating_sub(2) };
        check_counts(first + count, triangles + added, self.most)?;
        let is_mirrored = place.determinant() < 0.0;
        let mut push = |[a, b, c]: [u64; 3]| {
            let corners = if is_mirrored { [a, c, b] } else { [a, b, c] };
            self.soup.push_polygon(&corners.map(|i| first + i))
        };
        match mode {
            Mode::TriangleStrip => indices.windows(3).enumerate().try_for_each(|(i, w)| {
                // Every other triangle of a strip is passed the other way.
                push(if i % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] })
            }),
            Mode::TriangleFan => indices.get(1..).unwrap_or_default().windows(2).try_for_each(|w| push([w[0], w[1], indices[0]])),
            _ => indices.chunks_exact(3).try_for_each(|t| push([t[0], t[1], t[2]])),
        }
    }

    /// The numbers of an accessor, its elements one after the other.
    fn numbers(&self, index: Index<Accessor>, kind: Type) -> Result<Vec<f64>, String> {
        let name = format!("accessor {}", index.value());
        let accessor = self.root.get(index).ok_or_else(|| format!("{name} is not there"))?;
        let (Valid(found), Valid(component)) = (&accessor.type_, &accessor.component_type) else {
            return Err(format!("{name} is of an unknown type"));
        };
        let component = component.0;
        let is_index = kind == Type::Scalar;
        let is_unsigned = matches!(component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        if *found != kind || is_index && !is_unsigned || !is_index && component == ComponentType::U32 {
            return Err(format!(
                "{name} is of {component:?} {found:?}, which are no {}",
                if is_index { "indices" } else { "positions" }
            ));
        }
        if accessor.sparse.is_some() {
            return Err(format!("{name} is sparse, which is not read"));
        }
        let view = accessor.buffer_view.ok_or_else(|| format!("{name} holds no data (compressed meshes are not read)"))?;
        let view = self.root.get(view).ok_or_else(|| format!("{name} has no buffer view {}", view.value()))?;
        let offset = accessor.byte_offset.unwrap_or_default().0;
        let parts = if is_index { 1 } else { 3 };
        let element = parts * component.size();
        let stride = view.byte_stride.map_or(element, |s| s.0).max(element);
        let data = self.view(view).ok_or_else(|| format!("{name}: its buffer view reaches beyond the buffer"))?;
        let count = accessor.count.0;
        let end = count.checked_sub(1).map_or(Some(0), |n| n.checked_mul(stride as u64)?.checked_add(element as u64));
        let is_held = end.and_then(|end| end.checked_add(offset)).is_some_and(|end| end <= data.len() as u64);
        if !is_held {
            return Err(format!("{name} reaches beyond its buffer view: {count} elements in {} bytes", data.len()));
        }
        let at = |i: usize| offset as usize + i / parts * stride + i % parts * component.size();
        // In range, and so within memory: the last element's end was checked.
        Ok((0..count as usize * parts).map(|i| number(&data[at(i)..], component, accessor.normalized)).collect())
    }

    /// The bytes of a buffer view.
    fn view(&self, view: &buffer::View) -> Option<&[u8]> {
        let data = self.buffers.get(view.buffer.value())?;
        let start = usize::try_from(view.byte_offset.unwrap_or_default().0).ok()?;
        data.get(start..)?.get(..usize::try_from(view.byte_length.0).ok()?)
    }
}

fn missing(what: &str, index: usize) -> Fault {
    Fault::new(format!("{what} {index} is not there"))
}

/// The number at the start of `bytes`; normalized ones as the specification has it (section 3.11).
fn number(bytes: &[u8], component: ComponentType, is_normalized: bool) -> f64 {
    let mut word = [0; 4];
    word[..component.size()].copy_from_slice(&bytes[..component.size()]);
    let [a, b, ..] = word;
    let (value, most) = match component {
        ComponentType::I8 => (f64::from(i8::from_le_bytes([a])), f64::from(i8::MAX)),
        ComponentType::U8 => (f64::from(a), f64::from(u8::MAX)),
        ComponentType::I16 => (f64::from(i16::from_le_bytes([a, b])), f64::from(i16::MAX)),
        ComponentType::U16 => (f64::from(u16::from_le_bytes([a, b])), f64::from(u16::MAX)),
        ComponentType::U32 => (f64::from(u32::from_le_bytes(word)), f64::from(u32::MAX)),
        ComponentType::F32 => return f64::from(f32::from_le_bytes(word)),
    };
    if is_normalized { (value / most).max(-1.0) } else { value }
}

#[cfg(test)]
pub(super) mod tests;
