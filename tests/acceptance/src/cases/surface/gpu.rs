//! The surface on the device: with `--engine gpu` alone.

use super::clay::{CELL, CutCube, Random, affine, ball, dented, domain, scattered};
use super::device::{Device, difference, grain_difference};
use crate::lab::{Size, is_gpu};
use crate::report::Row;
use bevy_clay::sim::gpu::GpuDevice;
use bevy_clay::surface::extract::extract_field;
use bevy_clay::surface::field::{Field, SurfaceSettings};
use bevy_clay::surface::gpu::SurfaceRoom;
use bevy_clay::surface::grains::extract_with_grains;

/// Fields and meshes against the processor's.
pub fn on_device(size: Size) -> Vec<Row> {
    if !is_gpu() {
        return vec![];
    }
    let Ok(device) = GpuDevice::headless().and_then(Device::new) else {
        return vec![Row::at_most("surface on the device: shaders refused", f64::NAN, "-", 0.0)];
    };
    let mut rows = vec![
        Row::at_most("on the device: random fields whose mesh differs", random_fields(&device, size), "count", 0.0),
        Row::at_most("on the device: cut cubes whose mesh differs", cubes(&device, size), "count", 0.0),
    ];
    rows.push(Row::at_most("on the device: scattered clay whose grains differ", grains(&device, size), "count", 0.0));
    rows.extend(dent(&device, size));
    rows
}

/// A ball whose top is pushed in by a fifth of a cell and springs back, frame by frame, against all of it
/// anew.
fn dent(device: &Device, size: Size) -> [Row; 2] {
    let source = ball(size.pick(6.0, 10.0, 14.63), 0.25, 3);
    let dented = dented(&source);
    let settings = SurfaceSettings::default();
    let mut run = device.run(&source, &settings, SurfaceRoom::for_particles(source.particles.len()));
    let all = run.frame(&source, true).status.block_count;
    let blocks = f64::from(run.frame(&dented, false).status.block_count) / f64::from(all);
    let time = run.time(&[&source], 10, true).as_secs_f64();
    let share = run.time(&[&source, &dented], 10, false).as_secs_f64() / time;
    [
        Row::figure("on the device: a dent: blocks extracted", blocks, "of all"),
        Row::figure("on the device: a dent: time, fields included", share, "of that for all"),
    ]
}

/// Clay scattered about a cube: the grains, one by one.
fn grains(device: &Device, size: Size) -> f64 {
    let mut random = Random(7);
    let settings = SurfaceSettings::default();
    let mut is_other = |_: &usize| {
        let source = scattered(&mut random);
        let ours = device.run_with_grains(&source, &settings).frame(&source, false);
        grain_difference(&ours.grains, &extract_with_grains(&source, &settings).grains, CELL).is_some()
    };
    (0..size.pick(1, 4, 100)).filter(|case| is_other(case)).count() as f64
}

/// 7^3 nodes between empty ones, one to three sheets.
fn random_fields(device: &Device, size: Size) -> f64 {
    let mut random = Random(5);
    let mut surface = device.surface(&domain(4.0), 1, &SurfaceSettings::default());
    let mut is_other = |case: usize| {
        let mut total = vec![0.0f32; 729];
        let mut sides = vec![[vec![0.0f32; 729], vec![0.0f32; 729]]; case % 4];
        for i in 0..343 {
            let at = i % 7 + 1 + 9 * (i / 7 % 7 + 1 + 9 * (i / 49 + 1));
            let f = random.range(0.0, 1.0) as f32;
            total[at] = if case.is_multiple_of(2) { (f * 4.0).round() / 4.0 } else { f };
            for side in &mut sides {
                let part = random.range(-1.5, 1.5) as f32;
                side[usize::from(part < 0.0)][at] = part.abs().min(total[at]);
            }
        }
        let field = Field::from_nodes([9; 3], &total, sides.iter().map(|[p, m]| (&p[..], &m[..])));
        let ours = device.extract_field(&mut surface, &field).merged();
        difference(&ours, &extract_field(&field, 0.5), 2e-5).is_some()
    };
    (0..size.pick(5, 40, 1000)).filter(|case| is_other(*case)).count() as f64
}

/// Cut cubes: the mesh of the fields that the device made.
fn cubes(device: &Device, size: Size) -> f64 {
    let mut random = Random(6);
    let settings = SurfaceSettings::default();
    let kinds = [CutCube::one, CutCube::crossed, CutCube::crossed_by_partial, CutCube::joined];
    let mut is_other = |case: usize| {
        let source = kinds[case % 4](case / 4, &mut random).source(affine(&mut random));
        let output = device.extract(&source, &settings);
        output.field.as_ref().is_none_or(|field| {
            difference(&output.merged(), &extract_field(field, settings.iso_threshold), (2e-5 * CELL) as f32).is_some()
        })
    };
    (0..size.pick(1, 4, 100)).filter(|case| is_other(*case)).count() as f64
}
