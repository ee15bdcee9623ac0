//! Triangle meshes and what can be measured on them.

use crate::sim::disjoint::DisjointSets;
use glam::{DVec3, Vec3};

/// An indexed triangle mesh; triangles are counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions \[m\], shape `[n, 3]`.
    pub positions: Vec<[f32; 3]>,
    /// Vertex indices, shape `[m, 3]`.
    pub triangles: Vec<[u32; 3]>,
    /// Outward unit normals per vertex, shape `[n, 3]`.
    pub normals: Option<Vec<[f32; 3]>>,
}

impl Mesh {
    /// A mesh without normals.
    pub fn new(positions: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        Self { positions, triangles, normals: None }
    }

    /// The three corners of a triangle \[m\].
    pub fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|v| Vec3::from_array(self.positions[v as usize]).as_dvec3())
    }

    /// Signed enclosed volume [m^3]: positive where triangles face outwards.
    pub fn volume(&self) -> f64 {
        // About a point of the mesh: a body far from the origin loses no digits.
        let base = self.positions.first().map_or(DVec3::ZERO, |&p| Vec3::from_array(p).as_dvec3());
        let sum: f64 = self
            .triangles
            .iter()
            .map(|&t| {
                let [a, b, c] = self.corners(t).map(|p| p - base);
                a.dot(b.cross(c))
            })
            .sum();
        sum / 6.0
    }

    /// Surface area [m^2].
    pub fn area(&self) -> f64 {
        self.triangles.iter().map(|&t| self.area_vector(t).length()).sum()
    }

    /// Area [m^2] times the unit normal of a triangle.
    pub fn area_vector(&self, triangle: [u32; 3]) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a) / 2.0
    }

    /// Low and high corner of the vertices \[m\]; `None` of a mesh without vertices.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let mut points = self.positions.iter().map(|&p| Vec3::from_array(p).as_dvec3());
        let first = points.next()?;
        Some(points.fold((first, first), |(low, high), p| (low.min(p), high.max(p))))
    }

    /// V - E + F over the vertices in use: 2 per closed body without handles, less 2 per handle.
    pub fn euler_number(&self) -> i64 {
        let mut edges: Vec<[u32; 2]> = self.edges().map(|[a, b]| [a.min(b), a.max(b)]).collect();
        edges.sort_unstable();
        edges.dedup();
        let mut used = vec![false; self.positions.len()];
        self.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
        let vertices = used.iter().filter(|&&u| u).count();
        vertices as i64 - edges.len() as i64 + self.triangles.len() as i64
    }

    /// The directed edges of all triangles, three per triangle.
    pub fn edges(&self) -> impl Iterator<Item = [u32; 2]> + '_ {
        self.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
    }

    /// The component of each triangle and the number of components; triangles that share a vertex are in one
    /// component.
    pub fn component_labels(&self) -> (Vec<u32>, usize) {
        let mut sets = DisjointSets::new(self.positions.len());
        for t in &self.triangles {
            sets.join(t[0], t[1]);
            sets.join(t[1], t[2]);
        }
        let mut label_of = vec![u32::MAX; self.positions.len()];
        let mut count = 0;
        let mut labels = Vec::with_capacity(self.triangles.len());
        for t in &self.triangles {
            let label = &mut label_of[sets.root(t[0]) as usize];
            if *label == u32::MAX {
                *label = count;
                count += 1;
            }
            labels.push(*label);
        }
        (labels, count as usize)
    }

    /// The connected components as meshes of their own, in the order of their first triangles.
    pub fn components(&self) -> Vec<Self> {
        let (labels, count) = self.component_labels();
        let mut parts = vec![Self { normals: self.normals.as_ref().map(|_| Vec::new()), ..Self::default() }; count];
        // No vertex is in two components: one table of new indices serves all.
        let mut new = vec![u32::MAX; self.positions.len()];
        for (t, label) in self.triangles.iter().zip(labels) {
            let part = &mut parts[label as usize];
            let triangle = t.map(|v| {
                let entry = &mut new[v as usize];
                if *entry == u32::MAX {
                    *entry = part.positions.len() as u32;
                    part.positions.push(self.positions[v as usize]);
                    if let (Some(kept), Some(all)) = (&mut part.normals, &self.normals) {
                        kept.push(all[v as usize]);
                    }
                }
                *entry
            });
            part.triangles.push(triangle);
        }
        parts
    }

    /// The mesh of some of the triangles, with the vertices they use.
    pub fn with_triangles(&self, mut triangles: Vec<[u32; 3]>) -> Self {
        let mut new = vec![u32::MAX; self.positions.len()];
        let mut kept = Vec::new();
        for v in triangles.iter_mut().flatten() {
            let entry = &mut new[*v as usize];
            if *entry == u32::MAX {
                *entry = kept.len() as u32;
                kept.push(*v as usize);
            }
            *v = *entry;
        }
        let positions = kept.iter().map(|&v| self.positions[v]).collect();
        let normals = self.normals.as_ref().map(|n| kept.iter().map(|&v| n[v]).collect());
        Self { positions, triangles, normals }
    }

    /// Sets the normals to the area-weighted means of the triangles around each vertex.
    pub fn compute_normals(&mut self) {
        let mut sums = vec![Vec3::ZERO; self.positions.len()];
        for &t in &self.triangles {
            let [a, b, c] = t.map(|v| Vec3::from_array(self.positions[v as usize]));
            let area = (b - a).cross(c - a);
            t.iter().for_each(|&v| sums[v as usize] += area);
        }
        self.normals = Some(sums.into_iter().map(|n| n.try_normalize().unwrap_or(Vec3::Y).to_array()).collect());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two tetrahedra of edge 1 at right angles, one of them far away.
    fn tetrahedra() -> Mesh {
        let mut mesh = Mesh::default();
        for offset in [0.0f32, 1000.0] {
            let base = mesh.positions.len() as u32;
            let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            mesh.positions.extend(corners.map(|[x, y, z]| [x + offset, y, z]));
            mesh.triangles.extend([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]].map(|t| t.map(|v| v + base)));
        }
        mesh
    }

    #[test]
    fn tetrahedra_have_known_measures() {
        let mesh = tetrahedra();
        assert!((mesh.volume() - 2.0 / 6.0).abs() < 1e-12);
        assert!((mesh.area() - 2.0 * (1.5 + 3f64.sqrt() / 2.0)).abs() < 1e-12);
        assert_eq!(mesh.euler_number(), 4);
        let parts = mesh.components();
        assert_eq!(parts.len(), 2);
        assert!(parts.iter().all(|p| p.positions.len() == 4 && (p.volume() - 1.0 / 6.0).abs() < 1e-12));
        assert_eq!(parts, [mesh.with_triangles(mesh.triangles[..4].to_vec()), mesh.with_triangles(mesh.triangles[4..].to_vec())]);
    }

    #[test]
    fn normals_of_a_tetrahedron_point_outwards() {
        let mut mesh = tetrahedra();
        mesh.compute_normals();
        let normal = Vec3::from_array(mesh.normals.expect("just made")[0]);
        assert!((normal + Vec3::ONE.normalize()).length() < 1e-6);
    }
}
