//! The exact solution of Eq. 6 in tangent planes, by a dual active set (Goldfarb and Idnani 1983) for three
//! unknowns.
//!
//! At most three planes hold a point in space. The one that is most violated comes in; with the (at most
//! three) that held the place until then it makes a problem of four planes, whose solution is held by the new
//! one and at most two of the others: seven sets to try. The distance to the target grows with each, so that
//! none comes twice.

use super::pairs::{Constraint, Pairs};
use super::solution::{FEASIBLE, Solution};
use glam::DVec3;

/// Planes taken in before the search ends without an answer. Warm searches take at most 12.
pub const PIVOT_MAX: u32 = 48;

/// Planes whose normals are closer than the square root of this \[rad\] hold no line between them.
const PARALLEL: f64 = 1e-13;

/// Multipliers down to this part of the largest, below zero, are zero and rounding.
const SIGN: f64 = 1e-11;

/// The planes that hold the proxy, by name: where the next search begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ActiveSet {
    ids: [u64; 3],
    count: usize,
}

/// Planes that hold a place, by where they stand in the list of pairs.
#[derive(Clone, Copy)]
struct Held {
    planes: [usize; 3],
    count: usize,
    position: DVec3,
}

impl ActiveSet {
    /// The names of the planes.
    pub fn ids(&self) -> &[u64] {
        &self.ids[..self.count]
    }

    /// The place nearest to `target` by a diagonal stiffness `stiffness` that is outside all planes. Scaling
    /// the stiffness by a power of two changes no bit of it.
    pub fn solve(&mut self, pairs: &Pairs, stiffness: DVec3, target: DVec3) -> Solution {
        let (planes, weight) = (pairs.constraints(), stiffness.recip());
        let mut held = self.warm(pairs, weight, target);
        let mut iterations = 0;
        let is_feasible = loop {
            let Some(worst) = worst(planes, held.position) else { break true };
            iterations += 1;
            let next = if iterations > PIVOT_MAX { None } else { take_in(planes, weight, target, &held, worst) };
            let Some(next) = next else { break false };
            held = next;
        };
        self.count = held.count;
        for (id, plane) in self.ids.iter_mut().zip(&held.planes[..held.count]) {
            *id = pairs.ids()[*plane];
        }
        Solution { position: held.position, iterations, is_feasible }
    }

    /// What still holds of the planes of the last search; nothing if one of them would have to pull.
    fn warm(&self, pairs: &Pairs, weight: DVec3, target: DVec3) -> Held {
        let mut held = Held { planes: [0; 3], count: 0, position: target };
        for id in self.ids() {
            if let Some(plane) = pairs.find(*id, 0) {
                held.planes[held.count] = plane;
                held.count += 1;
            }
        }
        match hold(pairs.constraints(), weight, target, &held.planes[..held.count]) {
            Some(position) => Held { position, ..held },
            None => Held { count: 0, ..held },
        }
    }
}

/// The plane that the place is deepest within, if any.
fn worst(planes: &[Constraint], x: DVec3) -> Option<usize> {
    let mut least = (-FEASIBLE, None);
    for (index, plane) in planes.iter().enumerate() {
        let gap = plane.gap(x);
        if gap < least.0 {
            least = (gap, Some(index));
        }
    }
    least.1
}

/// The solution for the planes that held the place and one more, which holds it now.
fn take_in(planes: &[Constraint], weight: DVec3, target: DVec3, held: &Held, new: usize) -> Option<Held> {
    let old = &held.planes[..held.count];
    if old.contains(&new) {
        return None;
    }
    let mut best: Option<(f64, Held)> = None;
    // Beside the new one two at most: three planes hold a place.
    for mask in (0..1u32 << old.len()).filter(|mask| mask.count_ones() < 3) {
        let mut next = Held { planes: [new; 3], count: 1, position: target };
        for (_, plane) in old.iter().enumerate().filter(|(bit, _)| mask >> bit & 1 == 1) {
            next.planes[next.count] = *plane;
            next.count += 1;
        }
        let Some(position) = hold(planes, weight, target, &next.planes[..next.count]) else { continue };
        next.position = position;
        let gap = old.iter().chain([&new]).fold(f64::INFINITY, |least, plane| least.min(planes[*plane].gap(position)));
        if best.as_ref().is_none_or(|(least, _)| gap > *least) {
            best = Some((gap, next));
        }
    }
    best.filter(|(gap, _)| *gap >= -FEASIBLE).map(|(_, next)| next)
}

/// The place nearest to `target` on all of these planes; none where one of them would have to pull, or where
/// they are parallel.
fn hold(planes: &[Constraint], weight: DVec3, target: DVec3, held: &[usize]) -> Option<DVec3> {
    // N W N' multipliers = offsets - N target, with W the inverse of the stiffness.
    let count = held.len();
    let mut rows = [[0.0; 4]; 3];
    for (i, plane) in held.iter().map(|plane| &planes[*plane]).enumerate() {
        let weighted = weight * plane.normal;
        for (j, other) in held.iter().enumerate() {
            rows[i][j] = weighted.dot(planes[*other].normal);
        }
        rows[i][3] = -plane.gap(target);
    }
    let scale = [rows[0][0], rows[1][1], rows[2][2]];
    for i in 0..count {
        // Symmetric and positive: the diagonal is the pivot.
        if rows[i][i] <= PARALLEL * scale[i] {
            return None;
        }
        for r in i + 1..count {
            let factor = rows[r][i] / rows[i][i];
            for c in i..4 {
                rows[r][c] -= factor * rows[i][c];
            }
        }
    }
    let mut multipliers = [0.0; 3];
    for i in (0..count).rev() {
        let rest: f64 = (i + 1..count).map(|j| rows[i][j] * multipliers[j]).sum();
        multipliers[i] = (rows[i][3] - rest) / rows[i][i];
    }
    let greatest = multipliers.iter().fold(0.0f64, |greatest, m| greatest.max(m.abs()));
    let mut position = target;
    for (plane, multiplier) in held.iter().zip(multipliers) {
        if multiplier < -SIGN * greatest {
            return None;
        }
        position += weight * planes[*plane].normal * multiplier;
    }
    Some(position)
}
