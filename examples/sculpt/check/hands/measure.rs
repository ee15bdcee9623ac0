//! Where dents and cuts lie, as the surface shows them.

use bevy_clay::prelude::*;
use bevy_clay::surface::extract::extract_field;
use bevy_clay::surface::field::{Field, SurfaceSettings};
use bevy_clay::surface::ray::cast_ray;
use glam::{DVec2, DVec3};

/// Rays across a dent, each way.
const RAYS: i32 = 20;
/// Least part of the whole that counts as a body of its own.
const BODY_PART: f64 = 0.005;

/// A dent in what was a flat top.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dent {
    /// Its middle, in x and z of the clay's frame \[m\]: the mean place of what went down by more than half its
    /// depth, by how far it did.
    pub(super) middle: DVec2,
    /// How far its lowest point went down \[m\].
    pub(super) depth: f64,
}

/// Height of the surface at x and z \[m\].
pub(super) fn height(surface: &Field, at: DVec2) -> Option<f64> {
    let origin = DVec3::new(at.x, 0.5, at.y);
    cast_ray(surface, &SurfaceSettings::default(), origin, DVec3::NEG_Y).map(|hit| hit.point.y)
}

/// The dent within `radius` \[m\] of a place on top.
pub(super) fn dent(before: &Field, after: &Field, at: DVec2, radius: f64) -> Option<Dent> {
    let mut drops = vec![];
    for i in -RAYS..=RAYS {
        for k in -RAYS..=RAYS {
            let place = at + DVec2::new(f64::from(i), f64::from(k)) * radius / f64::from(RAYS);
            if place.distance(at) <= radius
                && let (Some(was), Some(is)) = (height(before, place), height(after, place))
            {
                drops.push((place, was - is));
            }
        }
    }
    let (_, depth) = drops.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let (mut weight, mut sum) = (0.0, DVec2::ZERO);
    for (place, drop) in drops.iter().filter(|(_, drop)| *drop > depth / 2.0) {
        weight += drop;
        sum += place * drop;
    }
    (weight > 0.0).then(|| Dent { middle: sum / weight, depth })
}

/// A cut across x: what is between two bodies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cut {
    /// The plane that is as far from the one side as from the other \[m\].
    pub(super) x: f64,
    /// How far the sides are apart \[m\].
    pub(super) gap: f64,
    pub(super) bodies: usize,
}

/// The cut near the plane of `x` \[m\], as seen within `reach` of it; a surface without one has none.
pub(super) fn cut(surface: &ClaySurface, x: f64, reach: f64) -> Option<Cut> {
    let mesh = match surface.mesh() {
        Some(mesh) => (**mesh).clone(),
        None => extract_field(surface.field(), SurfaceSettings::default().iso_threshold),
    };
    let least = BODY_PART * mesh.volume().abs();
    let bodies: Vec<_> = mesh.components().into_iter().filter(|body| body.volume().abs() > least).collect();
    // Each side by the areas that face across, weighted by them.
    let side = |sign: f64| {
        let (mut area, mut sum) = (0.0, 0.0);
        for triangle in mesh.triangles.iter().copied() {
            let (corners, out) = (mesh.corners(triangle), mesh.area_vector(triangle));
            let middle = corners.iter().sum::<DVec3>() / 3.0;
            if (middle.x - x).abs() < reach && out.x * sign > 0.8 * out.length() {
                area += out.length();
                sum += out.length() * middle.x;
            }
        }
        (area > 0.0).then(|| sum / area)
    };
    let (left, right) = (side(1.0)?, side(-1.0)?);
    Some(Cut { x: (left + right) / 2.0, gap: right - left, bodies: bodies.len() })
}
