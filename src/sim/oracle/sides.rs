//! Which nodes are divided, and by which cuts: the compatibility of Eq. 2-3 as fields at nodes.
//!
//! Each sheet divides a node or not, apart from the others. Within the band of its blade
//! ([`Blade::within_band`](super::super::tool::Blade::within_band)) it does, and the node's *owner* is the
//! sign of the distance (0 counts as front). Else it does where `m_F + m_B > m / 2`: `m_F` and `m_B` are the
//! folded masses of the classes with its side +1 and -1, `m` that of all clay of the bodies that have a side
//! of it here; there the kept cut runs, and the owner is front if `m_F >= m_B`.
//!
//! A class is *beyond* a division if it has the side that its owner has not; clay without a side of the sheet
//! moves with the owner. A *field* is all clay of one body that is beyond the same divisions: one of each
//! body at a whole node, up to two where one cut runs, four where two cross. A folded outer node is divided
//! as its inner one is.

use super::grid::{Band, Division, Field, Grid, Node};
use super::tools::Surroundings;
use glam::IVec3;

/// Finds the sheets that divide each node, and who owns it.
pub(super) fn divide(grid: &mut Grid, around: &Surroundings) {
    for (coordinate, node) in grid.coordinates().zip(&mut grid.nodes) {
        let mut divisions: Vec<Division> = bands(coordinate, around);
        let mut sheets: Vec<u8> = node.folded.iter().flat_map(|(key, _)| key.sides()).map(|side| side.0).collect();
        sheets.sort_unstable();
        sheets.dedup();
        // No other method knows cuts without their blades.
        sheets.retain(|_| around.plan.cutting.keeps_cuts());
        sheets.retain(|sheet| divisions.iter().all(|d| d.sheet != *sheet));
        divisions.extend(sheets.into_iter().filter_map(|sheet| division_by_mass(node, sheet)));
        divisions.sort_by_key(|d| d.sheet);
        node.divisions = divisions;
    }
}

/// The blades in whose bands the node stands.
fn bands(node: IVec3, around: &Surroundings) -> Vec<Division> {
    let band = |(tool, moving): (usize, &super::tools::MovingTool)| {
        let (distance, normal) = moving.side(node, around.domain)?;
        let owner = if distance < 0.0 { -1 } else { 1 };
        Some(Division { sheet: moving.path.sheet_id(), owner, band: Some(Band { tool, distance, normal }) })
    };
    around.tools.iter().enumerate().filter_map(band).collect()
}

/// A kept cut: mass tagged by the sheet above half of all of its bodies.
fn division_by_mass(node: &Node, sheet: u8) -> Option<Division> {
    let [front, back] = [1, -1].map(|side| node.folded.mass_on(sheet, side));
    let owner = if front >= back { 1 } else { -1 };
    let mut bodies: Vec<u16> = node.folded.iter().filter(|(key, _)| key.side(sheet) != 0).map(|(key, _)| key.body()).collect();
    bodies.dedup();
    let mass: f64 = bodies.into_iter().map(|body| node.folded.mass_of(body)).sum();
    (front + back > 0.5 * mass).then_some(Division { sheet, owner, band: None })
}

/// Sums the classes into the fields in which they move.
pub(super) fn sum_fields(grid: &mut Grid) {
    for node in &mut grid.nodes {
        let mut fields: Vec<Field> = Vec::new();
        for (key, sum) in node.folded.iter() {
            let (body, beyond) = node.place(key);
            let at = fields.binary_search_by_key(&(body, beyond), Field::place).unwrap_or_else(|at| {
                fields.insert(at, Field { body, beyond, ..Field::default() });
                at
            });
            fields[at].sum += sum;
        }
        node.fields = fields;
    }
}
