//! Whether clay touches a separating tool. A node's stencil reaches 1.5 cells, so clay and tool share nodes
//! before they meet, and velocities at a node cannot tell a gap from contact. The particles can: each knows
//! its distance from the tool and how far its own clay reaches.
//!
//! That contact needs a closed gap besides an approach is Bardenhagen's and Nairn's (2013, "Modeling
//! imperfect interfaces in the material point method using multimaterial methods", CMES 92), who take the gap
//! from mean positions at the nodes. A mean over the stencil is blind to tips and edges, where most of it is
//! far from the tool; what touches is summed here instead.

/// Offset of a separating tool's contact \[cells\]: nodes closer than this take part where clay touches. Half a
/// cell: there is always one plane of nodes within half a cell of a face.
pub const TOUCH_OFFSET: f64 = 0.5;

/// A particle begins to touch and touches wholly within this length \[cells\]: a small error of a distance
/// stays a small error of the motion.
pub const TOUCH_FADE: f64 = 0.1;

/// Share of the first layer of particles, or of their touch, that closes a gap [-].
pub const TOUCH_SHARE: f64 = 0.25;

/// Where the centres of the first layer of particles are when its face is on the surface [cells]: 4 particles
/// a cell of the layer, two along each edge.
pub(crate) const LAYER_DEPTH: f64 = 0.25;

/// How much a particle touches a tool at `distance` \[cells\] from its centre if its clay reaches `radius`
/// \[cells\] about it, half the cube root of its volume: [`TOUCH_SHARE`] where its face is on the surface, 1
/// further in, 0 away.
pub fn particle_touch(distance: f64, radius: f64) -> f64 {
    (TOUCH_SHARE + (radius - distance) / TOUCH_FADE).clamp(0.0, 1.0)
}

/// The quadratic B-spline at `distance` \[cells\] from a node [-].
pub(crate) fn spline(distance: f64) -> f64 {
    let r = distance.abs();
    if r < 0.5 { 0.75 - r * r } else { 0.5 * (1.5 - r).max(0.0).powi(2) }
}

/// How closed the gap is [-] at a node at the distance `node` [cells, < [`TOUCH_OFFSET`]] from a separating
/// tool, where the clay that touches adds up to `touching` of a full cell's mass: `sum w m touch` against
/// [`TOUCH_SHARE`] of a layer of 4 particles a cell with its face on the surface, which brings the node half
/// the quadratic spline of its centres' distance.
pub fn closed_share(touching: f64, node: f64) -> f64 {
    let layer = TOUCH_SHARE * 0.5 * spline(LAYER_DEPTH - node);
    if touching >= layer { 1.0 } else { touching / layer }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A layer whose face is on the surface closes the gap at every node; a tenth of a cell away it does not
    /// touch.
    #[test]
    fn layer_touches_where_its_face_does() {
        let share = |node: f64, gap: f64| closed_share(0.5 * spline(0.25 + gap - node) * particle_touch(0.25 + gap, 0.25), node);
        for node in [-1.2, -0.7, -0.2, 0.0, 0.3, 0.49] {
            assert!(share(node, 0.0) > 0.999 && share(node, -0.05) == 1.0, "{node}");
            assert_eq!(share(node, 0.1), 0.0, "{node}");
        }
    }

    /// A quarter of the layer, clay at an edge, closes the gap once it is pressed in by less than a tenth of
    /// a cell.
    #[test]
    fn edge_of_clay_touches() {
        let share = |gap: f64| closed_share(0.25 * 0.5 * spline(0.25) * particle_touch(0.25 + gap, 0.25), 0.0);
        assert!(share(-0.1) == 1.0 && (0.2..0.3).contains(&share(0.0)), "{} {}", share(-0.1), share(0.0));
    }

    /// A node that no layer can reach is closed to whatever does, and no clay closes nothing.
    #[test]
    fn deep_nodes_are_closed() {
        assert_eq!(closed_share(1e-9, -1.4), 1.0);
        assert_eq!(closed_share(0.0, 0.0), 0.0);
    }
}
