//! What clay starts from: shapes, meshes, files, clay as it stood.

use crate::scene::file::{Body, ClayScene, MeshBody, Room};
use crate::scene::import::ImportedMesh;
use crate::scene::recording::Recording;
use crate::scene::track::AxisAngle;
use crate::sim::engine::Engine;
use crate::sim::native::NativeEngine;
use crate::sim::snapshot::Snapshot;
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use bevy::prelude::*;
use glam::DVec3;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Cells along the longest edge of clay whose cell width nobody gives: 64,000 particles in a cube.
const CELLS: f64 = 20.0;

/// What a piece of clay starts from.
#[derive(Clone, Debug, PartialEq, Reflect)]
#[reflect(Clone, Debug, PartialEq)]
#[non_exhaustive]
#[expect(clippy::large_enum_variant, reason = "one a clay, and reflection knows no boxes")]
pub enum ClaySource {
    /// A block that stands on the floor, its underside's middle at the entity.
    Block {
        /// Edge lengths \[m\].
        size: DVec3,
    },
    /// A ball that lies on the floor, its lowest point at the entity.
    Ball {
        /// Radius \[m\].
        radius: f64,
    },
    /// The inside of a mesh, where it is: its lowest point is on the floor. The mesh has to be kept in the
    /// main world, and is taken as it is when it is there.
    Mesh(Handle<Mesh>),
    /// The clay of a scene with its room and walls, and not its tools; paths in it are from the current
    /// folder.
    Scene(ClayScene),
    /// The same, of a scene file.
    SceneFile(PathBuf),
    /// Clay as it stood.
    Snapshot(SavedClay),
    /// Clay as it stood at the end of a recorded run, which the CPU engine runs again: that takes as long as
    /// it took.
    Recording(PathBuf),
}

/// A snapshot, shared. Written into Bevy's scenes as text, 155 bytes a particle.
#[derive(Clone, Debug, Reflect)]
#[reflect(opaque, Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SavedClay(pub Arc<Snapshot>);

impl PartialEq for SavedClay {
    /// By identity: comparing particles takes longer than a frame.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl Serialize for SavedClay {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&BASE64_STANDARD.encode(self.0.to_bytes()))
    }
}

impl<'de> Deserialize<'de> for SavedClay {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        let bytes = BASE64_STANDARD.decode(text).map_err(serde::de::Error::custom)?;
        Snapshot::from_bytes(&bytes).map(|clay| Self(Arc::new(clay))).map_err(serde::de::Error::custom)
    }
}

impl ClaySource {
    /// The snapshot, with cells of `cell_width` \[m\] where that is not the source's to say. Takes its time.
    pub(super) fn build(&self, cell_width: Option<f64>, mesh: Option<ImportedMesh>) -> Result<Snapshot, String> {
        let width = |extent: DVec3| cell_width.unwrap_or(extent.max_element() / CELLS);
        let text = |error: crate::scene::error::SceneError| error.to_string();
        match self {
            Self::Block { size } => {
                let body = Body::Box { size: *size, center: DVec3::Y * size.y / 2.0 };
                roomy(body, (DVec3::new(-size.x, 0.0, -size.z) / 2.0, *size), width(*size)).build(Path::new(".")).map_err(text)
            }
            Self::Ball { radius } => {
                let size = DVec3::splat(2.0 * radius);
                let body = Body::Sphere { radius: *radius, center: DVec3::Y * *radius };
                roomy(body, (DVec3::new(-radius, 0.0, -radius), size), width(size)).build(Path::new(".")).map_err(text)
            }
            Self::Mesh(_) => {
                let mesh = mesh.ok_or("the mesh is not there")?;
                let (low, high) = mesh.bounds();
                let (path, center) = ("the mesh".into(), Some((low + high) / 2.0));
                let rotation = AxisAngle::default();
                let body = MeshBody { path, height: None, scale: None, position: None, center, rotation };
                roomy(Body::Mesh(body), (low, high - low), width(high - low)).build_with_mesh(mesh).map_err(text)
            }
            Self::Scene(scene) => scene.build(Path::new(".")).map_err(text),
            Self::SceneFile(path) => {
                let folder = path.parent().unwrap_or(Path::new("."));
                ClayScene::load(path).and_then(|scene| scene.build(folder)).map_err(text)
            }
            Self::Snapshot(saved) => return Ok((*saved.0).clone()),
            Self::Recording(path) => return replay(path),
        }
        .map(|built| {
            built.warnings.iter().for_each(|warning| warn!("{warning}"));
            built.snapshot
        })
    }
}

/// A piece of clay with its lowest corner and its size, in a room that leaves as much space as it takes to
/// every side and above: a hand that works clay spreads it.
fn roomy(body: Body, (low, size): (DVec3, DVec3), cell_width: f64) -> ClayScene {
    let mut scene = ClayScene::new(vec![body], cell_width);
    let extent = size.max_element();
    // Whole cells, so that a block of whole cells stands on nodes.
    let margin = (extent / cell_width).ceil() * cell_width;
    // Of sizes that make no sense there is no room: they are named when the clay is built.
    if margin.is_finite() {
        let margin = DVec3::splat(margin);
        scene.domain = Some(Room { low: low - margin * DVec3::new(1.0, 0.0, 1.0), high: low + size + margin });
    }
    scene
}

/// Clay as it stood at the end of the recording at `path`.
fn replay(path: &Path) -> Result<Snapshot, String> {
    let text = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let mut engine = NativeEngine::new();
    for event in Recording::open(path).map_err(|e| e.to_string())? {
        event.map_err(|e| e.to_string())?.apply(&mut engine).map_err(|e| text(&e))?;
    }
    // A run that was killed may have left frames under way.
    while engine.pending() > 0 {
        engine.wait().map_err(|e| text(&e))?;
    }
    engine.save().map_err(|e| text(&e))
}

/// What Bevy's mesh holds, in the clay's terms.
pub(super) fn imported(mesh: &Mesh) -> Result<ImportedMesh, String> {
    let fault = |error: &dyn std::fmt::Display| format!("the mesh: {error}");
    let positions = mesh.try_attribute(Mesh::ATTRIBUTE_POSITION).map_err(|e| fault(&e))?;
    let corners: Vec<[Vec3; 3]> = if mesh.try_indices_option().map_err(|e| fault(&e))?.is_some() {
        mesh.triangles().map_err(|e| fault(&e))?.map(|triangle| triangle.vertices).collect()
    } else {
        let positions = positions.as_float3().ok_or_else(|| fault(&"positions are no vectors of three numbers"))?;
        positions.chunks_exact(3).map(|corners| [0, 1, 2].map(|i| Vec3::from(corners[i]))).collect()
    };
    let positions: Vec<DVec3> = corners.as_flattened().iter().map(|p| p.as_dvec3()).collect();
    // As many as there are indices, which are u32.
    let triangles: Vec<[u32; 3]> = (0..corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    ImportedMesh::from_triangles(&positions, &triangles, "the mesh").map_err(|e| e.to_string())
}
