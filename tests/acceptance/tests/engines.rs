//! The native engine against the f64 oracle.

use bevy_clay::prelude::*;
use bevy_clay::sim::oracle::Oracle;
use bevy_clay::sim::prelude::*;
use bevy_clay::sim::validation::Validation;
use bevy_clay::sim::validation::{AffineDrive, Manufactured};
use clay_acceptance::agreement::{self, Agreement, CELL, Case, assert_close, block, floor_walls, moving, plan, soft, velocities};
use glam::{DMat3, DQuat, DVec2, DVec3, IVec3};
use std::f64::consts::PI;

fn assert_all(cases: Vec<Agreement>) {
    let mut engine = NativeEngine::new();
    for case in cases {
        assert_close(&mut engine, &case);
    }
}

#[test]
fn walls_in_a_corner_agree() {
    assert_all(agreement::walls_in_a_corner());
}

#[test]
fn impact_agrees() {
    assert_all(agreement::impact());
}

#[test]
fn asymmetric_deformation_agrees() {
    assert_all(agreement::asymmetric_deformation());
}

#[test]
fn solid_tools_agree() {
    assert_all(agreement::solid_tools());
}

#[test]
fn found_tools_agree() {
    assert_all(agreement::found_tools());
}

/// A plate parts the clay on its two sides; of one that has gone nothing is left.
#[test]
fn thin_plates_agree() {
    let cases = agreement::thin_plates();
    for Agreement { case, name, .. } in &cases {
        let mut oracle = Oracle::new(&case.snapshot);
        oracle.run(&case.plan);
        let beside = |sheet, side| oracle.particles.iter().filter(|p| p.key().side(sheet) == side).count();
        let left = oracle.particles.iter().filter(|p| p.key().side(250) != 0).count();
        assert!(beside(243, 1).min(beside(243, -1)) > 5 && left == 0, "{name}: {} {} {left}", beside(243, 1), beside(243, -1));
    }
    assert_all(cases);
}

/// Each particle clings to two tools at most, some to two.
#[test]
fn tools_in_a_corner_agree() {
    let cases = agreement::tools_in_a_corner();
    for Agreement { case, name, .. } in &cases {
        let mut oracle = Oracle::new(&case.snapshot);
        oracle.run(&case.plan);
        let clinging = oracle.particles.iter().filter(|p| p.anchors.iter().all(Option::is_some)).count();
        assert!(clinging > 20, "{name}: {clinging}");
    }
    assert_all(cases);
}

#[test]
fn anchors_end_where_the_touch_does() {
    agreement::assert_anchors_end_where_the_touch_does(&mut NativeEngine::new());
}

#[test]
fn sides_end_where_the_plate_does() {
    agreement::assert_sides_end_where_the_plate_does(&mut NativeEngine::new());
}

#[test]
fn blades_agree() {
    assert_all(agreement::blades());
}

#[test]
fn flanks_of_worked_clay_agree() {
    assert_all(agreement::worked_flanks());
}

#[test]
fn other_blades_agree() {
    assert_all(agreement::other_blades());
}

#[test]
fn kept_cut_agrees() {
    assert_all(agreement::kept_cut());
}

#[test]
fn crossed_cuts_agree() {
    assert_all(agreement::crossed_cuts());
}

#[test]
fn cut_through_cuts_agrees() {
    assert_all(agreement::recut());
}

/// A blade that cuts down between two bodies bears nothing by its edge, in one it does.
#[test]
fn parted_clay_agrees() {
    let force = |a: &Agreement| Oracle::new(&a.case.snapshot).run(&a.case.plan).tools[0].force.y;
    let cut = agreement::blades().into_iter().find(|a| a.case.plan.tools[0].tool.contact == Contact::Slip).expect("one");
    let (parted, whole) = (force(&agreement::parted()[0]), force(&cut));
    assert!(whole > 0.0 && parted.abs() < 0.01 * whole, "{parted} N and {whole}");
    assert_all(agreement::parted());
}

#[test]
fn welding_agrees() {
    let welded = agreement::welding().iter().map(|a| Oracle::new(&a.case.snapshot).run(&a.case.plan).welded).collect::<Vec<_>>();
    assert!(welded[0] > 1000 && welded[1] == 0 && welded[2] > 1000 && welded[3] == 0, "{welded:?}");
    assert_all(agreement::welding());
}

/// What is pressed when its blade leaves stays marked until it is released, below half of what welds, and is
/// marked while the blade is there, at its cut where that parts bodies: nothing of it grows together.
#[test]
fn left_pressed_agrees() {
    let cases = agreement::left_pressed();
    let counts = |a: &Agreement| {
        let mut oracle = Oracle::new(&a.case.snapshot);
        assert_eq!(oracle.run(&a.case.plan).welded, 0, "{}", a.name);
        let tags: Vec<Tag> = oracle.particles.iter().flat_map(|p| p.tags).filter(|tag| tag.side != 0).collect();
        assert!(tags.len() > 1000 && tags.iter().all(|tag| tag.sheet == 7), "{}", a.name);
        let of = |count| tags.iter().filter(|tag| tag.side.unsigned_abs() == count).count();
        [of(127), of(1)]
    };
    let [on, released, beside, between, almost] = [0, 1, 2, 3, 4].map(|i| counts(&cases[i]));
    assert!(on[0] > 2000 && released[0] == 0 && released[1] > 2000, "{on:?} {released:?}");
    assert!(beside[0] > 1000 && between[0] > 1000, "{beside:?} {between:?}");
    assert!(almost[0] > 1000, "{almost:?}");
    assert_all(cases);
}

#[test]
fn carried_sides_agree() {
    let runs = agreement::carrying().into_iter().map(|a| Oracle::new(&a.case.snapshot).run(&a.case.plan).carried);
    let carried: Vec<u64> = runs.collect();
    assert!(carried[0] > 500 && carried[1] > carried[0], "{carried:?}");
    assert_all(agreement::carrying());
}

#[test]
fn bodies_agree() {
    assert_all(agreement::bodies());
}

/// A cut that has gone through gives way to a body, and two bodies are one where they have grown together.
#[test]
fn found_bodies_agree() {
    assert_all(agreement::found_bodies());
}

#[test]
fn all_blades_agree() {
    assert_all(agreement::all_blades());
}

#[test]
fn laws_agree() {
    assert_all(agreement::laws());
}

/// The laws as published too, under which the stress itself fades from the tool.
#[test]
fn all_laws_agree() {
    assert_all(agreement::all_laws());
}

/// The methods of others: all but the first.
const METHODS: [CuttingMethod; CuttingMethod::ALL.len() - 1] = {
    let [_, others @ ..] = CuttingMethod::ALL;
    others
};

/// The methods of others, each with blades that cut, sweep, stick and reach through the floor, a bent and a
/// pointed one, and a ball beside the blade.
fn compared(method: CuttingMethod) -> Vec<Agreement> {
    let flat = ToolShape::Blade { half_width: 4.1 * CELL, half_height: 3.4 * CELL };
    let pointed = ToolShape::PointedBlade { half_width: 2.1 * CELL, half_height: 4.3 * CELL };
    let bend: Vec<DVec2> = (0..7).map(|i| DVec2::from_angle(PI + f64::from(i) * PI / 6.0) * 2.6 * CELL).collect();
    let bent = ToolShape::BentBlade { profile: Profile::new(&bend).expect("a profile"), half_height: 3.4 * CELL };
    let (down, sideways) = (DVec3::new(0.02, -2.0, 0.01), DVec3::new(1.2, 0.03, 0.3));
    let mut cases = vec![];
    for (name, shape, contact, height, step) in [
        ("cut", flat, Contact::Slip, 8.07, down),
        ("sweep", flat, agreement::SEPARATE, 8.07, sideways),
        ("sticking", flat, Contact::Stick, 8.07, sideways),
        ("through the floor", flat, agreement::SEPARATE, 3.07, sideways),
        ("pointed", pointed, agreement::SEPARATE, 7.07, down),
        ("bent", bent, agreement::SEPARATE, 7.07, sideways * 0.5),
    ] {
        let s = block(IVec3::new(10, 8, 10), 0.0, floor_walls(Wall::Separate), soft());
        let mut p = plan(&s, 0.25, 20, vec![]);
        p.cutting = method;
        let at = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(11.13, height, 11.3);
        let ball = Tool { shape: ToolShape::Sphere { radius: 2.2 * CELL }, contact: agreement::SEPARATE };
        let beside = DVec3::new(15.0, 8.9, 12.2) + s.domain.wall_nodes().0.as_dvec3();
        p.tools = vec![
            moving(&s, &p, Tool { shape, contact }, at, at + step, DQuat::from_rotation_y(1.4) * DQuat::from_rotation_x(0.03)),
            ToolPath { id: 4, ..moving(&s, &p, ball, beside, beside + down * 0.5, DQuat::IDENTITY) },
        ];
        let tagged = if method.has_ghosts() { 300 } else { 0 };
        let name = format!("{method:?}: {name}");
        cases.push(Agreement { position: 2e-6, strain: 6e-6, tagged, ..held_closely(name, s, p) });
    }
    cases
}

#[test]
fn other_methods_agree() {
    METHODS.into_iter().for_each(|method| assert_all(compared(method)));
}

#[test]
fn volume_averaging_agrees() {
    assert_all(agreement::averaging());
}

fn held_closely(name: impl Into<String>, snapshot: Snapshot, plan: FramePlan) -> Agreement {
    Agreement { name: name.into(), case: Case { snapshot, plan }, position: 1e-6, strain: 3e-6, tagged: 0 }
}

/// A block that falls into the corner of clamped walls.
#[test]
fn clamped_walls_agree() {
    let case = |kind: Wall| {
        let mut s = block(IVec3::new(9, 12, 11), 0.3, Walls { high: [kind; 3], ..floor_walls(kind) }, soft());
        let mut p = plan(&s, 0.25, 20, vec![]);
        velocities(&mut s, |_| DVec3::new(0.04, -0.05, 0.002) * CELL / p.dt);
        // Against the wall at high x, in the last row of whose ghosts some particles' weights end.
        let shift = s.domain.wall_nodes().1.x - s.domain.wall_nodes().0.x - 6 - 9;
        s.particles.iter_mut().for_each(|q| q.set_grid(q.grid() + f64::from(shift) * DVec3::X));
        p.validation.clamped_walls = true;
        held_closely(format!("clamped {kind:?}"), s, p)
    };
    assert_all([Wall::Separate, Wall::Slip, Wall::Stick].map(case).into());
}

/// A ball that moves, turns and grows by 0.05 cells per substep in the block's middle.
#[test]
fn growing_balls_agree() {
    let case = |contact: Contact| {
        let s = block(IVec3::splat(10), 0.0, floor_walls(Wall::Stick), soft());
        let mut p = plan(&s, 0.25, 20, vec![]);
        let from = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(11.0, 5.0, 11.3);
        let tool = Tool { shape: ToolShape::Sphere { radius: 2.2 * CELL }, contact };
        p.tools = vec![moving(&s, &p, tool, from, from + DVec3::new(0.2, -0.1, 0.1), DQuat::IDENTITY)];
        p.validation.sphere_growth = 0.05 * CELL / p.dt;
        held_closely(format!("growing ball {contact:?}"), s, p)
    };
    assert_all(Contact::ALL.map(case).into());
}

/// A block under the force of a manufactured solution, at a wall and in the open, with scaled inertia.
#[test]
fn manufactured_force_agrees() {
    let s = block(IVec3::new(9, 12, 11), 0.0, floor_walls(Wall::Separate), soft());
    let mut p = plan(&s, 0.25, 20, vec![]);
    let (low, high) = s.domain.corners();
    let (length, phases) = ((high - low).max_element(), DVec3::new(0.3, 1.0, 2.2));
    let case = Manufactured { amplitudes: DVec3::splat(0.1), length, low, phases, time: 0.0 };
    p.integrator = Integrator::Explicit { density_scale: 2.0 };
    p.validation.manufactured = Some(Manufactured { time: 0.4 * PI / case.frequency(&p.material), ..case });
    assert_all(vec![held_closely("manufactured", s, p)]);
}

/// A block of which a shell of nodes is driven, and the middle free.
#[test]
fn affine_drive_agrees() {
    let s = block(IVec3::splat(10), 2.0, Walls::default(), soft());
    let mut p = plan(&s, 0.25, 20, vec![]);
    let at = |x: f64| s.domain.to_world(s.domain.wall_nodes().0.as_dvec3() + DVec3::new(6.0 + x, 2.0 + x, 6.0 + x));
    let gradient = DMat3::from_cols_array(&[4.0, 1.0, -2.0, 5.0, -3.0, 2.0, -1.0, 3.0, 1.0]) * (2e-3 / p.dt);
    let drive = AffineDrive { gradient, about: at(4.3), free: [at(2.5), at(7.5)] };
    p.validation = Validation { affine_drive: Some(drive), ..Validation::default() };
    assert_all(vec![held_closely("driven", s, p)]);
}

/// Implicit steps, iteration by iteration; those too that are lost with their passes and get more, that pairs
/// lead too far, and that meet what the preconditioner does not know.
#[test]
fn implicit_steps_agree() {
    assert_all(agreement::implicit_steps());
    let lost = agreement::lost();
    let taken = Oracle::new(&lost.case.snapshot).run(&lost.case.plan).passes;
    assert!(taken > 3 * lost.case.plan.steps, "none is lost in {taken} passes");
    let withdrawn = agreement::withdrawn();
    let rejected = Oracle::new(&withdrawn.case.snapshot).run(&withdrawn.case.plan).rejected;
    assert!(rejected > 0, "nothing leads too far");
    let fallen = [Wall::Separate, Wall::Stick].map(agreement::fallen);
    for of_floor in &fallen {
        let mut oracle = Oracle::new(&of_floor.case.snapshot);
        let report = oracle.run(&of_floor.case.plan);
        assert!(report.rejected > 0 && report.residual < 1.0, "{}: {report:?}", of_floor.name);
    }
    assert_all([lost, withdrawn].into_iter().chain(fallen).collect());
}

/// Flat blades, a wire and a plate in implicit steps, near the least: on the way there the engine's
/// iterations are not the oracle's.
#[test]
fn blades_agree_in_implicit_steps() {
    let is_flat = |p: &FramePlan| !matches!(p.tools[0].tool.shape, ToolShape::BentBlade { .. });
    let mut cases = agreement::implicit_blades();
    cases.retain(|agreement| is_flat(&agreement.case.plan));
    cases.extend(agreement::worked_flanks_in_implicit_steps());
    for Agreement { case, position, strain, .. } in &mut cases {
        // A wire's is found sooner: what comes after is rounding, which cuts steps.
        let passes = if case.plan.tools[0].tool.shape.is_wire() { 10 } else { 60 };
        case.plan.integrator = Integrator::Implicit { passes };
        (*position, *strain) = (4e-5, 1e-4);
    }
    assert_all(cases);
}

/// Their bits do not depend on the number of threads: under a ball, about a blade, at cuts.
#[test]
fn implicit_runs_are_bit_identical() {
    for cases in [agreement::implicit_steps(), agreement::implicit_blades(), agreement::implicit_cuts()] {
        let run = |threads| agreement::run(&mut NativeEngine::with_threads(threads), &cases[1].case, 3);
        assert!(run(1) == run(2), "one thread against two: {}", cases[1].name);
    }
}

/// Stiff crumbs settle on the floor, slower than a frame's fall would make them: nodes however light are
/// counted where the potential is judged.
#[test]
fn crumbs_rest_in_implicit_steps() {
    let mut s = block(IVec3::splat(6), 0.0, floor_walls(Wall::Slip), stiff());
    let mut index = 0u64..;
    s.particles.retain(|_| index.next().is_some_and(|i| i.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 62 == 0));
    let mut engine = NativeEngine::new();
    engine.load(&s).expect("load");
    let dt = 1.0 / 90.0;
    let mut p = FramePlan { dt, gravity: DVec3::NEG_Y * 9.81, ..plan(&s, 1.0, 1, vec![]) };
    p.integrator = Integrator::Implicit { passes: 15 };
    for _ in 0..4 {
        engine.submit(p.clone()).expect("submit");
        let report = engine.wait().expect("report");
        assert!(report.health.is_ok() && report.speed(CELL) < 9.81 * dt, "{} {}", report.health, report.speed(CELL));
    }
}

/// An implicit frame in whose steps clay goes too far is redone in steps of half the length, from the clay as
/// it was: bit by bit the frame that was planned so, under a tool that touches it and across a cut.
#[test]
fn implicit_frame_that_is_redone_is_one_of_shorter_steps() {
    let mut s = block(IVec3::splat(6), 1.0, Walls::default(), stiff());
    for q in &mut s.particles {
        let side = q.grid().x - s.domain.wall_nodes().0.as_dvec3().x - 9.1;
        q.tags[0] = Tag { sheet: 7, side: if side < 0.0 { -1 } else { 1 } };
    }
    let dt = 1e-3;
    velocities(&mut s, |_| DVec3::X * 2.0 * CELL / dt);
    let tool = Tool { shape: ToolShape::Sphere { radius: 2.0 * CELL }, contact: agreement::SEPARATE };
    let at = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(9.0, 8.9, 9.0);
    let run = |dt: f64, steps: u32| {
        let mut p = FramePlan { dt, steps, ..plan(&s, 1.0, 1, vec![]) };
        p.integrator = Integrator::Implicit { passes: 12 };
        p.tools = vec![moving(&s, &p, tool, at, at + DVec3::X * 2.0, DQuat::IDENTITY)];
        let mut engine = NativeEngine::new();
        engine.load(&s).expect("load");
        engine.submit(p).expect("submit");
        let report = engine.wait().expect("report");
        assert!(!report.health.contains(Health::GIVEN_UP) && report.tools[0].contacts > 0, "{}", report.health);
        (report.redone, report.steps, engine.save().expect("save"))
    };
    let (redone, steps, clay) = run(dt, 1);
    assert!(redone > 0 && steps == 1 << redone, "{redone}: {steps}");
    let planned = run(dt / f64::from(steps), steps);
    assert_eq!((planned.0, planned.1), (0, steps));
    assert!(planned.2.particles == clay.particles, "the same clay");
}

/// A blade that stands askew pushes free clay on as fast as it goes itself, and not off along its own axes: a
/// preconditioner with the diagonal of its springs alone threw it aside at four fifths of that.
#[test]
fn askew_blade_pushes_clay_on_in_implicit_steps() {
    let material = ClayMaterial { young_modulus: 5.5e6, yield_stress: 1e5, ..stiff() };
    let mut s = block(IVec3::splat(8), 0.0, floor_walls(Wall::Separate), material);
    s.particles.iter_mut().for_each(|p| p.set_grid(p.grid() + DVec3::Y * 3.0));
    let normal = DVec3::new(0.13, 0.45, 0.88).normalize();
    let blade = ToolShape::Blade { half_width: 9.0 * CELL, half_height: 9.0 * CELL };
    let tool = Tool { shape: blade, contact: Contact::Slip };
    let turn = DQuat::from_rotation_arc(DVec3::Z, normal);
    let middle = s.particles.iter().map(Particle::grid).sum::<DVec3>() / s.particles.len() as f64;
    let reach = s.particles.iter().map(|p| -(p.grid() - middle).dot(normal)).fold(0.0, f64::max);
    let (dt, speed) = (1.0 / 90.0, 0.16);
    let from = middle - normal * (reach + 0.1);
    let mut p = FramePlan { dt, gravity: DVec3::ZERO, ..plan(&s, 1.0, 1, vec![]) };
    p.integrator = Integrator::Implicit { passes: 15 };
    p.tools = vec![ToolPath { sheet: 3, ..moving(&s, &p, tool, from, from + normal * (speed * dt / CELL), turn) }];
    let mut engine = NativeEngine::new();
    engine.load(&s).expect("load");
    engine.submit(p).expect("submit");
    let report = engine.wait().expect("report");
    let mean = report.momentum / report.particle_mass;
    let across = mean.reject_from_normalized(normal).length();
    assert!((0.3 * speed..1.5 * speed).contains(&mean.dot(normal)) && across < 0.5 * speed, "{mean} of {speed}, {across} across");
}

/// Stiff clay in frames of one implicit step each, or of explicit ones, and a tool that goes `way` \[cells\]
/// in each: the force on it along that.
fn force_path(s: &Snapshot, integrator: Integrator, tool: Tool, at: DVec3, way: DVec3, turn: DQuat, frames: u32) -> Vec<f64> {
    let mut engine = NativeEngine::new();
    engine.load(s).expect("load");
    let mut p = FramePlan { volume_averaging: 5e-4, gravity: DVec3::ZERO, ..plan(s, 0.5, 1, vec![]) };
    let duration = way.length() * CELL / 0.02;
    if let Integrator::Explicit { density_scale } = integrator {
        p.steps = (duration / (p.dt * density_scale.sqrt())).ceil() as u32;
    }
    p.dt = duration / f64::from(p.steps);
    p.integrator = integrator;
    let frame = |i: u32| {
        let from = at + f64::from(i) * way;
        p.tools = vec![moving(s, &p, tool, from, from + way, turn)];
        engine.submit(p.clone()).expect("submit");
        let report = engine.wait().expect("report");
        assert!(report.health.is_ok() && report.balance_error() < 1e-6, "{} {:e}", report.health, report.balance_error());
        let pose = p.tools[0].pose_at(duration);
        if let ToolShape::Blade { half_width, half_height } = tool.shape {
            let is_behind = |q: &Particle| {
                let local = pose.to_local(s.domain.to_world(q.grid()));
                let side = q.tags.iter().find(|tag| tag.sheet == 3).map_or(0, |tag| tag.sign());
                local.x.abs() < half_width && local.y.abs() < half_height && f64::from(side) * local.z < 0.0
            };
            assert_eq!(engine.save().expect("save").particles.iter().filter(|q| is_behind(q)).count(), 0, "frame {i}");
        }
        report.tools[0].force.dot(way.normalize())
    };
    (0..frames).map(frame).collect()
}

fn stiff() -> ClayMaterial {
    ClayMaterial { young_modulus: 5.5e5, poisson_ratio: 0.45, yield_stress: 1e4, density: 1700.0, weld: Weld::Off, ..soft() }
}

/// No particle gets to the wrong side of a blade that sweeps a cell and more through clay, and it bears.
#[test]
fn nothing_leaks_through_a_blade_in_implicit_steps() {
    let s = block(IVec3::new(8, 6, 5), 0.0, floor_walls(Wall::Stick), stiff());
    let tool = Tool {
        shape: ToolShape::Blade { half_width: 9.0 * CELL, half_height: 2.1 * CELL },
        contact: Contact::Separate { friction: 0.3 },
    };
    let (at, turn) = (s.domain.wall_nodes().0.as_dvec3() + DVec3::new(9.13, 4.2, 8.5), DQuat::from_rotation_y(PI / 2.0));
    for (way, frames) in [(0.1, 12), (0.25, 6)] {
        let integrator = Integrator::Implicit { passes: 15 };
        let force = force_path(&s, integrator, tool, at, DVec3::X * way, turn, frames);
        let least = force.iter().skip(2).fold(f64::INFINITY, |least, force| least.min(-force));
        assert!(least > 5.0, "{way}: {force:?}");
    }
}

/// A block that a level cut divides bears between floor and plate what it bears in explicit steps.
#[test]
fn closed_cuts_bear_in_implicit_steps() {
    let mut s = block(IVec3::splat(6), 0.0, floor_walls(Wall::Separate), stiff());
    let low = s.domain.wall_nodes().0.as_dvec3();
    for q in &mut s.particles {
        let side = q.grid().y - low.y - 3.13;
        q.tags[0] = Tag { sheet: 7, side: if side < 0.0 { -1 } else { 1 } };
    }
    let tool = Tool { shape: ToolShape::Box { half_size: DVec3::new(9.0, 2.0, 9.0) * CELL }, contact: agreement::SEPARATE };
    let at = low + DVec3::new(9.0, 8.0, 9.0);
    let of = |integrator| force_path(&s, integrator, tool, at, DVec3::NEG_Y * 0.05, DQuat::IDENTITY, 14);
    let (implicit, explicit) = (of(Integrator::Implicit { passes: 30 }), of(Integrator::Explicit { density_scale: 16.0 }));
    // In explicit steps the plate's first blow rings.
    let [ours, theirs] = [&implicit, &explicit].map(|force| -force[11..].iter().sum::<f64>());
    assert!(theirs > 60.0 && (ours / theirs - 1.0).abs() < 0.1, "{implicit:?} {explicit:?}");
}

#[test]
fn given_up_frames_leave_no_trace() {
    agreement::assert_given_up_frames_leave_no_trace(&mut NativeEngine::new());
}

/// Two runs give the same bits, on one thread and on two.
#[test]
fn runs_are_bit_identical() {
    let run = |threads| agreement::run(&mut NativeEngine::with_threads(threads), &agreement::mixed(), 3);
    let one = run(1);
    assert!(one == run(2), "one thread against two");
    assert!(one == run(1), "two runs");
}

/// The same of the methods of others.
#[test]
fn runs_of_other_methods_are_bit_identical() {
    for method in METHODS {
        let mut case = agreement::mixed();
        case.plan.cutting = method;
        case.plan.steps = 30;
        let run = |threads| agreement::run(&mut NativeEngine::with_threads(threads), &case, 2);
        let one = run(1);
        assert!(one == run(2), "{method:?}: one thread against two");
        assert!(one == run(1), "{method:?}: two runs");
    }
}

/// What only our method knows is refused by name.
#[test]
fn other_methods_refuse_wires_and_validation_inputs() {
    let s = block(IVec3::splat(4), 0.0, Walls::default(), soft());
    let wire = Tool { shape: ToolShape::Wire { half_length: CELL }, contact: Contact::Slip };
    for cutting in METHODS {
        let with_wire =
            FramePlan { cutting, tools: vec![ToolPath::still(1, wire, Pose::default())], ..plan(&s, 0.25, 1, vec![]) };
        let validation = Validation { damping: 1.0, ..Validation::default() };
        let with_input = FramePlan { cutting, validation, ..plan(&s, 0.25, 1, vec![]) };
        for refused in [with_wire, with_input] {
            assert_eq!(refused.validate().expect_err("a refusal").name, "cutting", "{cutting:?}");
        }
    }
}

/// One particle, weightless and at rest, before a blade that comes on: its ghost at the nodes beyond the
/// blade has the blade's velocity, its own nodes none.
#[test]
fn ghosts_move_with_the_blade() {
    let mut s = block(IVec3::splat(4), 0.0, Walls::default(), soft());
    s.particles.truncate(1);
    let at = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(6.2, 5.4, 7.6);
    s.particles[0].set_grid(at);
    let blade =
        Tool { shape: ToolShape::Blade { half_width: 4.1 * CELL, half_height: 4.2 * CELL }, contact: agreement::SEPARATE };
    for cutting in METHODS.into_iter().filter(|method| method.has_ghosts()) {
        let mut p = FramePlan { cutting, gravity: DVec3::ZERO, ..plan(&s, 0.25, 1, vec![]) };
        let from = at - DVec3::Z * 0.35;
        p.tools = vec![moving(&s, &p, blade, from, from + DVec3::Z * 0.05, DQuat::IDENTITY)];
        let mut oracle = Oracle::new(&s);
        let report = oracle.run(&p);
        // Only the lowest of the three layers of nodes, 0.6 cells below the particle, is behind the blade.
        let speed = 0.5 * 0.9 * 0.9 * 0.05 * CELL / p.dt;
        assert!(
            (oracle.particles[0].velocity - DVec3::Z * speed).length() < 1e-6 * speed,
            "{cutting:?}: {}",
            oracle.particles[0].velocity
        );
        let mass = s.material.density * f64::from(s.particles[0].rest_volume);
        assert!((report.tools[0].impulse + DVec3::Z * mass * speed).length() < 1e-6 * mass * speed, "{cutting:?}");
        assert_eq!(oracle.particles[0].tags[0].side, 1, "{cutting:?}");
        oracle.run(&FramePlan { tools: vec![], ..p });
        assert_eq!(oracle.particles[0].tags, [Tag::default(); 2], "{cutting:?}: nothing is kept");
    }
}

/// Deep inside a tool of interactive particles a node of mass m has been given `rho dx^3 V / (m + rho dx^3)`
/// by the tool.
#[test]
fn interactive_particles_share_their_velocity() {
    let s = block(IVec3::splat(10), 2.0, Walls::default(), soft());
    let cutting = CuttingMethod::InteractiveParticles;
    let mut p = FramePlan { cutting, gravity: DVec3::ZERO, ..plan(&s, 0.25, 1, vec![]) };
    let at = s.domain.wall_nodes().0.as_dvec3() + DVec3::new(11.0, 7.0, 11.0);
    let tool = Tool { shape: ToolShape::Box { half_size: DVec3::splat(3.0 * CELL) }, contact: Contact::Slip };
    p.tools = vec![moving(&s, &p, tool, at, at + DVec3::X * 0.05, DQuat::IDENTITY)];
    let whole = s.material.density * CELL.powi(3);
    let nodes = Oracle::new(&s).trace(&p);
    let inner: Vec<_> = nodes.iter().filter(|n| (n.node.as_dvec3() - at).abs().max_element() < 1.5).collect();
    assert_eq!(inner.len(), 27);
    for n in inner {
        let shared = DVec3::X * (whole / (n.mass + whole) * 0.05 * CELL / p.dt);
        assert!((n.velocity - shared).length() < 1e-9 * shared.length(), "{}: {} {}", n.node, n.velocity, shared);
    }
}

/// A cut that is pressed together for as long as it takes grows together in implicit steps, all along, as in
/// explicit ones, and no sooner.
#[test]
fn pressed_cuts_grow_together_in_implicit_steps() {
    const FRAME: f64 = 0.01;
    let mut s = block(IVec3::splat(6), 0.0, floor_walls(Wall::Separate), ClayMaterial { weld: Weld::Sticky, ..stiff() });
    let low = s.domain.wall_nodes().0.as_dvec3();
    for q in &mut s.particles {
        let side = q.grid().y - low.y - 3.13;
        // Within reach of the other side.
        if side.abs() < 1.0 {
            q.tags[0] = Tag { sheet: 7, side: if side < 0.0 { -1 } else { 1 } };
        }
    }
    let tagged = s.particles.iter().filter(|q| q.tags[0].side != 0).count() as u64;
    let tool = Tool { shape: ToolShape::Box { half_size: DVec3::new(9.0, 2.0, 9.0) * CELL }, contact: agreement::SEPARATE };
    let at = |frame: u32| low + DVec3::new(9.0, 8.0 - 0.05 * f64::from(frame.min(3)), 9.0);
    let of = |integrator| {
        let mut engine = NativeEngine::new();
        engine.load(&s).expect("load");
        let mut p = FramePlan { gravity: DVec3::ZERO, integrator, ..plan(&s, 0.5, 1, vec![]) };
        p.steps = if let Integrator::Explicit { density_scale } = integrator {
            (FRAME / (p.dt * density_scale.sqrt())).ceil() as u32
        } else {
            1
        };
        p.dt = FRAME / f64::from(p.steps);
        let frame = |frame: u32| {
            p.tools = vec![moving(&s, &p, tool, at(frame), at(frame + 1), DQuat::IDENTITY)];
            engine.submit(p.clone()).expect("submit");
            let report = engine.wait().expect("report");
            assert!(report.health.is_ok(), "{}", report.health);
            report.welded
        };
        (0..9).map(frame).collect::<Vec<_>>()
    };
    let (implicit, explicit) = (of(Integrator::Implicit { passes: 15 }), of(Integrator::Explicit { density_scale: 16.0 }));
    assert_eq!(implicit[..4], [0; 4], "{implicit:?} {explicit:?}");
    let [ours, theirs] = [&implicit, &explicit].map(|welded| welded.iter().sum::<u64>());
    assert!(ours > tagged / 2 && theirs > tagged / 3, "of {tagged}: {implicit:?} {explicit:?}");
}
