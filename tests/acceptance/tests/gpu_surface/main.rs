//! The surface on the GPU against the one on the processor, by its real shaders.
//!
//! `CLAY_GPU=off|auto|require`: without an adapter the tests are listed as ignored, or, where one is
//! required, fail.

mod bodies;
mod changes;

use bevy_clay::sim::frame::{SurfaceParticle, SurfaceSource};
use bevy_clay::sim::prelude::*;
use bevy_clay::surface::check::MeshCheck;
use bevy_clay::surface::extract::{extract, extract_field};
use bevy_clay::surface::field::{Field, SurfaceSettings, Tier};
use bevy_clay::surface::gpu::{SurfaceRoom, flag};
use bevy_clay::surface::grains::extract_with_grains;
use bevy_clay::surface::mesh::Mesh;
use bevy_clay::surface::stitch::print_ready;
use clay_acceptance::cases::surface::clay::{
    CELL, CutCube, Random, affine, ball, changed, domain, lattice, scattered, source, with_dust,
};
use clay_acceptance::cases::surface::device::{Device, Output, difference, grain_difference};
use glam::{DMat3, DVec3, Vec3};
use libtest_mimic::{Arguments, Failed, Trial};
use std::sync::LazyLock;

/// The one device whose shaders all tests share; why there is none.
static DEVICE: LazyLock<Result<Device, String>> = LazyLock::new(|| match GpuMode::from_env()? {
    GpuMode::Off => Err("CLAY_GPU=off".into()),
    GpuMode::Auto | GpuMode::Require => GpuDevice::headless().and_then(Device::new).map_err(|e| e.to_string()),
});

fn device() -> Result<&'static Device, Failed> {
    DEVICE.as_ref().map_err(|e| Failed::from(e.as_str()))
}

/// The same triangles within `distance` [m] of each other, in whatever order, and the same topology.
fn assert_same(name: &str, ours: &Mesh, theirs: &Mesh, distance: f32) {
    assert_eq!(difference(ours, theirs, distance), None, "{name}");
    let check = (MeshCheck::of(ours), MeshCheck::of(theirs));
    assert_eq!((check.0.open_edges, check.0.euler, check.0.components), (0, check.1.euler, check.1.components), "{name}");
}

/// Random fields of up to three sheets, consistent or not, with whole numbers among them: the same triangles
/// as on the processor.
fn random_fields_agree(device: &Device) -> Result<(), Failed> {
    let mut random = Random(3);
    let mut surface = device.surface(&domain(4.0), 1, &SurfaceSettings::default());
    for case in 0..60 {
        let sheets = case % 4;
        let mut total = vec![0.0f32; 1331];
        let mut sides = vec![[vec![0.0f32; 1331], vec![0.0f32; 1331]]; sheets];
        for i in 0..729 {
            let at = i % 9 + 1 + 11 * (i / 9 % 9 + 1 + 11 * (i / 81 + 1));
            let f = random.range(0.0, 1.2) as f32;
            total[at] = if case % 3 == 0 { (f * 4.0).round() / 4.0 } else { f };
            for side in &mut sides {
                let part = random.range(-1.5, 1.5) as f32;
                side[usize::from(part < 0.0)][at] = part.abs().min(total[at]);
            }
        }
        let field = Field::from_nodes([11; 3], &total, sides.iter().map(|[p, m]| (&p[..], &m[..])));
        let output = device.extract_field(&mut surface, &field);
        assert_eq!(output.status.flags, 0, "case {case}");
        assert_same(&format!("case {case}, {sheets} sheets"), &output.merged(), &extract_field(&field, 0.5), 2e-5);
    }
    Ok(())
}

/// Balls and cut cubes: the fields are those of the processor within 1e-5, and the mesh is that of the same
/// fields.
fn clay_agrees(device: &Device) -> Result<(), Failed> {
    let mut random = Random(4);
    let mut cases: Vec<(String, SurfaceSource, Tier)> = vec![];
    for tier in [Tier::Fine, Tier::Coarse] {
        cases.push((format!("ball {tier:?}"), ball(4.0, 0.5, 3), tier));
        for (name, cube) in [
            ("full", CutCube::one(0, &mut random)),
            ("partial", CutCube::one(3, &mut random)),
            ("crossed", CutCube::crossed(0, &mut random)),
            ("crossed by a partial one", CutCube::crossed_by_partial(0, &mut random)),
            ("T-junction", CutCube::joined(2, &mut random)),
        ] {
            cases.push((format!("{name} {tier:?}"), cube.source(affine(&mut random)), tier));
        }
    }
    for (name, source, tier) in cases {
        let settings = SurfaceSettings::new(tier);
        let output = device.extract(&source, &settings);
        assert_eq!(output.status.flags, 0, "{name}");
        let field = output.field.as_ref().ok_or("the fields")?;
        let expected = Field::of_particles(&source, &settings);
        let off = field.greatest_difference(&expected);
        assert!(off < 1e-5, "{name}: a node's value is off by {off}");
        assert_same(&name, &output.merged(), &extract_field(field, 0.5), (2e-5 * CELL) as f32);
        // Beside the processor's own mesh: the same bodies of the same volume, the same normals.
        let (ours, theirs) = (print_ready(&output.merged()).0, print_ready(&extract(&source, &settings)).0);
        let check = (MeshCheck::of(&ours), MeshCheck::of(&theirs));
        assert!(check.0.is_closed_manifold() && check.0.components == check.1.components, "{name}: {check:?}");
        assert!((ours.volume() / theirs.volume() - 1.0).abs() < 1e-5, "{name}");
    }
    Ok(())
}

/// Normals are those of the processor.
fn normals_agree(device: &Device) -> Result<(), Failed> {
    let cube = CutCube::crossed(1, &mut Random(6));
    let source = cube.source(DMat3::IDENTITY);
    let settings = SurfaceSettings::default();
    let output = device.extract(&source, &settings);
    let theirs = extract(&source, &settings);
    let normals = theirs.normals.as_ref().ok_or("normals")?;
    let mut at = std::collections::HashMap::<_, Vec<Vec3>>::new();
    let key = |p: &[f32; 3]| p.map(|x| (f64::from(x) / (1e-2 * CELL)).round() as i64);
    for (p, n) in theirs.positions.iter().zip(normals) {
        at.entry(key(p)).or_default().push(Vec3::from_array(*n));
    }
    let (mut found, mut off) = (0, 0);
    for (p, n) in output.mesh.positions.iter().zip(&output.normals) {
        if let Some(all) = at.get(&key(p)) {
            found += 1;
            off += usize::from(all.iter().all(|m| m.distance(Vec3::from_array(*n)) > 1e-2));
        }
    }
    // Some places round to another key; where a slope is next to nothing its direction is rounding.
    assert!(found * 10 > output.mesh.positions.len() * 9 && off * 500 < found, "{found} found, {off} off");
    Ok(())
}

/// Clay at rest is extracted once; the same clay forced twice gives the same bits; clay that moves is
/// extracted again, with a tail.
fn clay_at_rest_stays_bit_identical(device: &Device) -> Result<(), Failed> {
    let source = ball(4.0, 0.5, 3);
    let settings = SurfaceSettings::default();
    let mut run = device.run(&source, &settings, SurfaceRoom::for_particles(source.particles.len()));
    let first = run.frame(&source, false);
    // Less than what is seen: a thousandth of a cell.
    let shaken = |by: f32| changed(&source, |all| all.iter_mut().for_each(|p| p.position[0] += by));
    let second = run.frame(&shaken(1e-3), false);
    assert!(first.words == second.words && second.status.extraction_count == 1 && second.status.is_changed == 0);
    let forced = run.frame(&source, true);
    assert!(first.words == forced.words && forced.status.extraction_count == 2);
    assert_eq!([second.status.slot_counts, forced.status.slot_counts], [first.status.slot_counts; 2], "blocks of the same clay");
    let moved = run.frame(&shaken(0.3), false);
    assert!(first.words != moved.words && moved.status.extraction_count == 3 && moved.status.is_changed == 1);
    let fewer = changed(&source, |all| all.truncate(all.len() / 2));
    let half = run.frame(&fewer, false);
    assert!(half.status.index_count < moved.status.index_count);
    let tail = &half.words.1[half.status.index_count as usize..moved.status.index_count as usize];
    assert!(tail.iter().all(|&i| i == 0), "a tail of triangles without size");
    assert!(MeshCheck::of(&half.merged()).is_closed_manifold());
    Ok(())
}

/// A surface of another tier, or of fewer particles, goes on in the same mesh: nothing is left of what stood
/// there.
fn another_surface_leaves_nothing_of_the_first(device: &Device) -> Result<(), Failed> {
    let (large, small) = (ball(5.0, 0.5, 3), ball(3.0, 0.5, 3));
    let settings = SurfaceSettings::default();
    let mut run = device.run(&large, &settings, SurfaceRoom::for_particles(large.particles.len()));
    let first = run.frame(&large, false);
    for (source, tier) in [(&large, Tier::Coarse), (&large, Tier::Fine), (&small, Tier::Fine)] {
        run.begin_anew(source, &SurfaceSettings::new(tier));
        let second = run.frame(source, false);
        assert!(second.status.flags == 0 && second.status.index_count > 0);
        let left = second.words.1[second.status.index_count as usize..].iter().filter(|i| **i != 0).count();
        assert_eq!(left, 0, "indices of another mesh, of {} at first", first.status.index_count);
    }
    Ok(())
}

/// Too little room of any kind is a flag, leaves the mesh as it was, and says how much is needed.
fn want_of_room_is_told(device: &Device) -> Result<(), Failed> {
    let cube = CutCube::crossed(0, &mut Random(7)).source(DMat3::IDENTITY);
    let settings = SurfaceSettings::default();
    let room = SurfaceRoom::for_particles(cube.particles.len());
    let cases = [
        (SurfaceRoom { blocks: 20, ..room }, flag::BLOCKS_FULL),
        (SurfaceRoom { cell_blocks: 2, ..room }, flag::BLOCKS_FULL),
        (SurfaceRoom { sheets: 1, ..room }, flag::SHEETS_FULL),
    ];
    for (small, expected) in cases {
        let output = device.run(&cube, &settings, small).frame(&cube, false);
        assert_eq!(output.status.flags, expected);
        assert!(output.words.0.iter().all(|w| *w == 0));
        let grown = device.run(&cube, &settings, small.grown(&output.status)).frame(&cube, false);
        assert_eq!(grown.status.flags, 0, "{:?}", small.grown(&output.status));
    }
    let mut run = device.run(&cube, &settings, room);
    run.capacity = (100, 300);
    let output = run.frame(&cube, false);
    assert_eq!(output.status.flags, flag::MESH_FULL);
    assert!(output.words.0.iter().all(|w| *w == 0) && output.status.least[1] > 100);
    Ok(())
}

/// Particles that are not finite, or outside of the grid; no particles.
fn odd_particles_are_left_out(device: &Device) -> Result<(), Failed> {
    let source = ball(3.0, 0.25, 3);
    let settings = SurfaceSettings::default();
    let expected = device.extract(&source, &settings);
    let mut particles = source.particles.to_vec();
    for x in [f32::NAN, f32::INFINITY, -1e30, 1e6] {
        let mut p = particles[0];
        p.position[1] = x;
        particles.push(p);
        p = particles[0];
        p.volume_ratio = if x.is_nan() { x } else { f32::INFINITY };
        particles.push(p);
    }
    let odd = device.extract(&SurfaceSource { domain: source.domain, particles: particles.into() }, &settings);
    assert!(odd.words == expected.words);
    let mut run = device.run(&source, &settings, SurfaceRoom::for_particles(64));
    let none: Output = run.frame(&SurfaceSource { domain: source.domain, particles: Vec::new().into() }, false);
    assert_eq!((none.status.flags, none.status.index_count), (0, 0));
    Ok(())
}

/// Particles that have burst to a thousand cells leave no cavity where their sums would end.
fn burst_particles_are_shown(device: &Device) -> Result<(), Failed> {
    let mut source = ball(3.0, 0.25, 3);
    let mut particles = source.particles.to_vec();
    let centre = particles.iter().map(|p| Vec3::from_array(p.position)).sum::<Vec3>() / particles.len() as f32;
    let away = |p: &SurfaceParticle| Vec3::from_array(p.position).distance(centre);
    particles.sort_by(|a, b| away(a).total_cmp(&away(b)));
    particles.iter_mut().take(8).for_each(|p| p.volume_ratio = 8000.0);
    source.particles = particles.into();
    let check = MeshCheck::of(&device.extract(&source, &SurfaceSettings::default()).merged());
    assert!(check.is_closed_manifold() && check.components == 1 && check.euler == 2, "{check:?}");
    Ok(())
}

/// From the engine's own buffer, as loaded and after a frame: what comes by way of the processor.
fn engine_particles_are_taken_in_place(device: &Device) -> Result<(), Failed> {
    let domain = domain(12.0);
    let low = domain.wall_nodes().0.as_dvec3() + 2.0;
    let volume = (domain.cell_width.powi(3) / 8.0) as f32;
    let at = |i: u32| DVec3::new(f64::from(i % 8), f64::from(i / 8 % 8), f64::from(i / 64)) * 0.5 + 0.25;
    let particles = (0..512).map(|i| Particle::at(low + at(i), volume, i)).collect();
    let material = Preset::SoftClay.material();
    let mut engine = GpuEngine::new(device.gpu())?;
    engine.load(&Snapshot::new(domain, material, particles))?;
    let settings = SurfaceSettings::default();
    for frame in 0..2u64 {
        if frame > 0 {
            let dt = 0.5 * material.time_step_limit(domain.cell_width, material.density);
            let gravity = DVec3::new(0.0, -2e3, 0.0);
            engine.submit(FramePlan { id: frame, gravity, ..FramePlan::new(material, dt, 20) })?;
            let report = engine.wait()?;
            assert!(report.health.is_ok() && report.momentum.length() > 0.0, "{}", report.health);
        }
        let source = engine.surface().ok_or("a surface")?;
        let (buffer, count) = engine.link().surface_particles().ok_or("particles")?;
        let mut run = device.run(&source, &settings, SurfaceRoom::for_particles(count as usize));
        let ours = run.frame_of((&buffer, count), false);
        assert!(ours.status.index_count > 0 && ours.words == device.extract(&source, &settings).words, "frame {frame}");
    }
    Ok(())
}

/// Particles and clusters scattered about a cube: the grains are the processor's, and so is the surface
/// without them; a ball has none, a cube has none.
fn grains_agree(device: &Device) -> Result<(), Failed> {
    let mut random = Random(11);
    let mut partial = 0;
    for tier in [Tier::Fine, Tier::Coarse] {
        let settings = SurfaceSettings::new(tier);
        for case in 0..4 {
            let source = scattered(&mut random);
            let expected = extract_with_grains(&source, &settings);
            let output = device.run_with_grains(&source, &settings).frame(&source, false);
            assert_eq!(output.status.flags, 0, "{tier:?} {case}");
            assert_eq!(grain_difference(&output.grains, &expected.grains, CELL), None, "{tier:?} {case}");
            // A particle of 8 per cell has a radius of 0.31 cells.
            partial += output.grains.iter().filter(|g| f64::from(g.radius) < 0.3 * CELL).count();
            assert!(output.grains.len() > 30, "{tier:?} {case}: {} grains", output.grains.len());
            let (ours, theirs) = (output.merged(), &expected.mesh);
            let check = (MeshCheck::of(&ours), MeshCheck::of(theirs));
            assert_eq!((check.0.open_edges, check.0.components), (0, check.1.components), "{tier:?} {case}");
            assert!((ours.volume() / theirs.volume() - 1.0).abs() < 1e-5, "{tier:?} {case}");
        }
    }
    assert!(partial > 10, "{partial} grains near a surface");
    let cube = lattice(DVec3::splat(10.3), DVec3::splat(18.3), 0.25, &mut random, |_| true);
    for source in [ball(5.0, 0.25, 3), source(domain(30.0), &cube, |_| 0, 1.0)] {
        let settings = SurfaceSettings::default();
        let output = device.run_with_grains(&source, &settings).frame(&source, false);
        assert!(output.grains.is_empty() && output.words == device.extract(&source, &settings).words);
    }
    let none = SurfaceSource { domain: domain(30.0), particles: Vec::new().into() };
    assert_eq!(device.run_with_grains(&none, &SurfaceSettings::default()).frame(&none, false).status.index_count, 0);
    Ok(())
}

/// Two runs give the same bits; what hardly moves keeps them; a grain that moves, goes or comes is seen
/// though the surface is the same. Room that is enough for the surface alone is told as too little.
fn grains_rest_and_move_with_the_clay(device: &Device) -> Result<(), Failed> {
    let source = with_dust(&ball(4.0, 0.25, 3), 200);
    let settings = SurfaceSettings::default();
    let mut run = device.run_with_grains(&source, &settings);
    let first = run.frame(&source, false);
    assert_eq!(first.grains.len(), 200);
    assert!(device.run_with_grains(&source, &settings).frame(&source, false).words == first.words, "another run");
    let shaken = run.frame(&changed(&source, |all| all.iter_mut().for_each(|p| p.position[0] += 1e-3)), false);
    assert!(shaken.words == first.words && shaken.status.extraction_count == 1);
    let moved = run.frame(&changed(&source, |all| all.iter_mut().last().expect("dust").position[1] += 0.1), false);
    let up = moved.grains[199].position[1] - first.grains[199].position[1];
    assert!((f64::from(up) / CELL - 0.1).abs() < 1e-4 && moved.grains[..199] == first.grains[..199]);
    assert!(moved.status.extraction_count == 2 && moved.merged() == first.merged());
    let fewer = run.frame(&changed(&source, |all| all.truncate(all.len() - 60)), false);
    assert!(fewer.grains == first.grains[..140] && fewer.status.extraction_count == 3);
    let tail = &fewer.words.1[fewer.status.index_count as usize..moved.status.index_count as usize];
    assert!(tail.len() == 3600 && tail.iter().all(|&i| i == 0), "a tail of triangles without size");
    let again = run.frame(&source, false);
    assert!(again.draws_as(&first), "as at the start");
    run.capacity = (first.mesh.positions.len() as u32 + 100, 700_000);
    let full = run.frame(&source, true);
    assert!(full.status.flags == flag::MESH_FULL && full.words == first.words, "as it was");
    assert_eq!((full.status.wanted, full.status.least), (first.status.wanted, first.status.least));
    // Told again until there is room, though the clay rests.
    assert_eq!(run.frame(&source, false).status.flags, flag::MESH_FULL);
    run.capacity = (160_000, 700_000);
    assert!(run.frame(&source, false).draws_as(&first));
    Ok(())
}

/// More than 10,000 grains are octahedra; in several workgroups' counts, and as many as the processor finds.
fn many_grains_are_octahedra(device: &Device) -> Result<(), Failed> {
    let settings = SurfaceSettings::new(Tier::Coarse);
    for (count, vertices) in [(9_700, 12), (10_500, 6)] {
        let source = with_dust(&ball(3.0, 0.25, 3), count);
        let output = device.run_with_grains(&source, &settings).frame(&source, false);
        assert_eq!((output.status.flags, output.status.ball_counts().0), (0, vertices * count as u32));
        let expected = extract_with_grains(&source, &settings);
        assert_eq!(grain_difference(&output.grains, &expected.grains, CELL), None);
        assert_eq!(expected.drawn().triangles.len(), output.status.least[1] as usize);
    }
    Ok(())
}

fn main() {
    let arguments = Arguments::from_args();
    type Test = fn(&Device) -> Result<(), Failed>;
    let tests: [(&str, Test); 19] = [
        ("bodies_agree", bodies::bodies_agree),
        ("bodies_that_move_are_drawn_whole", bodies::bodies_that_move_are_drawn_whole),
        ("numbers_alone_change_nothing", bodies::numbers_alone_change_nothing),
        ("random_fields_agree", random_fields_agree),
        ("clay_agrees", clay_agrees),
        ("normals_agree", normals_agree),
        ("clay_at_rest_stays_bit_identical", clay_at_rest_stays_bit_identical),
        ("another_surface_leaves_nothing_of_the_first", another_surface_leaves_nothing_of_the_first),
        ("want_of_room_is_told", want_of_room_is_told),
        ("odd_particles_are_left_out", odd_particles_are_left_out),
        ("burst_particles_are_shown", burst_particles_are_shown),
        ("engine_particles_are_taken_in_place", engine_particles_are_taken_in_place),
        ("a_dent_alone_is_extracted", changes::a_dent_alone_is_extracted),
        ("clay_that_moves_about_is_drawn_whole", changes::clay_that_moves_about_is_drawn_whole),
        ("failed_frames_leave_nothing_behind", changes::failed_frames_leave_nothing_behind),
        ("empty_blocks_change_nothing", changes::empty_blocks_change_nothing),
        ("grains_agree", grains_agree),
        ("grains_rest_and_move_with_the_clay", grains_rest_and_move_with_the_clay),
        ("many_grains_are_octahedra", many_grains_are_octahedra),
    ];
    let mode = GpuMode::from_env().unwrap_or_else(|e| panic!("{e}"));
    let is_ignored = DEVICE.is_err() && mode != GpuMode::Require;
    let trial = |(name, test): (&str, Test)| Trial::test(name, move || test(device()?)).with_ignored_flag(is_ignored);
    libtest_mimic::run(&arguments, tests.into_iter().map(trial).collect()).exit();
}
