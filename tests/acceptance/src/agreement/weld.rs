//! Sides of cuts that grow together, or do not.

use super::{Agreement, CELL, SEPARATE, agreement_at_cut, block, moving, plan, soft};
use bevy_clay::prelude::*;
use bevy_clay::sim::cut::JOINT_SHEET;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};
use std::f64::consts::FRAC_PI_2;

/// A block in two halves, pressed along x so far that it flows, or so little that nothing grows together: by
/// a fiftieth of the stress that welds, or by .9 of it.
pub fn welding() -> Vec<Agreement> {
    let case = |name: &str, strain: f64, sheets: &[u8]| {
        let mut s = block(IVec3::new(10, 8, 10), 2.0, Walls::default(), ClayMaterial { weld: Weld::Sticky, ..soft() });
        let mut p = plan(&s, 0.25, 20, vec![]);
        // A frame of 20 substeps is a tenth of the time that growing together takes: one frame more makes it
        // whole.
        let part = (p.duration() / 0.05 * 100.0).floor() as i8;
        let middle = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(11.03, 6.0, 11.0);
        for q in &mut s.particles {
            let side = [q.grid().x - middle.x, q.grid().y + 0.3 * q.grid().z - middle.y - 3.3];
            for (tag, (sheet, side)) in q.tags.iter_mut().zip(sheets.iter().zip(side)).filter(|(_, (_, side))| side.abs() < 2.0) {
                *tag = Tag { sheet: *sheet, side: (101 - part) * if side < 0.0 { -1 } else { 1 } };
            }
            q.elastic_strain = [-2.0 * strain, 0.0, 0.0, 0.0, 0.0, 0.0].map(|e| e as f32);
        }
        p.gravity = DVec3::ZERO;
        agreement_at_cut(format!("welding, {name}"), s, p, 0)
    };
    let clay = soft();
    // Weld::Sticky takes a twentieth of the shear strength.
    let almost = 0.9 * 0.05 * clay.shear_strength() / (clay.lame_lambda() + 2.0 * clay.lame_mu());
    vec![
        case("pressed", 0.01, &[7]),
        case("hardly pressed", 1e-4, &[7]),
        case("one of two cuts", 0.01, &[7, 3]),
        case("almost pressed", almost, &[7]),
    ]
}

/// The same halves, whose blade left them pressed: pressed on, hardly pressed, with the blade still there,
/// with the blade still there between bodies, half of which count how they grow together, and almost pressed.
pub fn left_pressed() -> Vec<Agreement> {
    let case = |from: usize, name: &str, change: &dyn Fn(&mut Agreement)| {
        let mut agreement = welding().swap_remove(from);
        agreement.name = format!("left pressed, {name}");
        agreement.case.snapshot.particles.iter_mut().flat_map(|q| &mut q.tags).for_each(|tag| tag.side = tag.sign() * 127);
        change(&mut agreement);
        agreement
    };
    let beside_its_blade = |Agreement { case, .. }: &mut Agreement| {
        case.snapshot.particles.iter_mut().flat_map(|q| &mut q.tags).for_each(|tag| tag.side = tag.sign());
        let at = case.snapshot.domain.wall_nodes().0.as_dvec3() + DVec3::new(11.03, 10.5, 11.0);
        let blade = Tool { shape: ToolShape::Blade { half_width: 4.1 * CELL, half_height: CELL }, contact: SEPARATE };
        let path = moving(&case.snapshot, &case.plan, blade, at, at, DQuat::from_rotation_y(FRAC_PI_2));
        case.plan.tools = vec![ToolPath { sheet: 7, ..path }];
    };
    let between_bodies = |agreement: &mut Agreement| {
        beside_its_blade(agreement);
        let Snapshot { domain, particles, .. } = &mut agreement.case.snapshot;
        let middle = f64::from(domain.wall_nodes().0.x) + 11.03;
        for q in particles {
            let side = q.tags[0].side;
            q.body = u32::from(side < 0 || (side == 0 && q.grid().x < middle));
            if side != 0 && q.id % 2 == 0 {
                q.tags[1] = Tag { sheet: JOINT_SHEET, side: 50 };
            }
        }
    };
    vec![
        case(0, "pressed on", &|_| ()),
        case(1, "released", &|_| ()),
        case(0, "beside its blade", &beside_its_blade),
        case(0, "between bodies", &between_bodies),
        // Before the block has sprung back.
        case(3, "pressed by less than welds", &|agreement| agreement.case.plan.steps = 4),
    ]
}
