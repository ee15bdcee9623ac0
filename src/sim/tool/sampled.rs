//! Tools as clouds of points, for the methods of others: rigid particles (Hu et al. 2018) and interactive
//! particles (Deng et al.).

use super::super::cutting::CuttingMethod;
use super::super::spline::spline;
use super::outline::Outline;
use super::path::Motion;
use super::profile::Profile;
use super::shape::ToolShape;
use glam::{DVec3, IVec3};
use std::collections::HashMap;

/// Greatest distance between neighbouring points [cells]: with half a cell, the 3^3 nodes of the points of a
/// plane leave no hole, and one layer is closed.
pub(crate) const SPACING: f64 = 0.5;

/// Distances that differ by less are equal \[cells\].
const TIE: f64 = 1e-9;

/// A point of a tool in its own frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    pub(crate) at: DVec3,
    /// Unit normal of a blade's front; 0 inside a solid tool.
    pub(crate) normal: DVec3,
}

/// Points from -`half` to `half`, both among them, at most `spacing` apart.
fn row(half: f64, spacing: f64) -> impl Iterator<Item = f64> {
    // A length of whole spacings is not cut once more for a rounding error.
    let count = (2.0 * half / spacing - 1e-9).ceil().max(1.0);
    (0..=count as u32).map(move |i| half * (2.0 * f64::from(i) / count - 1.0))
}

/// A shape's points, at most `spacing` apart: one layer of a blade, rim included; all of a solid. A wire has
/// none.
pub(crate) fn samples(shape: &ToolShape, spacing: f64) -> Vec<Sample> {
    let flat = |at| Sample { at, normal: DVec3::Z };
    match shape.outline() {
        Some(Outline::Rectangle { half_width, half_height }) => {
            let line = |y| row(half_width, spacing).map(move |x| flat(DVec3::new(x, y, 0.0)));
            row(half_height, spacing).flat_map(line).collect()
        }
        Some(Outline::Triangle { half_width, half_height }) => {
            let width = |y: f64| half_width * (y + half_height) / (2.0 * half_height);
            let line = |y| row(width(y), spacing).map(move |x| flat(DVec3::new(x, y, 0.0)));
            row(half_height, spacing).flat_map(line).collect()
        }
        Some(Outline::Strip { profile, half_height }) => bent(&profile, half_height, spacing),
        Some(Outline::Wire { .. }) => vec![],
        Some(Outline::Plate { .. }) | None => {
            // The points of a lattice about the origin that are inside.
            let half = (shape.bounding_radius() / spacing).ceil();
            let axis = || row(half * spacing, spacing);
            let points = axis().flat_map(|x| axis().flat_map(move |y| axis().map(move |z| DVec3::new(x, y, z))));
            points.filter(|at| shape.distance(*at) <= 0.0).map(|at| Sample { at, normal: DVec3::ZERO }).collect()
        }
    }
}

fn bent(profile: &Profile, half_height: f64, spacing: f64) -> Vec<Sample> {
    let mut samples = vec![];
    for pair in profile.points().windows(2) {
        let (middle, half) = ((pair[0] + pair[1]) / 2.0, (pair[1] - pair[0]) / 2.0);
        let front = half.normalize().perp();
        let normal = DVec3::new(front.x, 0.0, front.y);
        for t in row(half.length(), spacing) {
            let at = middle + half.normalize() * t;
            samples.extend(row(half_height, spacing).map(|y| Sample { at: DVec3::new(at.x, y, at.y), normal }));
        }
    }
    samples
}

/// What a sampled tool is to the nodes in one substep.
#[derive(Clone, Debug)]
pub(crate) enum Sampled {
    /// Of a blade's rigid particles, at the substep's end: the signed distance \[cells\] of the nodes about
    /// them from the nearest of them, and the front's normal there.
    Sides(HashMap<IVec3, (f64, DVec3)>),
    /// Of a tool's interactive particles, where they are at the substep's start: mass and momentum at the
    /// nodes.
    Mass(HashMap<IVec3, (f64, DVec3)>),
}

impl Sampled {
    /// What `samples`, moved by `motion` and put into cells by `to_grid`, are under `method`: of `mass` each
    /// if they have any. The momentum has the unit of `mass` and `motion`.
    pub(crate) fn new(
        method: CuttingMethod,
        samples: &[Sample],
        motion: &Motion,
        mass: f64,
        to_grid: impl Fn(DVec3) -> DVec3,
    ) -> Option<Self> {
        match method {
            CuttingMethod::TwoFields | CuttingMethod::Published => None,
            CuttingMethod::RigidParticles => {
                let mut sides: HashMap<IVec3, (f64, DVec3)> = HashMap::new();
                for sample in samples.iter().filter(|s| s.normal != DVec3::ZERO) {
                    let (at, normal) = (to_grid(motion.end.to_world(sample.at)), motion.end.rotation * sample.normal);
                    for (node, _) in nodes(at) {
                        let way = node.as_dvec3() - at;
                        let distance = if way.dot(normal) < 0.0 { -way.length() } else { way.length() };
                        let nearest = sides.entry(node).or_insert((distance, normal));
                        // Of several that are as near the first, whatever the last bit says.
                        if distance.abs() < nearest.0.abs() - TIE {
                            *nearest = (distance, normal);
                        }
                    }
                }
                Some(Self::Sides(sides))
            }
            CuttingMethod::InteractiveParticles => {
                let mut masses: HashMap<IVec3, (f64, DVec3)> = HashMap::new();
                for sample in samples {
                    let [from, to] = [motion.start, motion.end].map(|pose| pose.to_world(sample.at));
                    let velocity = (to - from) / motion.duration;
                    for (node, weight) in nodes(to_grid(from)) {
                        let sum = masses.entry(node).or_default();
                        sum.0 += weight * mass;
                        sum.1 += weight * mass * velocity;
                    }
                }
                Some(Self::Mass(masses))
            }
        }
    }

    /// Signed distance \[cells\] of a node from the nearest rigid particle and the normal of the front there,
    /// if the node is about one.
    pub(crate) fn side(&self, node: IVec3) -> Option<(f64, DVec3)> {
        match self {
            Self::Sides(sides) => sides.get(&node).copied(),
            Self::Mass(_) => None,
        }
    }

    /// Mass and momentum of the tool's particles at a node.
    pub(crate) fn mass(&self, node: IVec3) -> (f64, DVec3) {
        match self {
            Self::Sides(_) => (0.0, DVec3::ZERO),
            Self::Mass(masses) => masses.get(&node).copied().unwrap_or_default(),
        }
    }

    /// The side (+1, -1, or 0 where it is undecided) that most of the nodes of a particle at `at` \[cells\]
    /// have, `sign(sum w T |d|)`, if any of them has one.
    pub(crate) fn colour(&self, at: DVec3) -> Option<i8> {
        let sides = nodes(at).filter_map(|(node, weight)| Some(weight * self.side(node)?.0));
        let sum = sides.reduce(|a, b| a + b)?;
        Some(if sum > 0.0 { 1 } else { -i8::from(sum < 0.0) })
    }
}

/// The 3^3 nodes about `at` \[cells\], and the weight of each.
fn nodes(at: DVec3) -> impl Iterator<Item = (IVec3, f64)> {
    let base = (at - 0.5).floor();
    (0..27).map(move |i| {
        let node = base + DVec3::new(f64::from(i / 9), f64::from(i / 3 % 3), f64::from(i % 3));
        let weight = (node - at).to_array().map(spline).iter().product();
        (node.as_ivec3(), weight)
    })
}

#[cfg(test)]
mod tests {
    use super::super::{BAND, Pose};
    use super::*;

    fn still(at: DVec3) -> Motion {
        let pose = Pose { position: at, ..Pose::default() };
        Motion { start: pose, end: pose, duration: 1.0 }
    }

    /// The nodes within the band over the blade know their side, those further off none.
    #[test]
    fn rigid_particles_know_the_sides_of_a_blade() {
        let blade = samples(&ToolShape::Blade { half_width: 3.1, half_height: 2.2 }, SPACING);
        let at = DVec3::new(10.2, 10.3, 10.1);
        let sides = Sampled::new(CuttingMethod::RigidParticles, &blade, &still(at), 0.0, |x| x).expect("rigid particles");
        for z in 5..16 {
            let distance = f64::from(z) - at.z;
            let side = sides.side(IVec3::new(10, 11, z));
            assert_eq!(side.is_some(), distance.abs() <= BAND, "{z}");
            assert!(
                side.is_none_or(|s| s.0.signum() == distance.signum() && (s.0.abs() - distance.abs()).abs() < 0.1),
                "{z}: {side:?}"
            );
        }
        assert_eq!(
            (sides.colour(at + DVec3::Z * 0.3), sides.colour(at - DVec3::Z), sides.colour(at + DVec3::Z * 4.0)),
            (Some(1), Some(-1), None)
        );
    }

    /// The points of a ball have its volume, those of a pointed blade are inside its outline, and mass and
    /// momentum reach the nodes whole.
    #[test]
    fn interactive_particles_fill_the_tool() {
        let ball = samples(&ToolShape::Sphere { radius: 3.0 }, SPACING);
        let volume = ball.len() as f64 * SPACING.powi(3);
        assert!((volume / (36.0 * std::f64::consts::PI) - 1.0).abs() < 0.06, "{volume}");
        let pointed = ToolShape::PointedBlade { half_width: 2.0, half_height: 3.0 };
        assert!(samples(&pointed, SPACING).iter().all(|s| pointed.distance(s.at) < 1e-12));
        let motion = Motion { end: Pose { position: DVec3::X * 0.1, ..Pose::default() }, ..still(DVec3::ZERO) };
        let Some(Sampled::Mass(nodes)) = Sampled::new(CuttingMethod::InteractiveParticles, &ball, &motion, 2.0, |x| x) else {
            panic!("interactive particles");
        };
        let (mass, momentum) = nodes.values().fold((0.0, DVec3::ZERO), |sum, n| (sum.0 + n.0, sum.1 + n.1));
        let whole = 2.0 * ball.len() as f64;
        assert!((mass - whole).abs() < 1e-9 && (momentum - DVec3::X * 0.1 * whole).length() < 1e-9, "{mass} {momentum}");
    }
}
