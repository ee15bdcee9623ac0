//! What a node finds of two sides by itself: what the oracle goes by, and what the native engine finds for
//! eight nodes at a time is held to.

use super::{FACE_DISTANCE, Facing, NORMAL_REGULARISATION, OBLIQUE_GAP, SLOPE_MIN, TERMS};
use glam::{DMat3, DVec3};

impl Facing {
    /// What is found at a node, as it counts in a mean: normal and gap times the mass that both share there,
    /// and that mass.
    pub(crate) fn weighted(self, [front, back]: [f64; 2]) -> [f64; 5] {
        let mass = front * back / (front + back);
        let [x, y, z] = (mass * self.normal).to_array();
        [x, y, z, mass * self.gap, mass]
    }
}

/// What a node tells of two sides to the fits of the nodes about it; sums over 27 nodes, each by 1/2 for
/// every axis along which it is off the one in their midst, make [`facing`]. Places are in cells from an
/// origin that all of a sum have in common.
///
/// First the mass in front times place and 1, then that behind. Then come numbers that count by the mass
/// `w = F B / (F + B)` which both share, p the middle of the node's clay and s the logarithm `ln(F / B)`: w,
/// w s, w p, w s p; and of the matrix w p p the entries xx, yy, zz, xy, yz and zx.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Terms(pub(crate) [f64; TERMS]);

/// How the two sides face each other at the node at `place`, by that alone, from the sums of what the 27
/// nodes about it tell. None where one side is missing.
///
/// The normal is the slope of `ln(F / B)` over the middles of the nodes' clay, each by what it shares. Where
/// that slope is less than [`SLOPE_MIN`], as of nodes with both sides that stand in one plane, it is the way
/// from the back's centre of mass to the front's.
///
/// The gap is the sum of the distances of both faces from the node, each by how far that side's centre of
/// mass stands before the node ([`face_distance`]), and what two faces at an angle to the grid are farther
/// apart than that ([`OBLIQUE_GAP`]).
pub(crate) fn facing(sums: &Terms, place: DVec3) -> Option<Facing> {
    let t = &sums.0;
    let vector = |i: usize| DVec3::new(t[i], t[i + 1], t[i + 2]);
    let weight = t[8];
    if weight == 0.0 {
        return None;
    }
    let mean = vector(10) / weight;
    let mut moment =
        DMat3::from_cols(DVec3::new(t[16], t[19], t[21]), DVec3::new(t[19], t[17], t[20]), DVec3::new(t[21], t[20], t[18]));
    moment -= DMat3::from_cols(mean * mean.x, mean * mean.y, mean * mean.z) * weight;
    // Nodes of one plane alone say nothing of the slope across it.
    moment += DMat3::IDENTITY * (NORMAL_REGULARISATION * (moment.x_axis.x + moment.y_axis.y + moment.z_axis.z));
    let slope = moment.inverse() * (vector(13) - mean * t[9]);
    let [front, back] = [0, 4].map(|side| vector(side) / t[side + 3] - place);
    // That of a single node is no number.
    let along = if slope.length() >= SLOPE_MIN { slope } else { front - back };
    let normal = along.try_normalize()?;
    let faces: f64 = [front.dot(normal), -back.dot(normal)].map(face_distance).iter().sum();
    Some(Facing { normal, gap: faces + OBLIQUE_GAP * (1.0 - (normal * normal).length_squared()) })
}

/// Distance \[cells\] from a node, outwards, of the face of clay whose centre of mass over the 27 nodes about
/// it, each by 1/2 for every axis along which it is off, stands `centre` \[cells\] in that direction: for clay
/// that ends in a plane, however much of it there is beside, a function of the distance alone. Fitted to a
/// plane along the grid, whose centre is `(S(1 - d) - S(-1 - d)) / (S(1 - d) + 2 S(-d) + S(-1 - d))`, S the
/// spline's integral, to 0.03 cells from -1.2 to 1.3, and put 0.023 nearer: of clay that is even or jittered
/// by a tenth of its spacing a closed cut is shut, wherever it runs. Clay of less than 1.5 cells stands
/// farther back than it seems.
fn face_distance(centre: f64) -> f64 {
    let c = centre.clamp(0.0, 1.0);
    FACE_DISTANCE.iter().fold(0.0, |sum, a| sum * c + a)
}
