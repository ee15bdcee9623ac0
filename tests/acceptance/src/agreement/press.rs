//! Solid tools that press on clay, in turn and together, and tools that are set into it.

use super::{Agreement, CELL, Case, agreement, agreement_at_cut, block, floor_walls, moving, plan, soft, velocities};
use bevy_clay::prelude::*;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec3, IVec3};

/// Raises a tool of `shape` at `at` \[cells\] until it stands off the clay by a little more than its particles
/// reach.
fn raised(snapshot: &Snapshot, shape: &ToolShape, mut at: DVec3, rotation: DQuat) -> DVec3 {
    let pose = |at| Pose { position: snapshot.domain.to_world(at), rotation };
    let touches = |at| {
        let pose = pose(at);
        let distance = |p: &Particle| shape.distance(pose.to_local(snapshot.domain.to_world(p.grid())));
        snapshot.particles.iter().any(|p| distance(p) < 0.27 * CELL)
    };
    while touches(at) {
        at.y += 0.02;
    }
    at
}

/// Each solid tool with each contact, pressed onto the block's top at 0.06 cells per substep while it slides;
/// then the same lifted.
pub fn solid_tools() -> Vec<Agreement> {
    let mut cases = vec![];
    for agreement in found_tools() {
        let Case { snapshot, mut plan } = agreement.case;
        let path = &mut plan.tools[0];
        let samples = path.samples.clone();
        let [from, to] = [0, 1].map(|i: usize| snapshot.domain.to_grid(samples[i].pose.position));
        let at = raised(&snapshot, &path.tool.shape, from, samples[0].pose.rotation);
        let place = |cells| Pose { position: snapshot.domain.to_world(cells), ..samples[0].pose };
        let (half, pressed) = (0.5 * samples[1].time, at + 0.7 * (to - from));
        path.samples = vec![
            PoseSample { time: 0.0, pose: place(at) },
            PoseSample { time: half, pose: place(pressed) },
            PoseSample { time: 2.0 * half, pose: place(pressed + 0.3 * DVec3::Y) },
        ];
        cases.push(Agreement {
            name: format!("pressed and lifted, {}", agreement.name),
            case: Case { snapshot, plan },
            ..agreement
        });
    }
    cases
}

/// Two boxes that make a corner, a ball in it, and a fourth tool over both, that press on clay which a cut
/// divides: an anchor for each tool, and for no more than two.
pub fn tools_in_a_corner() -> Vec<Agreement> {
    let case = |contact: Contact, is_cut: bool| {
        let mut s = block(IVec3::new(10, 8, 10), 0.0, floor_walls(Wall::Stick), soft());
        let mut p = plan(&s, 0.25, 20, vec![]);
        let low = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(6.0, 0.0, 6.0);
        let plate = |half: DVec3| Tool { shape: ToolShape::Box { half_size: half * CELL }, contact };
        let ball = Tool { shape: ToolShape::Sphere { radius: 2.0 * CELL }, contact };
        let press = DVec3::splat(0.35);
        let shift = |tool: Tool, at: DVec3, way: DVec3, id| ToolPath {
            id,
            ..moving(&s, &p, tool, low + at, low + at + way, DQuat::IDENTITY)
        };
        let (thick, wide) = (2.0, 12.0);
        p.tools = vec![
            shift(plate(DVec3::new(thick, wide, wide)), DVec3::new(-thick - 0.15, 4.0, 5.0), press * DVec3::X, 0),
            shift(plate(DVec3::new(wide, thick, wide)), DVec3::new(5.0, 8.15 + thick, 5.0), press * DVec3::NEG_Y, 7),
            shift(plate(DVec3::new(wide, wide, thick)), DVec3::new(5.0, 4.0, -thick - 0.15), press, 9),
            shift(ball, DVec3::new(4.0, 9.9, 4.0), DVec3::NEG_Y * 0.6, 2),
        ];
        if is_cut {
            for q in &mut s.particles {
                let side = (q.grid() - low - DVec3::new(3.3, 4.0, 4.0)).dot(DVec3::new(1.0, 0.2, 0.1).normalize());
                if side.abs() < 2.0 {
                    q.tags[0] = Tag { sheet: 5, side: if side < 0.0 { -1 } else { 1 } };
                }
            }
        }
        let name = format!("corner, {contact:?}{}", if is_cut { ", cut" } else { "" });
        if is_cut { agreement_at_cut(name, s, p, 0) } else { agreement(name, s, p) }
    };
    Contact::ALL.into_iter().flat_map(|contact| [case(contact, false), case(contact, true)]).collect()
}

/// Plates thinner than two cells, across each of their edges and with each contact, that go on edge into
/// clay, whole and cut, and push it aside. The first three are one across each edge.
pub fn thin_plates() -> Vec<Agreement> {
    let case = |(axis, contact, is_cut): (usize, Contact, bool)| {
        let mut s = block(IVec3::new(10, 8, 10), 0.0, floor_walls(Wall::Stick), soft());
        let mut p = plan(&s, 0.25, 40, vec![]);
        let low = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(6.0, 0.0, 6.0);
        let mut half = DVec3::splat(3.0);
        half[axis] = 0.6;
        // Its edge goes down.
        let turn = DQuat::from_scaled_axis(DVec3::new(0.1, 0.2, if axis == 1 { 1.4 } else { -0.2 }));
        let tool = Tool { shape: ToolShape::Box { half_size: half * CELL }, contact };
        let at = raised(&s, &tool.shape, low + DVec3::new(5.2, 10.6, 5.1), turn);
        let path = moving(&s, &p, tool, at, at + DVec3::new(0.5, -2.4, 0.2), turn);
        p.tools = vec![ToolPath { id: 3, sheet: 243, ..path }];
        if is_cut {
            for q in &mut s.particles {
                let side = (q.grid() - low - DVec3::new(5.3, 7.3, 4.0)).dot(DVec3::new(0.2, 1.0, 0.1).normalize());
                // What is left of a plate that is not there any more, and a cut.
                q.tags[0] =
                    if side.abs() < 2.0 { Tag { sheet: 5, side: if side < 0.0 { -1 } else { 1 } } } else { Tag::default() };
                q.tags[1] = Tag { sheet: 250, side: 1 };
            }
        }
        let name = format!("plate across {axis}, {contact:?}{}", if is_cut { ", cut" } else { "" });
        if is_cut { agreement_at_cut(name, s, p, 0) } else { agreement(name, s, p) }
    };
    let cut = Contact::ALL.into_iter().rev().map(|contact| (2, contact, true));
    [(0, Contact::default(), false), (1, Contact::Stick, false)].into_iter().chain(cut).map(case).collect()
}

/// A cut block that comes into a corner of three kinds of walls, and into the opposite one: it arrives at
/// two, bounces off the third, and slides along all.
pub fn walls_in_a_corner() -> Vec<Agreement> {
    let size = IVec3::new(7, 6, 8);
    let case = |kinds: [Wall; 3], is_high: bool| {
        let mut s = block(size, 0.0, Walls { low: kinds, high: kinds }, soft());
        let p = plan(&s, 0.25, 20, vec![]);
        let (low, high) = s.domain.wall_nodes();
        let corner = if is_high { (high - size).as_dvec3() - 0.2 } else { low.as_dvec3() + 0.2 };
        let shift = corner - (low.as_dvec3() + DVec3::new(6.0, 0.0, 6.0));
        for q in &mut s.particles {
            q.set_grid(q.grid() + shift);
            let side = (q.grid() - corner - 3.3).dot(DVec3::new(1.0, 0.2, 0.1).normalize());
            if side.abs() < 2.0 {
                q.tags[0] = Tag { sheet: 5, side: if side < 0.0 { -1 } else { 1 } };
            }
        }
        let way = DVec3::new(-0.03, -0.04, -0.02) * if is_high { -1.0 } else { 1.0 };
        velocities(&mut s, |_| way * CELL / p.dt);
        agreement_at_cut(format!("corner of {kinds:?}, high {is_high}"), s, p, 0)
    };
    let mut kinds = [Wall::Slip, Wall::Separate, Wall::Stick];
    let mut cases = vec![];
    for _ in 0..3 {
        kinds.rotate_left(1);
        cases.extend([case(kinds, false), case(kinds, true)]);
    }
    cases
}

/// Each solid tool with each contact, found in the block's top, which it pushes out, while it moves.
pub fn found_tools() -> Vec<Agreement> {
    let mut cases = vec![];
    for shape in ToolShape::ALL.into_iter().filter(|shape| !shape.is_blade()).map(|shape| shape.scaled(CELL)) {
        for contact in Contact::ALL {
            let s = block(IVec3::new(10, 8, 10), 0.0, floor_walls(Wall::Stick), ClayMaterial { softening: 0.4, ..soft() });
            let mut p = plan(&s, 0.25, 20, vec![]);
            let turn = DQuat::from_scaled_axis(DVec3::new(0.3, 0.2, -0.9));
            let top = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(11.0, 8.0 + 1.5, 11.3);
            p.tools = vec![moving(&s, &p, Tool { shape, contact }, top, top + DVec3::new(0.5, -1.2, 0.1), turn)];
            cases.push(agreement(format!("{shape:?} {contact:?}"), s, p));
        }
    }
    cases
}

/// Particles cling to a tool while it stays; to nothing once it has jumped away between two frames, and once
/// there is none.
pub fn assert_anchors_end_where_the_touch_does(engine: &mut dyn Engine) {
    let Agreement { case: Case { snapshot, plan }, name, .. } = solid_tools().swap_remove(0);
    let end = plan.tools[0].samples[1].pose;
    let brief = FramePlan { steps: 2, tools: vec![], ..plan.clone() };
    let with =
        |pose: Pose| FramePlan { tools: vec![ToolPath::still(plan.tools[0].id, plan.tools[0].tool, pose)], ..brief.clone() };
    let away = Pose { position: end.position + DVec3::Y * 60.0 * CELL, ..end };
    let pressing = FramePlan { steps: plan.steps / 2, ..plan.clone() };
    let mut clinging_after = |plans: &[FramePlan]| {
        engine.load(&snapshot).expect("load");
        for plan in plans {
            engine.submit(plan.clone()).expect("submit");
            assert!(engine.wait().expect("report").health.is_ok(), "{name}");
        }
        let particles = engine.save().expect("save").particles;
        particles.iter().filter(|p| p.anchors.iter().any(|anchor| *anchor != Anchor::default())).count()
    };
    let pressed = clinging_after(std::slice::from_ref(&pressing));
    let held = clinging_after(&[pressing.clone(), with(end)]);
    assert!(pressed > 10 && held > 10, "{name}: {pressed}, {held}");
    assert_eq!(clinging_after(&[pressing.clone(), with(away)]), 0, "{name}: away");
    assert_eq!(clinging_after(&[pressing, brief]), 0, "{name}: none");
}

/// Clay is on a side of a plate for as long as the plate is beside it: it has none where the plate has jumped
/// away, or is in the next frame no more.
pub fn assert_sides_end_where_the_plate_does(engine: &mut dyn Engine) {
    let Agreement { case: Case { snapshot, plan }, name, .. } = thin_plates().swap_remove(0);
    let (plate, end) = (plan.tools[0].clone(), plan.tools[0].samples[1].pose);
    let brief = FramePlan { steps: 2, tools: vec![], ..plan.clone() };
    let with = |pose: Pose| FramePlan {
        tools: vec![ToolPath { samples: vec![PoseSample { time: 0.0, pose }], ..plate.clone() }],
        ..brief.clone()
    };
    let away = Pose { position: end.position + DVec3::Y * 60.0 * CELL, ..end };
    let mut after = |clay: &Snapshot, plan: FramePlan| {
        engine.load(clay).expect("load");
        engine.submit(plan).expect("submit");
        assert!(engine.wait().expect("report").health.is_ok(), "{name}");
        engine.save().expect("save")
    };
    let is_beside = |tag: &Tag| tag.sheet == plate.sheet && tag.side != 0;
    let beside = |clay: &Snapshot| clay.particles.iter().filter(|p| p.tags.iter().any(is_beside)).count();
    let pressed = after(&snapshot, plan.clone());
    let (cut, held) = (beside(&pressed), beside(&after(&pressed, with(end))));
    assert!(cut > 10 && held > 10, "{name}: {cut}, {held}");
    assert_eq!(beside(&after(&pressed, with(away))), 0, "{name}: away");
    assert_eq!(beside(&after(&pressed, brief.clone())), 0, "{name}: none");
}
