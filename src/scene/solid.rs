//! Solids to fill with clay: exact inside tests of boxes, balls and cylinders, the winding number of meshes.

use super::import::ImportedMesh;
use super::winding::WindingTree;
use glam::DVec3;

/// A solid in the world, in metres.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Solid {
    /// A block.
    Box {
        /// Low corner \[m\].
        low: DVec3,
        /// High corner \[m\].
        high: DVec3,
    },
    /// A ball.
    Sphere {
        /// Centre \[m\].
        center: DVec3,
        /// Radius \[m\].
        radius: f64,
    },
    /// A cylinder with its axis along Y.
    Cylinder {
        /// Centre \[m\].
        center: DVec3,
        /// Radius \[m\].
        radius: f64,
        /// Height \[m\].
        height: f64,
    },
    /// The inside of a mesh.
    Mesh(Box<MeshSolid>),
}

/// The inside of a mesh: where the size of its winding number exceeds 1/2, so that a mesh turned inside out
/// has the same inside.
#[derive(Clone, Debug)]
pub struct MeshSolid {
    /// The mesh in the world \[m\].
    pub mesh: ImportedMesh,
    tree: WindingTree,
    is_closed: bool,
    orientation: f64,
}

impl MeshSolid {
    /// The inside of `mesh`.
    pub fn new(mesh: ImportedMesh) -> Self {
        let (is_closed, orientation) = (mesh.open_edges().count == 0, mesh.volume().signum());
        Self { tree: WindingTree::new(&mesh), is_closed, orientation, mesh }
    }

    /// 1 where triangles face outwards, -1 where the mesh is inside out.
    pub fn orientation(&self) -> f64 {
        self.orientation
    }

    /// Winding number at `point` \[m\].
    pub fn winding(&self, point: DVec3) -> f64 {
        self.tree.at(point)
    }
}

impl Solid {
    /// Low and high corner of the bounding box \[m\].
    pub fn bounds(&self) -> (DVec3, DVec3) {
        match self {
            Self::Box { low, high } => (*low, *high),
            Self::Sphere { center, radius } => (*center - *radius, *center + *radius),
            Self::Cylinder { center, radius, height } => {
                let half = DVec3::new(*radius, height / 2.0, *radius);
                (*center - half, *center + half)
            }
            Self::Mesh(solid) => solid.mesh.bounds(),
        }
    }

    /// Exact volume [m^3]; none of an open mesh, which has no volume of its own.
    pub fn volume(&self) -> Option<f64> {
        match self {
            Self::Box { low, high } => Some((*high - *low).element_product()),
            Self::Sphere { radius, .. } => Some(4.0 / 3.0 * std::f64::consts::PI * radius.powi(3)),
            Self::Cylinder { radius, height, .. } => Some(std::f64::consts::PI * radius * radius * height),
            Self::Mesh(solid) => solid.is_closed.then(|| solid.mesh.volume().abs()),
        }
    }

    /// Thickness \[m\]: the least extent, or of a mesh twice volume over area where that is less (the thickness
    /// of a sheet).
    pub fn thickness(&self) -> f64 {
        let (low, high) = self.bounds();
        let extent = (high - low).min_element();
        match self {
            Self::Mesh(solid) => extent.min(2.0 * solid.mesh.volume().abs() / solid.mesh.area().max(f64::MIN_POSITIVE)),
            _ => extent,
        }
    }

    /// Whether `point` \[m\] is inside.
    pub fn contains(&self, point: DVec3) -> bool {
        match self {
            Self::Mesh(solid) => solid.winding(point).abs() > 0.5,
            _ => self.depth(point) > 0.0,
        }
    }

    /// Depth \[m\] of `point` below the surface, negative outside, its size never more than the distance to the
    /// surface. Of a mesh, 0: unknown.
    pub fn depth(&self, point: DVec3) -> f64 {
        match self {
            Self::Box { low, high } => (point - *low).min(*high - point).min_element(),
            Self::Sphere { center, radius } => radius - point.distance(*center),
            Self::Cylinder { center, radius, height } => {
                let q = point - *center;
                (radius - q.x.hypot(q.z)).min(height / 2.0 - q.y.abs())
            }
            Self::Mesh(_) => 0.0,
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use std::collections::HashMap;

    /// A ball of triangles: an icosahedron split `levels` times, its vertices at `radius` from the origin.
    pub(in super::super) fn icosphere(levels: u32, radius: f64) -> ImportedMesh {
        let g = (1.0 + 5f64.sqrt()) / 2.0;
        let ring = [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)];
        let corners = |f: fn(f64, f64) -> DVec3| ring.map(|(a, b)| f(a, b).normalize() * radius);
        let mut positions =
            [corners(|a, b| DVec3::new(a, b, 0.0)), corners(|a, b| DVec3::new(0.0, a, b)), corners(|a, b| DVec3::new(b, 0.0, a))]
                .concat();
        let faces = "0 11 5 0 5 1 0 1 7 0 7 10 0 10 11 1 5 9 5 11 4 11 10 2 10 7 6 7 1 8 3 9 4 3 4 2 3 2 6 3 6 8 3 8 9 4 9 5 2 4 11 6 2 10 8 6 7 9 8 1";
        let indices: Vec<u32> = faces.split(' ').map(|w| w.parse().expect("index")).collect();
        let mut triangles: Vec<[u32; 3]> = indices.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        for _ in 0..levels {
            let mut middles = HashMap::new();
            let mut middle = |a: u32, b: u32| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let sum = positions[a as usize] + positions[b as usize];
                    positions.push(sum.normalize() * radius);
                    positions.len() as u32 - 1
                })
            };
            triangles = triangles
                .iter()
                .flat_map(|&[a, b, c]| {
                    let [x, y, z] = [middle(a, b), middle(b, c), middle(c, a)];
                    [[a, x, z], [x, b, y], [z, y, c], [x, y, z]]
                })
                .collect();
        }
        ImportedMesh { positions, triangles, doubled: 0 }
    }

    #[test]
    fn icosphere_is_closed_and_faces_outwards() {
        let mesh = icosphere(3, 2.0);
        assert_eq!((mesh.triangles.len(), mesh.open_edges().count), (1280, 0));
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 8.0;
        assert!((mesh.volume() / exact - 1.0).abs() < 0.01, "{}", mesh.volume() / exact);
    }

    #[test]
    fn mesh_turned_inside_out_has_the_same_inside() {
        let mut mesh = icosphere(2, 1.0);
        mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1));
        assert!(mesh.volume() < 0.0);
        let solid = Solid::Mesh(Box::new(MeshSolid::new(mesh)));
        assert!(solid.contains(DVec3::splat(0.3)) && !solid.contains(DVec3::splat(0.7)));
        assert!(solid.volume().is_some_and(|v| v > 0.0));
    }

    /// Depth never says more than the distance to the surface: stepping by less than it stays on the same
    /// side.
    #[test]
    fn depth_bounds_the_distance_to_the_surface() {
        let (low, high) = (DVec3::new(-1.0, -0.5, -0.7), DVec3::new(0.4, 0.5, 0.9));
        let center = DVec3::new(0.1, 0.0, -0.1);
        let solids = [
            Solid::Box { low, high },
            Solid::Sphere { center, radius: 0.8 },
            Solid::Cylinder { center, radius: 0.6, height: 1.1 },
        ];
        for solid in solids {
            for i in 0..2000 {
                let r = |k: i32| f64::from((i * 7919 + k * 104_729) % 2000) / 1000.0 - 1.0;
                let (point, way) = (DVec3::new(r(1), r(2), r(3)), DVec3::new(r(4), r(5), r(6)).normalize_or_zero());
                let depth = solid.depth(point);
                // Half the points go straight from or to the middle, the way that meets the surface first.
                let way = if i % 2 == 0 { way } else { (point - center).normalize_or_zero() * depth.signum() };
                let there = solid.depth(point + way * depth.abs() * 0.999);
                // On the surface itself the sign is rounding.
                assert!(depth.abs() < 1e-12 || (depth > 0.0) == (there > 0.0), "{solid:?} at {point}: {depth}, {there}");
            }
        }
    }
}
