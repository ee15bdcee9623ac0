//! Which nodes are two-sided: the compatibility of Eq. 2-3 as fields at nodes.
//!
//! A node in the band of a blade is split by the sign of its distance. Elsewhere a node is split where most of its mass is tagged:
//! the kept cut runs there. Untagged clay moves with the owner's class; the other class has a field of its own.

use super::super::params::Domain;
use super::super::snapshot::Side;
use super::grid::{Band, Division, Field, Grid, Node};
use super::tools::Surroundings;
use glam::IVec3;

/// Decides for each node whether it is whole or split, and who owns it.
pub(super) fn divide(grid: &mut Grid, around: &Surroundings) {
    let coordinates = grid.coordinates();
    for (index, coordinate) in coordinates.enumerate() {
        // A ghost node is its mirror's image and divided as that is, so that folding never mixes two sides.
        let mirror = reflected(coordinate, around.domain);
        grid.nodes[index].division = match band(mirror, around) {
            Some(band) => {
                let owner = if band.distance < 0.0 { Side::Back } else { Side::Front };
                Division::Split { owner, band: Some(band) }
            }
            None => grid.get(mirror).map_or(Division::Whole, division_by_mass),
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
    let [untagged, front, back] = node.classes.map(|sum| sum.mass);
    if front + back > 0.5 * (untagged + front + back) {
        Division::Split { owner: if front >= back { Side::Front } else { Side::Back }, band: None }
    } else {
        Division::Whole
    }
}

/// The mirror of a ghost node, axis by axis; any other node itself.
fn reflected(node: IVec3, domain: &Domain) -> IVec3 {
    let (low, high) = domain.wall_nodes();
    let below = IVec3::select(node.cmpeq(low - 1), low + 1, node);
    IVec3::select(below.cmpeq(high + 1), high - 1, below)
}

/// Sums the classes into the fields in which they move.
pub(super) fn sum_fields(grid: &mut Grid) {
    for node in &mut grid.nodes {
        node.fields = [Field::default(); 2];
        for side in [Side::None, Side::Front, Side::Back] {
            node.fields[node.field_index(side)].own += node.classes[super::grid::class(side)];
        }
        for field in &mut node.fields {
            field.folded = field.own;
        }
    }
}
