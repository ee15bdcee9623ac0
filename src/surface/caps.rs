//! Closes the small gaps between the two copies of a cut cell and the one copy of a rim cell beside it.

use super::mesh::Mesh;
use std::collections::{BTreeMap, HashSet};

/// Caps every closed cycle of unbalanced edges of the triangles marked `at_cut` (the rest of the mesh is closed by construction).
///
/// On a face between a cut and a rim cell the contours of the front copy, the back copy and the rim cell differ by cycles of 3 or 4
/// vertices; each becomes a fan of 1 or 2 triangles.
pub(crate) fn cap_cycles(mesh: &mut Mesh, at_cut: &[bool]) {
    let mut near = vec![false; mesh.positions.len()];
    for (t, _) in mesh.triangles.iter().zip(at_cut).filter(|(_, c)| **c) {
        t.iter().for_each(|&v| near[v as usize] = true);
    }
    // Balance of each edge between such vertices: an edge with a triangle at the cut has both ends among them.
    let mut edges: Vec<([u32; 2], i32)> = mesh
        .edges()
        .filter(|[a, b]| near[*a as usize] && near[*b as usize])
        .map(|[a, b]| if a < b { ([a, b], 1) } else { ([b, a], -1) })
        .collect();
    edges.sort_unstable();
    let mut present = HashSet::new();
    let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for run in edges.chunk_by(|a, b| a.0 == b.0) {
        let [a, b] = run[0].0;
        present.insert([a, b]);
        let balance: i32 = run.iter().map(|e| e.1).sum();
        // A cap passes the edge the other way.
        let (from, to) = if balance > 0 { (b, a) } else { (a, b) };
        (0..balance.abs()).for_each(|_| next.entry(from).or_default().push(to));
    }
    for cycle in simple_cycles(next) {
        fan(mesh, &cycle, &mut present);
    }
}

/// Splits a balanced set of directed edges into cycles that pass no vertex twice.
fn simple_cycles(mut next: BTreeMap<u32, Vec<u32>>) -> Vec<Vec<u32>> {
    let mut cycles = Vec::new();
    while let Some((&start, _)) = next.first_key_value() {
        let mut path = vec![start];
        while let Some(&last) = path.last() {
            let Some(ends) = next.get_mut(&last) else { break };
            let end = ends.pop();
            if ends.is_empty() {
                next.remove(&last);
            }
            let Some(end) = end else { break };
            match path.iter().position(|&v| v == end) {
                Some(at) => {
                    cycles.push(path.split_off(at));
                    path.push(end);
                }
                None => path.push(end),
            }
        }
    }
    cycles
}

/// Fills a cycle with a fan from a vertex whose chords are no edges yet, or from a new vertex in the middle if there is none.
fn fan(mesh: &mut Mesh, cycle: &[u32], present: &mut HashSet<[u32; 2]>) {
    let count = cycle.len();
    let edge = |a: u32, b: u32| [a.min(b), a.max(b)];
    let at = |i: usize| cycle[i % count];
    let is_free = |first: &usize| (2..count - 1).all(|i| !present.contains(&edge(at(*first), at(first + i))));
    if let Some(first) = (0..count).find(is_free) {
        for i in 1..count - 1 {
            mesh.triangles.push([at(first), at(first + i), at(first + i + 1)]);
            present.insert(edge(at(first), at(first + i + 1)));
        }
        return;
    }
    let middle = mesh.positions.len() as u32;
    let sum = cycle.iter().fold(glam::Vec3::ZERO, |s, &v| s + glam::Vec3::from_array(mesh.positions[v as usize]));
    mesh.positions.push((sum / count as f32).to_array());
    (0..count).for_each(|i| mesh.triangles.push([middle, at(i), at(i + 1)]));
}
