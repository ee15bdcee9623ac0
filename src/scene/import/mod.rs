//! Triangle meshes from OBJ, STL, PLY and glTF files: merged, checked, placed.

mod gltf;
mod obj;
mod ply;
mod soup;
mod stl;

use super::error::SceneError;
use super::line::{named, one_line};
use super::stamp::FileStamp;
use super::text::read_bytes;
use glam::{DQuat, DVec3};
use soup::{BYTES_MAX, Beside, Fault, Soup};
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Mesh file formats that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MeshFormat {
    /// Wavefront OBJ: vertices and faces; everything else is skipped.
    Obj,
    /// STL, ASCII or binary.
    Stl,
    /// PLY 1.0, ASCII or binary of either byte order.
    Ply,
    /// glTF 2.0, binary (`.glb`) or text (`.gltf`): the triangles of the default scene, placed by their
    /// nodes, lengths in metres.
    Gltf,
}

impl MeshFormat {
    /// The format that a file's extension names, upper or lower case.
    pub fn from_path(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "obj" => Some(Self::Obj),
            "stl" => Some(Self::Stl),
            "ply" => Some(Self::Ply),
            "glb" | "gltf" => Some(Self::Gltf),
            _ => None,
        }
    }
}

/// Where a mesh stops being closed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OpenEdges {
    /// Edges that have no partner of the opposite direction.
    pub count: usize,
    /// Connected groups of them.
    pub holes: usize,
    /// Diagonal of the bounding box of the largest group \[m\].
    pub largest: f64,
}

/// A triangle mesh with shared vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ImportedMesh {
    /// Vertex positions \[m\], shape [`vertex_count`, 3].
    pub positions: Vec<DVec3>,
    /// Vertex indices, counter-clockwise seen from outside, shape [`triangle_count`, 3].
    pub triangles: Vec<[u32; 3]>,
    /// Triangles of the file that it had given before, left out: they would count twice in volumes and
    /// winding numbers.
    pub doubled: usize,
}

impl ImportedMesh {
    /// Reads the mesh file at `path`.
    ///
    /// # Errors
    /// A file that is missing, of an unknown extension, damaged, or without triangles.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        Self::load_stamped(path, &mut vec![])
    }

    /// [`Self::load`]; `stamps` gains every file that was read, as it was before.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_stamped(path: &Path, stamps: &mut Vec<FileStamp>) -> Result<Self, SceneError> {
        let file = named(path);
        let Some(format) = MeshFormat::from_path(path) else {
            return Err(SceneError::Mesh {
                file,
                line: None,
                reason: "unknown mesh format; known are .obj, .stl, .ply, .glb and .gltf".into(),
            });
        };
        stamps.push(FileStamp::of(path));
        let mut beside = Beside { folder: path.parent(), stamps };
        Self::read(&read_bytes(path, BYTES_MAX, "mesh")?, format, &file, &mut beside)
    }

    /// Reads a mesh from the bytes of a file; `file` names it in errors. A `.gltf` with buffers in other
    /// files is read by [`Self::load`] alone.
    ///
    /// # Errors
    /// Bytes that are damaged or hold no triangle.
    pub fn from_bytes(bytes: &[u8], format: MeshFormat, file: &str) -> Result<Self, SceneError> {
        Self::read(bytes, format, file, &mut Beside { folder: None, stamps: &mut vec![] })
    }

    fn read(bytes: &[u8], format: MeshFormat, file: &str, beside: &mut Beside) -> Result<Self, SceneError> {
        let soup = match format {
            MeshFormat::Obj => obj::read(bytes),
            MeshFormat::Stl => stl::read(bytes),
            MeshFormat::Ply => ply::read(bytes),
            MeshFormat::Gltf => gltf::read(bytes, beside),
        };
        let fault = |Fault { line, reason }| SceneError::Mesh { file: file.to_string(), line, reason: one_line(&reason) };
        let mesh = Self::merge(&soup.map_err(fault)?);
        if mesh.triangles.is_empty() {
            return Err(fault(Fault::new("the mesh has no triangles")));
        }
        Ok(mesh)
    }

    /// A mesh that a program has: vertex positions \[m\], triangles counter-clockwise seen from outside.
    /// `name` names it in errors.
    ///
    /// # Errors
    /// A position that is not finite, an index out of range, no triangle at all.
    pub fn from_triangles(positions: &[DVec3], triangles: &[[u32; 3]], name: &str) -> Result<Self, SceneError> {
        let fault = |reason: String| SceneError::Mesh { file: name.to_string(), line: None, reason: one_line(&reason) };
        let mut soup = Soup::default();
        positions.iter().try_for_each(|position| soup.push_position(*position)).map_err(fault)?;
        triangles.iter().try_for_each(|triangle| soup.push_polygon(&triangle.map(u64::from))).map_err(fault)?;
        let mesh = Self::merge(&soup);
        if mesh.triangles.is_empty() { Err(fault("the mesh has no triangles".into())) } else { Ok(mesh) }
    }

    /// Merges vertices of equal position; drops vertices without a triangle, triangles of fewer than three
    /// vertices, and all but the first of triangles of the same vertices that face the same way.
    fn merge(soup: &Soup) -> Self {
        let mut mesh = Self::default();
        let mut known = HashMap::new();
        let mut seen = HashSet::new();
        for triangle in &soup.triangles {
            let corners = triangle.map(|i| soup.positions[i as usize]);
            // Adding 0 turns -0 into 0, so that equal numbers have equal bits.
            let keys = corners.map(|p| p.to_array().map(|x| (x + 0.0).to_bits()));
            if keys[0] == keys[1] || keys[1] == keys[2] || keys[2] == keys[0] {
                continue;
            }
            let mut merged = [0; 3];
            for ((index, key), corner) in merged.iter_mut().zip(keys).zip(corners) {
                *index = *known.entry(key).or_insert_with(|| {
                    mesh.positions.push(corner);
                    // Never more than the soup's vertices, whose indices are u32.
                    (mesh.positions.len() - 1) as u32
                });
            }
            if seen.insert(turned_first(merged)) {
                mesh.triangles.push(merged);
            } else {
                mesh.doubled += 1;
            }
        }
        mesh
    }

    /// The three corners of each triangle \[m\].
    pub fn corners(&self) -> impl Iterator<Item = [DVec3; 3]> {
        self.triangles.iter().map(|t| t.map(|i| self.positions[i as usize]))
    }

    /// Low and high corner of the bounding box \[m\].
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        self.positions.iter().fold(none, |(low, high), p| (low.min(*p), high.max(*p)))
    }

    /// Signed volume [m^3]: positive where triangles face outwards. Of an open mesh, the volume with its
    /// holes capped towards the box's middle.
    pub fn volume(&self) -> f64 {
        let (low, high) = self.bounds();
        let middle = (low + high) / 2.0;
        self.corners().map(|c| c.map(|p| p - middle)).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }

    /// Surface area [m^2].
    pub fn area(&self) -> f64 {
        self.corners().map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0).sum()
    }

    /// Turns by `rotation`, then multiplies by `scale` about the origin, then moves by `offset` \[m\].
    pub fn place(&mut self, rotation: DQuat, scale: f64, offset: DVec3) {
        self.positions.iter_mut().for_each(|p| *p = rotation * *p * scale + offset);
    }

    /// Triangles that have another on the same vertices that faces the other way, in pairs: in volumes and
    /// winding numbers the two are nothing.
    pub fn cancelled(&self) -> usize {
        let faces: HashSet<_> = self.triangles.iter().map(|triangle| turned_first(*triangle)).collect();
        self.triangles.iter().filter(|[a, b, c]| faces.contains(&turned_first([*c, *b, *a]))).count() / 2
    }

    /// The mesh's open edges: none where it is closed.
    pub fn open_edges(&self) -> OpenEdges {
        let mut balance: HashMap<(u32, u32), i32> = HashMap::new();
        for &[a, b, c] in &self.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *balance.entry((from.min(to), from.max(to))).or_default() += if from < to { 1 } else { -1 };
            }
        }
        let open: Vec<_> = balance.into_iter().filter(|(_, net)| *net != 0).collect();
        let mut parent: HashMap<u32, u32> = open.iter().flat_map(|((a, b), _)| [(*a, *a), (*b, *b)]).collect();
        for ((a, b), _) in &open {
            let (root_a, root_b) = (root(&mut parent, *a), root(&mut parent, *b));
            parent.insert(root_a, root_b);
        }
        let vertices: Vec<u32> = parent.keys().copied().collect();
        let mut boxes: HashMap<u32, (DVec3, DVec3)> = HashMap::new();
        for vertex in vertices {
            let position = self.positions[vertex as usize];
            let (low, high) = boxes.entry(root(&mut parent, vertex)).or_insert((position, position));
            (*low, *high) = (low.min(position), high.max(position));
        }
        OpenEdges {
            count: open.len(),
            holes: boxes.len(),
            largest: boxes.values().map(|(low, high)| low.distance(*high)).fold(0.0, f64::max),
        }
    }
}

/// A triangle that faces the same way, its least vertex first.
fn turned_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap_or_default()
}

/// The representative of `vertex`'s group, halving the way there.
fn root(parent: &mut HashMap<u32, u32>, mut vertex: u32) -> u32 {
    while let Some(&up) = parent.get(&vertex).filter(|up| **up != vertex) {
        let above = parent.get(&up).copied().unwrap_or(up);
        parent.insert(vertex, above);
        vertex = above;
    }
    vertex
}

#[cfg(test)]
mod tests;
