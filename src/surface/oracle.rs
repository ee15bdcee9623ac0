//! The Euler number of a surface from the signs of the nodes alone: judges the mesher without meshing.

/// Euler number of the isosurface of `values` (x fastest, shape `extent`) under the "separate inside" face
/// rule.
///
/// The inside is the cubical complex of the inside nodes: nodes V, edges E with both ends inside, faces Q and
/// cubes C with all corners inside. Two opposite outside corners of an otherwise inside cube are joined by no
/// tunnel in that complex, but each is cut off by a triangle of its own, which is one cell more: H. The
/// surface of a solid has twice its Euler number: 2 (V - E + Q - C + H). Nodes beyond the array are outside;
/// so are values equal to `iso`.
pub fn euler_number_of_nodes(extent: [usize; 3], values: &[f32], iso: f32) -> i64 {
    let inside = |p: [usize; 3]| (0..3).all(|d| p[d] < extent[d]) && values[p[0] + extent[0] * (p[1] + extent[1] * p[2])] > iso;
    let mut sum = 0;
    for z in 0..extent[2] {
        for y in 0..extent[1] {
            for x in 0..extent[0] {
                // The cell with low corner here, each of its faces, edges and nodes that touch that corner.
                for span in 0..8usize {
                    let all = (0..8usize).filter(|c| c & !span == 0).all(|c| inside(corner([x, y, z], c)));
                    sum += if all { [1, -1, 1, -1][span.count_ones() as usize] } else { 0 };
                }
                let outside: Vec<usize> = (0..8).filter(|&c| !inside(corner([x, y, z], c))).collect();
                sum += i64::from(matches!(outside[..], [a, b] if a + b == 7));
            }
        }
    }
    2 * sum
}

fn corner(low: [usize; 3], c: usize) -> [usize; 3] {
    [low[0] + (c & 1), low[1] + (c >> 1 & 1), low[2] + (c >> 2 & 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A single node is a sphere; a ring of eight nodes is a torus; a hollow cube has two spheres.
    #[test]
    fn known_bodies_have_their_euler_number() {
        assert_eq!(euler_number_of_nodes([1, 1, 1], &[1.0], 0.0), 2);
        let ring = [1.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0];
        assert_eq!(euler_number_of_nodes([3, 3, 1], &ring, 0.0), 0);
        let mut hollow = [1.0; 27];
        hollow[13] = 0.0;
        assert_eq!(euler_number_of_nodes([3, 3, 3], &hollow, 0.0), 4);
    }
}
