//! Where a ray meets the surface, from the fields alone: no mesh is made.
//!
//! The ray passes over blocks that hold nothing, and goes cell by cell through the others. A cell on whose
//! corners the own value (rule 3 of [`super::labels`]) is above the threshold and below it holds surface:
//! there, and nowhere else, the triangles are made that the extractor makes of that cell, and the ray is cut
//! with them; at lips also those of the cells about it, which may reach into it. So a pointer meets what a
//! mesh of the same fields shows, to rounding, open lips and crack fronts too. The root of a trilinear
//! interpolant would stand beside the lips of a cut: a corner on the other side of it has that side's value.
//!
//! A ray that starts within the clay sees of cuts only what f itself sees: those that are closed, or so
//! narrow that f stays above the threshold, it passes as if the clay were whole.

use super::cells::{AboutCellTile, CellTile, Near, OneCellTile};
use super::extract::{EdgeEnd, triangles};
use super::field::{Field, SurfaceSettings};
use super::grid::BLOCK;
use super::labels::Rules;
use glam::{DVec3, IVec3, Vec3};

/// Where a ray meets the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// The place \[m\].
    pub point: DVec3,
    /// The surface's smooth unit normal, outwards.
    pub normal: Vec3,
    /// From the ray's origin \[m\].
    pub distance: f64,
}

/// How far beyond its edges a triangle is hit, in parts of its edges: no ray slips through between two of
/// them by rounding.
const EDGE_MARGIN: f64 = 1e-9;
/// How far beyond a cell's sides a triangle counts as met in it \[node spacings\].
const CELL_MARGIN: f64 = 1e-6;
/// Least area of a triangle across the ray, twice [node spacings^2]: below it the triangle is seen edge-on.
const AREA_MIN: f64 = 1e-12;

/// The first place where the ray from `origin` \[m\] along `direction` (of any length) meets the surface from
/// outside; from within the clay that is where it comes back in. None for a direction that is zero or not
/// finite.
pub fn cast_ray(field: &Field, settings: &SurfaceSettings, origin: DVec3, direction: DVec3) -> Option<RayHit> {
    let line = Line { start: (origin - field.origin) / field.spacing, way: direction.try_normalize()? };
    if !line.start.is_finite() {
        return None;
    }
    let iso = settings.iso_threshold;
    let rules = Rules::new(settings.method);
    let mut tiles = Tiles { rules, iso, own: OneCellTile::new(rules, iso), about: None };
    let mut is_within = field.total_at(line.start) > iso;
    for (block, from) in Walk::new(line, BLOCK, field.grid.bounds(), 0.0)? {
        if field.grid.slot(block).is_none() {
            continue;
        }
        let near = Near::new(field, block);
        for (cell, _) in Walk::new(line, 1, (block * BLOCK, (block + 1) * BLOCK), from).into_iter().flatten() {
            let corners = (0..8).map(|i| cell + IVec3::new(i & 1, i >> 1 & 1, i >> 2));
            let inside = corners.filter(|&node| field.grid.value(&field.total, node) > iso).count();
            is_within &= inside == 8;
            // A side's value is f at most: where f is below the threshold, all values are.
            if inside == 0 || is_within || (inside == 8 && near.is_empty()) {
                continue;
            }
            if let Some((distance, normal)) = line.first_front_in(field, &mut tiles, (block, &near), cell) {
                let distance = distance * field.spacing;
                return Some(RayHit { point: origin + line.way * distance, normal, distance });
            }
        }
    }
    None
}

/// A cell, and, once it is wanted, what is about it.
struct Tiles {
    rules: Rules,
    iso: f32,
    own: OneCellTile,
    about: Option<AboutCellTile>,
}

/// A ray \[node spacings\]; `way` is a unit vector.
#[derive(Clone, Copy, Debug)]
struct Line {
    start: DVec3,
    way: DVec3,
}

impl Line {
    /// The nearest triangle that is seen from its front as the ray passes a cell: one of the cell's own, or,
    /// at lips, whose last vertices stand beside their edges, of one beside it.
    fn first_front_in(
        &self,
        field: &Field,
        tiles: &mut Tiles,
        (block, near): (IVec3, &Near<'_>),
        cell: IVec3,
    ) -> Option<(f64, Vec3)> {
        let at = cell - block * BLOCK;
        if !tiles.own.load(field, (block, at), near) {
            return None;
        }
        if !tiles.own.is_at_lips() {
            return OneCellTile::cells().find_map(|low| self.first_front(&tiles.own, low, cell));
        }
        let about = tiles.about.get_or_insert_with(|| AboutCellTile::new(tiles.rules, tiles.iso));
        if !about.load(field, (block, at - IVec3::ONE), near) {
            return None;
        }
        // What is met in another cell is found there, or was.
        let is_in_cell = |hit: &(f64, Vec3)| {
            let from_low = self.start + self.way * hit.0 - cell.as_dvec3();
            from_low.cmpge(DVec3::splat(-CELL_MARGIN)).all() && from_low.cmple(DVec3::splat(1.0 + CELL_MARGIN)).all()
        };
        let fronts = AboutCellTile::cells().filter_map(|low| self.first_front(about, low, cell - IVec3::ONE));
        fronts.filter(is_in_cell).min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// The nearest triangle that is seen from its front, of the cell at `low` of a tile whose first cell is
    /// given: distance \[node spacings\] and normal.
    fn first_front<const NODES: usize>(&self, tile: &CellTile<NODES>, low: usize, first: IVec3) -> Option<(f64, Vec3)> {
        let mut nearest: Option<([EdgeEnd; 3], Crossing)> = None;
        triangles(tile, low, |ends| {
            let at = ends.map(|end| {
                let node = first + CellTile::<NODES>::node_offset(end.low);
                node.as_dvec3() + tile.point(end.low, end.axis, tile.crossing(end.low, end.axis))
            });
            if let Some(crossing) = self.crossing(at)
                && nearest.as_ref().is_none_or(|(_, n)| crossing.distance < n.distance)
            {
                nearest = Some((ends, crossing));
            }
        });
        let (ends, crossing) = nearest?;
        let normal_at = |EdgeEnd { low, axis, keeps_low }: EdgeEnd| {
            tile.normal(low, axis, tile.variant(low, axis, keeps_low), tile.crossing(low, axis)).normalize_or_zero()
        };
        let normal: Vec3 = ends.iter().zip(crossing.shares).map(|(end, share)| normal_at(*end) * share as f32).sum();
        Some((crossing.distance, normal.normalize_or(crossing.flat.as_vec3())))
    }

    /// Moeller and Trumbore; fronts only.
    fn crossing(&self, [a, b, c]: [DVec3; 3]) -> Option<Crossing> {
        let (ab, ac) = (b - a, c - a);
        let p = self.way.cross(ac);
        let across = ab.dot(p);
        if across < AREA_MIN {
            return None;
        }
        let from = self.start - a;
        let q = from.cross(ab);
        let (u, v) = (from.dot(p) / across, self.way.dot(q) / across);
        let distance = ac.dot(q) / across;
        let is_hit = u >= -EDGE_MARGIN && v >= -EDGE_MARGIN && u + v <= 1.0 + EDGE_MARGIN && distance >= 0.0;
        is_hit.then(|| Crossing { distance, shares: [1.0 - u - v, u, v], flat: ab.cross(ac).normalize_or_zero() })
    }
}

/// Where a line meets a triangle.
struct Crossing {
    /// From the line's start \[node spacings\].
    distance: f64,
    /// How much each corner counts there.
    shares: [f64; 3],
    /// The triangle's own normal.
    flat: DVec3,
}

/// The cubes that a line passes, each with the distance \[node spacings\] at which it comes in.
#[derive(Debug)]
struct Walk {
    line: Line,
    /// Edge of a cube \[node spacings\].
    width: i32,
    /// The first cube, and the one behind the last.
    bounds: (IVec3, IVec3),
    cube: IVec3,
    /// Where the line comes into `cube`.
    from: f64,
}

impl Walk {
    /// The cubes within `bounds`, from the distance `from` on; none if the line misses them all.
    fn new(line: Line, width: i32, bounds: (IVec3, IVec3), from: f64) -> Option<Self> {
        let (low, high) = ((bounds.0 * width).as_dvec3() - line.start, (bounds.1 * width).as_dvec3() - line.start);
        let (mut from, mut to) = (from, f64::INFINITY);
        for axis in 0..3 {
            let (low, high, way) = (low[axis], high[axis], line.way[axis]);
            if way == 0.0 {
                to = if low <= 0.0 && 0.0 <= high { to } else { f64::NEG_INFINITY };
            } else {
                from = from.max((low / way).min(high / way));
                to = to.min((low / way).max(high / way));
            }
        }
        let at = (line.start + line.way * from) / f64::from(width);
        let cube = at.floor().as_ivec3().clamp(bounds.0, bounds.1 - 1);
        (from <= to).then_some(Self { line, width, bounds, cube, from })
    }
}

impl Iterator for Walk {
    type Item = (IVec3, f64);

    fn next(&mut self) -> Option<Self::Item> {
        if self.cube.cmplt(self.bounds.0).any() || self.cube.cmpge(self.bounds.1).any() {
            return None;
        }
        let here = (self.cube, self.from);
        let Line { start, way } = self.line;
        let exit = |axis: usize| {
            let border = (self.cube[axis] + i32::from(way[axis] > 0.0)) * self.width;
            if way[axis] == 0.0 { f64::INFINITY } else { (f64::from(border) - start[axis]) / way[axis] }
        };
        let exits = DVec3::from_array([0, 1, 2].map(exit));
        let axis = exits.min_position();
        self.cube[axis] += if way[axis] > 0.0 { 1 } else { -1 };
        self.from = exits[axis];
        Some(here)
    }
}
