//! Generalized winding number: how many times a mesh encloses a point, for meshes with holes as well.
//!
//! `w(q)` is the sum over triangles of the solid angle seen from `q`, over 4 pi: 1 inside a closed mesh, 0
//! outside, and in between near a hole. Near triangles count exactly (van Oosterom and Strackee 1983); a far
//! group of triangles counts as one dipole (Barill et al. 2018).

use super::import::ImportedMesh;
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;

/// A group is far where the point is farther than this times the group's radius. On the bunny (a test) the
/// greatest error of w against the exact sum is 0.056: what is to be told apart are 0 and 1.
const FAR: f64 = 2.0;
/// Most triangles of a leaf: one, so that all but the nearest few count as dipoles, a tenth of the cost of an
/// exact solid angle.
const LEAF: usize = 1;

/// A group of triangles, seen from afar.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// Area-weighted middle \[m\].
    center: DVec3,
    /// Sum of area times normal [m^2].
    area_normal: DVec3,
    /// Distance from the middle to the farthest corner \[m\].
    radius: f64,
    /// Leaf: the first triangle. Else: the second child; the first is the next node.
    first: u32,
    /// Leaf: the number of triangles. Else 0.
    count: u32,
}

/// A mesh prepared for winding numbers.
#[derive(Clone, Debug)]
pub struct WindingTree {
    nodes: Vec<Node>,
    triangles: Vec<[DVec3; 3]>,
}

impl WindingTree {
    /// A tree over the triangles of `mesh`; triangles without area are left out, for they enclose nothing.
    pub fn new(mesh: &ImportedMesh) -> Self {
        let mut triangles: Vec<_> = mesh.corners().filter(|c| area_normal(c) != DVec3::ZERO).collect();
        let mut nodes = Vec::with_capacity(2 * triangles.len() / LEAF + 1);
        if !triangles.is_empty() {
            split(&mut nodes, &mut triangles, 0);
        }
        Self { nodes, triangles }
    }

    /// The winding number of `point` \[m\].
    pub fn at(&self, point: DVec3) -> f64 {
        // Halving splits: the tree of 2^32 triangles is 30 deep, and each level leaves one node waiting.
        let mut waiting = [0u32; 64];
        let mut count = usize::from(!self.nodes.is_empty());
        let mut solid_angle = 0.0;
        while count > 0 {
            count -= 1;
            let index = waiting[count];
            let node = &self.nodes[index as usize];
            let away = node.center - point;
            let square = away.length_squared();
            if square > (FAR * node.radius).powi(2) {
                solid_angle += node.area_normal.dot(away) / (square * square.sqrt());
            } else if node.count > 0 {
                let first = node.first as usize;
                let near = &self.triangles[first..first + node.count as usize];
                solid_angle += near.iter().map(|t| triangle_solid_angle(t, point)).sum::<f64>();
            } else {
                waiting[count] = node.first;
                waiting[count + 1] = index + 1;
                count += 2;
            }
        }
        solid_angle / (4.0 * PI)
    }

    /// The winding numbers of `points` \[m\], shape [n, 3], on all cores.
    pub fn at_all(&self, points: &[DVec3]) -> Vec<f64> {
        points.par_iter().map(|point| self.at(*point)).collect()
    }

    /// The winding number by the sum over every triangle: the reference of [`Self::at`].
    pub fn exact_at(&self, point: DVec3) -> f64 {
        self.triangles.iter().map(|t| triangle_solid_angle(t, point)).sum::<f64>() / (4.0 * PI)
    }
}

/// Half the cross product of two edges: area times normal.
fn area_normal([a, b, c]: &[DVec3; 3]) -> DVec3 {
    (*b - *a).cross(*c - *a) / 2.0
}

/// Signed solid angle of a triangle, positive where its front faces away from `point`.
fn triangle_solid_angle(triangle: &[DVec3; 3], point: DVec3) -> f64 {
    let [a, b, c] = triangle.map(|corner| corner - point);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let numerator = a.dot(b.cross(c));
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * numerator.atan2(denominator)
}

/// Appends the node of `triangles`, which begin at `first` in the tree's list, and the nodes below it.
fn split(nodes: &mut Vec<Node>, triangles: &mut [[DVec3; 3]], first: u32) {
    let middle = |t: &[DVec3; 3]| (t[0] + t[1] + t[2]) / 3.0;
    let areas: f64 = triangles.iter().map(|t| area_normal(t).length()).sum();
    let center = triangles.iter().map(|t| middle(t) * area_normal(t).length()).sum::<DVec3>() / areas;
    let radius = triangles.iter().flatten().map(|corner| corner.distance(center)).fold(0.0, f64::max);
    let index = nodes.len();
    // Mesh indices are u32, so counts of triangles and nodes are.
    nodes.push(Node {
        center,
        area_normal: triangles.iter().map(area_normal).sum(),
        radius,
        first,
        count: triangles.len() as u32,
    });
    if triangles.len() <= LEAF {
        return;
    }
    let low = triangles.iter().map(middle).fold(DVec3::INFINITY, DVec3::min);
    let high = triangles.iter().map(middle).fold(DVec3::NEG_INFINITY, DVec3::max);
    let axis = (high - low).max_position();
    let half = triangles.len() / 2;
    triangles.select_nth_unstable_by(half, |a, b| middle(a)[axis].total_cmp(&middle(b)[axis]));
    let (left, right) = triangles.split_at_mut(half);
    split(nodes, left, first);
    nodes[index].count = 0;
    nodes[index].first = nodes.len() as u32;
    split(nodes, right, first + half as u32);
}

#[cfg(test)]
mod tests {
    use super::super::import::MeshFormat;
    use super::super::solid::tests::icosphere;
    use super::*;

    fn bunny() -> ImportedMesh {
        ImportedMesh::from_bytes(include_bytes!("../../assets/meshes/bunny.obj"), MeshFormat::Obj, "bunny.obj").expect("bunny")
    }

    /// A lattice of at least `count` points over the mesh's box and a quarter beyond it.
    fn points(mesh: &ImportedMesh, edge: i32) -> Vec<DVec3> {
        let (low, high) = mesh.bounds();
        let (from, size) = (low - 0.25 * (high - low), 1.5 * (high - low));
        let at = |i: i32| (f64::from(i) + 0.5) / f64::from(edge);
        let index = |i: i32| DVec3::new(at(i % edge), at(i / edge % edge), at(i / edge / edge));
        (0..edge.pow(3)).map(|i| from + size * index(i)).collect()
    }

    #[test]
    fn tree_agrees_with_the_sum_over_all_triangles() {
        for mesh in [bunny(), icosphere(4, 1.0)] {
            let tree = WindingTree::new(&mesh);
            let points = points(&mesh, 14);
            let errors = tree.at_all(&points).into_iter().zip(&points).map(|(w, p)| (w - tree.exact_at(*p)).abs());
            let worst = errors.fold(0.0, f64::max);
            println!("{} triangles: greatest error {worst:.2e}", mesh.triangles.len());
            assert!(worst < 0.07, "{worst}");
        }
    }

    #[test]
    fn winding_number_of_a_sphere_is_one_inside_and_zero_outside() {
        let mesh = icosphere(4, 1.0);
        let tree = WindingTree::new(&mesh);
        for point in points(&mesh, 20) {
            // Between the icosphere's faces and its circumscribed sphere (0.2 % below) either may hold.
            let (r, w) = (point.length(), tree.at(point));
            assert!((r > 0.995 || (w - 1.0).abs() < 0.06) && (r < 1.005 || w.abs() < 0.06), "{w} at radius {r}");
        }
    }

    #[test]
    fn five_percent_of_triangles_missing_change_few_points() {
        let mesh = bunny();
        let mut torn = mesh.clone();
        let mut index = 0u32;
        torn.triangles.retain(|_| {
            index += 1;
            index.wrapping_mul(2_654_435_761) >> 16 >= 65_536 / 20
        });
        let missing = 1.0 - torn.triangles.len() as f64 / mesh.triangles.len() as f64;
        assert!((0.04..0.06).contains(&missing), "{missing}");
        let points = points(&mesh, 40);
        let (whole, torn) = (WindingTree::new(&mesh).at_all(&points), WindingTree::new(&torn).at_all(&points));
        let changed = whole.iter().zip(&torn).filter(|(a, b)| (**a > 0.5) != (**b > 0.5)).count();
        println!("{changed} of {} points changed with {:.1} % of triangles missing", points.len(), 100.0 * missing);
        assert!((changed as f64) < 1e-3 * points.len() as f64, "{changed} of {}", points.len());
    }
}
