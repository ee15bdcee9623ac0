//! From the extracted mesh to bodies that a printer or a mesh tool takes: manifold, oriented, without empty
//! bodies.
//!
//! The extractor's mesh is closed and oriented, but where a crack ends its lips can share an edge, and lips
//! that coincide may enclose nothing at all. [`print_ready`] repairs both and reports it.

use super::mesh::Mesh;
use crate::sim::disjoint::DisjointSets;
use glam::{DVec3, Vec3};
use std::f64::consts::TAU;

/// What [`print_ready`] changed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Repairs {
    /// Closed components that were dropped because they enclose nothing.
    pub pillows: usize,
    /// Sum of their volumes' magnitudes [m^3].
    pub pillow_volume: f64,
    /// Bodies one node thick, wedged in between the lips of cuts, that were dropped: where cuts meet, the
    /// edge of a piece may come apart on the grid.
    pub crumbs: usize,
    /// Sum of their volumes [m^3].
    pub crumb_volume: f64,
    /// Whether the mesh was inside out.
    pub was_inverted: bool,
    /// Vertices that stood on another vertex and were moved into their body.
    pub parted_vertices: usize,
}

/// A pillow encloses less than this times area^1.5; a sphere encloses 0.094, the thinnest useful plate (1
/// : 100) 0.002.
const PILLOW_FILL_MAX: f64 = 1e-6;
/// Volume over area of a crumb, in its mean edge length, at most: 0.14 for the octahedron around one node,
/// 0.22 for a row of nodes, 0.4 for two nodes each way.
const CRUMB_THICKNESS_MAX: f64 = 0.3;
/// Volume of a crumb over that of the whole mesh, at most.
const CRUMB_VOLUME_MAX: f64 = 1e-3;
/// Share of a crumb's vertices that stand on those of other bodies, at least: free surface and blunt edges
/// are its own.
const CRUMB_WEDGED_MIN: f64 = 0.3;
/// Distance by which coincident lips are parted, over the mesh's diagonal: 1 um in 100 mm, 100 times the
/// rounding of f32.
const LIP_GAP: f64 = 1e-5;
/// Two triangles at an edge closer than this \[rad\] lie on each other: the slit of a cut, with clay all
/// around.
const SLIT_ANGLE: f64 = 1e-6;

/// A manifold mesh for export: bodies separated, pillows dropped, oriented outwards, lips parted by 1e-5 of
/// the mesh's diagonal so that a reader that merges equal positions does not glue them.
pub fn print_ready(mesh: &Mesh) -> (Mesh, Repairs) {
    let (mut mesh, mut repairs) = drop_pillows(&separate(mesh));
    if mesh.volume() < 0.0 {
        mesh.triangles.iter_mut().for_each(|t| t.reverse());
        repairs.was_inverted = true;
    }
    repairs.parted_vertices = part_lips(&mut mesh);
    if mesh.normals.is_some() {
        mesh.compute_normals();
    }
    (mesh, repairs)
}

/// One direction of one triangle's edge: triangle, and which of its corners the edge starts at.
type HalfEdge = (usize, usize);

/// Makes every edge one of two triangles and every vertex one fan: at an edge of four triangles, those that
/// enclose the least solid angle are paired ("separate inside", as in the case table); each fan gets a vertex
/// of its own. Open edges stay open.
pub fn separate(mesh: &Mesh) -> Mesh {
    let pairs = pair_edges(mesh);
    let corner = |(t, k): HalfEdge, ahead: usize| (3 * t + (k + ahead) % 3) as u32;
    let mut sets = DisjointSets::new(3 * mesh.triangles.len());
    for &(a, b) in &pairs {
        sets.join(corner(a, 0), corner(b, 1));
        sets.join(corner(a, 1), corner(b, 0));
    }
    let mut out = Mesh { normals: mesh.normals.as_ref().map(|_| Vec::new()), ..Mesh::default() };
    let mut vertex_of = vec![u32::MAX; 3 * mesh.triangles.len()];
    for (t, old) in mesh.triangles.iter().enumerate() {
        let triangle = [0, 1, 2].map(|k| {
            let vertex = &mut vertex_of[sets.root((3 * t + k) as u32) as usize];
            if *vertex == u32::MAX {
                *vertex = out.positions.len() as u32;
                out.positions.push(mesh.positions[old[k] as usize]);
                if let (Some(new), Some(all)) = (&mut out.normals, &mesh.normals) {
                    new.push(all[old[k] as usize]);
                }
            }
            *vertex
        });
        out.triangles.push(triangle);
    }
    split_double_edges(&mut out, &pairs);
    out
}

/// Pairs the two directions of each edge.
fn pair_edges(mesh: &Mesh) -> Vec<(HalfEdge, HalfEdge)> {
    let mut halves: Vec<([u32; 2], HalfEdge)> = Vec::with_capacity(3 * mesh.triangles.len());
    for (t, v) in mesh.triangles.iter().enumerate() {
        halves.extend((0..3).map(|k| ([v[k].min(v[(k + 1) % 3]), v[k].max(v[(k + 1) % 3])], (t, k))));
    }
    halves.sort_unstable();
    let mut pairs = Vec::with_capacity(halves.len() / 2);
    for run in halves.chunk_by(|a, b| a.0 == b.0) {
        let edge = run[0].0;
        let is_forward = |&(t, k): &HalfEdge| mesh.triangles[t][k] == edge[0];
        let (forward, backward): (Vec<HalfEdge>, Vec<HalfEdge>) = run.iter().map(|h| h.1).partition(is_forward);
        if let ([a], [b]) = (&forward[..], &backward[..]) {
            pairs.push((*a, *b));
            continue;
        }
        let mut wedges = Vec::new();
        for &f in &forward {
            wedges.extend(backward.iter().map(|&b| (wedge_angle(mesh, edge, f, b), f, b)));
        }
        wedges.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
        let mut taken = Vec::new();
        for (_, f, b) in wedges {
            if !taken.contains(&f) && !taken.contains(&b) {
                taken.extend([f, b]);
                pairs.push((f, b));
            }
        }
    }
    pairs
}

/// Angle of the solid between two triangles at an edge, in (0, 2 pi].
fn wedge_angle(mesh: &Mesh, [low, high]: [u32; 2], forward: HalfEdge, backward: HalfEdge) -> f64 {
    let at = |v: u32| Vec3::from_array(mesh.positions[v as usize]).as_dvec3();
    let axis = (at(high) - at(low)).normalize_or(DVec3::X);
    let (u, v) = axis.any_orthonormal_pair();
    let angle = |(t, k): HalfEdge| {
        let third = at(mesh.triangles[t][(k + 2) % 3]) - at(low);
        third.dot(v).atan2(third.dot(u))
    };
    // (u, v, axis) is right-handed, so the angle grows along the normal of a forward triangle: its solid is
    // below it.
    let handed = if u.cross(v).dot(axis) > 0.0 { 1.0 } else { -1.0 };
    let wedge = (handed * (angle(forward) - angle(backward))).rem_euclid(TAU);
    if wedge < SLIT_ANGLE { TAU } else { wedge }
}

/// Where both ends of two paired edges are still the same vertices, the later pair gets a vertex of its own
/// in the middle.
fn split_double_edges(mesh: &mut Mesh, pairs: &[(HalfEdge, HalfEdge)]) {
    let ends = |triangles: &[[u32; 3]], (t, k): HalfEdge| {
        let (a, b) = (triangles[t][k], triangles[t][(k + 1) % 3]);
        [a.min(b), a.max(b)]
    };
    let mut edges: Vec<([u32; 2], usize)> = pairs.iter().enumerate().map(|(i, p)| (ends(&mesh.triangles, p.0), i)).collect();
    edges.sort_unstable();
    let doubles: Vec<usize> = edges.chunk_by(|a, b| a.0 == b.0).flat_map(|run| run[1..].iter().map(|e| e.1)).collect();
    // Triangle -> the middle vertices of its edges, so that a triangle with more than one is split by all of
    // them.
    let mut middles: std::collections::BTreeMap<usize, [Option<u32>; 3]> = std::collections::BTreeMap::new();
    for i in doubles {
        let (a, b) = pairs[i];
        let [low, high] = ends(&mesh.triangles, a).map(|v| v as usize);
        let middle = mesh.positions.len() as u32;
        let mean = |all: &[[f32; 3]]| ((Vec3::from_array(all[low]) + Vec3::from_array(all[high])) / 2.0).to_array();
        mesh.positions.push(mean(&mesh.positions));
        if let Some(normals) = &mut mesh.normals {
            normals.push(normals[low]);
        }
        for (t, k) in [a, b] {
            middles.entry(t).or_default()[k] = Some(middle);
        }
    }
    for (t, middle) in middles {
        let corners = mesh.triangles[t];
        let polygon: Vec<u32> = (0..3).flat_map(|k| [Some(corners[k]), middle[k]]).flatten().collect();
        // A fan from the first middle: its chords join it to vertices off its own edge.
        let first = polygon.iter().position(|v| middle.contains(&Some(*v))).unwrap_or(0);
        let at = |i: usize| polygon[(first + i) % polygon.len()];
        mesh.triangles[t] = [at(0), at(1), at(2)];
        (2..polygon.len() - 1).for_each(|i| mesh.triangles.push([at(0), at(i), at(i + 1)]));
    }
}

/// Drops closed components that enclose nothing (lips of a cut that meet all around), and crumbs.
pub fn drop_pillows(mesh: &Mesh) -> (Mesh, Repairs) {
    let mut repairs = Repairs::default();
    let (labels, count) = mesh.component_labels();
    let bodies = mesh.components();
    let mut is_kept = vec![true; count];
    let wedged = wedged_bodies(mesh, &labels, count);
    let volume_max = CRUMB_VOLUME_MAX * mesh.volume().abs();
    for ((kept, body), is_wedged) in is_kept.iter_mut().zip(&bodies).zip(wedged) {
        let (volume, area) = (body.volume().abs(), body.area());
        if volume <= PILLOW_FILL_MAX * area.powf(1.5) {
            *kept = false;
            repairs.pillows += 1;
            repairs.pillow_volume += volume;
        } else if is_wedged && volume <= volume_max && volume <= CRUMB_THICKNESS_MAX * area * mean_edge(body) {
            *kept = false;
            repairs.crumbs += 1;
            repairs.crumb_volume += volume;
        }
    }
    let kept = mesh.triangles.iter().zip(labels).filter(|(_, l)| is_kept[*l as usize]).map(|(t, _)| *t).collect();
    (mesh.with_triangles(kept), repairs)
}

/// Whether many of a component's vertices stand on those of other components.
fn wedged_bodies(mesh: &Mesh, labels: &[u32], count: usize) -> Vec<bool> {
    let mut body_of = vec![u32::MAX; mesh.positions.len()];
    for (t, label) in mesh.triangles.iter().zip(labels) {
        t.iter().for_each(|&v| body_of[v as usize] = *label);
    }
    let used = (0..mesh.positions.len() as u32).filter(|&v| body_of[v as usize] != u32::MAX);
    let mut shares = vec![(0.0, 0.0); count];
    for run in standing_together(mesh, used).chunk_by(|a, b| place(mesh, *a) == place(mesh, *b)) {
        for &v in run {
            let body = body_of[v as usize];
            let (wedged, all) = &mut shares[body as usize];
            *wedged += if run.iter().any(|&w| body_of[w as usize] != body) { 1.0 } else { 0.0 };
            *all += 1.0;
        }
    }
    shares.into_iter().map(|(wedged, all)| wedged >= CRUMB_WEDGED_MIN * all).collect()
}

/// Vertices sorted by place, so that those at one place stand together.
fn standing_together(mesh: &Mesh, vertices: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut order: Vec<u32> = vertices.collect();
    order.sort_by_key(|&v| place(mesh, v));
    order
}

fn place(mesh: &Mesh, vertex: u32) -> [u32; 3] {
    mesh.positions[vertex as usize].map(|x| (x + 0.0).to_bits())
}

fn mean_edge(mesh: &Mesh) -> f64 {
    let at = |v: u32| Vec3::from_array(mesh.positions[v as usize]).as_dvec3();
    mesh.edges().map(|[a, b]| at(a).distance(at(b))).sum::<f64>() / (3 * mesh.triangles.len()).max(1) as f64
}

/// Moves vertices that stand on other vertices into their own body; returns how many.
fn part_lips(mesh: &mut Mesh) -> usize {
    let Some((low, high)) = mesh.bounds() else { return 0 };
    let gap = (LIP_GAP * (high - low).length()) as f32;
    let order = standing_together(mesh, 0..mesh.positions.len() as u32);
    let runs = order.chunk_by(|a, b| place(mesh, *a) == place(mesh, *b));
    let shared: Vec<u32> = runs.filter(|run| run.len() > 1).flatten().copied().collect();
    let mut normals = Mesh::new(std::mem::take(&mut mesh.positions), mesh.triangles.clone());
    normals.compute_normals();
    mesh.positions = normals.positions;
    if let Some(all) = normals.normals {
        for &v in &shared {
            let moved = Vec3::from_array(mesh.positions[v as usize]) - gap * Vec3::from_array(all[v as usize]);
            mesh.positions[v as usize] = moved.to_array();
        }
    }
    shared.len()
}

#[cfg(test)]
mod tests {
    use super::super::check::MeshCheck;
    use super::*;

    fn append_box(mesh: &mut Mesh, low: [f32; 3], high: [f32; 3]) {
        let base = mesh.positions.len() as u32;
        mesh.positions.extend((0..8).map(|i| [0, 1, 2].map(|d| if i >> d & 1 == 1 { high[d] } else { low[d] })));
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        for q in quads {
            mesh.triangles.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]].map(|t| t.map(|v| base + v)));
        }
    }

    /// Merges vertices of equal position.
    fn glue(mesh: &Mesh) -> Mesh {
        let mut out = Mesh::default();
        let mut index = std::collections::HashMap::new();
        for &t in &mesh.triangles {
            out.triangles.push(t.map(|v| {
                let p = mesh.positions[v as usize];
                *index.entry(p.map(f32::to_bits)).or_insert_with(|| {
                    out.positions.push(p);
                    out.positions.len() as u32 - 1
                })
            }));
        }
        out
    }

    /// Two boxes that share an edge come apart; their edge had four triangles.
    #[test]
    fn boxes_at_an_edge_are_separated() {
        let mut mesh = Mesh::default();
        append_box(&mut mesh, [0.0; 3], [1.0; 3]);
        append_box(&mut mesh, [1.0, 1.0, 0.0], [2.0, 2.0, 1.0]);
        let glued = glue(&mesh);
        assert_eq!(MeshCheck::of(&glued).nonmanifold_edges, 1);
        let check = MeshCheck::of(&separate(&glued));
        assert!(check.is_closed_manifold(), "{check:?}");
        assert_eq!((check.components, check.euler), (2, 4));
    }

    /// Two boxes with a common corner.
    #[test]
    fn boxes_at_a_corner_are_separated() {
        let mut mesh = Mesh::default();
        append_box(&mut mesh, [0.0; 3], [1.0; 3]);
        append_box(&mut mesh, [1.0; 3], [2.0; 3]);
        let glued = glue(&mesh);
        assert_eq!(MeshCheck::of(&glued).nonmanifold_vertices, 1);
        assert_eq!(MeshCheck::of(&separate(&glued)).components, 2);
    }

    /// Surface of unit cubes, vertices shared.
    fn voxels(cubes: &[[i32; 3]]) -> Mesh {
        let mut mesh = Mesh::default();
        for &c in cubes {
            let mut cube = Mesh::default();
            append_box(&mut cube, c.map(|x| x as f32), c.map(|x| x as f32 + 1.0));
            let is_outer = |t: &&[u32; 3]| {
                let n = cube.area_vector(**t).normalize();
                !cubes.contains(&[c[0] + n.x as i32, c[1] + n.y as i32, c[2] + n.z as i32])
            };
            let base = mesh.positions.len() as u32;
            mesh.triangles.extend(cube.triangles.iter().filter(is_outer).map(|t| t.map(|v| v + base)));
            mesh.positions.extend(&cube.positions);
        }
        glue(&mesh)
    }

    /// Two cubes that share an edge, joined above and below: the edge's ends stay connected around, so it is
    /// split in the middle.
    #[test]
    fn body_that_touches_itself_at_an_edge_becomes_manifold() {
        let mut cubes = vec![[0, 0, 0], [1, 1, 0]];
        for z in [-1, 1] {
            cubes.extend([[0, 0, z], [1, 0, z], [0, 1, z], [1, 1, z]]);
        }
        let glued = voxels(&cubes);
        let before = MeshCheck::of(&glued);
        assert_eq!((before.nonmanifold_edges, before.open_edges), (1, 0));
        let separated = separate(&glued);
        let check = MeshCheck::of(&separated);
        assert!(check.is_closed_manifold(), "{check:?}");
        // Two posts between two plates: one handle.
        assert_eq!((check.components, check.euler), (1, 0));
        assert_eq!(separated.volume(), 10.0);
    }

    /// Two boxes with one face on the other that share one edge of it: the slit between them is not taken for
    /// a body of no width.
    #[test]
    fn boxes_at_a_slit_stay_two_bodies() {
        let mut mesh = Mesh::default();
        append_box(&mut mesh, [0.0; 3], [1.0; 3]);
        append_box(&mut mesh, [1.0, 0.0, 0.0], [2.0, 1.0, 1.0]);
        // Corners 0 and 2 of the second box are corners 1 and 3 of the first.
        mesh.triangles.iter_mut().flatten().for_each(|v| *v = if *v == 8 || *v == 10 { *v - 7 } else { *v });
        let before = MeshCheck::of(&mesh);
        assert_eq!((before.nonmanifold_edges, before.components), (1, 1));
        let check = MeshCheck::of(&separate(&mesh));
        assert!(check.is_closed_manifold() && check.components == 2, "{check:?}");
    }

    /// A box and two coincident triangles back to back, far from it.
    #[test]
    fn pillows_are_dropped_and_reported() {
        let mut mesh = Mesh::default();
        append_box(&mut mesh, [0.0; 3], [1.0; 3]);
        mesh.positions.extend([[3.0, 0.0, 0.0], [4.0, 0.0, 0.0], [3.0, 1.0, 0.0]]);
        mesh.triangles.extend([[8, 9, 10], [8, 10, 9]]);
        let (kept, repairs) = drop_pillows(&mesh);
        assert_eq!((repairs.pillows, repairs.pillow_volume), (1, 0.0));
        assert_eq!((kept.triangles.len(), kept.positions.len()), (12, 8));
    }

    /// One node of 9^3 that a cut parts from all others: it goes, and so does the hollow that it stood in.
    #[test]
    fn crumbs_are_dropped_with_their_hollow() {
        let (mut total, mut front, mut back) = (vec![0.0; 1331], vec![0.0; 1331], vec![0.0; 1331]);
        for i in 0..729 {
            let at = i % 9 + 1 + 11 * (i / 9 % 9 + 1 + 11 * (i / 81 + 1));
            total[at] = 1.0;
            let side = if i == 364 { &mut front } else { &mut back };
            side[at] = 1.0;
        }
        let field = super::super::field::Field::from_nodes([11; 3], &total, [(&front[..], &back[..])]);
        let raw = super::super::extract::extract_field(&field, 0.5);
        assert_eq!(raw.component_labels().1, 3);
        let (mesh, repairs) = print_ready(&raw);
        assert_eq!((repairs.crumbs, mesh.component_labels().1), (2, 1));
        assert!((repairs.crumb_volume - 1.0 / 3.0).abs() < 1e-6 && mesh.euler_number() == 2, "{repairs:?}");
    }

    #[test]
    fn inverted_box_is_turned_outwards() {
        let mut mesh = Mesh::default();
        append_box(&mut mesh, [0.0; 3], [1.0; 3]);
        mesh.triangles.iter_mut().for_each(|t| t.reverse());
        let (out, repairs) = print_ready(&mesh);
        assert!(repairs.was_inverted && (out.volume() - 1.0).abs() < 1e-12);
    }

    /// Two boxes with one face on the other: merging equal positions afterwards leaves two bodies.
    #[test]
    fn lips_that_coincide_are_parted() {
        let mut mesh = Mesh::default();
        append_box(&mut mesh, [0.0; 3], [1.0; 3]);
        append_box(&mut mesh, [1.0, 0.0, 0.0], [2.0, 1.0, 1.0]);
        assert!(!MeshCheck::of(&glue(&mesh)).is_closed_manifold());
        let (out, repairs) = print_ready(&mesh);
        assert_eq!(repairs.parted_vertices, 8);
        let check = MeshCheck::of(&glue(&out));
        assert!(check.is_closed_manifold() && check.components == 2, "{check:?}");
        assert!((out.volume() - 2.0).abs() < 1e-3);
    }
}
