//! Trouble on the device: found, acted on, named; nothing of the clay lost.

use bevy_clay::prelude::*;
use bevy_clay::sim::engine::StateLost;
use bevy_clay::sim::prelude::*;
use clay_acceptance::agreement::{self, CELL, Case};
use clay_acceptance::cases::blade::along_x;
use clay_acceptance::lab::{Mover, block as block_of, room, wave_step};
use glam::{DVec3, IVec3};
use libtest_mimic::Failed;

fn run(engine: &mut GpuEngine, case: &Case) -> Result<FrameReport, Failed> {
    engine.load(&case.snapshot).map_err(|e| e.to_string())?;
    engine.submit(case.plan.clone()).map_err(|e| e.to_string())?;
    Ok(engine.wait().map_err(|e| e.to_string())?)
}

fn block(steps: u32) -> Case {
    let s = agreement::block(IVec3::new(4, 4, 4), 1.0, Walls::default(), agreement::soft());
    let p = agreement::plan(&s, 0.25, steps, vec![]);
    Case { snapshot: s, plan: p }
}

/// A particle that is not finite is set aside, named, and the rest goes on as without it.
pub(crate) fn nan_particle_is_contained(engine: &mut GpuEngine) -> Result<(), Failed> {
    let mut case = block(20);
    case.snapshot.particles[100].velocity[1] = f32::NAN;
    let report = run(engine, &case)?;
    assert!(report.health.contains(Health::QUARANTINED), "{}", report.health);
    assert_eq!((report.quarantined, report.particle_count), (vec![100], 511));
    assert!(report.momentum.is_finite());
    Ok(())
}

/// Clay with no way to stay finite: the frame is given up and the clay stands as before, to the bit.
pub(crate) fn impossible_frame_is_given_up(engine: &mut GpuEngine) -> Result<(), Failed> {
    let mut case = block(4);
    case.snapshot.particles[7].velocity[0] = 1e30;
    let report = run(engine, &case)?;
    assert!(report.health.contains(Health::GIVEN_UP), "{}", report.health);
    assert!(engine.save().map_err(|e| e.to_string())?.particles == case.snapshot.particles, "the clay changed");
    // And goes on when the next plan is sane: here, with the particle slowed down.
    case.snapshot.particles[7].velocity[0] = 0.0;
    assert!(run(engine, &case)?.health.is_ok());
    Ok(())
}

/// A frame queued behind one that is given up is given up too; the next one runs.
pub(crate) fn frame_behind_a_given_up_one_does_not_run(engine: &mut GpuEngine) -> Result<(), Failed> {
    let mut case = block(4);
    case.snapshot.particles[7].velocity[0] = 1e30;
    engine.load(&case.snapshot).map_err(|e| e.to_string())?;
    let mut plans = [case.plan.clone(), case.plan.clone()];
    plans[1].id = 2;
    for plan in plans {
        engine.submit(plan).map_err(|e| e.to_string())?;
    }
    for id in [1, 2] {
        let report = engine.wait().map_err(|e| e.to_string())?;
        assert!(report.plan_id == id && report.health.contains(Health::GIVEN_UP) && report.steps == 0, "{report:?}");
    }
    // A third is run for what it is: it fails by itself, four halvings later.
    engine.submit(case.plan.clone()).map_err(|e| e.to_string())?;
    assert_eq!(engine.wait().map_err(|e| e.to_string())?.redone, 4);
    Ok(())
}

/// A block that moves faster than half a cell a substep: redone with half the step, as often as it needs, and
/// right.
pub(crate) fn fast_clay_is_redone_with_smaller_steps(engine: &mut GpuEngine) -> Result<(), Failed> {
    let mut case = block(4);
    let speed = 0.9 * CELL / case.plan.dt;
    agreement::velocities(&mut case.snapshot, |_| DVec3::X * speed);
    case.plan.gravity = DVec3::ZERO;
    let before = case.snapshot.particles[0].grid();
    let report = run(engine, &case)?;
    assert!(report.health.contains(Health::SPEED) && report.redone == 1 && report.steps == 8, "{report:?}");
    let after = engine.save().map_err(|e| e.to_string())?.particles.iter().find(|p| p.id == 0).map(Particle::grid);
    let moved = after.map(|a| a - before).unwrap_or_default();
    assert!((moved - DVec3::X * 3.6).length() < 1e-5, "{moved}");
    Ok(())
}

/// Clay that bursts apart needs more blocks than it was loaded with, more than a cell between re-bins, and
/// more headroom: all found by the device, the frame run again, and the result the native engine's.
pub(crate) fn bursting_clay_gets_room(engine: &mut GpuEngine) -> Result<(), Failed> {
    let walls = Walls::default();
    let mut s =
        agreement::block(IVec3::new(4, 4, 4), 20.0, walls, ClayMaterial { yield_stress: f64::INFINITY, ..agreement::soft() });
    s.domain = Domain::new(DVec3::ZERO, DVec3::splat(0.6), CELL, walls).map_err(|e| e.to_string())?;
    let middle = s.domain.to_grid(DVec3::splat(0.3));
    let centre: DVec3 = s.particles.iter().map(Particle::grid).sum::<DVec3>() / s.particles.len() as f64;
    let p = agreement::plan(&s, 0.25, 200, vec![]);
    for (i, q) in s.particles.iter_mut().enumerate() {
        let arm = q.grid() - centre;
        q.set_grid(middle + arm);
        // Dust: each particle its own way.
        q.velocity = (arm * 0.04 * CELL / p.dt).as_vec3().to_array();
        q.rest_volume *= if i % 2 == 0 { 1.0 } else { 0.5 };
    }
    let case = Case { snapshot: s, plan: p };
    let report = run(engine, &case)?;
    assert!(report.health.without(Health::STRAIN).is_ok(), "{}", report.health);
    assert!(engine.reruns() > 0, "the clay was loaded with room for its spray");
    assert!((report.grid_mass / report.particle_mass - 1.0).abs() < 1e-6);
    let mut native = NativeEngine::new();
    native.load(&case.snapshot).map_err(|e| e.to_string())?;
    native.submit(case.plan.clone()).map_err(|e| e.to_string())?;
    let other = native.wait().map_err(|e| e.to_string())?;
    assert!((report.momentum - other.momentum).length() < 1e-5 * other.momentum_scale);
    assert!((report.energies.kinetic / other.energies.kinetic - 1.0).abs() < 1e-3, "{report:?} {other:?}");
    Ok(())
}

/// Clay of no particles, and of one, runs and is saved as it is.
pub(crate) fn hardly_any_clay_runs(engine: &mut GpuEngine) -> Result<(), Failed> {
    for count in [0, 1] {
        let mut case = block(70);
        case.snapshot.particles.truncate(count);
        let report = run(engine, &case)?;
        assert!(report.health.is_ok() && report.particle_count == count, "{report:?}");
        assert_eq!(engine.save().map_err(|e| e.to_string())?.particles.len(), count);
        assert_eq!(engine.surface().map(|s| s.particles.len()), Some(count));
    }
    Ok(())
}

/// Plans with more tools than the engine takes are refused by name, and nothing is lost.
pub(crate) fn too_many_tools_are_refused(engine: &mut GpuEngine) -> Result<(), Failed> {
    let mut case = block(1);
    let tool = Tool { shape: ToolShape::Sphere { radius: 0.01 }, contact: Contact::Slip };
    case.plan.tools = (0..33).map(|id| ToolPath::still(id, tool, Pose::default())).collect();
    engine.load(&case.snapshot).map_err(|e| e.to_string())?;
    let error = engine.submit(case.plan.clone()).expect_err("33 tools");
    assert!(error.to_string().contains("at most 32"), "{error}");
    case.plan.tools.clear();
    engine.submit(case.plan).map_err(|e| e.to_string())?;
    assert!(engine.wait().map_err(|e| e.to_string())?.health.is_ok());
    Ok(())
}

/// A device with small limits refuses a scene over them, names the limit and the largest clay that fits, and
/// takes a smaller one.
pub(crate) fn limits_are_named() -> Result<(), Failed> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let adapter =
        pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default())).map_err(|e| e.to_string())?;
    let limits = wgpu::Limits { max_storage_buffer_binding_size: 262_144, ..wgpu::Limits::default() };
    let descriptor = wgpu::DeviceDescriptor { required_limits: limits, ..Default::default() };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).map_err(|e| e.to_string())?;
    let device = GpuDevice { device, queue, info: adapter.get_info() };
    let mut engine = GpuEngine::new(device).map_err(|e| e.to_string())?;
    let large = agreement::block(IVec3::new(8, 8, 8), 1.0, Walls::default(), agreement::soft());
    let error = engine.load(&large).expect_err("786 kB of particles").to_string();
    assert!(error.contains("max_storage_buffer_binding_size is 262144") && error.contains("1365 particles at most"), "{error}");
    let case = block(2);
    assert!(run(&mut engine, &case)?.health.is_ok());
    Ok(())
}

/// A program that asks for a device, as this one does before it lists its tests, prints nothing of its
/// libraries' about displays on standard error: cargo sees to it.
pub(crate) fn search_for_a_device_is_silent() -> Result<(), Failed> {
    let test = std::env::current_exe().map_err(|e| e.to_string())?;
    let listed = std::process::Command::new(test).arg("--list").output().map_err(|e| e.to_string())?;
    let error = String::from_utf8_lossy(&listed.stderr);
    assert!(listed.status.success() && error.is_empty(), "{error}");
    Ok(())
}

/// A lost device stops the engine, which says so; what it reported last can still be saved.
pub(crate) fn lost_device_is_told() -> Result<(), Failed> {
    let device = GpuDevice::headless().map_err(|e| e.to_string())?;
    let handle = device.device.clone();
    let mut engine = GpuEngine::new(device).map_err(|e| e.to_string())?;
    let case = block(10);
    run(&mut engine, &case)?;
    let before = engine.save().map_err(|e| e.to_string())?;
    handle.destroy();
    let outcome = engine.submit(case.plan.clone()).and_then(|()| engine.wait());
    assert!(matches!(outcome, Err(EngineError::Stopped(_) | EngineError::Device(_))), "{outcome:?}");
    let after = engine.state_deferred().map_err(|e| e.to_string())?()?;
    assert!(before == after, "the last state is lost");
    Ok(())
}

/// So does one that goes with a frame under way: what the frame leads to is freed with the device in the poll
/// that finds it ended.
pub(crate) fn device_lost_in_a_frame_is_told() -> Result<(), Failed> {
    let device = GpuDevice::headless().map_err(|e| e.to_string())?;
    let handle = device.device.clone();
    let mut engine = GpuEngine::new(device).map_err(|e| e.to_string())?;
    let case = block(10);
    engine.load(&case.snapshot).map_err(|e| e.to_string())?;
    engine.submit(case.plan.clone()).map_err(|e| e.to_string())?;
    handle.destroy();
    let outcome = engine.wait();
    assert!(matches!(outcome, Err(EngineError::Stopped(_))), "{outcome:?}");
    Ok(())
}

/// What is read of a mapped buffer after its device has gone is an error.
pub(crate) fn state_that_went_with_its_device_is_told() -> Result<(), Failed> {
    let device = GpuDevice::headless().map_err(|e| e.to_string())?;
    let handle = device.device.clone();
    let mut engine = GpuEngine::new(device).map_err(|e| e.to_string())?;
    let case = block(10);
    run(&mut engine, &case)?;
    let (state, surface) = (engine.state_deferred().map_err(|e| e.to_string())?, engine.surface_deferred());
    handle.destroy();
    handle.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| e.to_string())?;
    assert!(matches!(state(), Err(StateLost)), "a state of a device that is gone");
    assert!(matches!(surface.ok_or("a surface")?(), Err(StateLost)), "a surface of a device that is gone");
    Ok(())
}

/// Two clays on one device know nothing of each other.
pub(crate) fn two_engines_share_nothing(first: &mut GpuEngine) -> Result<(), Failed> {
    let mut second = first.sibling();
    let (one, other) = (block(10), {
        let mut c = block(10);
        agreement::velocities(&mut c.snapshot, |_| DVec3::Y * 0.1);
        c
    });
    let alone = agreement::run(first, &one, 2);
    first.load(&one.snapshot).map_err(|e| e.to_string())?;
    second.load(&other.snapshot).map_err(|e| e.to_string())?;
    for _ in 0..2 {
        first.submit(one.plan.clone()).map_err(|e| e.to_string())?;
        second.submit(other.plan.clone()).map_err(|e| e.to_string())?;
        second.wait().map_err(|e| e.to_string())?;
        first.wait().map_err(|e| e.to_string())?;
    }
    let mut saved = first.save().map_err(|e| e.to_string())?;
    saved.particles.sort_by_key(|p| p.id);
    assert!(saved.to_bytes() == alone, "another clay on the device changed this one");
    Ok(())
}

/// More combinations of sides in a block than there is room for: told, and the same ones find room in every
/// run.
pub(crate) fn crowded_blocks_repeat(engine: &mut GpuEngine) -> Result<(), Failed> {
    let mut case = block(20);
    agreement::velocities(&mut case.snapshot, |x| 0.05 * x.cross(DVec3::ONE));
    // Each particle with two of 21 sheets: hundreds of combinations.
    for (i, p) in (0u8..=255).cycle().zip(&mut case.snapshot.particles) {
        p.tags =
            [(1 + i % 10, i & 1), (11 + (i / 3) % 11, i >> 1 & 1)].map(|(sheet, side)| Tag { sheet, side: 2 * side as i8 - 1 });
    }
    let mut state = || -> Result<Vec<u8>, Failed> {
        let report = run(engine, &case)?;
        assert!(report.health.contains(Health::CROWDED) && report.steps == 20, "{report:?}");
        let mut saved = engine.save().map_err(|e| e.to_string())?;
        saved.particles.sort_by_key(|p| p.id);
        Ok(saved.to_bytes())
    };
    let first = state()?;
    for run in 0..8 {
        assert!(state()? == first, "run {run}");
    }
    Ok(())
}

/// A blade that meets the clay at 3 cells a substep, which no planner asks for: the sums get as much room
/// after each halving of the step as before it.
pub(crate) fn fast_blade_is_given_room(engine: &mut GpuEngine) -> Result<(), Failed> {
    let domain = room([40, 20, 12], Wall::Slip);
    let material = ClayMaterial { poisson_ratio: 0.3, ..Preset::SoftClay.material() };
    let particles = block_of(DVec3::new(6.0, 0.0, 0.0), IVec3::new(28, 16, 12));
    engine.load(&Snapshot::new(domain, material, particles)).map_err(|e| e.to_string())?;
    let (dt, blade) = (wave_step(&material, 0.4), ToolShape::Blade { half_width: 3.0, half_height: 6.0 });
    let contact = Contact::Separate { friction: 0.0 };
    let mut mover = Mover::new(&domain, blade, contact, DVec3::new(11.03, 8.0, 6.0), along_x());
    mover.velocity = DVec3::X * 3.0 * domain.cell_width / dt;
    for id in 0..2 {
        let plan = FramePlan { id, tools: vec![mover.path(dt)], ..FramePlan::new(material, dt, 1) };
        engine.submit(plan).map_err(|e| e.to_string())?;
        let report = engine.wait().map_err(|e| e.to_string())?;
        assert!(!report.health.contains(Health::GIVEN_UP), "frame {id}: {}, redone {}", report.health, report.redone);
    }
    Ok(())
}
