//! What each node finds by itself of the sides of cuts, and the bodies, that meet there: how they face each
//! other. The definition is that of [`facing`](super::super::facing).

use super::super::facing::definition::{Terms, facing};
use super::super::facing::{Between, DISPLACEMENT, TERMS};
use super::grid::Grid;
use glam::{DVec3, IVec3};

/// What each node finds of the sides that meet there.
pub(super) fn find_faces(grid: &mut Grid) {
    let of_node = |(index, coordinate): (usize, IVec3)| {
        let node = &grid.nodes[index].folded;
        let found = |between: Between| {
            let masses = |at: IVec3| grid.get(at).map_or([0.0; 2], |n| n.folded.masses(between));
            let own = node.masses(between);
            if own.contains(&0.0) {
                return None;
            }
            let total = |at: IVec3| masses(at).iter().sum::<f64>();
            let told = |o: IVec3| {
                let at = coordinate + o;
                tell(o.as_dvec3(), masses(at), || IVec3::AXES.map(|axis| [at - axis, at + axis].map(total)))
            };
            Some((between, facing(&sum(told), DVec3::ZERO)?.weighted(own)))
        };
        Between::all(node.iter().map(|(key, _)| key)).into_iter().filter_map(found).collect()
    };
    let found: Vec<Vec<_>> = grid.coordinates().enumerate().map(of_node).collect();
    grid.nodes.iter_mut().zip(found).for_each(|(node, found)| node.found = found);
}

/// From a node to the 27 nodes about it.
pub(super) fn offsets() -> impl Iterator<Item = IVec3> {
    (0..27).map(|i| IVec3::new(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1))
}

/// Sum of what the 27 nodes about one tell, each by 1/2 for every axis along which it is off.
fn sum(told: impl Fn(IVec3) -> Terms) -> Terms {
    let mut sum = [0.0; TERMS];
    for offset in offsets() {
        let near = 1.0 / f64::from(1 << offset.abs().element_sum());
        sum.iter_mut().zip(told(offset).0).for_each(|(sum, term)| *sum += near * term);
    }
    Terms(sum)
}

/// What the node at `place` tells, by its masses in front and behind, and by those of both that are at the
/// nodes before and after it along each axis.
fn tell(place: DVec3, [front, back]: [f64; 2], beside: impl FnOnce() -> [[f64; 2]; 3]) -> Terms {
    let DVec3 { x, y, z } = place;
    let mut terms = [0.0; TERMS];
    terms[..4].copy_from_slice(&[front * x, front * y, front * z, front]);
    terms[4..8].copy_from_slice(&[back * x, back * y, back * z, back]);
    if front.min(back) > 0.0 {
        let middle = beside().map(|[before, after]| displacement(before, front + back, after));
        let p = place + DVec3::from_array(middle);
        let (share, w) = ((front / back).ln(), front * back / (front + back));
        let (wp, slope) = (w * p, w * share * p);
        terms[8..16].copy_from_slice(&[w, w * share, wp.x, wp.y, wp.z, slope.x, slope.y, slope.z]);
        terms[16..].copy_from_slice(&[wp.x * p.x, wp.y * p.y, wp.z * p.z, wp.x * p.y, wp.y * p.z, wp.z * p.x]);
    }
    Terms(terms)
}

/// How far along an axis \[cells\] the middle of the clay that has come to a node is off it
/// ([`DISPLACEMENT`]).
fn displacement(before: f64, here: f64, after: f64) -> f64 {
    let sum = before + 2.0 * here + after;
    if sum <= 0.0 {
        return 0.0;
    }
    let c = (after - before) / sum;
    let a = c.abs();
    c * a * DISPLACEMENT.iter().fold(0.0, |sum, coefficient| sum * a + coefficient)
}

#[cfg(test)]
mod tests {
    use super::super::super::facing::Facing;
    use super::*;

    fn facing_of(masses: impl Fn(IVec3) -> [f64; 2]) -> Option<Facing> {
        facing_by(&masses, |o| IVec3::AXES.map(|axis| [o - axis, o + axis].map(|n| masses(n).iter().sum())))
    }

    /// That of the node in the origin, by what is said to be beside each.
    fn facing_by(masses: impl Fn(IVec3) -> [f64; 2], beside: impl Fn(IVec3) -> [[f64; 2]; 3]) -> Option<Facing> {
        facing(&sum(|o| tell(o.as_dvec3(), masses(o), || beside(o))), DVec3::ZERO)
    }

    /// Share of a node's spline on the low side of a plane `d` cells above it.
    fn within(d: f64) -> f64 {
        match d.clamp(-1.5, 1.5) {
            d if d < -0.5 => (1.5 + d).powi(3) / 6.0,
            d if d > 0.5 => 1.0 - (1.5 - d).powi(3) / 6.0,
            d => 0.5 + 0.75 * d - d.powi(3) / 3.0,
        }
    }

    /// Masses whose ratio grows along a direction have that normal, whatever their sum; one node alone, or
    /// one side alone, has none.
    #[test]
    fn normal_is_that_of_the_ratio() {
        let n = DVec3::new(1.0, -0.3, 0.2).normalize();
        let masses = |o: IVec3| {
            let back = 1.0 / (1.0 + (1.7 * n.dot(o.as_dvec3())).exp());
            [2.0 * (1.0 - back), 2.0 * back]
        };
        let found = facing_of(masses).expect("a normal").normal;
        assert!(found.angle_between(n) < 2e-3, "{found}");
        let alone = |o: IVec3| if o == IVec3::ZERO { [1.0; 2] } else { [0.0; 2] };
        assert_eq!(facing_of(alone), None);
        assert_eq!(facing_of(|_| [1.0, 0.0]), None);
    }

    /// A cut that opens has both sides at the nodes of one plane alone, with shares alike but for rounding:
    /// it faces where the rest of its sides are.
    #[test]
    fn opening_cut_faces_its_sides() {
        let masses = |o: IVec3| match o.x {
            ..=-1 => [0.0, 1.0],
            0 => [0.1 * (1.0 + 1e-7 * f64::from(3 * o.y - o.z)), 0.1],
            _ => [1.0, 0.0],
        };
        let found = facing_of(masses).expect("a normal").normal;
        assert!(found.angle_between(DVec3::X) < 1e-6, "{found}");
    }

    /// The gap between two half spaces of clay, wherever the plane stands between the nodes and however the
    /// clay ends beside them, is found to a few hundredths of a cell, and so is their mean.
    #[test]
    fn gap_is_that_between_the_faces() {
        for at in [-0.5, -0.3, 0.0, 0.17, 0.5] {
            for gap in [0.0, 0.1, 0.5, 1.0] {
                let beside = |o: IVec3| if o.y > 0 { 0.3 } else { 1.0 };
                let back = |o: IVec3| beside(o) * within(at - 0.5 * gap - f64::from(o.x));
                let front = |o: IVec3| beside(o) * within(f64::from(o.x) - at - 0.5 * gap);
                let found = facing_of(|o| [front(o), back(o)]).expect("two sides");
                assert!((found.gap - gap).abs() < 0.07, "{gap} at {at}: {}", found.gap);
                let twice = [found.weighted([1.0, 3.0]), Facing { gap: found.gap + 0.3, ..found }.weighted([0.5, 0.5])];
                let mean = Facing::mean(std::array::from_fn(|i| twice[0][i] + twice[1][i])).expect("a normal");
                // Masses of 0.75 and 0.25.
                assert!((mean.gap - found.gap - 0.075).abs() < 1e-12 && (mean.normal - found.normal).length() < 1e-12);
            }
        }
        assert_eq!(Facing::mean([0.0; 5]), None);
    }

    /// The middle of clay that ends in a plane is where the spline's own integral has it.
    #[test]
    fn displacement_is_that_of_the_clay() {
        // Clay beyond d along the axis.
        for d in [-2.0, -1.2, -0.7, -0.2, 0.0, 0.4, 0.8, 1.1] {
            let mass = |node: f64| within(node - d);
            let steps = 3000;
            let x = |i: i32| d.max(-1.5) + (1.5 - d.max(-1.5)) * (f64::from(i) + 0.5) / f64::from(steps);
            let spline = |x: f64| within(x + 5e-4) - within(x - 5e-4);
            let weights: f64 = (0..steps).map(|i| spline(x(i))).sum();
            let middle = (0..steps).map(|i| spline(x(i)) * x(i)).sum::<f64>() / weights;
            let found = displacement(mass(-1.0), mass(0.0), mass(1.0));
            assert!((found - middle).abs() < 0.035, "{d}: {found}, {middle}");
            assert!((displacement(mass(1.0), mass(0.0), mass(-1.0)) + found).abs() < 1e-12);
        }
        assert_eq!((displacement(0.0, 0.0, 0.0), displacement(1.0, 1.0, 1.0)), (0.0, 0.0));
    }

    /// Masses at nodes of clay a sixteenth of a cell apart, by the side on which a place is.
    fn known(side: impl Fn(DVec3) -> Option<usize>) -> impl Fn(IVec3) -> [f64; 2] {
        let place = |i: i32| (f64::from(i) + 0.5) / 16.0 - 1.5;
        let masses = |node: IVec3| {
            let mut masses = [0.0; 2];
            for at in (0..48 * 48 * 48).map(|i| DVec3::new(place(i / 2304), place(i / 48 % 48), place(i % 48))) {
                if let Some(side) = side(node.as_dvec3() + at) {
                    masses[side] += at.to_array().map(super::super::super::spline::spline).iter().product::<f64>();
                }
            }
            masses
        };
        let known: Vec<[f64; 2]> = (0..125).map(|i| masses(IVec3::new(i / 25, i / 5 % 5, i % 5) - 2)).collect();
        move |o| known[((o.x + 2) * 25 + (o.y + 2) * 5 + o.z + 2) as usize]
    }

    /// A closed cut is shut at any angle to the grid, and no more so at one than at another.
    #[test]
    fn closed_cut_is_shut_at_any_angle() {
        let gap = |n: DVec3| {
            let n = n.normalize();
            facing_of(known(|at| Some(usize::from(n.dot(at) < 0.0)))).expect("two sides").gap
        };
        for n in [DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::ONE, DVec3::new(2.0, 1.0, 0.3)] {
            let gap = gap(n);
            assert!((-0.06..0.0).contains(&gap), "{n}: {gap}");
        }
    }

    /// A plane that slopes through a block is found where the block ends, too.
    #[test]
    fn slope_is_known_at_the_rim() {
        let n = DVec3::new(0.4, 0.9, 0.2).normalize();
        let of = known(|at| (at.x < 0.2).then_some(usize::from(n.dot(at) < 0.0)));
        let found = facing_of(&of).expect("a normal").normal;
        let off = found.angle_between(n).to_degrees();
        assert!(off < 1.5, "{off}");
        let taken = facing_by(&of, |_| [[1.0; 2]; 3]).expect("a normal").normal;
        let off = taken.angle_between(n).to_degrees();
        assert!(off > 3.0, "where the middle of the clay is does not matter: {off}");
    }
}
