//! Tools by entity: any number at once, each with its own force and status, in the world's frame.

use super::*;

/// A ball of 2 cells' radius at `at` \[cells\].
fn ball(app: &mut App, at: DVec3) -> Entity {
    app.world_mut().spawn((SculptTool::ball(2.0 * DX as f32), Transform::from_translation((at * DX).as_vec3()))).id()
}

fn force(app: &App, tool: Entity) -> ToolForce {
    *app.world().get::<ToolForce>(tool).expect("a force")
}

fn tool_error(app: &App, tool: Entity) -> Option<String> {
    app.world().get::<ToolStatus>(tool).expect("a status").error.as_ref().map(ToString::to_string)
}

/// Moves tools by so many cells in the next tick.
fn push(app: &mut App, clay: Entity, tools: &[Entity], by: DVec3) {
    for tool in tools {
        app.world_mut().get_mut::<Transform>(*tool).expect("a tool").translation += (by * DX).as_vec3();
    }
    tick(app, clay);
}

/// Two hands with tools as they come: each is swept, each feels the clay for itself.
#[test]
fn two_default_tools_press_at_once() {
    let mut app = app();
    let clay = spawn(&mut app, cube(4, 0.0));
    let tools = [ball(&mut app, DVec3::new(4.0, 6.5, 4.0)), ball(&mut app, DVec3::new(8.5, 2.0, 4.0))];
    let idle = app.world_mut().spawn((SculptTool::default(), Transform::from_xyz(0.02, 0.1, 0.02))).id();
    // Further in, the block is caught between them or slips out, as a rounding has it.
    for _ in 0..3 {
        for (tool, by) in tools.into_iter().zip([DVec3::NEG_Y, DVec3::NEG_X]) {
            app.world_mut().get_mut::<Transform>(tool).expect("a tool").translation += (by * 0.4 * DX).as_vec3();
        }
        tick(&mut app, clay);
    }
    assert_eq!(status(&app, clay).error, None);
    let [down, aside] = tools.map(|tool| force(&app, tool));
    // The other tool pushes the clay along under it: friction is 0.3, and the ball is round.
    assert!(down.force.y > 0.1 && down.force.y > 2.0 * down.force.x.abs(), "{down:?}");
    assert!(aside.force.x > 0.1 && aside.force.x > 3.0 * aside.force.z.abs(), "{aside:?}");
    assert!(down.contacts > 0 && (down.clay, aside.clay) == (Some(clay), Some(clay)));
    assert_eq!(force(&app, idle), ToolForce::default());
    // The report has them by entity too.
    let reports = app.world().resource::<Reports>();
    let last = reports.0.last().expect("a report");
    assert_eq!(last.tool(tools[1]).map(|t| t.force.x as f32), Some(aside.force.x));
    assert_eq!(last.tools.len(), 3);
    // What is taken away feels nothing.
    app.world_mut().get_mut::<SculptTool>(tools[0]).expect("a tool").is_active = false;
    tick(&mut app, clay);
    assert_eq!(force(&app, tools[0]), ToolForce::default());
}

/// A tool that cannot be is left out and says so, while the clay and the other tools go on; mended, it is
/// back.
#[test]
fn faulty_tools_are_left_out_by_name() {
    let mut app = app();
    let clay = spawn(&mut app, cube(4, 0.0));
    let sound = ball(&mut app, DVec3::new(4.0, 6.5, 4.0));
    let faulty = ball(&mut app, DVec3::new(20.0, 2.0, 4.0));
    let place = |app: &mut App, transform| *app.world_mut().get_mut::<Transform>(faulty).expect("a tool") = transform;
    let far = Transform::from_xyz(0.1, 0.01, 0.02);
    let faults = [
        (far.with_scale(Vec3::new(1.0, 2.0, 1.0)), "uniform"),
        (far.with_scale(Vec3::splat(-1.0)), "positive"),
        (far.with_translation(Vec3::NAN), "finite"),
        (far.with_scale(Vec3::splat(1e-9)), "radius"),
    ];
    for (transform, part) in faults {
        place(&mut app, transform);
        let before = metrics(&app, clay).time;
        push(&mut app, clay, &[sound], DVec3::NEG_Y * 0.4);
        let error = tool_error(&app, faulty).expect("an error");
        assert!(error.contains(part), "{error}");
        assert!(metrics(&app, clay).time > before, "{part}: the clay stands");
        assert_eq!((status(&app, clay).error.as_ref(), tool_error(&app, sound)), (None, None));
    }
    push(&mut app, clay, &[sound], DVec3::NEG_Y * 0.4);
    assert!(force(&app, sound).force.y > 0.1, "{:?}", force(&app, sound));
    place(&mut app, far);
    tick(&mut app, clay);
    assert_eq!(tool_error(&app, faulty), None);
    assert_eq!(app.world().resource::<Reports>().0.last().expect("a report").tools.len(), 2);
}

/// Force and torque stand in the world's frame, however the clay is turned; a scale leaves them as they are.
#[test]
fn forces_are_in_the_frame_of_the_world() {
    let press = |place: Transform| {
        let mut app = app();
        let clay = spawn(&mut app, cube(4, 0.0));
        app.world_mut().get_mut::<ClaySettings>(clay).expect("settings").gravity = Some(DVec3::ZERO);
        app.world_mut().entity_mut(clay).insert(place);
        let at = |y: f64| place * Transform::from_translation((DVec3::new(4.5, y, 4.0) * DX).as_vec3());
        let tool = app.world_mut().spawn((SculptTool::ball(2.0 * DX as f32), at(6.5))).id();
        for y in 1..5 {
            app.world_mut().entity_mut(tool).insert(at(6.5 - 0.4 * f64::from(y)));
            tick(&mut app, clay);
        }
        let ToolForce { force, torque, .. } = force(&app, tool);
        (force, torque)
    };
    let (force, torque) = press(Transform::IDENTITY);
    let turn = Quat::from_rotation_z(1.1) * Quat::from_rotation_x(-0.6);
    let turned = press(Transform::from_xyz(0.2, 0.1, -0.3).with_rotation(turn).with_scale(Vec3::splat(2.0)));
    assert!(force.y > 0.1 && (turned.0 - turn * force).length() < 2e-3 * force.length(), "{force}, {}", turned.0);
    let lever = force.length() * 2.0 * DX as f32;
    assert!((turned.1 - turn * torque).length() < 2e-3 * lever, "{torque}, {}", turned.1);
}

/// A tool touches the clays it is told to, all of them otherwise.
#[test]
fn filter_says_which_clays_a_tool_touches() {
    let mut app = app();
    let clays = [spawn(&mut app, cube(4, 0.0)), spawn(&mut app, cube(4, 0.0))];
    let both = ball(&mut app, DVec3::new(4.0, 6.5, 4.0));
    let one = ball(&mut app, DVec3::new(8.5, 2.0, 4.0));
    app.world_mut().entity_mut(one).insert(TouchesOnly(vec![clays[1]]));
    for _ in 0..2 {
        push(&mut app, clays[0], &[both], DVec3::NEG_Y * 0.4);
        settle(&mut app, "the other clay", |world| engine(world, clays[1]).pending() == 0);
    }
    let sorted = |mut tools: [Entity; 2]| {
        tools.sort();
        tools.to_vec()
    };
    let tools = |clay: Entity| {
        let reports = &app.world().resource::<Reports>().0;
        let mut tools = reports.iter().rfind(|r| r.clay == clay).expect("a report").tools.clone();
        tools.sort();
        tools
    };
    assert_eq!((tools(clays[0]), tools(clays[1])), (vec![both], sorted([both, one])));
}

/// Poses of a faster clock are all swept: a way out and back between two looks of the app cuts the clay, and
/// the tool stays where its trail ends.
#[test]
fn trail_of_a_faster_clock_is_swept() {
    let dent = |is_trailed: bool| {
        let mut app = app();
        let clay = spawn(&mut app, cube(4, 0.0));
        let at = |y: f64| (DVec3::new(4.0, y, 4.0) * DX).as_vec3();
        let tool = ball(&mut app, DVec3::new(4.0, 6.5, 4.0));
        app.world_mut().entity_mut(tool).insert(ToolTrail::default());
        tick(&mut app, clay);
        for sample in 1..=10 {
            // Down by a cell and up again, at 1 kHz.
            let y = 6.5 - 0.3 * f64::from(5 - i32::abs(sample - 5));
            if is_trailed {
                let mut trail = app.world_mut().get_mut::<ToolTrail>(tool).expect("a trail");
                trail.push(17.0 + 1e-3 * f64::from(sample), Isometry3d::from_translation(at(y)));
            }
        }
        tick(&mut app, clay);
        let report = app.world().resource::<Reports>().0.last().expect("a report").clone();
        assert_eq!(app.world().get::<ToolTrail>(tool).expect("a trail").is_empty(), !is_trailed);
        let pose = engine(app.world(), clay).tool_pose(tool).expect("a pose");
        assert!((pose.position.as_vec3() - at(6.5)).length() < 1e-6, "{pose:?}");
        report.tool(tool).expect("its report").impulse.y
    };
    assert_eq!(dent(false), 0.0);
    assert!(dent(true) > 1e-6, "{}", dent(true));
}

/// What no trail can hold is left out.
#[test]
fn trail_takes_poses_in_order() {
    let mut trail = ToolTrail::default();
    for (time, x) in [(1.0, 0.0), (0.5, 1.0), (f64::NAN, 2.0), (2.0, f32::NAN), (2.0, 3.0)] {
        trail.push(time, Isometry3d::from_xyz(x, 0.0, 0.0));
    }
    assert_eq!(trail.len(), 2);
}
