//! Shells to bodies: a shell that faces inwards is the wall of a cavity and belongs to the body around it.

use crate::scene::import::ImportedMesh;
use crate::scene::winding::WindingTree;
use crate::surface::mesh::Mesh;
use glam::DVec3;
use std::cell::OnceCell;

/// A piece of clay on its own.
#[derive(Clone, Debug)]
pub struct Body {
    /// The outer shell, facing outwards, and those of its cavities, facing into them.
    pub mesh: Mesh,
    /// Volume [m^3], the cavities' taken off.
    pub volume: f64,
    /// Hollows without a way out.
    pub cavities: usize,
}

/// The bodies of a closed, oriented mesh, by falling volume. A cavity goes to the smallest shell around it; a
/// shell that faces inwards with none around it is a body inside out, and is turned.
pub fn bodies_of(mesh: &Mesh) -> Vec<Body> {
    let shells = mesh.components();
    let volumes: Vec<f64> = shells.iter().map(Mesh::volume).collect();
    let bounds: Vec<_> = shells.iter().map(|s| s.bounds().unwrap_or_default()).collect();
    let (inner, mut outer): (Vec<usize>, Vec<usize>) = (0..shells.len()).partition(|&i| volumes[i] < 0.0);
    // The smallest first: the first that a cavity is in is the one around it.
    outer.sort_by(|&a, &b| volumes[a].total_cmp(&volumes[b]));
    let mut cavities_of = vec![Vec::new(); shells.len()];
    let trees = vec![OnceCell::new(); shells.len()];
    let mut bodies = Vec::new();
    for cavity in inner {
        let (low, high) = bounds[cavity];
        let is_around = |&&shell: &&usize| {
            let (l, h) = bounds[shell];
            l.cmple(low).all()
                && h.cmpge(high).all()
                && is_inside(&shells[cavity], trees[shell].get_or_init(|| tree_of(&shells[shell])))
        };
        match outer.iter().find(is_around) {
            Some(&shell) => cavities_of[shell].push(cavity),
            None => {
                let mut mesh = shells[cavity].clone();
                mesh.triangles.iter_mut().for_each(|t| t.reverse());
                if mesh.normals.is_some() {
                    mesh.compute_normals();
                }
                bodies.push(Body { mesh, volume: -volumes[cavity], cavities: 0 });
            }
        }
    }
    for shell in outer {
        let mut body = Body { mesh: shells[shell].clone(), volume: volumes[shell], cavities: cavities_of[shell].len() };
        for &cavity in &cavities_of[shell] {
            append(&mut body.mesh, &shells[cavity]);
            body.volume += volumes[cavity];
        }
        bodies.push(body);
    }
    // Equal volumes keep the mesh's order of bodies.
    bodies.sort_by(|a, b| b.volume.total_cmp(&a.volume));
    bodies
}

/// Adds the vertices and triangles of `other`.
fn append(mesh: &mut Mesh, other: &Mesh) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(&other.positions);
    mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|v| first + v)));
    if let (Some(normals), Some(others)) = (&mut mesh.normals, &other.normals) {
        normals.extend(others);
    }
}

/// A shell prepared for the question what is in it.
fn tree_of(shell: &Mesh) -> WindingTree {
    let positions = shell.positions.iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
    WindingTree::new(&ImportedMesh { positions, triangles: shell.triangles.clone(), doubled: 0 })
}

/// Whether `inner` is inside a closed shell: by the mean winding number of three of its vertices, so that one
/// that all but touches the shell does not decide alone.
fn is_inside(inner: &Mesh, tree: &WindingTree) -> bool {
    let count = inner.positions.len();
    let points = [0, count / 3, 2 * count / 3].map(|i| DVec3::from_array(inner.positions[i].map(f64::from)));
    points.iter().map(|p| tree.at(*p)).sum::<f64>() > 1.5
}
