//! The same clay on another grid: the shape is kept, the particles are new.
//!
//! The surface of the old particles is filled anew at the spacing of the new grid. A new particle has
//! velocity, strain, hardening and structure of the nearest old one, so clay in equilibrium stays in it; the
//! sum of rest volumes, and so the mass, is the old one. Beside a cut it takes the side that most of the old
//! particles of the same sheet around it are on, beside another body the body of most, so that both part
//! where they did. Edges lose up to a cell of the coarser grid.

use super::build::{Cost, memory_limit};
use super::fill::Fill;
use super::import::ImportedMesh;
use super::solid::{MeshSolid, Solid};
use crate::sim::frame::{SurfaceParticle, SurfaceSource};
use crate::sim::params::{BLOCK, CELLS_MAX, Domain, PADDING, ParamsError};
use crate::sim::snapshot::{Particle, Snapshot};
use crate::surface::extract::extract;
use crate::surface::field::{SurfaceSettings, Tier};
use glam::{DVec3, IVec3};
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::sync::Arc;

/// Fewest particles that clay may be left with: a cell's worth.
const PARTICLES_MIN: f64 = 8.0;
/// Displacement of the new particles over their spacing, that of scenes.
const JITTER: f64 = 0.25;
/// Reach of the vote on a particle's side and body [old cells]: two particle spacings, past the jitter that
/// blurs the cut.
const VOTE_REACH: f64 = 1.0;
/// Free cells kept above the clay where the room loses a part of a block.
const HEADROOM: f64 = 2.0;

/// The clay of `snapshot` on a grid of `cell_width` \[m\], in the same room, rounded to whole blocks at its
/// high walls.
///
/// # Errors
/// Clay without particles; a cell width that is not a positive length, gives more cells or particles than
/// there is room for, or leaves no particle of the clay.
pub fn resample(snapshot: &Snapshot, cell_width: f64) -> Result<Snapshot, ParamsError> {
    resample_within(snapshot, cell_width, memory_limit())
}

/// [`resample`] with a limit of memory \[bytes\] of one's own.
///
/// # Errors
/// As [`resample`].
pub fn resample_within(snapshot: &Snapshot, cell_width: f64, memory_limit: f64) -> Result<Snapshot, ParamsError> {
    let old: Vec<Particle> = snapshot.particles.iter().filter(|p| p.is_finite() && p.rest_volume > 0.0).copied().collect();
    if old.is_empty() {
        return Err(ParamsError::new("particles", 0, "there is no clay to put on another grid"));
    }
    let domain = room(&snapshot.domain, &old, cell_width)?;
    let edge = particles_per_edge(&old, snapshot.domain.cell_width);
    let spacing = cell_width / f64::from(edge);
    let volume: f64 = old.iter().map(|p| f64::from(p.rest_volume)).sum();
    check_size(&domain, volume / spacing.powi(3), memory_limit)?;

    let mesh =
        extract(&surface_source(&snapshot.domain, &old), &SurfaceSettings { normals: false, ..SurfaceSettings::new(Tier::Fine) });
    let positions = mesh.positions.iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
    let solid = MeshSolid::new(ImportedMesh { positions, triangles: mesh.triangles, doubled: 0 });
    let (points, _) = Fill { spacing, jitter: JITTER, seed: 0 }.fill(&[Solid::Mesh(Box::new(solid))]);
    if points.is_empty() {
        return Err(ParamsError::new("cell_width", cell_width, "leaves no particle of the clay: it is thinner than a cell"));
    }

    let neighbours = Neighbours::new(&old);
    let (low, high) = domain.wall_nodes();
    let carried = |(id, point): (usize, &super::fill::FilledPoint)| {
        let mut particle = neighbours.carry(snapshot.domain.to_grid(point.position));
        particle.set_grid(domain.to_grid(point.position).clamp(low.as_dvec3(), high.as_dvec3()));
        // Filled is the volume as it stands; the strain carried along says what it is at rest.
        particle.rest_volume = (point.volume / particle.volume_ratio().max(f64::MIN_POSITIVE)) as f32;
        particle.id = id as u32;
        // Anchors and what it touches were of the old particle and the old cells.
        particle.anchors = Default::default();
        particle.walls = 0;
        particle
    };
    let mut particles: Vec<Particle> = points.par_iter().enumerate().map(|(i, p)| carried((i, p))).collect();
    let factor = volume / particles.iter().map(|p| f64::from(p.rest_volume)).sum::<f64>();
    particles.iter_mut().for_each(|p| p.rest_volume = (f64::from(p.rest_volume) * factor) as f32);
    Ok(Snapshot { time: snapshot.time, ..Snapshot::new(domain, snapshot.material, particles) })
}

/// What an extractor reads of particles that no engine holds.
pub fn surface_source(domain: &Domain, particles: &[Particle]) -> SurfaceSource {
    let cell = domain.cell_width.powi(3);
    let point = |p: &Particle| SurfaceParticle {
        position: p.grid().as_vec3().to_array(),
        volume_ratio: p.volume_ratio() as f32,
        density_weight: (f64::from(p.rest_volume) / cell) as f32,
        tags: u32::from_le_bytes([
            p.tags[0].sheet,
            p.tags[0].side.cast_unsigned(),
            p.tags[1].sheet,
            p.tags[1].side.cast_unsigned(),
        ]),
        body: p.body,
    };
    SurfaceSource { domain: *domain, particles: Arc::new(particles.iter().map(point).collect()) }
}

/// The old room on the new grid: its high walls stand at the nearest whole block, or farther where clay would
/// be in the way. (Rounded up each time, a room would grow with each change of the grid.)
fn room(old: &Domain, particles: &[Particle], cell_width: f64) -> Result<Domain, ParamsError> {
    let (low, high) = old.corners();
    let domain = Domain::new(low, high, cell_width, old.walls)?;
    let block = cell_width * f64::from(BLOCK);
    let top = particles.iter().map(|p| old.to_world(p.grid())).fold(low, DVec3::max);
    let needed = ((top + HEADROOM * cell_width - low) / block).ceil().max(DVec3::ONE);
    let blocks = ((high - low) / block).round().max(needed).min(domain.cells.as_dvec3() / f64::from(BLOCK));
    Ok(Domain { cells: blocks.as_ivec3() * BLOCK, ..domain })
}

/// Particles along a cell's edge, from the volume of a particle in the middle of the order of volumes: those
/// at the surface are smaller.
fn particles_per_edge(particles: &[Particle], cell_width: f64) -> u32 {
    let mut volumes: Vec<f32> = particles.iter().map(|p| p.rest_volume).collect();
    let middle = volumes.len() / 2;
    let (_, volume, _) = volumes.select_nth_unstable_by(middle, f32::total_cmp);
    (cell_width / f64::from(*volume).cbrt()).round().clamp(1.0, 4.0) as u32
}

/// Refuses a resolution before anything of its size is allocated.
fn check_size(domain: &Domain, particles: f64, memory_limit: f64) -> Result<(), ParamsError> {
    let width = domain.cell_width;
    if particles < PARTICLES_MIN {
        let most = width * (particles / PARTICLES_MIN).cbrt();
        let reason =
            format!("leaves fewer than {PARTICLES_MIN} particles; the greatest cell width for this clay is {most:.2e} m");
        return Err(ParamsError::new("cell_width", width, reason));
    }
    let cells = (domain.cells + PADDING).as_dvec3().element_product();
    let lattice = particles.max(domain.cells.as_dvec3().element_product());
    let bytes = Cost { particles, cells, lattice, edge: 0.0 }.bytes();
    if bytes > memory_limit {
        // Everything in the sum grows with the cube of the resolution.
        let least = width * (bytes / memory_limit).cbrt();
        let reason =
            format!("gives about {particles:.2e} particles, more than memory holds; the least cell width is {least:.2e} m");
        return Err(ParamsError::new("cell_width", width, reason));
    }
    Ok(())
}

/// Old particles by cell.
struct Neighbours<'a> {
    particles: &'a [Particle],
    /// Indices of particles, those of a cell together.
    order: Vec<u32>,
    cells: HashMap<IVec3, Range<usize>>,
}

impl<'a> Neighbours<'a> {
    fn new(particles: &'a [Particle]) -> Self {
        let mut order: Vec<u32> = (0..particles.len() as u32).collect();
        order.sort_by_key(|i| particles[*i as usize].cell);
        let mut cells = HashMap::new();
        let mut start = 0;
        for run in order.chunk_by(|a, b| particles[*a as usize].cell == particles[*b as usize].cell) {
            cells.insert(IVec3::from_array(particles[run[0] as usize].cell), start..start + run.len());
            start += run.len();
        }
        Self { particles, order, cells }
    }

    /// The particles within `radius` cells of the cell of `at`, and how far from it they are \[cells\].
    fn around(&self, at: DVec3, radius: i32) -> impl Iterator<Item = (f64, &'a Particle)> {
        let (home, width) = (at.floor().as_ivec3() - radius, 2 * radius + 1);
        let ranges = (0..width.pow(3))
            .filter_map(move |i| self.cells.get(&(home + IVec3::new(i % width, i / width % width, i / width / width))).cloned());
        ranges.flat_map(|range| &self.order[range]).map(move |i| {
            let particle = &self.particles[*i as usize];
            (particle.grid().distance(at), particle)
        })
    }

    /// The particle nearest to `at` \[cells\].
    fn nearest(&self, at: DVec3) -> &'a Particle {
        let mut radius = 1;
        loop {
            let nearest = self.around(at, radius).min_by(|a, b| a.0.total_cmp(&b.0));
            // A cube of cells holds every particle that is nearer than its radius. Filled points are within
            // the surface, a cell or two from a particle.
            match nearest {
                Some((distance, particle)) if distance <= f64::from(radius) => return particle,
                _ if radius > CELLS_MAX => return &self.particles[0],
                _ => radius *= 2,
            }
        }
    }

    /// A particle with the state of the clay at `at` \[old cells\].
    fn carry(&self, at: DVec3) -> Particle {
        let mut particle = *self.nearest(at);
        let near = || self.around(at, 1).filter(|(distance, _)| *distance < VOTE_REACH).map(|(d, p)| (VOTE_REACH - d, p));
        let mut votes: BTreeMap<u32, f64> = BTreeMap::new();
        near().for_each(|(weight, p)| *votes.entry(p.body).or_default() += weight);
        if let Some((body, _)) = votes.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
            particle.body = body;
        }
        for tag in particle.tags.iter_mut().filter(|tag| tag.side != 0) {
            let side_of = |p: &Particle| p.tags.iter().find(|t| t.sheet == tag.sheet).map_or(0, |t| t.sign());
            let vote: f64 = near().map(|(weight, p)| f64::from(side_of(p)) * weight).sum();
            if vote != 0.0 && (vote > 0.0) != (tag.side > 0) {
                tag.side = -tag.sign();
            }
        }
        particle
    }
}

#[cfg(test)]
mod tests;
