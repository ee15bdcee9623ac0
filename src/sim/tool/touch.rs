//! Whether clay touches a separating tool. A node's stencil reaches 1.5 cells, so clay and tool share nodes before they meet, and velocities at a node
//! cannot tell a gap from contact. The mean distance of the clay about the node can: of clay up to the surface it is a known function of the node's own.
//!
//! That contact needs a vanishing gap besides an approach, and the gap comes from positions taken to the nodes, is Nairn's (2013, "Modeling
//! imperfect interfaces in the material point method using multimaterial methods", CMES 92).

/// Offset of a separating tool's contact [cells]: nodes closer than this take part where the clay about them touches. More than half a cell, so that there is
/// always such a node under a face: with 0.4 the force of a plate on a ball dips by 6 % where one plane of nodes goes and the next has not come.
pub const TOUCH_OFFSET: f64 = 0.6;

/// Clay further than this from a tool [cells] shares no node with its contact: [`TOUCH_OFFSET`] and the diagonal of a stencil's reach of 1.5.
pub const TOUCH_REACH: f64 = 3.25;

/// Beyond the mean distance of touching clay, contact fades out over this length [cells]: a small error of a sum stays a small error of the motion.
pub(crate) const TOUCH_FADE: f64 = 0.1;

/// `l^2 / 24` [cells^2] of clay in layers `l` = 1/2 apart, as 8 particles a cell stand.
pub(crate) const TOUCH_LAYERS: f64 = 0.25 / 24.0;

/// How closed the gap is at a node `node` [cells] from a separating tool's surface, less than [`TOUCH_OFFSET`], if the clay about the node has the mean
/// distance `mean` [cells]: 1 where it touches, 0 where it does not.
///
/// Clay that fills the half space up to the surface, seen with the quadratic spline `N` from a node at the distance `s`, has the moments
/// `M0 = integral of N(d - s)` and `M1 = integral of d N(d - s)` over `d > 0`; layers of particles in place of the integral add `l^2 / 24` of the integrands' slopes at
/// 0 (Euler and Maclaurin). `M1 / M0` is the mean distance of touching clay.
pub(crate) fn closed_share(mean: f64, node: f64) -> f64 {
    let s = node;
    let reach = 1.5 + s;
    let (m0, m1, weight, slope) = if s <= -0.5 {
        (reach.powi(3) / 6.0, reach.powi(4) / 24.0, 0.5 * reach * reach, -reach)
    } else if s <= 0.5 {
        let m1 = 0.203_125 + s * (0.5 + s * (0.375 - s * s / 12.0));
        (0.5 + s * (0.75 - s * s / 3.0), m1, 0.75 - s * s, 2.0 * s)
    } else {
        let rest = (1.5 - s).max(0.0);
        (1.0 - rest.powi(3) / 6.0, s + rest.powi(4) / 24.0, 0.5 * rest * rest, rest)
    };
    let layers = m0 + TOUCH_LAYERS * slope;
    // No layer of touching clay reaches so deep a node: what does is inside the tool.
    if reach <= 0.0 || layers <= 0.0 {
        return 1.0;
    }
    let touching = (m1 + TOUCH_LAYERS * weight) / layers;
    (1.0 + (touching - mean) / TOUCH_FADE).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean distance at a node of layers of particles half a cell apart, the first a quarter cell beyond `gap`.
    fn layers(node: f64, gap: f64) -> f64 {
        let (mut mass, mut moment) = (0.0, 0.0);
        for i in 0..8 {
            let d = gap + 0.25 + 0.5 * f64::from(i);
            let r = (d - node).abs();
            let w = if r < 0.5 { 0.75 - r * r } else { 0.5 * (1.5 - r).max(0.0).powi(2) };
            mass += w;
            moment += w * d;
        }
        moment / mass
    }

    /// Clay whose face is on the surface touches, wherever the nodes stand; clay an eighth of a cell away does not.
    #[test]
    fn layers_touch_where_their_face_does() {
        for i in -9..=6 {
            let s = f64::from(i) * 0.1;
            // Kinks of the spline's second derivative leave some thousandths of a cell.
            assert!(closed_share(layers(s, -0.01), s) > 0.9, "{s}: {}", closed_share(layers(s, -0.01), s));
            let share = closed_share(layers(s, 0.25), s);
            assert_eq!(share, 0.0, "{s}");
        }
    }

    /// The three pieces meet, and a node that touching clay cannot reach is closed to what does.
    #[test]
    fn share_is_continuous_and_closed_deep_inside() {
        for (s, mean) in [(-0.5, 0.35), (0.5, 0.7)] {
            let [a, b] = [s - 1e-9, s + 1e-9].map(|s| closed_share(mean, s));
            assert!((a - b).abs() < 1e-6 && a > 0.0 && a < 1.0, "{a} {b}");
        }
        assert_eq!(closed_share(0.2, -1.4), 1.0);
        assert_eq!(closed_share(-1.0, -2.0), 1.0);
    }
}
