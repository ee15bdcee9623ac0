//! Which side of a blade each particle is on: swept crossing detection near the blade, kept ever after (Eq. 1 with persistent tags).

use super::super::params::Domain;
use super::super::snapshot::Tag;
use super::contact::ToolNow;
use super::state::{Cold, Hot, unpack_cell};
use glam::{DVec3, IVec3};

/// Where a particle found behind the blade is put: this far in front of it [cells].
const SET_BACK: f64 = 1e-3;

/// What tagging one block did.
#[derive(Clone, Debug, Default)]
pub(super) struct TagReport {
    /// For each tool: particles that took a side, particles put back, greatest depth of these [cells].
    pub tools: Vec<(u64, u64, f64)>,
    /// Greatest distance a particle was moved [cells].
    pub moved_max: f32,
    /// Whether a class changed.
    pub is_changed: bool,
}

/// Gives the particles of a block their sides of the blades among `tools`; `velocity_unit` is one cell per substep [m/s].
#[expect(clippy::cast_possible_truncation, reason = "offsets are f32")]
pub(super) fn tag(tools: &[ToolNow], domain: &Domain, velocity_unit: f64, hot: &mut [Hot], cold: &mut [Cold]) -> TagReport {
    let mut report = TagReport { tools: vec![Default::default(); tools.len()], ..TagReport::default() };
    let (low, high) = domain.wall_nodes();
    for (h, c) in hot.iter_mut().zip(cold) {
        let cell = IVec3::from_array(unpack_cell(h.cell)).as_dvec3();
        let start = cell + DVec3::from_array(h.offset.map(f64::from));
        let travelled = DVec3::from_array(c.velocity.map(f64::from)) / velocity_unit;
        let mut x = start;
        for (tool, sum) in tools.iter().zip(&mut report.tools) {
            let Some(blade) = &tool.blade else { continue };
            let near = blade.near(x - travelled, x);
            if let Some(side) = near.takes(c.tags[0].side != 0) {
                report.is_changed |= c.tags[0].side != side;
                c.tags[0] = Tag { sheet: tool.sheet, side };
                sum.0 += 1;
            }
            if c.tags[0].sheet == tool.sheet && near.is_behind(c.tags[0].side) {
                let side = f64::from(c.tags[0].side);
                x += blade.normal() * (side * SET_BACK - near.distance);
                sum.1 += 1;
                sum.2 = sum.2.max(near.distance.abs());
            }
        }
        if x != start {
            x = x.clamp(low.as_dvec3(), high.as_dvec3());
            h.offset = (x - cell).as_vec3().to_array();
            report.moved_max = report.moved_max.max((x - start).length() as f32);
        }
    }
    report
}

/// Brings the particles of a block into class order again, otherwise in the order they were; returns the count of each class.
pub(super) fn regroup(hot: &mut [Hot], cold: &mut [Cold]) -> [usize; 3] {
    let mut order: Vec<usize> = (0..cold.len()).collect();
    order.sort_by_key(|i| cold[*i].class());
    let mut counts = [0; 3];
    cold.iter().for_each(|c| counts[c.class() as usize] += 1);
    let (sorted_hot, sorted_cold): (Vec<Hot>, Vec<Cold>) = order.iter().map(|i| (hot[*i], cold[*i])).unzip();
    hot.copy_from_slice(&sorted_hot);
    cold.copy_from_slice(&sorted_cold);
    counts
}
