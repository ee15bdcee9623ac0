use super::super::params::{Wall, Walls};
use super::super::tool::Tool;
use super::*;
use glam::DQuat;

const CELL: f64 = 1e-3;
const DT: f64 = 1e-4;

fn material() -> ClayMaterial {
    ClayMaterial { density: 1000.0, young_modulus: 1e5, poisson_ratio: 0.1, yield_stress: 2e3, ..ClayMaterial::default() }
}

fn domain() -> Domain {
    Domain::new(DVec3::ZERO, DVec3::splat(40.0 * CELL), CELL, Walls { low: [Wall::Stick; 3], high: [Wall::Separate; 3] })
        .expect("a room")
}

/// Height of the clay's face, on which a lattice ends, and the tool's place in the middle above it \[cells\].
fn middle(domain: &Domain) -> DVec3 {
    (domain.to_grid(DVec3::new(20.0, 10.0, 20.0) * CELL)).round()
}

/// Full particles half a cell apart below the face, 20 cells wide and 6 deep; those touch that stand in the
/// tool.
fn lattice(domain: &Domain, mut of: impl FnMut(Seen)) {
    let top = middle(domain);
    let mut id = 0;
    for i in 0..40 {
        for j in 0..12 {
            for k in 0..40 {
                let at = DVec3::new(f64::from(i) - 19.5, -f64::from(j) - 0.5, f64::from(k) - 19.5) / 2.0;
                let strain = DMat3::ZERO;
                let seen = Seen {
                    id,
                    position: top + at,
                    volume: 0.125,
                    strain,
                    hardening: 0.0,
                    structure: 0.0,
                    anchor: None,
                    whole: Some(ClassKey::FIRST),
                };
                of(seen);
                id += 1;
            }
        }
    }
}

/// What a tool meets whose origin is `above` the clay's face \[cells\], with a force \[N\] upwards;
/// `strained` clay stands on its yield surface.
fn touch(shape: ToolShape, above: f64, force: f64, strained: bool) -> ToolTouch {
    let domain = domain();
    let place = domain.to_world(middle(&domain) + DVec3::Y * above);
    let tool = Tool { shape, contact: Contact::Separate { friction: 0.3 } };
    let path = ToolPath::still(4, tool, Pose { position: place, rotation: DQuat::IDENTITY });
    let plan = FramePlan { tools: vec![path], ..FramePlan::new(material(), DT, 10) };
    let mut gather = Gather::new(&plan.tools[0], &plan, &domain);
    let scaled = shape.scaled(1.0 / CELL);
    let at_yield = material().yield_stress / material().lame_mu();
    lattice(&domain, |mut seen| {
        // What a tool stands in has gone down with the clay below it.
        let at = seen.position - middle(&domain);
        let sunk = (0.25 - scaled.distance(DVec3::new(at.x, -0.25 - above, at.z))).max(0.0);
        let touches = sunk > 1e-9 && at.y > -0.3;
        seen.position.y -= sunk;
        let strain = if strained { DMat3::from_diagonal(DVec3::new(1.0, -2.0, 1.0) * at_yield / 3.0) } else { DMat3::ZERO };
        gather.see(Seen { anchor: touches.then_some(DVec3::ZERO), strain, ..seen });
    });
    gather.finish(&ToolReport { id: 4, force: DVec3::Y * force, ..ToolReport::default() })
}

fn close(found: f64, wanted: f64, part: f64) {
    assert!((found - wanted).abs() <= part * wanted.abs(), "{found} is not {wanted}");
}

/// What a raster leaves of small areas: over places of squares on it, they are .94 to 1.0 of themselves.
const RASTERED: f64 = 0.08;

const FACE: ToolShape = ToolShape::Box { half_size: DVec3::new(2.0 * CELL, 3.0 * CELL, 2.0 * CELL) };

/// A flat face of 16 cells, before it touches and pressed by a hundredth of a cell: Sneddon's stiffness,
/// Mindlin's across, Prandtl's load, none of it growing.
#[test]
fn flat_face_meets_its_own_area() {
    let (area, m) = (16.0 * CELL * CELL, material());
    for (above, gap) in [(3.3, 0.3), (2.99, 0.0)] {
        let found = touch(FACE, above, 0.0, false);
        assert!((found.normal - DVec3::Y).length() < 1e-12, "{}", found.normal);
        assert!((found.gap - gap * CELL).abs() < 2.0 * WAY_ERROR * CELL, "{}", found.gap);
        close(found.area, area, RASTERED);
        let normal = 2.0 * m.young_modulus / 0.99 * (found.area / PI).sqrt();
        close(found.stiffness.y_axis.y, normal, 1e-9);
        close(found.stiffness.x_axis.x, normal * 1.8 / 1.9, 1e-9);
        assert!(found.stiffness.x_axis.y.abs() < 1e-9 * normal && !found.is_yielding);
        close(found.yield_force.expect("it yields"), (2.0 + PI) * m.shear_strength() * found.area, 1e-9);
        assert_eq!((found.yield_slope, found.friction, found.id), (0.0, 0.3, 4));
        assert_eq!(found.near.len(), NEAR_MAX);
        close(found.near[0].radius, (0.75 * 0.125 / PI).cbrt() * CELL, 1e-12);
    }
}

/// Clay on its yield surface bears what it does bear; elastic clay that is pressed beyond the bound too.
#[test]
fn patch_that_yields_bears_its_force() {
    let found = touch(FACE, 2.99, 0.02, true);
    assert!(found.is_yielding);
    assert_eq!(found.yield_force, Some(0.02));
    let bound = (2.0 + PI) * material().shear_strength() * 16.0 * CELL * CELL;
    let unyielding = touch(FACE, 2.99, 2.0 * bound, false);
    assert_eq!((unyielding.is_yielding, unyielding.yield_force), (false, Some(2.0 * bound)));
}

/// The area of a ball grows by `2 pi R` with depth, `(2 + pi) k` of it is the slope; at the touch it bears
/// nothing yet. Pressed by .4 cells, its area is `2 pi R d` with what
/// it all but touches.
#[test]
fn ball_grows_with_depth() {
    let radius = 6.0;
    let ball = ToolShape::Sphere { radius: radius * CELL };
    let pressure = (2.0 + PI) * material().shear_strength();
    let before = touch(ball, radius + 0.5, 0.0, false);
    close(before.yield_slope, pressure * 2.0 * PI * radius * CELL, 0.25);
    let whole = pressure * before.area;
    assert!(before.yield_force.expect("it yields") < 0.35 * whole, "{:?} of {whole}", before.yield_force);
    let pressed = touch(ball, radius - 0.4, 0.0, false);
    let grown = pressed.yield_slope / pressure;
    close(grown, 2.0 * PI * radius * CELL, 0.25);
    close(pressed.area, 2.0 * PI * radius * (0.4 + FIRST) * CELL * CELL, 0.1);
}

/// In the midst of clay the fill is 1 and flat; at its face half, and grows into the clay.
#[test]
fn fill_falls_at_the_face() {
    let inside = touch(ToolShape::Sphere { radius: 0.5 * CELL }, -3.0, 0.0, false);
    close(inside.fill, 1.0, 0.03);
    assert!(inside.fill_gradient.length() < 0.05 / CELL, "{}", inside.fill_gradient);
    let face = touch(FACE, 3.0, 0.0, false);
    assert!((0.5..0.8).contains(&face.fill), "{}", face.fill);
    assert!(face.fill_gradient.y < -0.2 / CELL && face.fill_gradient.x.abs() < 0.1 / CELL, "{}", face.fill_gradient);
}

/// What lies under another does not count twice, what has spread counts by its place, and two patches apart
/// have no area between them.
#[test]
fn area_is_that_of_a_patch() {
    let square = |apart: f64, count: i32, at: f64| {
        let along = move |i: i32| (f64::from(i) - 0.5 * f64::from(count - 1)) * apart;
        let place = move |i: i32| DVec3::new(along(i % count) + at, -0.3 * f64::from(i % 2), along(i / count));
        (0..count * count).map(place)
    };
    for count in [8, 20] {
        close(area_of(square(0.5, count, 0.0), DVec3::Y), 0.25 * f64::from(count * count), RASTERED);
    }
    let twice = square(0.5, 8, 0.0).chain(square(0.5, 8, 0.0).map(|p| p - DVec3::Y * 0.5));
    close(area_of(twice, DVec3::Y), 16.0, RASTERED);
    // As far apart as pressed clay spreads: the rim is a little less than half of that.
    close(area_of(square(0.7, 8, 0.0), DVec3::Y), 8.0 * 8.0 * 0.49, 0.1);
    close(area_of(square(0.5, 8, 0.0).chain(square(0.5, 8, 9.0)), DVec3::Y), 32.0, RASTERED);
    let turn = DQuat::from_rotation_z(0.7);
    close(area_of(square(0.5, 8, 0.0).map(|p| turn * DVec3::new(p.x, 0.0, p.z)), turn * DVec3::Y), 16.0, RASTERED);
    assert_eq!(area_of(std::iter::empty(), DVec3::Y), 0.0);
}

/// A tool that goes past clay never touches it; one over a hole comes to what is below.
#[test]
fn way_ends_at_what_the_tool_meets() {
    let domain = domain();
    let place = domain.to_world(middle(&domain));
    let tool = Tool { shape: ToolShape::Sphere { radius: 2.0 * CELL }, contact: Contact::Slip };
    let plan = FramePlan {
        tools: vec![ToolPath::still(1, tool, Pose { position: place, ..Pose::default() })],
        ..FramePlan::new(material(), DT, 1)
    };
    let gather = Gather::new(&plan.tools[0], &plan, &domain);
    let way = |at: DVec3| {
        let seen = Seen {
            position: middle(&domain) + at,
            volume: 0.125,
            strain: DMat3::ZERO,
            id: 0,
            hardening: 0.0,
            structure: 0.0,
            anchor: None,
            whole: Some(ClassKey::FIRST),
        };
        let local = at;
        gather.way(&Found { seen, gap: at.length() - 2.25, local, normal: at.normalize(), area: 0.25 }, DVec3::Y)
    };
    assert!((way(DVec3::NEG_Y * 3.0).expect("met") - 0.75).abs() < 2.0 * WAY_ERROR);
    // On a line that the ball's edge passes: a circle of 2.25 about the axis.
    let beside = way(DVec3::new(2.0, -2.5, 0.0)).expect("met");
    assert!((beside - (2.5 - (2.25f64 * 2.25 - 4.0).sqrt())).abs() < 0.01, "{beside}");
    assert_eq!(way(DVec3::new(2.4, -2.5, 0.0)), None);
    assert_eq!(way(DVec3::NEG_Y * 8.0), None);
}

/// Far off there is nothing; a tool that sweeps half the frame and then stands has its mean there, of
/// implicit steps where they end, and no way in the latter half.
#[test]
fn far_tool_meets_nothing() {
    let found = touch(FACE, 9.0, 0.0, false);
    assert_eq!((found.normal, found.area, found.yield_force, found.near.len()), (DVec3::ZERO, 0.0, None, 0));
    let pose = |x| Pose { position: DVec3::X * x, ..Pose::default() };
    let mut path = ToolPath::still(1, Tool { shape: FACE, contact: Contact::Stick }, pose(0.0));
    let at = |time, x| super::super::tool::PoseSample { time, pose: pose(x) };
    path.samples = vec![at(0.0, 0.0), at(1.0, 4.0)];
    let explicit = FramePlan::new(material(), 0.5, 4);
    let implicit = FramePlan { integrator: Integrator::Implicit { passes: 15 }, ..explicit.clone() };
    assert!((mean_position(&path, &explicit) - DVec3::X * 3.0).length() < 1e-12);
    // At the ends of its four steps: 2, 4, 4, 4.
    assert!((mean_position(&path, &implicit) - DVec3::X * 3.5).length() < 1e-12);
    // It has stood since the middle of the frame; until then it went all of its way.
    assert_eq!(latter_way(&path, explicit.duration()), DVec3::ZERO);
    assert!((latter_way(&path, 1.0) - DVec3::X * 2.0).length() < 1e-12);
}

#[cfg(feature = "reference")]
mod engines {
    use super::super::super::engine::Engine;
    use super::super::super::frame::{FrameOutputs, FrameReport};
    use super::super::super::integrator::Integrator;
    use super::super::super::native::NativeEngine;
    use super::super::super::oracle::Oracle;
    use super::super::super::snapshot::{Particle, Snapshot};
    use super::super::super::tool::PoseSample;
    use super::*;

    /// A box that is pressed a third of a cell into a block, and a ball beside it that does not touch.
    fn pressed(integrator: Integrator, outputs: FrameOutputs) -> (Snapshot, FramePlan) {
        let domain = domain();
        let mut particles = vec![];
        lattice(&domain, |seen| {
            if (seen.position - middle(&domain)).abs().max_element() < 5.0 {
                particles.push(Particle::at(seen.position, (0.125 * CELL.powi(3)) as f32, seen.id));
            }
        });
        let (steps, dt) = match integrator {
            Integrator::Explicit { .. } => (40, 0.25 * material().time_step_limit(CELL, 1000.0)),
            Integrator::Implicit { .. } => (4, 1e-3),
        };
        let end = dt * f64::from(steps);
        let place = |at: DVec3| Pose { position: domain.to_world(middle(&domain) + at), rotation: DQuat::IDENTITY };
        let at = |time, y: f64| PoseSample { time, pose: place(DVec3::Y * y) };
        let contact = Contact::Separate { friction: 0.3 };
        let mut press = ToolPath::still(4, Tool { shape: FACE, contact }, place(DVec3::Y * 3.0));
        press.samples = vec![at(0.0, 3.0), at(end, 2.67)];
        let ball = Tool { shape: ToolShape::Sphere { radius: CELL }, contact };
        let beside = ToolPath::still(7, ball, place(DVec3::new(3.6, 2.1, 0.3)));
        let plan = FramePlan { integrator, outputs, tools: vec![press, beside], ..FramePlan::new(material(), dt, steps) };
        (Snapshot::new(domain, material(), particles), plan)
    }

    fn run(snapshot: &Snapshot, plan: &FramePlan) -> FrameReport {
        let mut engine = NativeEngine::with_threads(1);
        engine.load(snapshot).expect("load");
        engine.submit(plan.clone()).expect("submit");
        engine.wait().expect("report")
    }

    /// The native engine's touch is the oracle's to the rounding of f32; it costs nothing unasked.
    #[test]
    fn native_agrees_with_the_oracle() {
        let asked = FrameOutputs { touch: true, ..FrameOutputs::NOTHING };
        for (integrator, part) in [(Integrator::default(), 1e-4)] {
            let (snapshot, plan) = pressed(integrator, asked);
            let (ours, theirs) = (run(&snapshot, &plan), Oracle::new(&snapshot).run(&plan));
            assert_eq!((ours.touches.len(), theirs.touches.len()), (2, 2));
            for (a, b) in ours.touches.iter().zip(&theirs.touches) {
                assert!(b.area > 0.0 && b.near.len() > 20, "{b:?}");
                assert_eq!((a.id, a.pose, a.mean_position, a.friction), (b.id, b.pose, b.mean_position, b.friction));
                assert!((a.force - b.force).length() <= part * b.force.length(), "{} {}", a.force, b.force);
                assert!((a.normal - b.normal).length() < part, "{} {}", a.normal, b.normal);
                assert!((a.gap - b.gap).abs() < part * CELL, "{} {}", a.gap, b.gap);
                close(a.area, b.area, part);
                close(a.stiffness.y_axis.y, b.stiffness.y_axis.y, part);
                assert_eq!(a.is_yielding, b.is_yielding);
                close(a.yield_force.expect("ours"), b.yield_force.expect("theirs"), part);
                close(a.yield_slope, b.yield_slope, part);
                close(a.fill, b.fill, part);
            }
            let [press, beside] = &ours.touches[..] else { panic!("two tools") };
            assert!(press.gap == 0.0 && press.force.y > 0.0 && beside.gap > 0.0, "{press:?}");
            let (snapshot, plan) = pressed(integrator, FrameOutputs::NOTHING);
            assert!(run(&snapshot, &plan).touches.is_empty());
        }
    }

    /// A knife that sticks goes two cells and a half into a block, and 0.8 cells back.
    fn cut(integrator: Integrator) -> (Snapshot, FramePlan) {
        let asked = FrameOutputs { touch: true, ..FrameOutputs::NOTHING };
        let (snapshot, plan) = pressed(integrator, asked);
        let shape = ToolShape::Blade { half_width: 3.0 * CELL, half_height: 4.0 * CELL };
        let domain = domain();
        let place =
            |y: f64| Pose { position: domain.to_world(middle(&domain) + DVec3::new(0.2, y, 0.1)), rotation: DQuat::IDENTITY };
        let mut knife = ToolPath::still(4, Tool { shape, contact: Contact::Stick }, place(4.1));
        let steps = plan.steps * 6;
        let at = |time, y: f64| PoseSample { time, pose: place(y) };
        let end = plan.dt * f64::from(steps);
        knife.samples = vec![at(0.0, 4.1), at(0.7 * end, 1.4), at(end, 2.2)];
        let material = ClayMaterial { toughness: 5.0, ..plan.material };
        (Snapshot { material, ..snapshot }, FramePlan { tools: vec![knife], steps, material, ..plan })
    }

    /// What clay bears of a blade is the oracle's: its edge R L, its flanks 2 k A of the depth that it has
    /// cut.
    #[test]
    fn native_blade_agrees_with_the_oracle() {
        let (snapshot, plan) = cut(Integrator::default());
        let (ours, theirs) = (run(&snapshot, &plan), Oracle::new(&snapshot).run(&plan));
        let [a, b] = [&ours.touches[0], &theirs.touches[0]];
        let [ours, theirs] = [a, b].map(|touch| touch.blade.as_ref().expect("a blade"));
        assert!((a.normal - DVec3::Z).length() < 1e-12 && a.force.y > 0.0, "{a:?}");
        assert!((a.force - b.force).length() <= 1e-3 * b.force.length(), "{} {}", a.force, b.force);
        close(a.stiffness.z_axis.z, b.stiffness.z_axis.z, 1e-3);
        close(ours.flank, theirs.flank, 1e-3);
        (0..2).for_each(|i| close(ours.bearing[i], theirs.bearing[i], 1e-3));
        assert!((ours.flank_growth - theirs.flank_growth).length() <= 1e-3 * theirs.flank_growth.length());
        for (ours, theirs) in ours.edges.iter().zip(&theirs.edges) {
            assert_eq!(ours.outward, theirs.outward);
            assert!((ours.gap - theirs.gap).abs() < 1e-3 * CELL, "{} {}", ours.gap, theirs.gap);
            assert!((ours.force - theirs.force).abs() < 1e-3 * theirs.force.max(1e-3), "{} {}", ours.force, theirs.force);
        }
        close(theirs.edges[0].force, 5.0 * 6.0 * CELL, 0.2);
        // Its cut ends 0.8 cells below it, by half a layer of particles.
        assert!((0.5..1.3).contains(&(theirs.edges[0].gap / CELL)), "{}", theirs.edges[0].gap);
        close(theirs.flank, plan.material.shear_strength() * b.area, 1e-9);
    }
}
