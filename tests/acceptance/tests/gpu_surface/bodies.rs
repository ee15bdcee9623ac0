//! Bodies that touch: the processor's fields and its mesh, and no room taken for what is not there.

use super::assert_same;
use super::changes::assert_whole;
use bevy_clay::sim::frame::SurfaceSource;
use bevy_clay::surface::extract::{extract, extract_field};
use bevy_clay::surface::field::{Field, SurfaceSettings, Tier};
use bevy_clay::surface::gpu::{SurfaceRoom, flag};
use bevy_clay::surface::stitch::print_ready;
use clay_acceptance::cases::surface::clay::{CELL, CUBE_CENTRE, Cut, CutCube, Random, affine, changed};
use clay_acceptance::cases::surface::device::Device;
use glam::{DMat3, DVec3};
use libtest_mimic::Failed;

fn halves(off: f64) -> SurfaceSource {
    let cube = CutCube::new(vec![Cut::through(DVec3::X, CUBE_CENTRE + off)], 2, 0.25, &mut Random(41));
    cube.parted_source(DMat3::IDENTITY)
}

fn octants(random: &mut Random) -> CutCube {
    CutCube::octants(CUBE_CENTRE + random.vector(-1.0, 1.0), DMat3::from_axis_angle(random.direction(), 1.0), random)
}

/// Two bodies, on the grid and off it; eight; two of which one or both are cut, in part and through.
pub(crate) fn bodies_agree(device: &Device) -> Result<(), Failed> {
    let mut random = Random(42);
    let mut cases = vec![("on the grid", 2, halves(0.0)), ("off the grid", 2, halves(0.13))];
    cases.push(("eight", 8, octants(&mut random).parted_source(affine(&mut random))));
    for (name, is_in_both, depth) in [("one cut", false, 0.3), ("both cut", true, -0.8), ("one cut through", false, -9.0)] {
        let (cube, source) = CutCube::cut_beside_body(is_in_both, CUBE_CENTRE.y + depth, &mut random);
        cases.push((name, cube.bodies, source));
    }
    for (name, pieces, source) in &cases {
        for tier in [Tier::Fine, Tier::Coarse] {
            let name = format!("{name}, {tier:?}");
            let settings = SurfaceSettings::new(tier);
            let output = device.extract(source, &settings);
            assert_eq!(output.status.flags, 0, "{name}");
            let field = output.field.as_ref().ok_or("the fields")?;
            let off = field.greatest_difference(&Field::of_particles(source, &settings));
            assert!(off < 1e-5, "{name}: a node's value is off by {off}");
            assert_same(&name, &output.merged(), &extract_field(field, 0.5), (2e-5 * CELL) as f32);
            let (ours, theirs) = (print_ready(&output.merged()).0, print_ready(&extract(source, &settings)).0);
            assert_eq!([&ours, &theirs].map(|m| m.component_labels().1), [*pieces; 2], "{name}");
            assert!((ours.volume() / theirs.volume() - 1.0).abs() < 1e-5, "{name}");
        }
    }
    Ok(())
}

/// One of two bodies is moved away, bit by bit, joins the other and comes back; nothing is extracted of clay
/// that hardly moves.
pub(crate) fn bodies_that_move_are_drawn_whole(device: &Device) -> Result<(), Failed> {
    let (settings, first) = (SurfaceSettings::default(), halves(0.13));
    let room = SurfaceRoom { bodies: 2, pages: 2000, ..SurfaceRoom::for_particles(first.particles.len()) };
    let mut run = device.run(&first, &settings, room);
    let moved = |by: f32| changed(&first, |all| all.iter_mut().filter(|p| p.body == 0).for_each(|p| p.position[0] -= by));
    let one = |number: u32| changed(&first, |all| all.iter_mut().for_each(|p| p.body = number));
    let frames = [first.clone(), moved(0.02), moved(0.4), moved(3.0), first.clone(), one(3), one(4), first.clone()];
    for (i, source) in frames.iter().enumerate() {
        let output = run.frame(source, false);
        assert_whole(&format!("frame {i}"), &run, &output, source, &settings);
    }
    let count = run.frame(&first, false).status.extraction_count;
    let shaken = changed(&first, |all| all.iter_mut().for_each(|p| p.position[1] += 5e-4));
    assert_eq!(run.frame(&shaken, false).status.extraction_count, count, "clay at rest");
    let again = run.frame(&first, true);
    assert!(again.draws_as(&device.run(&first, &settings, room).frame(&first, true)), "the same bits as at first");
    Ok(())
}

/// A body alone has the same bits whatever its number, and needs no room for bodies; several that find none
/// say so, and leave the mesh as it was.
pub(crate) fn numbers_alone_change_nothing(device: &Device) -> Result<(), Failed> {
    let mut random = Random(43);
    let source = CutCube::one(1, &mut random).source(DMat3::IDENTITY);
    let settings = SurfaceSettings::default();
    let room = SurfaceRoom { bodies: 0, pages: 0, ..SurfaceRoom::for_particles(source.particles.len()) };
    let words = |number: u32| {
        let numbered = changed(&source, |all| all.iter_mut().for_each(|p| p.body = number));
        let output = device.run(&numbered, &settings, room).frame(&numbered, false);
        assert_eq!(output.status.flags, 0);
        output.words
    };
    assert!(words(0) == words(7));
    let eight = octants(&mut random).parted_source(DMat3::IDENTITY);
    for small in [SurfaceRoom { bodies: 3, pages: 5000, ..room }, SurfaceRoom { bodies: 8, pages: 9, ..room }] {
        let output = device.run(&eight, &settings, small).frame(&eight, false);
        assert_eq!(output.status.flags, flag::BODIES_FULL);
        assert!(output.words.0.iter().all(|w| *w == 0));
        let grown = small.grown(&output.status).grown(&output.status);
        assert!(grown != small);
    }
    Ok(())
}
