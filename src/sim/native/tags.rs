//! Which side of a blade each particle is on: swept crossing detection near the blade, kept ever after (Eq. 1
//! with persistent tags).

use super::super::ahead::ClayAhead;
use super::super::cut::{self, ClassKey};
use super::super::params::Domain;
use super::super::penalty::reach;
use super::super::snapshot::Anchor;
use super::super::tool::SET_BACK;
use super::contact::ToolNow;
use super::state::{Cold, Hot, Run, unpack_cell};
use glam::{DVec3, IVec3};

/// What a blade did to the particles' sides.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tagged {
    /// Particles that took a side.
    pub taken: u64,
    /// Those among them that gave up an older cut.
    pub displaced: u64,
    /// Particles put back.
    pub pushed_back: u64,
    /// Greatest depth of these \[cells\].
    pub depth_max: f64,
}

impl Tagged {
    pub(super) fn add(&mut self, other: &Self) {
        self.taken += other.taken;
        self.displaced += other.displaced;
        self.pushed_back += other.pushed_back;
        self.depth_max = self.depth_max.max(other.depth_max);
    }
}

/// What tagging one block did.
#[derive(Clone, Debug, Default)]
pub(super) struct TagReport {
    /// By each tool.
    pub tools: Vec<Tagged>,
    /// Greatest distance a particle was moved \[cells\].
    pub moved_max: f32,
    /// Whether a class changed.
    pub is_changed: bool,
    /// What edges have ahead.
    pub ahead: ClayAhead,
}

/// Gives the particles of a block their sides of the blades among `tools`. In implicit steps what a blade has
/// cut clings to it, and what a plate's middle puts back is found in the plate.
#[expect(clippy::cast_possible_truncation, reason = "offsets are f32")]
pub(super) fn tag(tools: &[ToolNow], domain: &Domain, hot: &mut [Hot], cold: &mut [Cold], clings: bool) -> TagReport {
    let mut report = TagReport { tools: vec![Default::default(); tools.len()], ..TagReport::default() };
    let (low, high) = domain.wall_nodes();
    for (h, c) in hot.iter_mut().zip(cold) {
        let cell = IVec3::from_array(unpack_cell(h.cell)).as_dvec3();
        let start = cell + DVec3::from_array(h.offset.map(f64::from));
        let travelled = DVec3::from_array(c.way.map(f64::from));
        let (mut x, key) = (start, c.key());
        for (tool, sum) in tools.iter().zip(&mut report.tools) {
            let Some(blade) = &tool.blade else { continue };
            let near = if clings { blade.near_implicitly(x - travelled, x) } else { blade.near(x - travelled, x) };
            let before = c.key();
            let takes = near.takes(cut::place(&c.tags, tool.sheet).is_some());
            if tool.is_solid() {
                sum.taken += u64::from(cut::beside_plate(&mut c.tags, tool.sheet, near.is_held, takes));
                report.is_changed |= c.key() != before;
            } else if let Some(side) = takes {
                sum.displaced += u64::from(cut::take(&mut c.tags, tool.sheet, side));
                report.is_changed |= c.key() != before;
                sum.taken += 1;
            }
            let side = c.key().side(tool.sheet);
            if near.is_behind(side) {
                x += near.normal * (f64::from(side) * SET_BACK - near.distance);
                sum.pushed_back += 1;
                sum.depth_max = sum.depth_max.max(near.distance.abs());
                if clings && tool.is_solid() {
                    let_go(&mut c.anchors, tool.id);
                }
            }
        }
        if x != start {
            x = x.clamp(low.as_dvec3(), high.as_dvec3());
            h.offset = (x - cell).as_vec3().to_array();
            report.moved_max = report.moved_max.max((x - start).length() as f32);
        }
        let volume = f64::from(h.mass) / 8.0;
        if clings && c.key() != key {
            cling(tools, key, x, volume, c);
        }
        look_ahead(tools, x, volume, c.key(), &mut report.ahead);
    }
    report
}

/// Notes of which edges a particle is ahead.
fn look_ahead(tools: &[ToolNow], x: DVec3, volume: f64, key: ClassKey, ahead: &mut ClayAhead) {
    for (index, tool) in tools.iter().enumerate().filter(|(_, tool)| !tool.is_solid() && key.side(tool.sheet) == 0) {
        if let Some(edge) = tool.blade.and_then(|blade| blade.edge(x)) {
            ahead.see((index, key), volume, edge.share, edge.beside);
        }
    }
}

/// Lets go of a plate: clay put back before its middle has not been pressed as deep as it stands now.
fn let_go(anchors: &mut [Anchor], id: u32) {
    let is_its = |kept: &&mut Anchor| kept.get().is_some_and(|kept| kept.0 == id);
    anchors.iter_mut().filter(is_its).for_each(|kept| *kept = Anchor::default());
}

/// Anchors to the blades the clay that they have just cut: a particle whose class was `before`, at `start`
/// \[cells\] as the step begins.
fn cling(tools: &[ToolNow], before: ClassKey, start: DVec3, volume: f64, cold: &mut Cold) {
    for tool in tools.iter().filter(|tool| !tool.is_solid()) {
        let side = cold.key().side(tool.sheet);
        let Some(blade) = tool.blade.filter(|blade| blade.holds && side != before.side(tool.sheet)) else { continue };
        let is_cut = (0.0..2.0 * reach(volume)).contains(&blade.distance_before(side, start));
        let is_its = |kept: &Anchor| kept.get().is_none_or(|kept| kept.0 == tool.id);
        if let Some(seat) = cold.anchors.iter().position(is_its) {
            let here = || Anchor::on(tool.id, tool.motion.start.to_local(start));
            cold.anchors[seat] = if is_cut { here() } else { Anchor::default() };
        }
    }
}

/// Brings the particles of a block into class order again, otherwise in the order they were.
pub(super) fn regroup(hot: &mut [Hot], cold: &mut [Cold]) -> Run {
    let mut order: Vec<usize> = (0..cold.len()).collect();
    order.sort_by_key(|i| cold[*i].key());
    let (sorted_hot, sorted_cold): (Vec<Hot>, Vec<Cold>) = order.iter().map(|i| (hot[*i], cold[*i])).unzip();
    hot.copy_from_slice(&sorted_hot);
    cold.copy_from_slice(&sorted_cold);
    Run::of(cold.iter().map(Cold::key))
}
