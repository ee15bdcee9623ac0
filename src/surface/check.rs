//! What can be wrong with a mesh, counted.

use super::mesh::Mesh;
use crate::sim::disjoint::DisjointSets;

/// Defects and topology of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshCheck {
    /// Edges of one triangle only.
    pub open_edges: usize,
    /// Edges of more than two triangles.
    pub nonmanifold_edges: usize,
    /// Vertices whose triangles do not form one fan.
    pub nonmanifold_vertices: usize,
    /// Edges of two or more triangles that are not passed equally often in both directions.
    pub misoriented_edges: usize,
    /// Triangles with a repeated vertex, or with no area in f64.
    pub degenerate_triangles: usize,
    /// Connected components.
    pub components: usize,
    /// V - E + F.
    pub euler: i64,
}

impl MeshCheck {
    /// Counts the defects of `mesh`.
    pub fn of(mesh: &Mesh) -> Self {
        let mut check = Self { components: mesh.component_labels().1, euler: mesh.euler_number(), ..Self::default() };
        for (_, forward, backward) in edge_counts(mesh) {
            match forward + backward {
                1 => check.open_edges += 1,
                count => {
                    check.nonmanifold_edges += usize::from(count > 2);
                    check.misoriented_edges += usize::from(forward != backward);
                }
            }
        }
        check.nonmanifold_vertices = nonmanifold_vertices(mesh);
        check.degenerate_triangles =
            mesh.triangles.iter().filter(|&&t| repeats(t) || mesh.area_vector(t).length_squared() == 0.0).count();
        check
    }

    /// Closed, oriented, and a manifold at every edge and vertex.
    pub fn is_closed_manifold(&self) -> bool {
        self.open_edges + self.nonmanifold_edges + self.nonmanifold_vertices + self.misoriented_edges == 0
    }
}

fn repeats([a, b, c]: [u32; 3]) -> bool {
    a == b || b == c || c == a
}

/// Each edge `[low, high]` with how often triangles pass it from low to high and back.
pub(crate) fn edge_counts(mesh: &Mesh) -> Vec<([u32; 2], u32, u32)> {
    let mut edges: Vec<([u32; 2], bool)> = mesh.edges().map(|[a, b]| ([a.min(b), a.max(b)], a < b)).collect();
    edges.sort_unstable();
    let count = |run: &[([u32; 2], bool)]| {
        let forward = run.iter().filter(|e| e.1).count() as u32;
        (run[0].0, forward, run.len() as u32 - forward)
    };
    edges.chunk_by(|a, b| a.0 == b.0).map(count).collect()
}

/// Vertices whose triangles fall into more than one set connected by edges at the vertex.
fn nonmanifold_vertices(mesh: &Mesh) -> usize {
    // A corner of a triangle at vertex v has two edges at v; corners that share one are joined.
    let mut ends: Vec<([u32; 2], u32)> = Vec::with_capacity(6 * mesh.triangles.len());
    for (i, t) in mesh.triangles.iter().enumerate() {
        for k in 0..3 {
            let corner = (3 * i + k) as u32;
            ends.push(([t[k], t[(k + 1) % 3]], corner));
            ends.push(([t[k], t[(k + 2) % 3]], corner));
        }
    }
    ends.sort_unstable();
    let mut sets = DisjointSets::new(3 * mesh.triangles.len());
    for run in ends.chunk_by(|a, b| a.0 == b.0) {
        run.iter().for_each(|e| sets.join(run[0].1, e.1));
    }
    let at_vertex = ends.chunk_by(|a, b| a.0[0] == b.0[0]);
    at_vertex.filter(|run| run.iter().any(|e| sets.root(e.1) != sets.root(run[0].1))).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> Mesh {
        let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        Mesh::new(corners, vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    }

    #[test]
    fn tetrahedron_is_sound() {
        let check = MeshCheck::of(&tetrahedron());
        assert_eq!(check, MeshCheck { components: 1, euler: 2, ..MeshCheck::default() });
    }

    #[test]
    fn missing_triangle_leaves_three_open_edges() {
        let mut mesh = tetrahedron();
        mesh.triangles.pop();
        assert_eq!(MeshCheck::of(&mesh).open_edges, 3);
    }

    #[test]
    fn flipped_triangle_misorients_three_edges() {
        let mut mesh = tetrahedron();
        mesh.triangles[0].reverse();
        assert_eq!(MeshCheck::of(&mesh).misoriented_edges, 3);
    }

    /// Two bodies that share a vertex, and two that share an edge.
    #[test]
    fn touching_bodies_are_nonmanifold() {
        let mut mesh = tetrahedron();
        mesh.positions.extend([[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]]);
        mesh.triangles.extend([[0, 4, 5], [0, 6, 4], [0, 5, 6], [4, 6, 5]]);
        let check = MeshCheck::of(&mesh);
        assert_eq!((check.nonmanifold_edges, check.nonmanifold_vertices, check.open_edges), (0, 1, 0));
        let mut mesh = tetrahedron();
        mesh.positions.extend([[-1.0, -1.0, 0.0], [-1.0, 0.0, 1.0]]);
        mesh.triangles.extend([[0, 1, 4], [0, 5, 1], [0, 4, 5], [1, 5, 4]]);
        let check = MeshCheck::of(&mesh);
        assert_eq!((check.nonmanifold_edges, check.nonmanifold_vertices, check.open_edges), (1, 0, 0));
    }

    #[test]
    fn flat_and_repeated_triangles_are_degenerate() {
        let mut mesh = tetrahedron();
        mesh.positions.push([0.5, 0.0, 0.0]);
        mesh.triangles.extend([[0, 4, 1], [0, 0, 1]]);
        assert_eq!(MeshCheck::of(&mesh).degenerate_triangles, 2);
    }
}
