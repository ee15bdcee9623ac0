use super::*;
use crate::haptics::model::NearParticle;
use crate::haptics::reference::bed::{Bed, Random, square_tool};
use glam::{DQuat, DVec3};

/// Random planes about the origin, of which many are nearly parallel, and a target within most of them.
fn planes(random: &mut Random, count: u64) -> Pairs {
    let mut pairs = Pairs::default();
    let mut direction = || DVec3::new(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5);
    let about = DVec3::Y + direction();
    for id in 0..count {
        let spread = if id % 3 == 0 { 1e-4 } else { 0.8 };
        let normal = (about + spread * direction()).normalize();
        assert!(pairs.push(id, Constraint { normal, offset: 0.006 * direction().x }));
    }
    pairs
}

/// The solution by trying all sets of up to three planes: none violated, none pulling, nearest.
fn by_trial(pairs: &Pairs, stiffness: DVec3, target: DVec3) -> Option<DVec3> {
    let planes = pairs.constraints();
    let outside = |x: DVec3| planes.iter().all(|p| p.gap(x) > -1e-9);
    let cost = |x: DVec3| (stiffness * (x - target)).dot(x - target);
    let mut best: Option<DVec3> = outside(target).then_some(target);
    let mut consider = |held: &[usize]| {
        let rows: Vec<(DVec3, f64)> = held.iter().map(|i| (planes[*i].normal, -planes[*i].gap(target))).collect();
        let Some(x) = on_planes(&rows, stiffness, target) else { return };
        if outside(x) && best.is_none_or(|known| cost(x) < cost(known)) {
            best = Some(x);
        }
    };
    for i in 0..planes.len() {
        consider(&[i]);
        for j in 0..i {
            consider(&[i, j]);
            (0..j).for_each(|k| consider(&[i, j, k]));
        }
    }
    best
}

/// The nearest place on planes, by another way than the solver's: in scaled coordinates, by cross products.
fn on_planes(rows: &[(DVec3, f64)], stiffness: DVec3, target: DVec3) -> Option<DVec3> {
    let root = DVec3::new(stiffness.x.sqrt(), stiffness.y.sqrt(), stiffness.z.sqrt());
    let scaled: Vec<(DVec3, f64)> = rows.iter().map(|(n, b)| (*n / root, *b)).collect();
    let step = match scaled[..] {
        [(n, b)] => n * b / n.length_squared(),
        [(n, a), (m, b)] => {
            let line = n.cross(m);
            (a * m.cross(line) + b * line.cross(n)) / line.length_squared()
        }
        [(n, a), (m, b), (l, c)] => (a * m.cross(l) + b * l.cross(n) + c * n.cross(m)) / n.dot(m.cross(l)),
        _ => return None,
    };
    step.is_finite().then(|| target + step / root)
}

#[test]
fn active_set_is_exact() {
    let mut random = Random(7);
    let mut held = 0;
    for _ in 0..60 {
        let pairs = planes(&mut random, 14);
        let stiffness = DVec3::new(400.0, 400.0 + 800.0 * random.unit(), 900.0);
        let target = DVec3::new(random.unit(), -random.unit(), random.unit()) * 0.01;
        let solution = ActiveSet::default().solve(&pairs, stiffness, target);
        let expected = by_trial(&pairs, stiffness, target).expect("a place");
        assert!(solution.is_feasible && solution.position.distance(expected) < 1e-9, "{solution:?} {expected}");
        held += u32::from(expected != target);
        let projected = Multipliers::default().solve(&pairs, stiffness, target);
        let apart = projected.position.distance(expected);
        assert!(apart < 1e-4 || !projected.is_feasible, "{apart}, {projected:?}");
    }
    assert!(held > 40, "{held} targets are held off");
}

/// Planes that leave no place outside all of them are told.
#[test]
fn conflicts_are_told() {
    let mut pairs = Pairs::default();
    for (id, normal) in [(0, DVec3::Y), (1, DVec3::NEG_Y)] {
        pairs.push(id, Constraint { normal, offset: 1e-3 });
    }
    assert!(!ActiveSet::default().solve(&pairs, DVec3::ONE, DVec3::ZERO).is_feasible);
}

/// Eq. 7 over all pairs there are.
fn least_gap(tool: &ToolSpheres, x: DVec3, near: &[NearParticle]) -> f64 {
    let gaps = tool.spheres().iter().flat_map(|sphere| {
        let gap = move |p: &NearParticle| {
            let place = glam::Vec3::from_array(p.position).as_dvec3();
            (x + sphere.centre).distance(place) - sphere.radius - f64::from(p.radius)
        };
        near.iter().map(gap)
    });
    gaps.fold(f64::INFINITY, f64::min)
}

/// What a drag through a bed of spheres comes to: every place, the most pivots or sweeps, the least gap.
fn drag(solver: Solver, stiffness: f64) -> (Vec<DVec3>, u32, f64) {
    let (bed, tool) = (Bed::new(7), square_tool(5, 1.5e-3, Bed::RADIUS));
    let mut proxy = Proxy::at(bed.above(&tool));
    let (mut iterations, mut gap) = (0, f64::INFINITY);
    let places = (0..200).map(|tick| {
        let target = bed.drag(tick, 6e-3);
        let near: Vec<NearParticle> = bed.near(proxy.position);
        let about = Surroundings { tool: &tool, rotation: DQuat::IDENTITY, near: &near, outwards: DVec3::Y };
        let step = proxy.advance(target, DVec3::splat(stiffness), &about, solver);
        iterations = iterations.max(step.iterations);
        gap = gap.min(least_gap(&tool, proxy.position, &near));
        proxy.position
    });
    (places.collect(), iterations, gap)
}

#[test]
fn proxy_stays_outside_and_is_found_in_few_pivots() {
    let (places, pivots, gap) = drag(Solver::ActiveSet, 500.0);
    assert!(gap >= -1e-6, "{gap}");
    assert!((3..=12).contains(&pivots), "{pivots}");
    assert!(places.iter().all(|x| x.y > -1e-4), "the proxy is on the bed");
    let (_, sweeps, gap) = drag(Solver::Projected, 500.0);
    assert!(gap >= -2e-6 && sweeps > pivots, "{gap}, {sweeps}");
}

/// A scalar in K does not change where the least of Eq. 6 is: by powers of two, not in a bit.
#[test]
fn proxy_does_not_depend_on_the_scale_of_the_stiffness() {
    for solver in [Solver::ActiveSet, Solver::Projected] {
        let (places, ..) = drag(solver, 500.0);
        for scale in [0.125, 2.0, 1024.0] {
            assert!(drag(solver, 500.0 * scale).0 == places, "{solver:?}, {scale}");
        }
    }
}

/// Clay that closes in on the proxy is left; where it cannot be, that is told, and the next frame frees it.
#[test]
fn caught_proxy_is_told_and_gets_out() {
    let tool = square_tool(1, 1e-3, 1.2e-3);
    let particle = |id, x: f32| NearParticle { id, position: [x, 0.0, 0.0], radius: 0.6e-3 };
    let mut proxy = Proxy::at(DVec3::ZERO);
    let mut advance = |near: &[NearParticle]| {
        let about = Surroundings { tool: &tool, rotation: DQuat::IDENTITY, near, outwards: DVec3::ZERO };
        proxy.advance(DVec3::ZERO, DVec3::splat(500.0), &about, Solver::ActiveSet)
    };
    let step = advance(&[particle(1, 1.7e-3)]);
    assert!(!step.is_caught && step.is_held && step.gap > -1e-9, "{step:?}");
    // Two balls that leave no room between them: it is pushed out upwards.
    let pair = [particle(1, -0.9e-3), particle(2, 0.9e-3)];
    assert!((0..20).map(|_| advance(&pair)).last().is_some_and(|step| step.gap >= -CAUGHT));
    // Two walls of them, without an end: told.
    let mut proxy = Proxy::at(DVec3::ZERO);
    let walls: Vec<NearParticle> = (0..200)
        .map(|id| NearParticle {
            id,
            position: [[-0.9e-3, 0.9e-3][id as usize % 2], 0.5e-3 * (id / 2) as f32, 0.0],
            radius: 0.6e-3,
        })
        .collect();
    let about = Surroundings { tool: &tool, rotation: DQuat::IDENTITY, near: &walls, outwards: DVec3::ZERO };
    let step = proxy.advance(DVec3::ZERO, DVec3::splat(500.0), &about, Solver::ActiveSet);
    assert!(step.is_caught && step.gap < -1e-4, "{step:?}");
}
