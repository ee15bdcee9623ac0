//! Particles to fields: how much clay is around each node of the visual grid, in all and on each side of a
//! cut.
//!
//! Equation 9 with volumes: `f_i = sum_p w_p B(x_i - x_p)` with B the quadratic B-spline of one cell, `w_p`
//! the particle's present volume in cells, so that `f` = 1 inside clay and 1/2 on its surface. P and M of a
//! cut are the same sums over the particles in front of and behind it alone; a particle counts at both of its
//! cuts. So is the clay of each body, where others are near (`bodies`).
//!
//! Particles that stand free weigh more: `w_p *= max(1, 0.65 / rho_p)^a` with
//! `rho_p = sum_i f_i B(x_i - x_p)` on the cell grid. A flat surface keeps its place, and small clusters keep
//! their volume instead of vanishing.
//!
//! On the fine grid (half a cell) B is not sampled directly, 216 nodes per particle: a quadratic B-spline is
//! the sum of four of half its width, (1 3 3 1)/4 per axis, so particles scatter to 27 nodes of the half-cell
//! lattice between the grid's nodes, and one separable filter per block then does the refinement and the blur
//! together, exactly.

use super::bodies::{BodyField, body_fields};
use super::closure::Closure;
use super::clusters::{GRAIN_FIELD, free_grains};
use super::grid::{BLOCK, BLOCK_NODES, BlockGrid, NodeValues, neighbours};
use super::labels::CutMethod;
use super::scatter::{Bins, Part};
use super::sheets::{SheetField, parts_at_cuts};
use crate::sim::frame::{SurfaceParticle, SurfaceSource};
use glam::{DVec3, IVec3, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Spacing of the visual grid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Tier {
    /// Nodes every half cell.
    #[default]
    Fine,
    /// Nodes every cell: about a quarter of the triangles.
    Coarse,
}

/// How particles become a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSettings {
    /// Spacing of the visual grid.
    pub tier: Tier,
    /// Field value of the surface over that of the inside, in (0, 1): 1/2 keeps a flat surface in its place.
    pub iso_threshold: f32,
    /// Exponent a of the density weight; 0 gives Equation 9 as published.
    pub density_exponent: f32,
    /// Passes of the binomial blur (1 2 1)/4 per axis, at most 2.
    pub blur_passes: u32,
    /// Whether the mesh gets normals.
    pub normals: bool,
    /// How cuts show.
    pub method: CutMethod,
}

impl SurfaceSettings {
    /// The recommended settings of a tier.
    pub fn new(tier: Tier) -> Self {
        let (density_exponent, blur_passes) = match tier {
            Tier::Fine => (1.0, 2),
            Tier::Coarse => (1.3, 1),
        };
        Self { tier, iso_threshold: 0.5, density_exponent, blur_passes, normals: true, method: CutMethod::TwoSided }
    }

    /// Equation 9 as published, for comparison: the cell grid, no weights by density, no blur, one value per
    /// node.
    pub fn equation_9() -> Self {
        Self { density_exponent: 0.0, blur_passes: 0, method: CutMethod::Equation9, ..Self::new(Tier::Coarse) }
    }
}

/// The raw lattice of a visual grid, and the way from its sums to the field.
pub(crate) struct Lattice {
    /// Nodes per cell, of the lattice and the grid.
    pub(crate) scale: f32,
    /// Place of visual node 0 on the lattice, less 0 \[nodes\].
    pub(crate) shift: f32,
    pub(crate) filter: Filter,
}

impl Lattice {
    /// Nodes before and behind the first one of a particle's stencil that are stored: visual node i reads raw
    /// nodes i + first ..= i + last, and cells need one node more below.
    pub(crate) fn reach(&self) -> (i32, i32) {
        (self.filter.last() + 1, 2 - self.filter.first)
    }
}

impl SurfaceSettings {
    pub(crate) fn lattice(&self) -> Lattice {
        let blur = self.blur_passes.min(BLUR_PASSES_MAX);
        match self.tier {
            Tier::Fine => Lattice { scale: 2.0, shift: 0.5, filter: Filter::refinement(blur) },
            Tier::Coarse => Lattice { scale: 1.0, shift: 0.0, filter: Filter::blur(blur) },
        }
    }
}

impl Default for SurfaceSettings {
    fn default() -> Self {
        Self::new(Tier::Fine)
    }
}

/// Most blur passes: with them the filter of the fine grid reaches 4 nodes, and a tile of a block must stay
/// within its neighbours.
const BLUR_PASSES_MAX: u32 = 2;
/// Density below which weights grow: about that of the outermost particles of a flat surface. Measured at 8
/// particles per cell with two blurs: 0.62 makes a sphere of 10 cells 0.6 % too small, 0.65 0.1-0.2 % too
/// small, 0.70 0.7-0.8 % too large.
pub(crate) const SURFACE_DENSITY: f32 = 0.65;
/// Density from which on a particle is within the surface, whatever the threshold.
pub(crate) const BULK_DENSITY: f32 = 0.95;
/// Least density: a particle alone in its cells has 0.02 at 8 particles per cell.
pub(crate) const DENSITY_MIN: f32 = 0.02;

/// Farther from node 0 than any node \[node spacings\].
const FAR: f64 = 1e9;

/// Change of a value, in those of the inside, that is not seen: the surface of clay at rest stays as it is,
/// bit by bit.
pub(crate) const HYSTERESIS: f32 = 0.01;

/// The fields on the visual grid: f in all, P and M of the two sides of each cut.
#[derive(Clone, Debug)]
pub struct Field {
    pub(crate) grid: BlockGrid,
    /// f: all clay.
    pub(crate) total: NodeValues,
    /// The bodies, by number; none of clay of one body.
    pub(crate) bodies: Vec<BodyField>,
    /// The cuts with clay on both sides, by body and sheet number.
    pub(crate) sheets: Vec<SheetField>,
    /// How closed they are.
    pub(crate) closure: Closure,
    /// World position of node 0 \[m\].
    pub(crate) origin: DVec3,
    /// Distance of nodes \[m\].
    pub(crate) spacing: f64,
}

impl Field {
    /// The fields of `source`.
    pub fn of_particles(source: &SurfaceSource, settings: &SurfaceSettings) -> Self {
        Self::new(source, settings, false).0
    }

    /// The fields without small clusters, and the particles that the surface does not show then, each with
    /// how far f is below [`GRAIN_FIELD`] there \[of that\].
    pub(crate) fn without_grains(source: &SurfaceSource, settings: &SurfaceSettings) -> (Self, Vec<(u32, f32)>) {
        Self::new(source, settings, true)
    }

    fn new(source: &SurfaceSource, settings: &SurfaceSettings, finds_grains: bool) -> (Self, Vec<(u32, f32)>) {
        let domain = &source.domain;
        let particles = &source.particles[..];
        // Weights are checked here once: a particle that is not finite, or has left the grid, shows as
        // missing, not as a broken mesh.
        let high = domain.grid_cells().as_vec3();
        let usable = |p: &SurfaceParticle| {
            let x = Vec3::from_array(p.position);
            x.cmpge(Vec3::ZERO).all() && x.cmple(high).all() && (p.density_weight * p.volume_ratio).is_finite()
        };
        let points = |scale: f32, shift: f32| -> Vec<Vec3> {
            let point = |p| Vec3::from_array(p) * scale - shift;
            particles.iter().map(|p| if usable(p) { point(p.position) } else { Vec3::NAN }).collect()
        };
        let volumes: Vec<f32> = particles.iter().map(|p| p.density_weight * p.volume_ratio).collect();
        let exponent = settings.density_exponent;
        let needs_densities = exponent != 0.0 || finds_grains;
        let densities = if needs_densities { densities(&volumes, points(1.0, 0.0)) } else { Vec::new() };
        let mut weights = if exponent == 0.0 { volumes } else { weights(volumes, &densities, exponent) };
        if finds_grains {
            free_grains(particles, &densities).into_iter().for_each(|p| weights[p as usize] = 0.0);
        }

        let lattice = settings.lattice();
        let (scale, filter) = (lattice.scale, &lattice.filter);
        let spacing = domain.cell_width / f64::from(scale);
        let bins = Bins::new(points(scale, lattice.shift), lattice.reach());
        let total = filter.apply(&bins.grid, &bins.scatter(&bins.whole(), &weights));
        let scattered = |part: &Part| filter.apply(&bins.grid, &bins.scatter(part, &weights));
        let sheet = |((body, sheet), [front, back]): ((u32, u8), [Part; 2])| {
            let [front, back] = [scattered(&front), scattered(&back)];
            SheetField { body, sheet, front, back }
        };
        let sheets: Vec<_> = parts_at_cuts(particles, &bins).into_iter().map(sheet).collect();
        let bodies = body_fields(particles, &bins, lattice.reach(), |part, is_stored| {
            filter.apply_in(&bins.grid, &bins.scatter(part, &weights), is_stored)
        });
        let closure = match settings.tier {
            Tier::Fine => Closure::new(&bins.grid, &total, &bodies, &sheets),
            Tier::Coarse => Closure::default(),
        };
        let field = Self { grid: bins.grid, total, bodies, sheets, closure, origin: domain.origin, spacing };
        if !finds_grains {
            return (field, Vec::new());
        }
        // Those of small clusters are outside of what is left.
        let outside = |i: u32| {
            let (p, rho) = (&particles[i as usize], densities[i as usize]);
            let is_near = rho > 0.0 && rho < BULK_DENSITY;
            let share = |f: f32| (i, 1.0 - f / (GRAIN_FIELD * settings.iso_threshold));
            is_near.then(|| share(field.total_at((Vec3::from_array(p.position) * scale).as_dvec3()))).filter(|g| g.1 > 0.0)
        };
        let grains = (0..particles.len() as u32).into_par_iter().filter_map(outside).collect();
        (field, grains)
    }

    /// Whether the surface of `earlier` still stands for this field's: the same blocks and cuts, and no value
    /// more than a hundredth of the inside's away, which is a hundredth of a cell or so at the surface.
    pub fn is_still(&self, earlier: &Self) -> bool {
        let is_same_room =
            (self.origin, self.spacing, self.sheets.len()) == (earlier.origin, earlier.spacing, earlier.sheets.len());
        let bodies = || self.bodies.iter().zip(&earlier.bodies);
        let is_still = |a: &NodeValues, b: &NodeValues| a.is_within(b, HYSTERESIS);
        let sheets = || self.sheets.iter().zip(&earlier.sheets);
        is_same_room
            && self.grid.blocks() == earlier.grid.blocks()
            && is_still(&self.total, &earlier.total)
            && self.bodies.len() == earlier.bodies.len()
            && bodies().all(|(a, b)| a.is_where(b) && is_still(&a.values, &b.values))
            && sheets().all(|(a, b)| {
                (a.body, a.sheet) == (b.body, b.sheet) && is_still(&a.front, &b.front) && is_still(&a.back, &b.back)
            })
    }

    /// The greatest difference of a node's value to that of another field of the same lattice, in any of f, P
    /// and M, and in the clay of any body.
    #[doc(hidden)]
    pub fn greatest_difference(&self, other: &Self) -> f32 {
        let blocks = self.grid.blocks().iter().chain(other.grid.blocks());
        let nodes = || (0..BLOCK_NODES).map(node_in_block);
        let none = NodeValues::default();
        let of = |field: &Self, key: (u32, u8)| field.sheets.iter().position(|s| (s.body, s.sheet) == key);
        let mut greatest = 0.0f32;
        for block in blocks {
            for node in nodes().map(|n| *block * BLOCK + n) {
                let apart = |a: &NodeValues, b: &NodeValues| (self.grid.value(a, node) - other.grid.value(b, node)).abs();
                greatest = greatest.max(apart(&self.total, &other.total));
                for body in self.bodies.iter().chain(&other.bodies).map(|b| b.body) {
                    greatest = greatest.max((self.body_value(body, node) - other.body_value(body, node)).abs());
                }
                for sheet in self.sheets.iter().chain(&other.sheets).map(|s| (s.body, s.sheet)) {
                    let [a, b] = [of(self, sheet).map(|k| &self.sheets[k]), of(other, sheet).map(|k| &other.sheets[k])];
                    greatest = greatest.max(apart(a.map_or(&none, |s| &s.front), b.map_or(&none, |s| &s.front)));
                    greatest = greatest.max(apart(a.map_or(&none, |s| &s.back), b.map_or(&none, |s| &s.back)));
                }
            }
        }
        greatest
    }

    /// By how much the two sides of a cut are more than all clay, at the node where that is greatest:
    /// rounding, in any field of clay.
    #[doc(hidden)]
    pub fn greatest_excess(&self) -> f32 {
        let nodes = |slot: usize, values: &NodeValues| values.block(slot).map_or_else(|| vec![0.0; BLOCK_NODES], <[f32]>::to_vec);
        let excess = |slot: usize, sheet: &SheetField| {
            let (all, front, back) = (nodes(slot, &self.total), nodes(slot, &sheet.front), nodes(slot, &sheet.back));
            all.iter().zip(front.iter().zip(back)).map(|(f, (p, m))| p + m - f).fold(0.0, f32::max)
        };
        let slots = 0..self.grid.blocks().len();
        slots.flat_map(|slot| self.sheets.iter().map(move |sheet| excess(slot, sheet))).fold(0.0, f32::max)
    }

    /// The clay of a body at a node; of clay of one body, whatever its number, all clay.
    pub(crate) fn body_value(&self, body: u32, node: IVec3) -> f32 {
        let Some(field) = self.bodies.iter().find(|b| b.body == body) else {
            return if self.bodies.is_empty() { self.grid.value(&self.total, node) } else { 0.0 };
        };
        self.grid.value_from(|slot| field.block(&self.total, slot), node)
    }

    /// f between nodes, linear along each axis; `at` in node spacings.
    pub(crate) fn total_at(&self, at: DVec3) -> f32 {
        let low = at.floor();
        let t = (at - low).as_vec3();
        // Far from all nodes the sums below must not overflow.
        let node = low.clamp(DVec3::splat(-FAR), DVec3::splat(FAR)).as_ivec3();
        let share = |c: i32, t: f32| if c == 1 { t } else { 1.0 - t };
        (0..8)
            .map(|i| {
                let d = IVec3::new(i & 1, i >> 1 & 1, i >> 2 & 1);
                share(d.x, t.x) * share(d.y, t.y) * share(d.z, t.z) * self.grid.value(&self.total, node + d)
            })
            .sum()
    }

    /// Fields given on the nodes of an array of shape `extent`, x fastest, node spacing 1 m; 0 beyond it.
    /// `sides` are P and M of the sheets 1, 2, and so on.
    ///
    /// # Panics
    /// An array whose length is not the product of `extent`, or more than 255 sheets.
    #[cfg(any(test, feature = "reference"))]
    pub fn from_nodes<'a>(extent: [usize; 3], total: &[f32], sides: impl IntoIterator<Item = (&'a [f32], &'a [f32])>) -> Self {
        assert_eq!(extent.iter().product::<usize>(), total.len(), "the field's length must be that of its extent");
        let blocks = IVec3::from_array(extent.map(|n| (n as i32).div_euclid(BLOCK) + 2));
        let grid = BlockGrid::new(IVec3::splat(-1), blocks, |_| true);
        let fill = |values: &[f32]| {
            let node_value = |node: IVec3| {
                let at = node.to_array().map(|i| usize::try_from(i).unwrap_or(usize::MAX));
                let inside = (0..3).all(|d| at[d] < extent[d]);
                if inside { values[at[0] + extent[0] * (at[1] + extent[1] * at[2])] } else { 0.0 }
            };
            let fill_block = |slot: usize, out: &mut [f32]| {
                for (i, value) in out.iter_mut().enumerate() {
                    *value = node_value(grid.blocks()[slot] * BLOCK + node_in_block(i));
                }
            };
            NodeValues::new(grid.blocks().len(), |_| true, fill_block)
        };
        let number = |i: usize| u8::try_from(i + 1).expect("sheets are numbered from 1 to 255");
        let sheet =
            |(i, (p, m)): (usize, (&[f32], &[f32]))| SheetField { body: 0, sheet: number(i), front: fill(p), back: fill(m) };
        let sheets: Vec<_> = sides.into_iter().enumerate().map(sheet).collect();
        let total = fill(total);
        let closure = Closure::new(&grid, &total, &[], &sheets);
        Self { total, bodies: Vec::new(), sheets, closure, grid, origin: DVec3::ZERO, spacing: 1.0 }
    }

    /// Low and high corner \[m\] of the box of the nodes where f is above `threshold`, and a node more on every
    /// side: the surface is within. `None` of a field without clay.
    pub fn bounds(&self, threshold: f32) -> Option<(DVec3, DVec3)> {
        let of_block = |(slot, block): (usize, &IVec3)| {
            let values = self.total.block(slot)?;
            let inside = values.iter().enumerate().filter(|v| *v.1 > threshold);
            let nodes = inside.map(|(i, _)| *block * BLOCK + node_in_block(i));
            nodes.map(|n| (n, n)).reduce(joined)
        };
        let (low, high) = self.grid.blocks().iter().enumerate().filter_map(of_block).reduce(joined)?;
        let world = |node: IVec3| self.origin + self.spacing * node.as_dvec3();
        Some((world(low - 1), world(high + 1)))
    }

    /// Bytes of the node values.
    pub fn memory(&self) -> usize {
        let sheets = self.sheets.iter().flat_map(|s| [&s.front, &s.back]);
        let bodies = self.bodies.iter().map(|b| &b.values);
        std::iter::once(&self.total).chain(bodies).chain(sheets).map(NodeValues::memory).sum()
    }
}

/// Node `i` of a block, relative to its first.
fn node_in_block(i: usize) -> IVec3 {
    let i = i as i32;
    IVec3::new(i % BLOCK, i / BLOCK % BLOCK, i / (BLOCK * BLOCK))
}

/// The box of two boxes.
fn joined(a: (IVec3, IVec3), b: (IVec3, IVec3)) -> (IVec3, IVec3) {
    (a.0.min(b.0), a.1.max(b.1))
}

/// Clay around each particle, on the cell grid; 0 for those left out.
fn densities(volumes: &[f32], points: Vec<Vec3>) -> Vec<f32> {
    let bins = Bins::new(points, (0, 2));
    bins.gather(&bins.scatter(&bins.whole(), volumes))
}

/// Present volume \[cells\] times the density weight, per particle.
fn weights(volumes: Vec<f32>, densities: &[f32], exponent: f32) -> Vec<f32> {
    let weight = |(volume, rho): (f32, &f32)| {
        let excess = SURFACE_DENSITY / rho.max(DENSITY_MIN);
        volume * if excess > 1.0 { excess.powf(exponent) } else { 1.0 }
    };
    volumes.into_iter().zip(densities).map(weight).collect()
}

/// A separable filter: node i of the result is `sum_k taps[k] raw[i + first + k]` along each axis.
pub(crate) struct Filter {
    pub(crate) first: i32,
    pub(crate) taps: Vec<f32>,
}

impl Filter {
    /// Binomial blur on the same nodes.
    fn blur(passes: u32) -> Self {
        (0..passes).fold(Self { first: 0, taps: vec![1.0] }, |f, _| f.then(&[0.25, 0.5, 0.25], -1))
    }

    /// Splines of half a cell on the half-cell lattice -> splines of one cell on the nodes between, then
    /// blur. A spline of half a cell has an eighth of the volume, which the taps' sum of 2 per axis makes up
    /// for.
    fn refinement(passes: u32) -> Self {
        Self::blur(passes).then(&[0.25, 0.75, 0.75, 0.25], -2)
    }

    fn then(&self, taps: &[f32], first: i32) -> Self {
        let mut product = vec![0.0; self.taps.len() + taps.len() - 1];
        for (i, a) in self.taps.iter().enumerate() {
            taps.iter().enumerate().for_each(|(k, b)| product[i + k] += a * b);
        }
        Self { first: self.first + first, taps: product }
    }

    fn last(&self) -> i32 {
        self.first + self.taps.len() as i32 - 1
    }

    fn apply(&self, grid: &BlockGrid, raw: &NodeValues) -> NodeValues {
        self.apply_in(grid, raw, |_| true)
    }

    /// [`Self::apply`] in the slots for which `is_stored` holds alone.
    pub(crate) fn apply_in(&self, grid: &BlockGrid, raw: &NodeValues, is_stored: impl Fn(usize) -> bool + Sync) -> NodeValues {
        let has_source =
            |slot: usize| neighbours().any(|d| grid.slot(grid.blocks()[slot] + d).is_some_and(|s| raw.block(s).is_some()));
        let size = BLOCK as usize + self.taps.len() - 1;
        NodeValues::new(
            grid.blocks().len(),
            |slot| !raw.is_empty() && is_stored(slot) && has_source(slot),
            |slot, out| {
                let mut tile = vec![0.0; size * size * size];
                grid.load(raw, grid.blocks()[slot], IVec3::splat(self.first), size as i32, &mut tile);
                self.filter_tile(&tile, size, out);
            },
        )
    }

    /// Filters a tile of `size`^3 raw nodes into a block, one axis after the other in rows of 8.
    fn filter_tile(&self, tile: &[f32], size: usize, out: &mut [f32]) {
        const ROW: usize = BLOCK as usize;
        let add = |sum: &mut [f32; ROW], tap: f32, row: &[f32]| sum.iter_mut().zip(row).for_each(|(s, v)| *s += tap * v);
        let mut along_x = vec![[0.0; ROW]; size * size];
        for (sum, row) in along_x.iter_mut().zip(tile.chunks(size)) {
            self.taps.iter().enumerate().for_each(|(k, &tap)| add(sum, tap, &row[k..k + ROW]));
        }
        let mut along_y = vec![[0.0; ROW]; size * ROW];
        for (i, sum) in along_y.iter_mut().enumerate() {
            let (y, z) = (i % ROW, i / ROW);
            self.taps.iter().enumerate().for_each(|(k, &tap)| add(sum, tap, &along_x[y + k + size * z]));
        }
        debug_assert_eq!(out.len(), BLOCK_NODES);
        for (i, row) in out.chunks_mut(ROW).enumerate() {
            let mut sum = [0.0; ROW];
            self.taps.iter().enumerate().for_each(|(k, &tap)| add(&mut sum, tap, &along_y[i + ROW * k]));
            row.copy_from_slice(&sum);
        }
    }
}
