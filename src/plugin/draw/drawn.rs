//! A clay whose surface is made on the device: its mesh, the mesh's room, and one frame's work for it.

use super::super::bridge::{Bridge, SharedDevice};
use crate::sim::engine::Deferred;
use crate::sim::frame::SurfaceSource;
use crate::sim::params::Domain;
use crate::surface::field::Tier;
use crate::surface::gpu::{SurfaceKernels, SurfaceStatus};
use bevy::asset::RenderAssetUsages;
use bevy::mesh::{Indices, MeshVertexAttribute, PrimitiveTopology, VertexFormat};
use bevy::prelude::*;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The number of a vertex's edge. With it a vertex has 28 bytes, which hardly any other mesh has: so these
/// meshes have slabs of their own.
pub(super) const EDGE_NUMBER: MeshVertexAttribute =
    MeshVertexAttribute::new("Vertex_ClayEdge", 0x636c_6179_6564_6765, VertexFormat::Uint32);

/// By how much a mesh has more room than the one before.
const CAPACITY_GROWTH: u32 = 4;
/// Vertices for each triangle: half, and a third of that again where blocks meet.
const VERTICES_PER_TRIANGLE: f64 = 0.75;
/// Most of a mesh \[bytes\]: what a binding may have on every device, less what is lost to its alignment.
const PART_MAX: u64 = (128 << 20) - 256;
/// Bytes of a vertex.
pub(super) const VERTEX_BYTES: u64 = 28;

/// Room in a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Capacity {
    vertices: u32,
    indices: u32,
}

impl Capacity {
    /// Room for so many triangles.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a count")]
    pub(super) fn of_triangles(count: u32) -> Self {
        Self { vertices: (f64::from(count) * VERTICES_PER_TRIANGLE) as u32, indices: 3 * count }
    }

    /// Whether so many vertices and triangles find room.
    fn holds(self, [vertices, triangles]: [u32; 2]) -> bool {
        self.vertices >= vertices && self.indices / 3 >= triangles
    }

    /// The least size, this one or a greater, in which so many vertices and triangles find room; none if that
    /// is more than a binding may have.
    pub(super) fn grown(self, counts: [u32; 2]) -> Option<Self> {
        let sizes = std::iter::successors(Some(self.indices / 3), |triangles| triangles.checked_mul(CAPACITY_GROWTH));
        let is_bound = |capacity: &Self| u64::from(capacity.vertices) * VERTEX_BYTES <= PART_MAX;
        sizes.map(Self::of_triangles).take_while(is_bound).find(|capacity| capacity.holds(counts))
    }

    /// A mesh of this size in which nothing is seen, its vertices at the corners of the room.
    pub(super) fn placeholder(self, (low, high): (Vec3, Vec3)) -> Mesh {
        let count = self.vertices as usize;
        let corner = |i: usize| if i.is_multiple_of(2) { low.to_array() } else { high.to_array() };
        Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::RENDER_WORLD)
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, (0..count).map(corner).collect::<Vec<_>>())
            .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, vec![[0.0, 1.0, 0.0]; count])
            .with_inserted_attribute(EDGE_NUMBER, vec![0u32; count])
            .with_inserted_indices(Indices::U32(vec![0; self.indices as usize]))
    }
}

/// What the render world says of a surface.
#[derive(Debug, Default)]
pub(super) struct Told {
    pub(super) status: Option<SurfaceStatus>,
    pub(super) fault: Option<String>,
}

/// A clay whose surface is made on the graphics device.
#[derive(Component, Clone)]
pub(in super::super) struct Drawn {
    pub(super) mesh: Handle<Mesh>,
    pub(super) capacity: Capacity,
    pub(super) tier: Tier,
    pub(super) domain: Domain,
    pub(super) generation: u64,
    pub(super) kernels: SurfaceKernels,
    pub(super) device: SharedDevice,
    pub(super) told: Arc<Mutex<Told>>,
}

impl Drawn {
    pub(super) fn told(&self) -> MutexGuard<'_, Told> {
        self.told.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What went wrong in the render world, once.
    pub(super) fn take_fault(&self) -> Option<String> {
        self.told().fault.take()
    }

    /// The mesh's capacity, or the next one that has the room the surface wants, or must have. The status may
    /// be one of the mesh before.
    ///
    /// # Errors
    /// More than a mesh can have.
    pub(super) fn capacity_wanted(&self) -> Result<Capacity, String> {
        let Some(status) = self.told().status else { return Ok(self.capacity) };
        let capacity = self.capacity.grown(status.wanted).or_else(|| self.capacity.grown(status.least));
        capacity.ok_or_else(|| format!("{} triangles are more than a mesh on the device can have", status.least[1]))
    }

    /// Triangles shown, or to be shown once there is room for them, as far as is known.
    pub(in super::super) fn triangle_count(&self) -> usize {
        self.told().status.map_or(0, |status| status.least[1] as usize)
    }
}

/// One surface to be made in this frame.
pub(super) struct Job {
    pub(super) entity: Entity,
    pub(super) drawn: Drawn,
    pub(super) source: JobSource,
}

/// Where the particles of a surface come from.
pub(super) enum JobSource {
    /// They are on the device.
    Engine(Bridge),
    /// They are with an engine on the processor, in this state; nothing once they were taken from there.
    Processor(u64, Option<Deferred<SurfaceSource>>),
}

#[cfg(test)]
mod tests {
    use super::super::CAPACITY_FIRST;
    use super::*;

    /// By what is needed, in one go; nothing beyond what a binding may have.
    #[test]
    fn capacity_grows_by_need() {
        let needs = |triangles: u32| [triangles / 2, triangles];
        let first = Capacity::of_triangles(CAPACITY_FIRST);
        assert_eq!(first.grown(needs(CAPACITY_FIRST)), Some(first), "enough is enough");
        assert_eq!(first.grown(needs(CAPACITY_FIRST + 1)), Some(Capacity::of_triangles(4 * CAPACITY_FIRST)));
        let next = first.grown(needs(300_000)).expect("a mesh of 300,000 triangles");
        assert_eq!((next.indices, next.grown(needs(300_000))), (3 * 64 * CAPACITY_FIRST, Some(next)));
        assert_eq!(first.grown(needs(8_000_000)), None);
    }
}
