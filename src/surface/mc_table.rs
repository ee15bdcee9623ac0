//! The marching cubes table, generated from one rule.
//!
//! Corner `i` of a cell stands at `(i & 1, i >> 1 & 1, i >> 2 & 1)`; bit `i` of a case is set where corner
//! `i` is inside. Edge `e` joins the corners [`EDGES`]`[e]` = `(low, high)`, whose numbers differ in one bit:
//! the edge's axis. Edges are in the order of their corner pairs: 01 02 04 13 15 23 26 37 45 46 57 67.
//!
//! On each face the contour cuts off the inside corners one by one ("separate inside"), so it depends on the
//! four signs of that face alone and the cells on both sides agree. Contours of the six faces close to loops;
//! each loop is triangulated without a diagonal in a face of the cell, so no edge inside a face is used by
//! more than the two cells. All 256 cases then need 5 triangles at most and no vertex inside the cell.

use std::sync::LazyLock;

/// Corner pairs `(low, high)` of the twelve edges.
pub const EDGES: [(u8, u8); 12] =
    [(0, 1), (0, 2), (0, 4), (1, 3), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 6), (5, 7), (6, 7)];

/// Most triangles of a case.
pub const TRIANGLES_MAX: usize = 5;

/// The triangles of one case, as edges of the cell, counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Case {
    count: u8,
    triangles: [[u8; 3]; TRIANGLES_MAX],
}

impl Case {
    /// The triangles; each corner is an index into [`EDGES`].
    pub fn triangles(&self) -> &[[u8; 3]] {
        &self.triangles[..usize::from(self.count)]
    }
}

static TABLE: LazyLock<[Case; 256]> = LazyLock::new(|| std::array::from_fn(|case| case_of(case as u8)));

/// The 256 cases, by their inside bits; generated at the first call.
pub fn table() -> &'static [Case; 256] {
    &TABLE
}

/// Axis (0 x, 1 y, 2 z) of an edge.
pub fn edge_axis(edge: u8) -> usize {
    let (low, high) = EDGES[usize::from(edge)];
    (low ^ high).trailing_zeros() as usize
}

fn case_of(bits: u8) -> Case {
    let mut case = Case::default();
    for l in loops(bits) {
        let mut triangles = Vec::new();
        let done = triangulate(&l, 0, l.len() - 1, &mut triangles);
        debug_assert!(done, "case {bits} has a loop with a diagonal in a face");
        for t in triangles {
            case.triangles[usize::from(case.count)] = t;
            case.count += 1;
        }
    }
    case
}

/// Corners of the face at `side` (0 low, 1 high) of `axis`, counter-clockwise seen from outside the cell.
pub(crate) fn face_corners(axis: usize, side: u8) -> [u8; 4] {
    let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
    let corners = [0, u, u | v, v].map(|c| c | side << axis);
    if side == 1 { corners } else { [corners[3], corners[2], corners[1], corners[0]] }
}

/// The edge that joins two corners.
pub(crate) fn edge_between(a: u8, b: u8) -> u8 {
    EDGES.iter().position(|&e| e == (a.min(b), a.max(b))).unwrap_or_default() as u8
}

/// Whether two edges lie in one face of the cell.
fn share_face(e: u8, g: u8) -> bool {
    let faces = |edge: u8| {
        let low = EDGES[usize::from(edge)].0;
        (0..3).filter(move |&d| d != edge_axis(edge)).map(move |d| (d, low >> d & 1))
    };
    faces(e).any(|f| faces(g).any(|h| f == h))
}

/// The closed contours of a case, each as the edges it passes.
fn loops(bits: u8) -> Vec<Vec<u8>> {
    let inside = |c: u8| bits >> c & 1 == 1;
    let mut next = [None; 12];
    for axis in 0..3 {
        for side in 0..2 {
            let corners = face_corners(axis, side);
            // Going round the face, each run of inside corners is entered at one edge and left at another:
            // the contour cuts it off from where it was entered to where it is left. On an ambiguous face the
            // runs are single corners.
            for k in 0..4 {
                if !inside(corners[k]) || inside(corners[(k + 1) % 4]) {
                    continue;
                }
                let mut first = k;
                while inside(corners[(first + 3) % 4]) {
                    first = (first + 3) % 4;
                }
                let entered = edge_between(corners[(first + 3) % 4], corners[first]);
                next[usize::from(entered)] = Some(edge_between(corners[k], corners[(k + 1) % 4]));
            }
        }
    }
    let mut loops = Vec::new();
    for start in 0..12 {
        let mut l = Vec::new();
        let mut edge = start;
        while let Some(following) = next[usize::from(edge)].take() {
            l.push(edge);
            edge = following;
        }
        if !l.is_empty() {
            loops.push(l);
        }
    }
    loops
}

/// Triangulates the part `low..=high` of a loop, of which the chord `low`-`high` is given, with no diagonal
/// in a face.
fn triangulate(l: &[u8], low: usize, high: usize, out: &mut Vec<[u8; 3]>) -> bool {
    if high - low < 2 {
        return true;
    }
    let mark = out.len();
    let diagonal = |a: usize, b: usize| b - a < 2 || !share_face(l[a], l[b]);
    for middle in low + 1..high {
        if !diagonal(low, middle) || !diagonal(middle, high) {
            continue;
        }
        if triangulate(l, low, middle, out) && triangulate(l, middle, high, out) {
            out.push([l[low], l[middle], l[high]]);
            return true;
        }
        out.truncate(mark);
    }
    false
}

#[cfg(test)]
mod tests {
    use super::super::check::MeshCheck;
    use super::super::extract::extract_field;
    use super::super::field::Field;
    use super::super::oracle::euler_number_of_nodes;
    use super::*;

    /// Extracts the nodes of `extent`, +1 inside and -1 outside, padded by one outside layer, and compares
    /// with the oracle.
    fn assert_sound(extent: [usize; 3], inside: &dyn Fn(usize) -> bool, name: &str) {
        let padded = extent.map(|n| n + 2);
        let mut values = vec![-1.0f32; padded.iter().product()];
        let mut count = 0;
        for z in 0..extent[2] {
            for y in 0..extent[1] {
                for x in 0..extent[0] {
                    if inside(count) {
                        values[x + 1 + padded[0] * (y + 1 + padded[1] * (z + 1))] = 1.0;
                    }
                    count += 1;
                }
            }
        }
        let mesh = extract_field(&Field::from_nodes(padded, &values, None), 0.0);
        let check = MeshCheck::of(&mesh);
        assert!(check.is_closed_manifold(), "{name}: {check:?}");
        assert_eq!(check.degenerate_triangles, 0, "{name}");
        assert_eq!(check.euler, euler_number_of_nodes(padded, &values, 0.0), "{name}");
        assert!(mesh.volume() > 0.0 || mesh.triangles.is_empty(), "{name}: inside out");
    }

    /// Case 0 and 255 are empty, no case has more than 5 triangles, some case has 5.
    #[test]
    fn table_has_at_most_five_triangles_per_case() {
        let most = table().iter().map(|c| c.triangles().len()).max();
        assert_eq!(most, Some(TRIANGLES_MAX));
        let empty: Vec<_> = (0..256).filter(|&c| table()[c].triangles().is_empty()).collect();
        assert_eq!(empty, [0, 255]);
    }

    /// No triangle edge other than a contour of the face lies in a face of the cell.
    #[test]
    fn table_uses_each_chord_of_a_face_once() {
        for (bits, case) in table().iter().enumerate() {
            let mut chords = Vec::new();
            for t in case.triangles() {
                for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                    if share_face(a, b) {
                        chords.push((a.min(b), a.max(b)));
                    }
                }
            }
            let count = chords.len();
            chords.sort_unstable();
            chords.dedup();
            assert_eq!(count, chords.len(), "case {bits}");
        }
    }

    #[test]
    fn single_cells_of_all_256_cases_are_closed_and_match_the_oracle() {
        for bits in 1..256usize {
            assert_sound([2, 2, 2], &|i| bits >> i & 1 == 1, &format!("case {bits}"));
        }
    }

    /// Every pair of cases that can meet at a face, in each of the three directions.
    #[test]
    fn cell_pairs_of_all_4095_sign_patterns_are_closed_and_match_the_oracle() {
        for (axis, extent) in [[3, 2, 2], [2, 3, 2], [2, 2, 3]].into_iter().enumerate() {
            for bits in 1..4096usize {
                assert_sound(extent, &|i| bits >> i & 1 == 1, &format!("axis {axis}, pattern {bits}"));
            }
        }
    }
}
