//! Balls that stand for grains: regular polyhedra of the ball's volume, one after the other behind a mesh.

use super::mesh::Mesh;
use glam::Vec3;

/// A ball that stands for one particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grain {
    /// Centre \[m\].
    pub position: [f32; 3],
    /// Radius of a ball \[m\] of the volume that the surface does not show: (3 V / 4 pi)^(1/3) with V the
    /// particle's present volume times 1 - 2 f / threshold at its place. So grains that the surface takes in
    /// shrink to nothing as it comes.
    pub radius: f32,
    /// Its number in the source.
    pub particle: u32,
}

/// Grains that are drawn as icosahedra, at most; more are drawn as octahedra. So 10,000 grains cost 200,000
/// triangles, six times those of the body of 100,000 particles that they may have come from, and every
/// further one 8. A particle of 8 per cell has a radius of 0.31 cells, a few pixels.
pub(crate) const ROUND_MAX: usize = 10_000;

/// The polyhedron.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ball {
    /// 12 vertices, 20 triangles.
    Icosahedron,
    /// 6 vertices, 8 triangles.
    Octahedron,
}

impl Ball {
    /// What each of so many grains is drawn as.
    pub(crate) fn for_count(count: usize) -> Self {
        if count <= ROUND_MAX { Self::Icosahedron } else { Self::Octahedron }
    }

    /// Distance of the vertices from the centre, over the radius of a ball of the same volume: (4 pi / 3 /
    /// V)^(1/3) with V the polyhedron's volume for vertices at 1, which is 2.5362 and 4/3.
    pub(crate) fn scale(self) -> f32 {
        match self {
            Self::Icosahedron => 1.182_055_4,
            Self::Octahedron => 1.464_591_9,
        }
    }

    /// Vertices and triangles.
    pub(crate) fn counts(self) -> (usize, usize) {
        match self {
            Self::Icosahedron => (12, 20),
            Self::Octahedron => (6, 8),
        }
    }

    /// Where a vertex is seen from the centre: of unit length, also the normal there. The icosahedron's are
    /// the rotations of (0, +-1, +-phi).
    pub(crate) fn direction(self, vertex: usize) -> Vec3 {
        let sign = |bit: usize| if vertex >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let mut direction = Vec3::ZERO;
        match self {
            Self::Icosahedron => {
                let axis = vertex / 4;
                direction[(axis + 1) % 3] = sign(0);
                direction[(axis + 2) % 3] = sign(1) * GOLDEN_RATIO;
                direction / (1.0 + GOLDEN_RATIO * GOLDEN_RATIO).sqrt()
            }
            Self::Octahedron => {
                direction[vertex / 2] = sign(0);
                direction
            }
        }
    }

    /// Vertices of the triangles, counter-clockwise seen from outside: all triples of neighbours.
    pub(crate) fn triangles(self) -> Vec<[u32; 3]> {
        let count = self.counts().0;
        let at: Vec<Vec3> = (0..count).map(|v| self.direction(v)).collect();
        // Neighbours of the icosahedron are 63 degrees apart, of the octahedron 90; the next vertices 117
        // and 180.
        let are_near = |a: usize, b: usize| at[a].dot(at[b]) > -0.2;
        let mut triangles = Vec::with_capacity(self.counts().1);
        for a in 0..count {
            for b in (a + 1..count).filter(|&b| are_near(a, b)) {
                for c in (b + 1..count).filter(|&c| are_near(a, c) && are_near(b, c)) {
                    let is_outward = at[a].dot(at[b].cross(at[c])) > 0.0;
                    triangles.push(if is_outward { [a, b, c] } else { [a, c, b] }.map(|v| v as u32));
                }
            }
        }
        triangles
    }
}

const GOLDEN_RATIO: f32 = 1.618_034;

/// Puts the grains behind the mesh, in their order; their vertices get normals if the mesh's have some.
pub(crate) fn add_balls(mesh: &mut Mesh, grains: &[Grain]) {
    let ball = Ball::for_count(grains.len());
    let (vertex_count, triangle_count) = ball.counts();
    let directions: Vec<Vec3> = (0..vertex_count).map(|v| ball.direction(v)).collect();
    let triangles = ball.triangles();
    mesh.positions.reserve(grains.len() * vertex_count);
    mesh.triangles.reserve(grains.len() * triangle_count);
    for grain in grains {
        let first = mesh.positions.len() as u32;
        let (centre, radius) = (Vec3::from_array(grain.position), grain.radius * ball.scale());
        mesh.positions.extend(directions.iter().map(|d| (centre + radius * d).to_array()));
        mesh.triangles.extend(triangles.iter().map(|t| t.map(|v| first + v)));
    }
    if let Some(normals) = &mut mesh.normals {
        normals.reserve(grains.len() * vertex_count);
        grains.iter().for_each(|_| normals.extend(directions.iter().map(|d| d.to_array())));
    }
}

#[cfg(test)]
mod tests {
    use super::super::check::MeshCheck;
    use super::*;

    /// Both polyhedra are closed, look outwards, have the volume of the ball, and normals of unit length.
    #[test]
    fn balls_have_the_volume_of_their_grains() {
        for count in [3, ROUND_MAX + 1] {
            let grain =
                |i: usize| Grain { position: [10.0 * i as f32, 2.0, 3.0], radius: 1.0 + (i % 2) as f32, particle: i as u32 };
            let grains: Vec<Grain> = (0..count).map(grain).collect();
            let mut mesh = Mesh { normals: Some(vec![]), ..Mesh::default() };
            add_balls(&mut mesh, &grains);
            let (vertex_count, triangle_count) = Ball::for_count(count).counts();
            assert_eq!((mesh.positions.len(), mesh.triangles.len()), (count * vertex_count, count * triangle_count));
            let first =
                |n: usize| Mesh::new(mesh.positions[..n * vertex_count].to_vec(), mesh.triangles[..n * triangle_count].to_vec());
            let check = MeshCheck::of(&first(3));
            assert!(check.is_closed_manifold() && check.components == 3 && check.euler == 6, "{check:?}");
            // A ball of radius 1, another of 2, and one of 1.
            let expected = 4.0 / 3.0 * std::f64::consts::PI * 10.0;
            assert!((first(3).volume() / expected - 1.0).abs() < 1e-5, "{}", first(3).volume());
            let normals = mesh.normals.expect("normals");
            assert!(
                normals.len() == mesh.positions.len()
                    && normals.iter().all(|n| (Vec3::from_array(*n).length() - 1.0).abs() < 1e-6)
            );
        }
    }
}
