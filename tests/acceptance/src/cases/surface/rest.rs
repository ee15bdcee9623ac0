//! Clay at rest: its mesh does not tremble, not by a bit.

use super::device::{Device, Output};
use crate::cases::blade::along_x;
use crate::lab::{DX, Lab, Size, block, is_gpu, room, snapshot, stable_step};
use crate::report::Row;
use bevy_clay::sim::gpu::GpuDevice;
use bevy_clay::sim::prelude::*;
use bevy_clay::surface::extract::{extract, extract_field};
use bevy_clay::surface::field::{Field, SurfaceSettings};
use bevy_clay::surface::gpu::SurfaceRoom;
use glam::{DVec3, IVec3};

/// Share of the velocity that is taken in each substep [-].
const DAMPING: f64 = 0.07;
/// Parts of the time at rest, after each of which the mesh is looked at.
const PARTS: u32 = 10;

/// A block, cut through, under its own weight on the floor, `steps` substeps after the blade has left.
fn settled(edge: i32, steps: u32) -> Lab {
    let domain = room([edge + 8; 3], Wall::Stick);
    let material = ClayMaterial { weld: Weld::Off, ..Preset::SoftClay.material() };
    let low = DVec3::new(4.0, 0.0, 4.0);
    let particles = block(low, IVec3::splat(edge));
    let dt = stable_step(&material);
    let mut lab = Lab::new(&snapshot(domain, material, particles), dt);
    let centre = lab.particles().iter().map(|p| p.grid()).sum::<DVec3>() / f64::from(8 * edge.pow(3));
    let half = f64::from(edge) * DX;
    let pose = Pose { position: domain.to_world(centre + DVec3::X * 0.3), rotation: along_x() };
    let blade = Tool { shape: ToolShape::Blade { half_width: half, half_height: half }, contact: Contact::Slip };
    lab.frame_with(1, &[ToolPath::still(1, blade, pose)]);
    lab.plan.gravity = DVec3::NEG_Y * 9.81;
    lab.plan.validation.damping = DAMPING / dt;
    // The blade's visit is over two frames after its last, and the cut gives way to bodies.
    (0..4).for_each(|_| _ = lab.frame(steps / 4));
    lab
}

/// The mesh as it is settled, and after each part of a thousand substeps more, as an app shows it: made anew
/// where the field has changed. With the GPU engine, on the device.
pub fn at_rest(size: Size) -> Vec<Row> {
    let (edge, steps) = size.pick((4, 1000), (6, 1500), (12, 4000));
    let mut lab = settled(edge, steps);
    let settings = SurfaceSettings::default();
    let source = |lab: &Lab| lab.engine.surface().expect("clay is loaded");
    let first = source(&lab);
    let bodies = extract(&first, &settings).components().len();
    let missing = bodies.abs_diff(2);
    let (mut differ, mut greatest) = (0, 0.0f32);
    let field = Field::of_particles(&first, &settings);
    let device = is_gpu().then(|| GpuDevice::headless().and_then(Device::new).expect("the device that runs the clay"));
    let mut run = device.as_ref().map(|d| d.run(&first, &settings, SurfaceRoom::for_particles(first.particles.len())));
    // A mesh that is never written would be equal to itself.
    let is_whole = |output: &Output| output.status.flags == 0 && output.status.index_count > 0;
    let words = run.as_mut().map(|run| run.frame(&first, false)).filter(is_whole).map(|output| output.words);
    for _ in 0..PARTS {
        lab.frame(1000 / PARTS);
        let now = source(&lab);
        let field_now = Field::of_particles(&now, &settings);
        greatest = greatest.max(field_now.greatest_difference(&field));
        let is_other = match &mut run {
            Some(run) => words.is_none() || Some(run.frame(&now, false).words) != words,
            None => !field_now.is_still(&field) && extract_field(&field_now, 0.5) != extract_field(&field, 0.5),
        };
        differ += u32::from(is_other);
    }
    let place = if is_gpu() { ", on the device" } else { "" };
    vec![
        Row::at_most("clay at rest: bodies beside the two that a cut keeps apart", missing as f64, "bodies", 0.0),
        Row::at_most(
            format!("clay at rest for 1000 substeps{place}: meshes that differ by a bit"),
            f64::from(differ),
            "of 10",
            0.0,
        ),
        Row::figure(
            format!("clay at rest for 1000 substeps{place}: greatest change of the field"),
            f64::from(greatest),
            "of the inside",
        ),
    ]
}
