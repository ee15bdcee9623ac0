//! Ghost velocities near blades, to compare with: sides of the present, and what a particle gathers at nodes
//! that are incompatible with it. In f64, one particle after the other; the clay away from blades takes the
//! usual way.
//!
//! Particles that stand on a side of a blade are classes of their own, as with kept cuts. A node that a class
//! is incompatible with holds in place of the class's velocity an [`Incompatible`]: what the class brought
//! goes to the tool (`meeting`), what its particles gather comes from it.

use super::super::cut::{self, ClassKey};
use super::super::cutting::CuttingMethod;
use super::super::snapshot::Tag;
use super::contact::ToolNow;
use super::grid::Grid;
use super::grid_step::GridReport;
use super::kernel::Tile;
use super::nodes::{Incompatible, for_arena};
use super::particle_step::ParticleStep;
use super::simd::Node;
use super::state::{Cold, Hot, State, Table};
use super::tags::TagReport;
use glam::{DVec3, IVec3};

/// How far from a blade a particle may have a side [cells]: its stencil reaches a node that a rigid
/// particle's reaches, each by 1.5 along every axis.
pub(super) const REACH: f64 = 5.2;

/// Gives the particles of a block the sides that they have now.
pub(super) fn tag(method: CuttingMethod, tools: &[ToolNow], hot: &[Hot], cold: &mut [Cold]) -> TagReport {
    let mut report = TagReport { tools: vec![Default::default(); tools.len()], ..TagReport::default() };
    for (h, c) in hot.iter().zip(cold) {
        let at = h.place();
        let (before, mut tags) = (c.key(), [Tag::default(); 2]);
        for (tool, sum) in tools.iter().zip(&mut report.tools) {
            let had = before.side(tool.sheet);
            let side = side_of(method, at, had, tool);
            if side != 0 {
                cut::take(&mut tags, tool.sheet, side);
                sum.taken += u64::from(side != had);
            }
        }
        c.tags = tags;
        report.is_changed |= c.key() != before;
    }
    report
}

/// The side of a tool that a particle which `had` one before has now; 0 for none.
fn side_of(method: CuttingMethod, at: DVec3, had: i8, tool: &ToolNow) -> i8 {
    match method {
        CuttingMethod::Published => {
            let near = tool.blade.and_then(|blade| blade.within_band(at));
            near.map_or(0, |(distance, _)| if distance < 0.0 { -1 } else { 1 })
        }
        CuttingMethod::RigidParticles => match tool.sampled.as_ref().and_then(|sampled| sampled.colour(at)) {
            Some(_) if had != 0 => had,
            now => now.unwrap_or(0),
        },
        CuttingMethod::TwoFields | CuttingMethod::InteractiveParticles => 0,
    }
}

/// A bound on the ghost velocities of a substep [cells/substep]: across the surface they have its velocity,
/// along it one between its and their own.
pub(super) fn speed_bound(state: &State, tools: &[ToolNow], gravity: DVec3) -> f64 {
    let tagged = state.hot.iter().zip(&state.cold).filter(|(_, c)| !c.key().is_first());
    let own = |(h, _): (&Hot, &Cold)| (DVec3::from_array(h.velocity.map(f64::from)) + gravity).length();
    let own = tagged.map(own).reduce(f64::max);
    let surface = tools.iter().filter(|t| t.blade.is_some()).map(ToolNow::speed_max).fold(0.0, f64::max);
    own.map_or(0.0, |own| own.hypot(surface))
}

/// Velocity and its moments `[v, m_x, m_y, m_z]` of the particles of a class in a block; tools give what
/// ghosts have.
#[expect(clippy::cast_possible_truncation, reason = "the kernels are f32")]
pub(super) fn gather(
    s: &ParticleStep<'_>,
    (grid, table): (&Grid, &Table),
    (block, key): (IVec3, ClassKey),
    hot: &[Hot],
    report: &mut GridReport,
) -> Vec<[Node; 4]> {
    let mut nodes: Vec<(DVec3, Option<Incompatible>)> = vec![(DVec3::ZERO, None); Tile::LEN];
    for_arena(table, block, |slot, local, at| {
        let v = grid.nodes_of(slot, key)[local].0.map(f64::from);
        nodes[at] = (DVec3::new(v[0], v[1], v[2]), grid.ghosts_of(slot, key).and_then(|ghosts| ghosts[local]));
    });
    let corner = block * super::super::params::BLOCK;
    let one = |h: &Hot| {
        let at = h.place();
        let own = DVec3::from_array(h.velocity.map(f64::from)) + s.gravity;
        let base = (at - 0.5).floor();
        let f = at - base;
        let weights = [0.5 * (1.5 - f) * (1.5 - f), 0.75 - (f - 1.0) * (f - 1.0), 0.5 * (f - 0.5) * (f - 0.5)];
        let mut got = [DVec3::ZERO; 4];
        for i in 0..27 {
            let o = IVec3::new(i / 9, i / 3 % 3, i % 3);
            let axis = |d: usize| weights[o[d] as usize][d];
            let (weight, arm) = (axis(0) * axis(1) * axis(2), o.as_dvec3() - f);
            let node = base.as_ivec3() + o;
            let n = node - corner;
            let (mut velocity, incompatible) = nodes[Tile::at(n.x, n.y, n.z)];
            if let Some(Incompatible { tool, normal }) = incompatible {
                let (world, tool) = (node.as_dvec3(), usize::from(tool));
                velocity = s.tools[tool].apply(own, world, normal);
                report.give(tool, &s.tools[tool], world, -weight * f64::from(h.mass) * velocity);
            }
            let v = weight * velocity;
            for (sum, part) in got.iter_mut().zip([1.0, arm.x, arm.y, arm.z]) {
                *sum += part * v;
            }
        }
        got.map(|g| Node([g.x as f32, g.y as f32, g.z as f32, 0.0, 0.0, 0.0, 0.0, 0.0]))
    };
    hot.iter().map(one).collect()
}
