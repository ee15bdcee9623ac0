//! Lines of the clay itself: the blocks that hold particles, and both sides of each cut.

use crate::sim::frame::SurfaceSource;
use crate::sim::params::BLOCK;
use crate::surface::sheets::tags;
use bevy::prelude::*;
use glam::{DVec3, IVec3};
use std::collections::{BTreeMap, BTreeSet};

/// Most nodes of the nets of all cuts of a clay.
const NODES_MAX: usize = 2000;

/// A line in the clay's frame \[m\].
pub(super) type Line = [Vec3; 2];

/// One side of a cut.
pub(super) struct CutSide {
    pub(super) sheet: u8,
    pub(super) is_front: bool,
    pub(super) lines: Vec<Line>,
}

/// What is drawn of a clay.
#[derive(Default)]
pub(super) struct Sketch {
    /// The outer edges of the blocks that hold particles.
    pub(super) blocks: Vec<Line>,
    pub(super) cuts: Vec<CutSide>,
}

impl Sketch {
    /// Of the clay as it stands. Takes its time.
    pub(super) fn new(source: &SurfaceSource) -> Self {
        Self { blocks: blocks(source), cuts: cuts(source) }
    }
}

/// The edges of blocks with particles that not all of the four blocks around have.
fn blocks(source: &SurfaceSource) -> Vec<Line> {
    let block = |p: [f32; 3]| p.map(|x| (x.floor() as i32).div_euclid(BLOCK));
    let held: BTreeSet<[i32; 3]> = source.particles.iter().map(|p| block(p.position)).collect();
    let mut edges: BTreeMap<([i32; 3], usize), u32> = BTreeMap::new();
    for block in held {
        for (axis, [u, v]) in [[1, 2], [2, 0], [0, 1]].into_iter().enumerate() {
            for (du, dv) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let mut corner = block;
                corner[u] += du;
                corner[v] += dv;
                *edges.entry((corner, axis)).or_default() += 1;
            }
        }
    }
    let at = |corner: IVec3| source.domain.to_world((corner * BLOCK).as_dvec3()).as_vec3();
    let outer = edges.into_iter().filter(|(_, count)| *count < 4);
    outer.map(|((corner, axis), _)| [at(IVec3::from(corner)), at(IVec3::from(corner) + IVec3::AXES[axis])]).collect()
}

/// A sheet, whether its front is meant, and a cube of cells.
type Cube = (u8, bool, [i32; 3]);

/// Nets through the particles at both sides of each cut: a node for those of each cube of 2^3 cells, which
/// are about as deep as a cut is kept on either side, or of larger ones where there are too many, joined with
/// those beside it.
fn cuts(source: &SurfaceSource) -> Vec<CutSide> {
    let mut width = 2;
    let mut nodes = nodes(source, width);
    while nodes.len() > NODES_MAX {
        width *= 2;
        nodes = self::nodes(source, width);
    }
    let mut cuts: Vec<CutSide> = vec![];
    for (&(sheet, is_front, cube), &from) in &nodes {
        if cuts.last().is_none_or(|last| (last.sheet, last.is_front) != (sheet, is_front)) {
            cuts.push(CutSide { sheet, is_front, lines: vec![] });
        }
        let Some(side) = cuts.last_mut() else { continue };
        for axis in 0..3 {
            let mut beside = cube;
            beside[axis] += 1;
            if let Some(to) = nodes.get(&(sheet, is_front, beside)) {
                side.lines.push([from, *to]);
            }
        }
    }
    cuts
}

/// The centres of the particles at each side of each cut, by cubes of `width` \[cells\].
fn nodes(source: &SurfaceSource, width: i32) -> BTreeMap<Cube, Vec3> {
    let mut sums: BTreeMap<Cube, (DVec3, f64)> = BTreeMap::new();
    for particle in source.particles.iter() {
        let cube = particle.position.map(|x| (x.floor() as i32).div_euclid(width));
        for (sheet, side) in tags(particle) {
            let (sum, count) = sums.entry((sheet, side > 0, cube)).or_default();
            *sum += Vec3::from(particle.position).as_dvec3();
            *count += 1.0;
        }
    }
    sums.into_iter().map(|(cube, (sum, count))| (cube, source.domain.to_world(sum / count).as_vec3())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::frame::SurfaceParticle;
    use crate::sim::params::{Domain, Walls};
    use std::sync::Arc;

    /// Particles at these places \[cells\], in front of a cut.
    fn source(places: impl Iterator<Item = [f32; 3]>) -> SurfaceSource {
        let domain = Domain::new(DVec3::ZERO, DVec3::ONE, 0.05, Walls::default()).expect("domain");
        let particle = |position| SurfaceParticle { position, tags: u32::from_le_bytes([1, 1, 0, 0]), ..Default::default() };
        SurfaceSource { domain, particles: Arc::new(places.map(particle).collect()) }
    }

    /// Of two blocks along each axis, edges at the outside alone: 54 less the 6 that meet in the middle.
    #[test]
    fn edges_between_blocks_are_left_out() {
        let at = |i: i32| [i & 1, i >> 1 & 1, i >> 2].map(|k| (BLOCK * k) as f32 + 5.5);
        let lines = blocks(&source((0..8).map(at)));
        assert_eq!(lines.len(), 48);
    }

    /// However large a cut is, its net has no more nodes than may be drawn.
    #[test]
    fn net_of_a_large_cut_is_coarse() {
        let row = |count: i32| source((0..count).map(|i| [2.0 * i as f32 + 0.5, 0.5, 0.5]));
        let lines = |count| cuts(&row(count)).iter().map(|side| side.lines.len()).sum::<usize>();
        assert_eq!(lines(NODES_MAX as i32), NODES_MAX - 1);
        assert_eq!(lines(2 * NODES_MAX as i32), NODES_MAX - 1);
    }
}
