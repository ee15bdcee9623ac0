//! Which nodes are two-sided: the compatibility of Eq. 2-3 as fields at nodes.
//!
//! A node in the band of a blade is split by the sign of its distance. Elsewhere a node is split where most of its mass is tagged:
//! the kept cut runs there. Untagged clay moves with the owner's class; the other class has a field of its own.

use super::super::snapshot::Side;
use super::grid::{Band, CLASSES, Division, Grid, Node, class};
use super::tools::Surroundings;
use glam::IVec3;

/// Decides for each node whether it is whole or split, and who owns it.
pub(super) fn divide(grid: &mut Grid, around: &Surroundings) {
    for (coordinate, node) in grid.coordinates().zip(&mut grid.nodes) {
        node.division = match band(coordinate, around) {
            Some(band) => {
                let owner = if band.distance < 0.0 { Side::Back } else { Side::Front };
                Division::Split { owner, band: Some(band) }
            }
            None => division_by_mass(node),
        };
    }
}

/// The first blade of the plan in whose band the node stands.
fn band(node: IVec3, around: &Surroundings) -> Option<Band> {
    let world = around.domain.to_world(node.as_dvec3());
    around.tools.iter().enumerate().find_map(|(tool, moving)| {
        let distance = moving.blade?.distance_within_band(world)? / around.domain.cell_width;
        Some(Band { tool, distance })
    })
}

/// A kept cut: tagged mass above half of all.
fn division_by_mass(node: &Node) -> Division {
    let [untagged, front, back] = node.folded.map(|sum| sum.mass);
    if front + back > 0.5 * (untagged + front + back) {
        Division::Split { owner: if front >= back { Side::Front } else { Side::Back }, band: None }
    } else {
        Division::Whole
    }
}

/// Sums the classes into the fields in which they move.
pub(super) fn sum_fields(grid: &mut Grid) {
    for node in &mut grid.nodes {
        for side in CLASSES {
            node.fields[node.field_index(side)].sum += node.folded[class(side)];
        }
    }
}
