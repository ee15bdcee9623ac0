//! How Bevy lays out the mesh in its buffers, against how the passes write it. Bevy promises nothing here, so
//! it is looked at in every frame, before anything is written.

use super::drawn::{EDGE_NUMBER, VERTEX_BYTES};
use bevy::mesh::{MeshVertexAttribute, MeshVertexBufferLayout};
use bevy::prelude::*;
use bevy::render::mesh::RenderMesh;
use bevy::render::render_resource::BufferUsages;
use wgpu::{IndexFormat, VertexStepMode};

/// What the passes write, and at which byte of a vertex.
const WRITTEN: [(MeshVertexAttribute, u64); 3] = [(Mesh::ATTRIBUTE_POSITION, 0), (Mesh::ATTRIBUTE_NORMAL, 12), (EDGE_NUMBER, 24)];

/// Checks that the passes may write a mesh into its buffers.
///
/// # Errors
/// How it differs from what they write.
pub(super) fn check_mesh(mesh: &RenderMesh, usages: [BufferUsages; 2]) -> Result<(), String> {
    for (name, usage) in ["vertices", "indices"].iter().zip(usages) {
        if !usage.contains(BufferUsages::STORAGE) {
            return Err(format!("the app's buffers for the {name} of meshes have no usage STORAGE"));
        }
    }
    check_layout(&mesh.layout.0, mesh.index_format())
}

/// Checks the layout of vertices and indices.
fn check_layout(vertices: &MeshVertexBufferLayout, indices: Option<IndexFormat>) -> Result<(), String> {
    let layout = vertices.layout();
    if layout.array_stride != VERTEX_BYTES || layout.step_mode != VertexStepMode::Vertex {
        return Err(format!("a vertex of its mesh has {} bytes, not {VERTEX_BYTES}", layout.array_stride));
    }
    for (attribute, offset) in WRITTEN {
        let place = vertices.attribute_ids().iter().position(|id| *id == attribute.id).and_then(|i| layout.attributes.get(i));
        let is_there = place.is_some_and(|place| (place.format, place.offset) == (attribute.format, offset));
        if !is_there {
            let found = place.map_or_else(|| "is missing".into(), |p| format!("is {:?} at byte {}", p.format, p.offset));
            let (name, format) = (attribute.name, attribute.format);
            return Err(format!("{name} of its mesh {found}, not {format:?} at byte {offset}"));
        }
    }
    match indices {
        Some(IndexFormat::Uint32) => Ok(()),
        Some(other) => Err(format!("indices of its mesh are {other:?}, not Uint32")),
        None => Err("its mesh has no indices".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::drawn::Capacity;
    use super::*;
    use bevy::mesh::{MeshVertexBufferLayouts, VertexBufferLayout, VertexFormat};
    use wgpu::VertexAttribute;

    const UINT32: Option<IndexFormat> = Some(IndexFormat::Uint32);

    /// A layout of these formats at these bytes, for the attributes that the passes write.
    fn laid_out(stride: u64, places: &[(VertexFormat, u64)]) -> MeshVertexBufferLayout {
        let attribute = |(i, (format, offset)): (usize, &(VertexFormat, u64))| VertexAttribute {
            format: *format,
            offset: *offset,
            shader_location: i as u32,
        };
        let attributes = places.iter().enumerate().map(attribute).collect();
        let ids = WRITTEN.iter().map(|(attribute, _)| attribute.id).take(places.len()).collect();
        MeshVertexBufferLayout::new(
            ids,
            VertexBufferLayout { array_stride: stride, step_mode: VertexStepMode::Vertex, attributes },
        )
    }

    /// The layout that Bevy makes of the plugin's meshes is the one that the passes write.
    #[test]
    fn mesh_of_the_plugin_is_laid_out_as_it_is_written() {
        let mesh = Capacity::of_triangles(2).placeholder((Vec3::ZERO, Vec3::ONE));
        let layout = mesh.get_mesh_vertex_buffer_layout(&mut MeshVertexBufferLayouts::default());
        assert_eq!(check_layout(&layout.0, mesh.indices().map(Into::into)), Ok(()));
    }

    /// Whatever differs is named.
    #[test]
    fn other_layouts_are_refused_by_what_differs() {
        use VertexFormat::{Float32x3, Snorm16x2, Snorm16x4, Uint32};
        let usual = [(Float32x3, 0), (Float32x3, 12), (Uint32, 24)];
        let layouts = [
            (28, usual.as_slice(), Some(IndexFormat::Uint16), "indices of its mesh are Uint16"),
            (28, &usual, None, "no indices"),
            (32, &usual, UINT32, "has 32 bytes, not 28"),
            (16, &[(Snorm16x4, 0), (Snorm16x2, 8), (Uint32, 12)], UINT32, "has 16 bytes"),
            (28, &[(Float32x3, 0), (Snorm16x2, 12), (Uint32, 24)], UINT32, "Vertex_Normal of its mesh is Snorm16x2 at byte 12"),
            (28, &[(Float32x3, 16), (Float32x3, 0), (Uint32, 12)], UINT32, "Vertex_Position of its mesh is Float32x3 at byte 16"),
            (28, &[(Float32x3, 0), (Float32x3, 12)], UINT32, "Vertex_ClayEdge of its mesh is missing"),
        ];
        assert_eq!(check_layout(&laid_out(28, &usual), UINT32), Ok(()));
        for (stride, places, indices, part) in layouts {
            let error = check_layout(&laid_out(stride, places), indices).expect_err(part);
            assert!(error.contains(part) && error.lines().count() == 1, "{error}");
        }
    }
}
