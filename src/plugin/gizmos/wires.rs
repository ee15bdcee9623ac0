//! A tool's shape as lines, and where clay pushes it.

use crate::sim::tool::ToolShape;
use bevy::prelude::*;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Chords of a circle.
const CHORDS: u32 = 48;

/// Lines on the surface of `shape`, in its own frame \[m\].
pub(super) fn of_shape(shape: &ToolShape) -> Vec<Vec<DVec3>> {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    match *shape {
        ToolShape::Sphere { radius } => [(x, y), (y, z), (z, x)].map(|(a, b)| circle(DVec3::ZERO, a * radius, b * radius)).into(),
        ToolShape::Capsule { radius, half_length } => {
            let end = y * half_length;
            let rounds = [end, -end].map(|at| circle(at, x * radius, z * radius));
            rounds.into_iter().chain([x, z].map(|side| stadium(end, side * radius, y * radius))).collect()
        }
        ToolShape::Box { half_size } => frame(half_size, &[(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)]),
        ToolShape::Blade { half_width, half_height } => {
            let (w, h) = (x * half_width, y * half_height);
            vec![vec![-w - h, w - h, w + h, h - w, -w - h]]
        }
        ToolShape::PointedBlade { half_width, half_height } => {
            let (w, h) = (x * half_width, y * half_height);
            vec![vec![-h, w + h, h - w, -h]]
        }
        ToolShape::BentBlade { profile, half_height } => {
            let along: Vec<_> = profile.points().iter().map(|p| (p.x, p.y)).collect();
            frame(DVec3::new(1.0, half_height, 1.0), &along)
        }
        ToolShape::Wire { half_length } => vec![vec![-x * half_length, x * half_length]],
        ToolShape::Cone { radius, half_height } => {
            let end = y * half_height;
            let slants = [x, z, -x, -z].map(|out| vec![-end, end + out * radius]);
            slants.into_iter().chain([circle(end, x * radius, z * radius)]).collect()
        }
    }
}

/// The arc about `centre` from angle `start` on, through `turn`; `a` and `b` are radii at right angles.
fn arc(centre: DVec3, a: DVec3, b: DVec3, (start, turn): (f64, f64)) -> impl Iterator<Item = DVec3> {
    (0..=CHORDS).map(move |i| {
        let (sin, cos) = (start + turn * f64::from(i) / f64::from(CHORDS)).sin_cos();
        centre + a * cos + b * sin
    })
}

fn circle(centre: DVec3, a: DVec3, b: DVec3) -> Vec<DVec3> {
    arc(centre, a, b, (0.0, TAU)).collect()
}

/// Half circles about `end` and the point opposite, joined; `side` and `up` are their radii.
fn stadium(end: DVec3, side: DVec3, up: DVec3) -> Vec<DVec3> {
    let arcs = arc(end, side, up, (0.0, PI)).chain(arc(-end, side, up, (PI, PI)));
    arcs.chain([end + side]).collect()
}

/// A polyline in the XZ plane at either height, with an upright at each of its points.
fn frame(scale: DVec3, along: &[(f64, f64)]) -> Vec<Vec<DVec3>> {
    let at = |(x, z): (f64, f64), y: f64| scale * DVec3::new(x, y, z);
    let rails = [-1.0, 1.0].map(|y| along.iter().map(|p| at(*p, y)).collect());
    let uprights = along.iter().map(|p| vec![at(*p, -1.0), at(*p, 1.0)]);
    rails.into_iter().chain(uprights).collect()
}

/// Where a `force` in the tool's own frame pushes it: the point of a solid shape's surface that lies against
/// the force from the origin \[m\]. The origin of blades and wires.
pub(super) fn touched(shape: &ToolShape, force: DVec3) -> DVec3 {
    /// Halvings of the way to the surface.
    const HALVINGS: u32 = 40;
    let against = -force.normalize_or_zero();
    if shape.is_blade() || against == DVec3::ZERO {
        return DVec3::ZERO;
    }
    let (mut inside, mut outside) = (0.0, shape.bounding_radius());
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(inside, outside);
        if shape.distance(against * middle) < 0.0 {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    against * outside
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The touched point lies on the surface, on the side that the force comes from.
    #[test]
    fn touched_point_is_where_the_force_comes_from() {
        for shape in ToolShape::ALL.into_iter().filter(|shape| !shape.is_blade()) {
            for force in [DVec3::new(0.3, 1.0, -0.4), DVec3::NEG_X, DVec3::new(0.0, -2.0, 1.0)] {
                let at = touched(&shape, force);
                assert!(shape.distance(at).abs() < 1e-9, "{shape:?}: {at}");
                assert!(at.angle_between(-force) < 1e-7, "{shape:?}: {at}");
            }
        }
        let blade = ToolShape::Blade { half_width: 1.0, half_height: 1.0 };
        assert_eq!(touched(&blade, DVec3::X), DVec3::ZERO);
    }
}
