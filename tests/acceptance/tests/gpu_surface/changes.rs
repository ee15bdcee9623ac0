//! What has changed is extracted, and nothing else; the mesh is that of all blocks all the same.

use super::assert_same;
use bevy_clay::sim::frame::{SurfaceParticle, SurfaceSource};
use bevy_clay::surface::check::MeshCheck;
use bevy_clay::surface::extract::extract_field;
use bevy_clay::surface::field::{Field, SurfaceSettings};
use bevy_clay::surface::gpu::{SurfaceRoom, flag};
use bevy_clay::surface::grains::extract_with_grains;
use clay_acceptance::cases::surface::clay::{BALL_CENTRE, CELL, Random, ball, changed, dented, with_dust};
use clay_acceptance::cases::surface::device::{Device, Output, Run, grain_difference};
use glam::Vec3;
use libtest_mimic::Failed;

/// What a value may be off without being seen: the inside's hundredth.
const UNSEEN: f32 = 0.01 + 1e-5;
/// Sums in fixed point of 2^-24, filtered.
const ROUNDING: f32 = 3e-6;

fn run<'a>(device: &'a Device, source: &SurfaceSource, settings: &SurfaceSettings) -> Run<'a> {
    device.run(source, settings, SurfaceRoom { cell_blocks: 1000, blocks: 1000, sheets: 2, bodies: 2, pages: 0 })
}

/// The mesh is the processor's of the values that the blocks were last extracted with, and those are the
/// clay's to a hundredth.
pub(crate) fn assert_whole(name: &str, run: &Run<'_>, output: &Output, source: &SurfaceSource, settings: &SurfaceSettings) {
    assert_eq!(output.status.flags, 0, "{name}");
    let kept = run.kept_field(&output.status);
    let off = kept.greatest_difference(&Field::of_particles(source, settings));
    assert!(off < UNSEEN, "{name}: a node's value is off by {off}");
    // Each node's values are of one frame.
    assert!(kept.greatest_excess() < ROUNDING, "{name}: {} more on the sides of a cut than there is", kept.greatest_excess());
    assert_same(name, &output.merged(), &extract_field(&kept, 0.5), (2e-5 * CELL) as f32);
    assert_eq!(output.mesh.triangles.len(), output.status.least[1] as usize, "{name}");
}

/// A dent in the top of a ball: the blocks about it are extracted, no others, and the rest of the mesh stays
/// where it is.
pub(crate) fn a_dent_alone_is_extracted(device: &Device) -> Result<(), Failed> {
    let source = ball(12.0, 0.25, 3);
    let settings = SurfaceSettings::default();
    let mut run = run(device, &source, &settings);
    let first = run.frame(&source, false);
    assert_eq!(first.status.block_count, first.status.slot_counts[1], "all at first");
    let top = source.particles.iter().map(|p| p.position[1]).fold(0.0, f32::max);
    let dented = dented(&source);
    let second = run.frame(&dented, false);
    assert_whole("dent", &run, &second, &dented, &settings);
    assert!(second.status.is_changed == 1 && second.mesh != first.mesh);
    let blocks = [first.status.block_count, second.status.block_count];
    assert!(5 * blocks[1] < blocks[0] && blocks[1] >= 4, "{blocks:?} blocks extracted");
    // Nothing below the blocks about the dent, which are 4 cells wide, is another, not even in its order.
    let low = |o: &Output| -> Vec<[f32; 3]> {
        let deep = source.domain.origin.y + (f64::from(top) - 14.0) * CELL;
        o.mesh.positions.iter().filter(|p| f64::from(p[1]) < deep).copied().collect()
    };
    assert!(low(&first).len() > 100 && low(&first) == low(&second));
    Ok(())
}

/// Lumps of a ball with dust about it wander off, or leap, and come back, a cut comes and goes: each mesh is
/// whole, the grains are those of all; blocks outgrow their regions, and are laid out anew. All over again,
/// the bits are the same.
pub(crate) fn clay_that_moves_about_is_drawn_whole(device: &Device) -> Result<(), Failed> {
    let settings = SurfaceSettings::default();
    let mut random = Random(21);
    let mut source = with_dust(&ball(5.0, 0.25, 3), 40);
    let home = source.particles.clone();
    let mut run = run(device, &source, &settings);
    let mut before = run.frame(&source, false).status;
    let roomy = with_dust(&source, 400);
    let [mut grainy, mut other] = [(); 2].map(|()| device.run_with_grains(&roomy, &settings));
    let (mut extracted, mut all, mut grown, mut shrunk) = (0, 0, 0, 0);
    for frame in 0..36 {
        let at = Vec3::from_array(home[random.range(0.0, home.len() as f64) as usize].position);
        let lump = |p: &SurfaceParticle| Vec3::from_array(p.position).distance(at) < 2.0;
        // Steps within a block and its neighbours, or far from all that is there.
        let reach = if frame % 3 == 1 { 12.0 } else { 1.5 };
        let by = Vec3::from_array(std::array::from_fn(|_| random.range(-reach, reach) as f32));
        let moved = |p: &SurfaceParticle| (Vec3::from_array(p.position) + by).to_array();
        source = changed(&source, |particles| match frame % 12 {
            // All go home.
            11 => particles.copy_from_slice(&home),
            // In front of and behind sheet 3.
            6 => particles.iter_mut().for_each(|p| p.tags = if p.position[0] < at.x { 0xff03 } else { 0x0103 }),
            _ => particles.iter_mut().filter(|p| lump(p)).for_each(|p| p.position = moved(p)),
        });
        let output = run.frame(&source, false);
        assert_whole(&format!("frame {frame}"), &run, &output, &source, &settings);
        let status = output.status;
        let output = grainy.frame(&source, false);
        let grains = extract_with_grains(&source, &settings).grains;
        assert_eq!((output.status.flags, grain_difference(&output.grains, &grains, CELL)), (0, None), "frame {frame}");
        assert_eq!(MeshCheck::of(&output.merged()).open_edges, 0, "frame {frame}");
        assert!(other.frame(&source, false).words == output.words, "frame {frame}, another run");
        extracted += status.block_count;
        all += status.slot_counts[1];
        grown += u32::from(status.vertex_count > before.vertex_count);
        shrunk += u32::from(status.vertex_count < before.vertex_count);
        before = status;
    }
    assert!(10 * extracted < 9 * all, "{extracted} of {all} blocks extracted");
    assert!(grown > 4 && shrunk > 1, "regions added in {grown} frames, laid out anew in {shrunk}");
    Ok(())
}

/// A block that comes without a value in it, as the margin of one that has, leaves the mesh as it is.
pub(crate) fn empty_blocks_change_nothing(device: &Device) -> Result<(), Failed> {
    let settings = SurfaceSettings::default();
    let source = ball(2.0, 0.25, 3);
    let mut run = run(device, &source, &settings);
    let shifted = |by: f32| changed(&source, |all| all.iter_mut().for_each(|p| p.position[0] += by));
    let mut blocks = |by: f32| run.frame(&shifted(by), true).status.slot_counts[1];
    // Where one more is reached: within 4 cells, which is a block.
    let (mut low, mut high) = (0.0, 0.0);
    while high < 4.0 && blocks(high) <= blocks(low) {
        (low, high) = (high, high + 0.25);
    }
    while high - low > 1e-3 {
        let middle = 0.5 * (low + high);
        if blocks(middle) > blocks(low) { high = middle } else { low = middle }
    }
    assert!(blocks(high) > blocks(low), "no more blocks within 4 cells");
    let [first, second] = [(low, true), (high, false)].map(|(by, is_forced)| run.frame(&shifted(by), is_forced));
    assert!(second.status.slot_counts[1] > first.status.slot_counts[1]);
    assert!(second.status.is_changed == 0 && second.words == first.words);
    Ok(())
}

/// A first frame that finds no room leaves nothing of another mesh behind when there is room for less, nor
/// does a later one.
pub(crate) fn failed_frames_leave_nothing_behind(device: &Device) -> Result<(), Failed> {
    let settings = SurfaceSettings::default();
    let source = ball(5.0, 0.25, 3);
    let mut run = run(device, &source, &settings);
    let first = run.frame(&source, false);
    let middle = BALL_CENTRE.as_vec3();
    let nearer = |p: &SurfaceParticle| middle.lerp(Vec3::from_array(p.position), 0.4).to_array();
    let smaller = changed(&source, |all| all.iter_mut().for_each(|p| p.position = nearer(p)));
    for is_new in [true, false] {
        if is_new {
            run.begin_anew(&source, &settings);
        }
        run.capacity = (first.status.least[0] / 2, 700_000);
        assert_eq!(run.frame(&source, !is_new).status.flags, flag::MESH_FULL);
        let output = run.frame(&smaller, false);
        assert!(output.status.flags == 0 && output.status.index_count < first.status.index_count / 2);
        let left = output.words.1[output.status.index_count as usize..].iter().filter(|i| **i != 0).count();
        assert_eq!(left, 0, "indices of another mesh, of {}", first.status.index_count);
        run.capacity = (160_000, 700_000);
        run.frame(&source, true);
    }
    Ok(())
}
