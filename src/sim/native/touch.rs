//! What tools meet: the particles of the blocks near them, for [`patch`](super::super::patch).

use super::super::frame::{FramePlan, ToolReport};
use super::super::params::Domain;
use super::super::patch::{Gather, Seen};
use super::super::tool::ToolPath;
use super::super::touch::ToolTouch;
use super::state::{Cold, Hot, State};
use glam::{DMat3, DVec3};

/// What each tool of the plan meets at the frame's end.
pub(super) fn touches(plan: &FramePlan, domain: &Domain, state: &State, tools: &[ToolReport]) -> Vec<ToolTouch> {
    let touch = |(path, tool): (&ToolPath, &ToolReport)| {
        let mut gather = Gather::new(path, plan, domain);
        let mut start = 0;
        for (block, run) in state.blocks.iter().zip(&state.runs) {
            let range = start..start + run.len();
            start = range.end;
            if gather.is_near(*block) {
                let of = (gather.id(), path.sheet_id());
                let particles = state.hot[range.clone()].iter().zip(&state.cold[range]);
                particles.for_each(|(hot, cold)| gather.see(seen(hot, cold, domain, of)));
            }
        }
        gather.finish(tool)
    };
    plan.tools.iter().zip(tools).map(touch).collect()
}

fn seen(hot: &Hot, cold: &Cold, domain: &Domain, (tool, sheet): (u32, u8)) -> Seen {
    let [xx, yy, zz, xy, xz, yz] = hot.strain.map(f64::from);
    Seen {
        id: cold.id,
        position: hot.place(),
        volume: f64::from(cold.rest_volume) / domain.cell_width.powi(3),
        strain: DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz)),
        hardening: f64::from(hot.hardening),
        structure: f64::from(cold.structure),
        anchor: cold.anchors.iter().find_map(|anchor| anchor.get().filter(|anchor| anchor.0 == tool)).map(|anchor| anchor.1),
        whole: Some(cold.key()).filter(|key| key.side(sheet) == 0),
    }
}
