//! Times, on a machine that has nothing else to do: no test asks for them.

use super::clay::{BALL_CENTRE, CELL, CUBE_CENTRE, CutCube, Random, ball, domain, with_dust};
use super::device::Device;
use crate::lab::{Size, is_gpu};
use crate::report::Row;
use bevy_clay::sim::frame::SurfaceSource;
use bevy_clay::sim::gpu::GpuDevice;
use bevy_clay::surface::extract::extract;
use bevy_clay::surface::field::{Field, SurfaceSettings, Tier};
use bevy_clay::surface::gpu::SurfaceRoom;
use bevy_clay::surface::grains::extract_with_grains;
use bevy_clay::surface::ray::cast_ray;
use glam::{DMat3, DVec3};
use std::hint::black_box;
use std::time::Instant;

/// Rays of which the mean counts.
const RAYS: usize = 10_000;

/// A ball of 104,900 particles, 8 per cell.
fn large_ball() -> SurfaceSource {
    ball(14.63, 0.25, 3)
}

/// Wall time of some work, the least of some runs [ms].
fn best(size: Size, work: &dyn Fn()) -> f64 {
    let time = |_| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64() * 1e3
    };
    (0..size.pick(3, 10, 30)).map(time).fold(f64::MAX, f64::min)
}

/// Extraction on the processor, whole.
pub fn extraction(size: Size) -> Vec<Row> {
    let s = large_ball();
    let extraction = |tier: Tier| best(size, &|| drop(extract(&s, &SurfaceSettings::new(tier))));
    let dusty = with_dust(&s, 10_000);
    let all = extract_with_grains(&dusty, &SurfaceSettings::default());
    let dusty_time = best(size, &|| drop(extract_with_grains(&dusty, &SurfaceSettings::default()).drawn()));
    let balls = best(size, &|| drop(all.drawn())) - best(size, &|| drop(all.mesh.clone()));
    vec![
        Row::at_most("104,900 particles, fine grid: time", extraction(Tier::Fine), "ms", 50.0),
        Row::at_most("104,900 particles, coarse grid: time", extraction(Tier::Coarse), "ms", 50.0),
        Row::at_least("10,000 particles around them, each alone: grains", all.grains.len() as f64, "count", 10_000.0),
        Row::figure("104,900 and 10,000 particles, fine grid, with balls: time", dusty_time, "ms"),
        Row::figure("balls for 10,000 grains: time", balls, "ms"),
    ]
}

/// Rays through fields: from all around into a ball, and out of the middle of a cube with two cuts that
/// cross.
pub fn rays(size: Size) -> Vec<Row> {
    let s = large_ball();
    let mut random = Random(25);
    let mut rows = vec![];
    for (tier, name) in [(Tier::Fine, "fine"), (Tier::Coarse, "coarse")] {
        let settings = SurfaceSettings::new(tier);
        let field = Field::of_particles(&s, &settings);
        let rays: Vec<(DVec3, DVec3)> = (0..RAYS)
            .map(|_| {
                let origin = BALL_CENTRE + 60.0 * random.direction();
                (s.domain.to_world(origin), BALL_CENTRE + random.vector(-15.0, 15.0) - origin)
            })
            .collect();
        let cast = || {
            black_box(rays.iter().filter_map(|(origin, way)| cast_ray(&field, &settings, *origin, *way)).count());
        };
        let each = best(size, &cast) * 1e3 / RAYS as f64;
        rows.push(Row::at_most(format!("a ray through 104,900 particles, {name} grid: time"), each, "us", 100.0));
        let made = best(size, &|| drop(Field::of_particles(&s, &settings)));
        rows.push(Row::figure(format!("field of 104,900 particles, {name} grid: time"), made, "ms"));
        rows.push(Row::figure(format!("field of 104,900 particles, {name} grid: memory"), (field.memory() >> 10) as f64, "KiB"));
        let bounds = best(size, &|| {
            black_box(field.bounds(settings.iso_threshold));
        });
        rows.push(Row::figure(format!("field of 104,900 particles, {name} grid: time of its box"), bounds, "ms"));
    }
    let settings = SurfaceSettings::new(Tier::Fine);
    let field = Field::of_particles(&CutCube::crossed(0, &mut random).source(DMat3::IDENTITY), &settings);
    let ways: Vec<DVec3> = (0..RAYS).map(|_| random.direction()).collect();
    let middle = domain(30.0).to_world(CUBE_CENTRE);
    let origin = |way: &DVec3| middle - 30.0 * CELL * *way;
    let cast = || {
        black_box(ways.iter().filter_map(|way| cast_ray(&field, &settings, origin(way), *way)).count());
    };
    rows.push(Row::at_most("a ray through crossed cuts: time", best(size, &cast) * 1e3 / RAYS as f64, "us", 100.0));
    rows
}

/// Extraction on a device that is no software, whole.
pub fn on_device(_: Size) -> Vec<Row> {
    if !is_gpu() {
        return vec![];
    }
    let Ok(device) = GpuDevice::headless().and_then(Device::new) else {
        return vec![Row::at_most("surface on the device: shaders refused", f64::NAN, "-", 0.0)];
    };
    if device.is_software() {
        return vec![];
    }
    let source = large_ball();
    let settings = SurfaceSettings::default();
    let mut run = device.run(&source, &settings, SurfaceRoom::for_particles(source.particles.len()));
    let time = run.time(&[&source], 100, true).as_secs_f64() * 1e3;
    let looking = device.run_with_grains(&source, &settings).time(&[&source], 100, true).as_secs_f64() * 1e3;
    let dusty = with_dust(&source, 10_000);
    let dusty_time = device.run_with_grains(&dusty, &settings).time(&[&dusty], 100, true).as_secs_f64() * 1e3;
    vec![
        Row::at_most("on the device: 104,900 particles, fine grid: time", time, "ms", 1.0),
        Row::at_most("on the device: the same, looking for grains: time", looking, "ms", 1.0),
        Row::at_most("on the device: 10,000 more, each alone, with balls: time", dusty_time, "ms", 2.0),
    ]
}
