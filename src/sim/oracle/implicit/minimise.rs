//! The least of the potential: L-BFGS with a few pairs (Nocedal & Wright 2006, algorithm 7.4) about the
//! V-cycle in place of a first inverse, at full steps.
//!
//! Each evaluation of the slope is a pass over the particles; there are as many as the plan says, and no
//! energies: along a step s from slope g to slope g' the potential changes by `(g + g') . s / 2` up to third
//! order, so a step that would raise it is one with `g' . s > -g . s`. It is then cut to where the slopes'
//! line crosses 0, and tried again. Where that is less than the least cut, the pairs are of other clay than
//! there is (that flowed, and now springs back: a step of 4 cells where .01 was right), and are forgotten; a
//! step without pairs met what the cycle did not know (clay a hair above a floor, which gravity takes four
//! cells further), and the cycle is made anew where the cut step leads. A step along which the slope hardly
//! changes goes on, longer, at most half of the way to where one was rejected, and makes no pair. None of
//! this in cut clay, whose sides close and open meanwhile.
//! What was last accepted is the answer; where it is lost still, judged by the forces at the last evaluation,
//! there are as many passes again.
//!
//! Clay goes on as it moved, or it stands still: the guess is the lower of both. The second is tried where
//! the first leads up by more than its inertia `sum m_i |u_i|^2 / h^2`, which is all that drives clay that
//! was in balance. So a tool that stops is not left behind.
//!
//! The sides of kept cuts bound where it may go ([`pairs`](super::pairs)): each place is made a possible one,
//! and what closed pairs hold is searched no further.

use super::super::super::implicit::{CURVATURE_MIN, CUT, OVERTIME, PAIRS, RESIDUAL_LOST, longer};
use super::multigrid::Multigrid;
use super::pairs::Pairs;
use super::residual::{Slope, System, dot};
use glam::DVec3;

/// What came of the iterations.
pub(super) struct Least {
    /// Displacements \[m\].
    pub(super) u: Vec<DVec3>,
    pub(super) slope: Slope,
    /// The forces that R is judged by \[N\], of the last evaluation.
    scale: f64,
    /// Evaluations of the slope.
    pub(super) passes: u32,
    /// Steps cut.
    pub(super) rejected: u32,
}

/// The preconditioner, and how it is made with the contacts at some displacements.
struct Cycle<'a> {
    now: Multigrid,
    at: &'a dyn Fn(&[DVec3]) -> Multigrid,
}

/// Goes down from `guess`, which is a possible one, with at most `passes` evaluations, [`OVERTIME`] times as
/// many where they leave it lost.
pub(super) fn minimise(system: &System<'_>, cycle_at: &dyn Fn(&[DVec3]) -> Multigrid, guess: Vec<DVec3>, passes: u32) -> Least {
    let mut cycle = Cycle { now: cycle_at(&guess), at: cycle_at };
    let mut pairs = system.pairs.clone();
    let slope = system.slope(&guess);
    let mut least = Least { u: guess, slope, scale: f64::INFINITY, passes: 1, rejected: 0 };
    if !least.slope.is_sound {
        // Nothing is as good a start where motion as it was turns a cell inside out.
        let mut still: Vec<DVec3> =
            least.u.iter().zip(&system.unknowns.all).map(|(u, unknown)| *u * (1.0 - unknown.free)).collect();
        pairs.begin(&mut still);
        least.slope = system.slope(&still);
        (least.u, least.passes) = (still, 2);
    }
    pairs.settle(&least.u, &least.slope.residual);
    let mut known: Vec<[Vec<DVec3>; 2]> = vec![];
    if least.passes == 1 && passes > 1 {
        known.extend(try_still(system, &mut pairs, &mut least));
    }
    go_down(system, &mut cycle, &mut pairs, &mut known, &mut least, passes);
    let residual = searched(&pairs, &least.slope.residual);
    if dot(&residual, &residual).sqrt() > RESIDUAL_LOST * least.scale {
        go_down(system, &mut cycle, &mut pairs, &mut known, &mut least, OVERTIME * passes);
    }
    least.slope.residual = searched(&pairs, &least.slope.residual);
    least
}

/// Steps until there were `passes` evaluations.
fn go_down(
    system: &System<'_>,
    cycle: &mut Cycle<'_>,
    pairs: &mut Pairs,
    known: &mut Vec<[Vec<DVec3>; 2]>,
    least: &mut Least,
    passes: u32,
) {
    while least.passes < passes {
        let residual = searched(pairs, &least.slope.residual);
        let mut step = direction(known, &cycle.now, pairs, &residual);
        if dot(&step, &residual) >= 0.0 {
            known.clear();
            step = direction(known, &cycle.now, pairs, &residual);
        }
        let Some((slope, u)) = descend(system, cycle, pairs, least, step, (passes, !known.is_empty())) else {
            known.clear();
            continue;
        };
        let step = difference(&u, &least.u);
        let change = difference(&slope.residual, &least.slope.residual);
        (least.u, least.slope) = (u, slope);
        pairs.settle(&least.u, &least.slope.residual);
        known.extend(searched_pair(pairs, step, change));
        if known.len() > PAIRS {
            known.remove(0);
        }
    }
}

/// The step and the change of the slope, of what is searched, if they tell of the curvature.
fn searched_pair(pairs: &Pairs, step: Vec<DVec3>, change: Vec<DVec3>) -> Option<[Vec<DVec3>; 2]> {
    let (step, change) = (pairs.along(step), pairs.without_reactions(change));
    let is_curved = dot(&step, &change) > CURVATURE_MIN * (dot(&step, &step) * dot(&change, &change)).sqrt();
    is_curved.then_some([step, change])
}

/// Goes back to where the clay stands still, if it is lower there; the step and the change of the slope, if
/// they tell of the curvature.
fn try_still(system: &System<'_>, pairs: &mut Pairs, least: &mut Least) -> Option<[Vec<DVec3>; 2]> {
    let step: Vec<DVec3> = system.unknowns.masked(least.u.iter().map(|u| -*u).collect());
    let back = dot(&step, &least.slope.residual);
    if -back <= system.inertia(&step) {
        return None;
    }
    let still: Vec<DVec3> = least.u.iter().zip(&step).map(|(u, step)| *u + *step).collect();
    let slope = system.slope(&still);
    (least.passes, least.scale) = (least.passes + 1, slope.scale);
    let change = difference(&slope.residual, &least.slope.residual);
    let is_sound = slope.is_sound;
    if is_sound && dot(&step, &slope.residual) <= -back {
        (least.u, least.slope) = (still, slope);
        pairs.settle(&least.u, &least.slope.residual);
    }
    if is_sound { searched_pair(pairs, step, change) } else { None }
}

fn difference(a: &[DVec3], b: &[DVec3]) -> Vec<DVec3> {
    a.iter().zip(b).map(|(a, b)| *a - *b).collect()
}

/// The slope with the friction of cuts, along what is searched.
fn searched(pairs: &Pairs, slope: &[DVec3]) -> Vec<DVec3> {
    let mut slope = slope.to_vec();
    pairs.rub(&mut slope);
    pairs.without_reactions(slope)
}

/// The slope after the step, and where that leads: on while the slope hardly changes, which `least` takes
/// meanwhile, or cut until the potential falls; none when the passes are used up, or where pairs have led too
/// far.
fn descend(
    system: &System<'_>,
    cycle: &mut Cycle<'_>,
    pairs: &Pairs,
    least: &mut Least,
    mut step: Vec<DVec3>,
    (passes, has_pairs): (u32, bool),
) -> Option<(Slope, Vec<DVec3>)> {
    let mut start = least.slope.residual.clone();
    pairs.rub(&mut start);
    // How many times as far as the step the last led that was rejected.
    let (mut is_anew, mut beyond) = (false, f64::INFINITY);
    while least.passes < passes {
        let mut there: Vec<DVec3> = least.u.iter().zip(&step).map(|(u, step)| *u + *step).collect();
        pairs.close(&mut there);
        let slope = system.slope(&there);
        (least.passes, least.scale) = (least.passes + 1, slope.scale);
        if is_anew && least.passes < passes {
            cycle.now = (cycle.at)(&there);
        }
        let way = difference(&there, &least.u);
        let mut end = slope.residual.clone();
        pairs.rub(&mut end);
        let (before, after) = (dot(&way, &start), dot(&way, &end));
        if slope.is_sound && after <= -before {
            let by = longer([before, after], beyond).filter(|_| pairs.is_empty() && least.passes < passes);
            let Some(by) = by else { return Some((slope, there)) };
            (least.u, least.slope, start) = (there, slope, end);
            (is_anew, beyond) = (false, (beyond - 1.0) / by);
            step.iter_mut().for_each(|step| *step *= by);
            continue;
        }
        least.rejected += 1;
        let short = if slope.is_sound { before / (before - after) } else { 0.5 * (CUT[0] + CUT[1]) };
        let is_lost = short < CUT[0] && pairs.is_empty();
        if is_lost && (is_anew || has_pairs) {
            return None;
        }
        is_anew = is_lost;
        let cut = short.clamp(CUT[0], CUT[1]);
        step.iter_mut().for_each(|step| *step *= cut);
        beyond = 1.0 / cut;
    }
    None
}

/// Minus the approximate inverse of the curvature, times the residual, along what is searched.
fn direction(known: &[[Vec<DVec3>; 2]], cycle: &Multigrid, pairs: &Pairs, residual: &[DVec3]) -> Vec<DVec3> {
    let mut q = residual.to_vec();
    let mut shares = vec![];
    for [step, change] in known.iter().rev() {
        let share = dot(step, &q) / dot(step, change);
        q.iter_mut().zip(change).for_each(|(q, change)| *q -= share * *change);
        shares.push(share);
    }
    let mut z = pairs.along(cycle.cycle(&pairs.without_reactions(q)));
    for ([step, change], share) in known.iter().zip(shares.iter().rev()) {
        let other = dot(change, &z) / dot(step, change);
        z.iter_mut().zip(step).for_each(|(z, step)| *z += (share - other) * *step);
    }
    z = pairs.along(z);
    z.iter_mut().for_each(|z| *z = -*z);
    z
}
