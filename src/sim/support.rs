//! What holds the clay up: whether there is clay that falls.
//!
//! Clay is looked at in cubes of two cells. Cubes with clay that share a face, an edge or a corner hang
//! together: so does all clay nearer than two cells, whose nodes meet, and none beyond four. Clay is loose
//! where no wall bears any that hangs together with it. A wall [bears](bearing_walls) if it holds all clay or
//! stands against gravity; tools do not.

use super::params::{BLOCK, Domain, Wall};
use glam::{DVec3, IVec3};
use std::collections::HashMap;

/// Bits of a block's eight cubes that hold clay; those beyond are of cubes whose clay a wall bears.
const CUBES: u32 = 8;

/// The walls that bear clay under `gravity`, a bit each, by number: those that stick, and those that stand
/// against gravity; without it all.
pub(crate) fn bearing_walls(domain: &Domain, gravity: DVec3) -> u32 {
    let side = |walls: [Wall; 3], inward: f64| {
        walls.map(|wall| wall == Wall::Stick).into_iter().zip((-inward * gravity).to_array()).collect::<Vec<_>>()
    };
    let walls = side(domain.walls.low, 1.0).into_iter().chain(side(domain.walls.high, -1.0));
    let bears = |(sticks, against): (bool, f64)| sticks || against > 0.0 || gravity == DVec3::ZERO;
    walls.enumerate().map(|(number, wall)| u32::from(bears(wall)) << number).sum()
}

/// Where there is clay, and where a wall bears it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Support {
    blocks: HashMap<IVec3, u32>,
}

impl Support {
    /// Adds the clay of a particle in `cell`.
    pub(crate) fn add(&mut self, cell: IVec3, is_borne: bool) {
        self.add_block(cell.div_euclid(IVec3::splat(BLOCK)), bits(cell, is_borne));
    }

    /// Adds a block with these bits.
    pub(crate) fn add_block(&mut self, block: IVec3, bits: u32) {
        *self.blocks.entry(block).or_default() |= bits;
    }

    /// Whether there is loose clay.
    pub(crate) fn has_loose(mut self) -> bool {
        let cubes = |(block, bits): (&IVec3, &u32)| {
            let borne = bits >> CUBES;
            let block = *block;
            (0..8).filter(move |i| borne >> i & 1 == 1).map(move |i| 2 * block + IVec3::new(i >> 2, i >> 1 & 1, i & 1))
        };
        let mut next: Vec<IVec3> = self.blocks.iter().flat_map(cubes).collect();
        while let Some(cube) = next.pop() {
            for i in 0..27 {
                let near = cube + IVec3::new(i / 9, i / 3 % 3, i % 3) - 1;
                let Some(bits) = self.blocks.get_mut(&near.div_euclid(IVec3::splat(2))) else { continue };
                let bit = 1 << cube_in_block(near);
                // What hangs together with borne clay is taken out.
                if *bits & bit != 0 {
                    *bits &= !bit;
                    next.push(near);
                }
            }
        }
        self.blocks.values().any(|bits| bits & ((1 << CUBES) - 1) != 0)
    }
}

/// The bits of a particle in `cell` among those of its block.
fn bits(cell: IVec3, is_borne: bool) -> u32 {
    let cube = 1 << cube_in_block(cell.div_euclid(IVec3::splat(2)));
    cube | if is_borne { cube << CUBES } else { 0 }
}

/// A cube's number in its block.
fn cube_in_block(cube: IVec3) -> u32 {
    let at = cube.rem_euclid(IVec3::splat(2));
    (4 * at.x + 2 * at.y + at.z).cast_unsigned()
}

#[cfg(test)]
mod tests {
    use super::super::params::Walls;
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

    #[test]
    fn walls_bear_that_stick_or_stand_against_gravity() {
        let walls = Walls { low: [Wall::Slip, Wall::Separate, Wall::Stick], high: [Wall::Separate, Wall::Slip, Wall::Slip] };
        let domain = Domain::new(DVec3::ZERO, DVec3::ONE, 0.1, walls).expect("a room");
        assert_eq!(bearing_walls(&domain, DVec3::NEG_Y), 0b00_0110);
        assert_eq!(bearing_walls(&domain, DVec3::new(1.0, 2.0, 0.0)), 0b01_1100);
        assert_eq!(bearing_walls(&domain, DVec3::ZERO), 0b11_1111);
    }
}
