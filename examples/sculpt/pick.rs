//! What a ray from the cursor meets, and how many bodies the clay is in.

use bevy::prelude::*;
use bevy_clay::prelude::ClaySurface;
use bevy_clay::surface::extract::extract_field;
use bevy_clay::surface::field::SurfaceSettings;

/// Least part of the whole that counts as a body of its own.
const BODY_PART: f64 = 0.005;

/// Where a ray meets the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hit {
    pub(crate) point: Vec3,
    /// Smooth, outwards.
    pub(crate) normal: Vec3,
    /// From the ray's origin.
    pub(crate) distance: f32,
}

/// Where `ray` first meets the surface. The clay's own frame is the world's.
pub(crate) fn cast(surface: &ClaySurface, ray: Ray3d) -> Option<Hit> {
    let hit = surface.cast(ray)?;
    Some(Hit { point: hit.point.as_vec3(), normal: hit.normal, distance: hit.distance as f32 })
}

/// Middle and half the diagonal of the surface's box.
pub(crate) fn ball(surface: &ClaySurface) -> Option<(Vec3, f32)> {
    let (low, high) = surface.bounds()?;
    Some(((low + high).as_vec3() / 2.0, (high - low).length() as f32 / 2.0))
}

/// Bodies of the surface, crumbs left out: takes long enough that it is not for the main thread.
pub(crate) fn bodies(surface: &ClaySurface) -> usize {
    let made = || extract_field(surface.field(), SurfaceSettings::default().iso_threshold).into();
    let mesh = surface.mesh().cloned().unwrap_or_else(made);
    let least = BODY_PART * mesh.volume().abs();
    mesh.components().iter().filter(|body| body.volume().abs() > least).count()
}
