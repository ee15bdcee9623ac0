//! Implicit steps: solid tools, blades, wires and plates, and the sides of cuts that press on each other.

use super::{Agreement, CELL, SEPARATE, agreement, block, floor_walls, moving, plan, soft, velocities};
use bevy_clay::prelude::*;
use bevy_clay::sim::prelude::*;
use glam::{DQuat, DVec2, DVec3, IVec3};
use std::f64::consts::PI;

/// Two steps of eight passes, far from the least, so that every iteration counts.
fn steps(snapshot: &Snapshot) -> FramePlan {
    let integrator = Integrator::Implicit { passes: 8 };
    FramePlan { dt: 1e-3, steps: 2, integrator, volume_averaging: 5e-4, ..plan(snapshot, 1.0, 1, vec![]) }
}

/// Clay that hardens and flows, moving unevenly.
fn moved_block(size: IVec3, floor: Wall) -> Snapshot {
    let material = ClayMaterial { hardening_modulus: 2e4, viscosity: 100.0, flow_index: 0.5, ..soft() };
    let mut s = block(size, 0.0, floor_walls(floor), material);
    velocities(&mut s, |at| 0.02 * DVec3::new((at.y / 3.0).sin(), (at.x / 4.0).cos() - 1.0, (at.x / 5.0).sin()));
    s
}

fn held(name: String, snapshot: Snapshot, plan: FramePlan, tagged: u64) -> Agreement {
    Agreement { position: 1e-5, strain: 1e-5, tagged, ..agreement(name, snapshot, plan) }
}

/// Clay that goes down where a floor stops it: there it starts from a standstill. A block, and crumbs, which
/// have the lightest nodes.
fn stopped(name: &str, is_kept: impl Fn(usize) -> bool) -> Agreement {
    let mut s = moved_block(IVec3::new(7, 5, 6), Wall::Stick);
    let mut index = 0..;
    s.particles.retain(|_| index.next().is_some_and(&is_kept));
    let p = FramePlan { dt: 1e-2, ..steps(&s) };
    velocities(&mut s, |_| DVec3::NEG_Y * 0.2 * CELL / p.dt);
    held(format!("implicit, {name} stopped by the floor"), s, p, 0)
}

/// Crumbs that a floor stops, in steps of so few passes that they are lost, and get more.
pub fn lost() -> Agreement {
    let mut crumbs = stopped("crumbs", |i| i % 7 < 2);
    crumbs.name = "implicit, lost steps".into();
    crumbs.case.plan.integrator = Integrator::Implicit { passes: 3 };
    crumbs
}

/// A ball that has pressed clay in, and goes back by half as far as it came in a step: clay that flowed
/// springs back.
pub fn withdrawn() -> Agreement {
    let mut s = block(IVec3::new(9, 8, 9), 0.0, floor_walls(Wall::Stick), Preset::SoftClay.material());
    let tool = Tool { shape: ToolShape::Sphere { radius: 3.0 * CELL }, contact: SEPARATE };
    let above = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(10.3, 11.1, 10.6);
    let way = |s: &Snapshot, p: &FramePlan, from: f64, to: f64| {
        vec![moving(s, p, tool, above + DVec3::Y * from, above + DVec3::Y * to, DQuat::IDENTITY)]
    };
    let press = FramePlan { dt: 5e-3, steps: 10, ..steps(&s) };
    let press = FramePlan { tools: way(&s, &press, 0.0, -1.1), ..press };
    let mut engine = NativeEngine::with_threads(1);
    engine.load(&s).expect("load");
    engine.submit(press).expect("submit");
    engine.wait().expect("report");
    s = engine.save().expect("save");
    let p = FramePlan { dt: 1e-2, steps: 1, integrator: Integrator::Implicit { passes: 12 }, ..steps(&s) };
    let p = FramePlan { tools: way(&s, &p, -1.1, -1.045), ..p };
    held("implicit, a ball that goes back".into(), s, p, 0)
}

/// A block close above a floor, which gravity takes four cells down in a step: the first direction leads far
/// below it.
pub fn fallen(floor: Wall) -> Agreement {
    let mut s = block(IVec3::new(5, 4, 6), 0.3, floor_walls(floor), soft());
    let integrator = Integrator::Implicit { passes: 15 };
    let p = FramePlan { dt: (4.0 * CELL / 9.81).sqrt(), steps: 1, integrator, gravity: DVec3::NEG_Y * 9.81, ..steps(&s) };
    velocities(&mut s, |at| 0.1 * CELL / p.dt * DVec3::new((at.y / 3.0).sin(), 0.0, (at.x / 5.0).sin()));
    held(format!("implicit, a block that falls on a floor: {floor:?}"), s, p, 0)
}

/// A ball with each contact, on each floor, and clay that a floor stops.
pub fn implicit_steps() -> Vec<Agreement> {
    let of = |floor: Wall, contact: Contact| {
        let s = moved_block(IVec3::new(9, 8, 9), floor);
        let mut p = steps(&s);
        let from = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(10.3, 11.1, 10.6);
        let tool = Tool { shape: ToolShape::Sphere { radius: 3.0 * CELL }, contact };
        p.tools = vec![moving(&s, &p, tool, from, from + DVec3::new(0.1, -0.4, 0.05), DQuat::IDENTITY)];
        held(format!("implicit, {floor:?} floor, {contact:?}"), s, p, 0)
    };
    let floors = [Wall::Separate, Wall::Slip, Wall::Stick];
    let balls = floors.into_iter().flat_map(|floor| Contact::ALL.map(|contact| of(floor, contact)));
    balls.chain([stopped("a block", |_| true), stopped("crumbs", |i| i % 7 < 2)]).collect()
}

/// A blade that cuts down and one that sweeps, with each contact; a gouge, a wire and a thin plate.
pub fn implicit_blades() -> Vec<Agreement> {
    let flat = ToolShape::Blade { half_width: 4.1 * CELL, half_height: 3.4 * CELL };
    let bend: Vec<DVec2> = (0..7).map(|i| DVec2::from_angle(PI + f64::from(i) * PI / 6.0) * 2.6 * CELL).collect();
    let gouge = ToolShape::BentBlade { profile: Profile::new(&bend).expect("a profile"), half_height: 3.4 * CELL };
    let wire = ToolShape::Wire { half_length: 7.3 * CELL };
    let plate = ToolShape::Box { half_size: DVec3::new(3.0, 3.0, 0.5) * CELL };
    let (down, sideways) = (DVec3::new(0.02, -0.4, 0.01), DVec3::new(0.3, 0.01, 0.1));
    let flat = Contact::ALL.into_iter().flat_map(|contact| [(flat, contact, down, 0), (flat, contact, sideways, 0)]);
    let others = [(gouge, SEPARATE, sideways, 0), (wire, SEPARATE, down, 0), (plate, SEPARATE, down, 243)];
    let case = |(shape, contact, way, sheet): (ToolShape, Contact, DVec3, u8)| {
        let s = moved_block(IVec3::new(9, 7, 8), Wall::Stick);
        let mut p = steps(&s);
        let height = if sheet == 0 { 6.07 } else { 9.1 };
        let from = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(10.6, height, 10.3);
        let turn = DQuat::from_rotation_y(1.4) * DQuat::from_rotation_x(0.03);
        p.tools = vec![ToolPath { sheet, ..moving(&s, &p, Tool { shape, contact }, from, from + way, turn) }];
        held(format!("implicit, {shape:?}, {contact:?}, {way}"), s, p, 50)
    };
    flat.chain(others).map(case).collect()
}

/// A block that a kept cut divides, or of two bodies, pressed from above, level and askew; slid along,
/// parted, and cut twice.
pub fn implicit_cuts() -> Vec<Agreement> {
    let level = DVec3::new(0.1, 1.0, 0.05);
    let case = |(name, normal, v, is_crossed, bodies): (&str, DVec3, DVec3, bool, [u32; 2])| {
        let mut s = block(IVec3::new(8, 7, 8), 0.0, floor_walls(Wall::Stick), soft());
        let mut p = steps(&s);
        let middle = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(10.0, 3.6, 10.0);
        for q in &mut s.particles {
            let side = (q.grid() - middle).dot(normal.normalize());
            let other = (q.grid() - middle).dot(DVec3::new(1.0, 0.1, -0.2).normalize());
            q.velocity = (v * side.signum() * CELL / p.dt).as_vec3().to_array();
            let tag = |sheet, side: f64| Tag { sheet, side: if side < 0.0 { -1 } else { 1 } };
            q.body = bodies[usize::from(side > 0.0)];
            if side.abs() < 3.0 && bodies[0] == bodies[1] {
                q.tags[0] = tag(7, side);
            }
            if is_crossed && other.abs() < 2.0 {
                q.tags[1] = tag(3, other);
            }
        }
        let press = Tool { shape: ToolShape::Box { half_size: DVec3::new(9.0, 2.0, 9.0) * CELL }, contact: SEPARATE };
        let from = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(10.0, 9.0, 10.0);
        p.tools = vec![moving(&s, &p, press, from, from - DVec3::Y * 0.2, DQuat::IDENTITY)];
        held(format!("implicit, {name}"), s, p, 0)
    };
    let (still, askew) = (DVec3::ZERO, DVec3::new(0.7, 1.0, 0.1));
    [
        ("pressed", level, still, false, [0, 0]),
        ("pressed askew", askew, still, false, [2, 2]),
        ("closing", level, DVec3::new(0.0, -0.05, 0.0), false, [0, 0]),
        ("sliding", level, DVec3::new(0.05, -0.02, 0.01), false, [0, 0]),
        ("parting", level, DVec3::new(0.01, 0.05, 0.0), false, [0, 0]),
        ("crossed", level, DVec3::new(0.03, -0.03, 0.0), true, [0, 0]),
        ("bodies pressed askew", askew, still, false, [0, 1]),
        ("bodies sliding", level, DVec3::new(0.05, -0.02, 0.01), false, [3, 0]),
        ("bodies parting", level, DVec3::new(0.01, 0.05, 0.0), false, [1, 2]),
        ("bodies crossed by a cut", level, DVec3::new(0.03, -0.03, 0.0), true, [0, 4]),
    ]
    .map(case)
    .into()
}
