//! What a ray from the cursor meets: the last surface in boxes, sorted away from the main thread, asked in microseconds.

use bevy::prelude::*;
use bevy::tasks::futures::check_ready;
use bevy::tasks::{AsyncComputeTaskPool, Task};
use bevy_clay::prelude::ClaySurface;
use bevy_clay::surface::mesh::Mesh as Surface;
use std::sync::Arc;

/// Boxes along the longest side of the surface.
const BOXES: f32 = 40.0;
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

/// A surface in boxes.
#[derive(Debug)]
pub(crate) struct PickGrid {
    surface: Arc<Surface>,
    low: Vec3,
    high: Vec3,
    width: f32,
    extent: IVec3,
    /// Where each box begins in `triangles`, and the end.
    starts: Vec<u32>,
    triangles: Vec<u32>,
    /// Counts the states of the clay.
    pub(crate) revision: (u64, u64),
    /// Bodies that the surface encloses.
    pub(crate) bodies: usize,
}

impl PickGrid {
    fn new(surface: Arc<Surface>, revision: (u64, u64)) -> Self {
        let (low, high) = surface.bounds().unwrap_or_default();
        let (low, high) = (low.as_vec3(), high.as_vec3());
        let width = ((high - low).max_element() / BOXES).max(1e-6);
        let extent = ((high - low) / width).floor().as_ivec3() + 1;
        let cell = |p: Vec3| ((p - low) / width).floor().as_ivec3().clamp(IVec3::ZERO, extent - 1);
        let mut entries = Vec::new();
        for (index, t) in (0u32..).zip(&surface.triangles) {
            let [a, b, c] = t.map(|v| Vec3::from_array(surface.positions[v as usize]));
            let (from, to) = (cell(a.min(b).min(c)), cell(a.max(b).max(c)));
            for z in from.z..=to.z {
                for y in from.y..=to.y {
                    entries.extend((from.x..=to.x).map(|x| (box_index(IVec3::new(x, y, z), extent), index)));
                }
            }
        }
        entries.sort_unstable();
        let count = extent.as_usizevec3().element_product();
        let starts = (0..=count as u32).map(|i| entries.partition_point(|e| e.0 < i) as u32).collect();
        let triangles = entries.into_iter().map(|e| e.1).collect();
        let bodies = bodies(&surface);
        Self { surface, low, high, width, extent, starts, triangles, revision, bodies }
    }

    /// Middle and half the diagonal of the surface's box.
    pub(crate) fn ball(&self) -> (Vec3, f32) {
        ((self.low + self.high) / 2.0, (self.high - self.low).length() / 2.0)
    }

    /// The first triangle, seen from its front, that `ray` meets: box after box along the ray.
    pub(crate) fn cast(&self, ray: Ray3d) -> Option<Hit> {
        let (origin, way) = (ray.origin, *ray.direction);
        let inverse = way.map(|d| if d.abs() < 1e-9 { 1e9f32.copysign(d) } else { 1.0 / d });
        let (a, b) = ((self.low - origin) * inverse, (self.high - origin) * inverse);
        let enter = a.min(b).max_element().max(0.0);
        let leave = a.max(b).min_element();
        if enter > leave {
            return None;
        }
        let at = (origin + way * enter - self.low) / self.width;
        let mut cell = at.floor().as_ivec3().clamp(IVec3::ZERO, self.extent - 1);
        let step = way.map(|d| if d < 0.0 { -1.0 } else { 1.0 }).as_ivec3();
        let across = (self.width * inverse).abs();
        let border = self.low + (cell + step.max(IVec3::ZERO)).as_vec3() * self.width;
        let mut next = (border - origin) * inverse;
        loop {
            let far = next.min_element();
            // A triangle reaches over several boxes: only what it shows of itself in this one counts, else a nearer one could be missed.
            if let Some(hit) = self.cast_in(cell, origin, way).filter(|h| h.distance <= far + 1e-4 * self.width) {
                return Some(hit);
            }
            let axis = if next.x <= next.y && next.x <= next.z { 0 } else { usize::from(next.y > next.z) + 1 };
            cell[axis] += step[axis];
            next[axis] += across[axis];
            if !(0..self.extent[axis]).contains(&cell[axis]) {
                return None;
            }
        }
    }

    fn cast_in(&self, cell: IVec3, origin: Vec3, way: Vec3) -> Option<Hit> {
        let index = box_index(cell, self.extent) as usize;
        let range = self.starts[index] as usize..self.starts[index + 1] as usize;
        let hits = self.triangles[range].iter().filter_map(|t| cast_at(&self.surface, *t, origin, way));
        hits.min_by(|a, b| a.distance.total_cmp(&b.distance))
    }
}

/// The first triangle of `surface`, seen from its front, that `ray` meets: all of them are asked.
pub(crate) fn cast_all(surface: &Surface, ray: Ray3d) -> Option<Hit> {
    let all = 0..surface.triangles.len() as u32;
    let hits = all.filter_map(|t| cast_at(surface, t, ray.origin, *ray.direction));
    hits.min_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// Moeller and Trumbore; fronts only.
fn cast_at(surface: &Surface, triangle: u32, origin: Vec3, way: Vec3) -> Option<Hit> {
    let corners = surface.triangles[triangle as usize];
    let [a, b, c] = corners.map(|v| Vec3::from_array(surface.positions[v as usize]));
    let (ab, ac) = (b - a, c - a);
    let p = way.cross(ac);
    let determinant = ab.dot(p);
    if determinant <= 1e-20 {
        return None;
    }
    let from = origin - a;
    let u = from.dot(p) / determinant;
    let q = from.cross(ab);
    let v = way.dot(q) / determinant;
    let distance = ac.dot(q) / determinant;
    if u < 0.0 || v < 0.0 || u + v > 1.0 || distance < 0.0 {
        return None;
    }
    let flat = ab.cross(ac).normalize_or_zero();
    let normal = surface.normals.as_ref().map_or(flat, |normals| {
        let [na, nb, nc] = corners.map(|i| Vec3::from_array(normals[i as usize]));
        (na * (1.0 - u - v) + nb * u + nc * v).normalize_or(flat)
    });
    Some(Hit { point: origin + way * distance, normal, distance })
}

fn box_index(cell: IVec3, extent: IVec3) -> u32 {
    (cell.x + extent.x * (cell.y + extent.y * cell.z)).cast_unsigned()
}

/// Bodies of the surface, crumbs left out.
fn bodies(surface: &Surface) -> usize {
    let least = BODY_PART * surface.volume().abs();
    surface.components().iter().filter(|body| body.volume().abs() > least).count()
}

/// The newest surface that can be asked.
#[derive(Resource, Default)]
pub(crate) struct Picking {
    pub(crate) grid: Option<Arc<PickGrid>>,
    under_way: Option<Task<PickGrid>>,
}

/// Sorts each new surface, one at a time.
pub(crate) fn sort(surfaces: Query<&ClaySurface>, mut picking: ResMut<Picking>) {
    if let Some(grid) = picking.under_way.as_mut().and_then(check_ready) {
        picking.grid = Some(Arc::new(grid));
        picking.under_way = None;
    }
    let Ok(surface) = surfaces.single() else { return };
    let is_new = picking.grid.as_ref().is_none_or(|g| g.revision != surface.revision());
    if picking.under_way.is_none() && is_new && !surface.mesh().triangles.is_empty() {
        let (mesh, revision) = (surface.mesh().clone(), surface.revision());
        picking.under_way = Some(AsyncComputeTaskPool::get().spawn(async move { PickGrid::new(mesh, revision) }));
    }
}
