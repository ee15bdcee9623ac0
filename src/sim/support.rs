//! What holds the clay up: whether there is clay that falls.
//!
//! Clay is looked at in cubes of two cells. Cubes with clay that share a face, an edge or a corner hang
//! together: so does all clay nearer than two cells, whose nodes meet, and none beyond four. Clay is loose
//! where no wall bears any that hangs together with it. A wall [bears](bearing_walls) if it holds all clay or
//! stands against gravity; tools do not.

use super::params::{BLOCK, Wall, Walls};
use super::penalty::arrival;
use super::snapshot::{Particle, Snapshot};
use glam::{DVec3, IVec3};
use std::collections::BTreeMap;

/// Bits of a block's eight cubes that hold clay; those beyond are of cubes whose clay a wall bears.
const CUBES: u32 = 8;

const _: () = assert!(BLOCK.cast_unsigned().is_power_of_two(), "blocks are found by shifts");

/// The walls that bear clay under `gravity`, a bit each, by number: those that stick, and those that stand
/// against gravity; without it all.
pub(crate) fn bearing_walls(walls: &Walls, gravity: DVec3) -> u32 {
    let side = |walls: [Wall; 3], inward: f64| {
        walls.map(|wall| wall == Wall::Stick).into_iter().zip((-inward * gravity).to_array()).collect::<Vec<_>>()
    };
    let walls = side(walls.low, 1.0).into_iter().chain(side(walls.high, -1.0));
    let bears = |(sticks, against): (bool, f64)| sticks || against > 0.0 || gravity == DVec3::ZERO;
    walls.enumerate().map(|(number, wall)| u32::from(bears(wall)) << number).sum()
}

/// The walls that stand at each piece of clay of a snapshot, a bit each, by number: what hangs together is
/// one piece.
pub(crate) fn pieces(snapshot: &Snapshot) -> Vec<u32> {
    let mut cubes = BTreeMap::<[i32; 3], u32>::new();
    for particle in &snapshot.particles {
        *cubes.entry(particle.cell.map(|cell| cell >> 1)).or_default() |= walls_at(snapshot, particle);
    }
    let mut pieces = vec![];
    while let Some((cube, mut walls)) = cubes.pop_first() {
        let mut next = vec![IVec3::from_array(cube)];
        while let Some(cube) = next.pop() {
            for near in (0..27).map(|i| cube + IVec3::new(i / 9, i / 3 % 3, i % 3) - 1) {
                if let Some(more) = cubes.remove(&near.to_array()) {
                    walls |= more;
                    next.push(near);
                }
            }
        }
        pieces.push(walls);
    }
    pieces.sort_unstable();
    pieces.dedup();
    pieces
}

/// The walls that a particle has come to.
fn walls_at(snapshot: &Snapshot, particle: &Particle) -> u32 {
    let (low, high) = snapshot.domain.wall_nodes();
    let at = particle.grid();
    let arrival = arrival(f64::from(particle.rest_volume) / snapshot.domain.cell_width.powi(3));
    let distances = (at - low.as_dvec3()).to_array().into_iter().chain((high.as_dvec3() - at).to_array());
    distances.enumerate().map(|(number, distance)| u32::from(distance <= arrival) << number).sum()
}

/// Where there is clay, and where a wall bears it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Support {
    /// Bits of blocks, of which some may be there several times.
    blocks: Vec<([i32; 3], u32)>,
}

impl Support {
    /// Adds the clay of a particle in `cell`.
    pub(crate) fn add(&mut self, cell: IVec3, is_borne: bool) {
        // Shifts round down.
        let (block, cube) = (cell >> BLOCK.ilog2().cast_signed(), 1 << cube_in_block(cell >> 1));
        self.add_block(block, cube | if is_borne { cube << CUBES } else { 0 });
    }

    /// Adds what another has.
    pub(crate) fn add_all(&mut self, other: Self) {
        self.blocks.extend(other.blocks);
    }

    /// Adds a block with these bits.
    pub(crate) fn add_block(&mut self, block: IVec3, bits: u32) {
        let block = block.to_array();
        // The native engine's particles of a block come one after another.
        match self.blocks.last_mut().filter(|last| last.0 == block) {
            Some(last) => last.1 |= bits,
            None => self.blocks.push((block, bits)),
        }
    }

    /// Whether there is loose clay.
    pub(crate) fn has_loose(mut self) -> bool {
        self.blocks.sort_unstable_by_key(|block| block.0);
        self.blocks.dedup_by(|other, first| {
            let is_same = other.0 == first.0;
            first.1 |= if is_same { other.1 } else { 0 };
            is_same
        });
        let borne = |(block, bits): &([i32; 3], u32)| cubes_of(IVec3::from_array(*block), bits >> CUBES);
        let mut next: Vec<IVec3> = self.blocks.iter().flat_map(borne).collect();
        while let Some(cube) = next.pop() {
            for (block, near) in about(cube) {
                let Ok(at) = self.blocks.binary_search_by_key(&block.to_array(), |block| block.0) else { continue };
                // What hangs together with borne clay is taken out.
                let hanging = self.blocks[at].1 & near;
                self.blocks[at].1 &= !hanging;
                next.extend(cubes_of(block, hanging));
            }
        }
        self.blocks.iter().any(|block| block.1 & ((1 << CUBES) - 1) != 0)
    }
}

/// The cubes of a block whose bits are set.
fn cubes_of(block: IVec3, bits: u32) -> impl Iterator<Item = IVec3> {
    (0..8).filter(move |i| bits >> i & 1 == 1).map(move |i| 2 * block + IVec3::new(i >> 2, i >> 1 & 1, i & 1))
}

/// The blocks in which cubes share a corner with a cube, or are it, and the bits of these.
fn about(cube: IVec3) -> impl Iterator<Item = (IVec3, u32)> {
    let (block, at) = (cube.div_euclid(IVec3::splat(2)), cube.rem_euclid(IVec3::splat(2)));
    (0..8).map(move |i| {
        // Along each axis its own block, or the next on the cube's side: there the near half alone.
        let step = IVec3::new(i >> 2, i >> 1 & 1, i & 1);
        let is_near = |of: &i32| {
            let other = IVec3::new(of >> 2, of >> 1 & 1, of & 1);
            (0..3).all(|axis| step[axis] == 0 || other[axis] != at[axis])
        };
        (block + step * (2 * at - 1), (0..8).filter(is_near).map(|of| 1 << of).sum())
    })
}

/// A cube's number in its block.
fn cube_in_block(cube: IVec3) -> u32 {
    let at = cube & 1;
    (4 * at.x + 2 * at.y + at.z).cast_unsigned()
}

#[cfg(test)]
mod tests {
    use super::super::material::Preset;
    use super::super::params::{Domain, WALL_NODE};
    use super::*;

    fn has_loose(cells: &[(IVec3, bool)]) -> bool {
        let mut support = Support::default();
        cells.iter().for_each(|(cell, is_borne)| support.add(*cell, *is_borne));
        support.has_loose()
    }

    /// Clay hangs together up to a gap of two cells in any direction, across blocks too, and never across
    /// four; what nothing bears is loose, wherever it stands.
    #[test]
    fn clay_is_loose_where_nothing_bears_what_it_hangs_together_with() {
        assert!(!has_loose(&[]));
        for low in [IVec3::new(5, 5, 5), IVec3::new(7, 6, 12), IVec3::new(4, 11, 7)] {
            assert!(has_loose(&[(low, false)]) && !has_loose(&[(low, true)]));
            for way in [IVec3::X, IVec3::new(0, 1, -1), IVec3::ONE, IVec3::new(-1, 1, 0)] {
                assert!(
                    !has_loose(&[(low, true), (low + way, false), (low + 3 * way, false), (low + 5 * way, false)]),
                    "{low} {way}"
                );
                assert!(has_loose(&[(low, true), (low + 4 * way, false)]), "{low} {way}");
                assert!(has_loose(&[(low, true), (low + 2 * way, false), (low + 7 * way, false)]), "{low} {way}");
            }
        }
    }

    /// A block that comes again, or from another part, is the same block, and borne if it is at one of its
    /// places.
    #[test]
    fn parts_make_one() {
        let far = IVec3::splat(40);
        for (first, last) in [(true, false), (false, true)] {
            let mut support = Support::default();
            let cells = [(IVec3::ONE, first), (far, true), (IVec3::ONE, last)];
            cells.into_iter().for_each(|(cell, is_borne)| support.add(cell, is_borne));
            assert!(!support.clone().has_loose());
            let mut part = Support::default();
            let cells = [(far + 8, false), (IVec3::ONE, false)];
            cells.into_iter().for_each(|(cell, is_borne)| part.add(cell, is_borne));
            support.add_all(part);
            assert!(support.clone().has_loose());
            support.add(far + 8, true);
            assert!(!support.has_loose());
        }
    }

    /// The cubes about a cube, each once, in their blocks.
    #[test]
    fn cubes_about_a_cube_are_those_that_touch_it() {
        for cube in [IVec3::new(0, 0, 0), IVec3::new(-1, 4, 7), IVec3::new(-3, -2, 1)] {
            let mut found: Vec<_> = about(cube).flat_map(|(block, bits)| cubes_of(block, bits)).map(|c| c.to_array()).collect();
            found.sort_unstable();
            let all = (0..27).map(|i| (cube + IVec3::new(i / 9, i / 3 % 3, i % 3) - 1).to_array());
            assert_eq!(found, all.collect::<Vec<_>>(), "{cube}");
        }
    }

    #[test]
    fn walls_bear_that_stick_or_stand_against_gravity() {
        let walls = Walls { low: [Wall::Slip, Wall::Separate, Wall::Stick], high: [Wall::Separate, Wall::Slip, Wall::Slip] };
        assert_eq!(bearing_walls(&walls, DVec3::NEG_Y), 0b00_0110);
        assert_eq!(bearing_walls(&walls, DVec3::new(1.0, 2.0, 0.0)), 0b01_1100);
        assert_eq!(bearing_walls(&walls, DVec3::ZERO), 0b11_1111);
    }

    /// Pieces of a snapshot stand at the walls that any of their clay has come to.
    #[test]
    fn pieces_stand_at_walls() {
        let domain = Domain::new(DVec3::ZERO, DVec3::splat(2.4), 0.1, Walls::default()).expect("a room");
        let at = |place: [f64; 3]| Particle::at(DVec3::from_array(place) + f64::from(WALL_NODE), 0.1f32.powi(3) / 8.0, 0);
        let pieces = |places: &[[f64; 3]]| {
            let particles = places.iter().copied().map(at).collect();
            pieces(&Snapshot::new(domain, Preset::SoftClay.material(), particles))
        };
        assert_eq!(pieces(&[]), [0; 0]);
        // On the floor, and at a wall by what hangs together with that.
        assert_eq!(pieces(&[[8.0, 0.25, 8.0], [8.0, 2.25, 8.0]]), [0b00_0010]);
        assert_eq!(pieces(&[[8.0, 0.25, 20.0], [8.0, 0.25, 22.0], [8.0, 0.5, 23.75]]), [0b10_0010]);
        // Above it, beside what stands there.
        assert_eq!(pieces(&[[8.0, 0.25, 8.0], [16.0, 0.5, 8.0]]), [0, 0b00_0010]);
    }
}
