//! The least of the potential: L-BFGS with two pairs (Nocedal & Wright 2006, algorithm 7.4) about the V-cycle
//! in place of a first inverse, at full steps.
//!
//! Each evaluation of the slope is a pass over the particles; there are as many as the plan says, and no
//! energies: along a step s from slope g to slope g' the potential changes by `(g + g') . s / 2` up to third
//! order, so a step that would raise it is one with `g' . s > -g . s`. It is then cut to where the slopes'
//! line crosses 0, and tried again. What was last accepted is the answer.

use super::super::super::implicit::{CURVATURE_MIN, CUT, PAIRS};
use super::multigrid::Multigrid;
use super::residual::{Slope, System, dot};
use glam::DVec3;

/// What came of the iterations.
pub(super) struct Least {
    /// Displacements \[m\].
    pub(super) u: Vec<DVec3>,
    pub(super) slope: Slope,
    /// Evaluations of the slope.
    pub(super) passes: u32,
    /// Steps cut.
    pub(super) rejected: u32,
}

/// Goes down from `guess` with at most `passes` evaluations.
pub(super) fn minimise(system: &System<'_>, cycle: &Multigrid, guess: Vec<DVec3>, passes: u32) -> Least {
    let slope = system.slope(&guess);
    let mut least = Least { u: guess, slope, passes: 1, rejected: 0 };
    if !least.slope.is_sound {
        // Nothing is as good a start where motion as it was turns a cell inside out.
        let still: Vec<DVec3> = least.u.iter().zip(&system.unknowns.all).map(|(u, unknown)| *u * (1.0 - unknown.free)).collect();
        least.slope = system.slope(&still);
        (least.u, least.passes) = (still, 2);
    }
    let mut pairs: Vec<[Vec<DVec3>; 2]> = vec![];
    while least.passes < passes {
        let residual = &least.slope.residual;
        let mut step = direction(&pairs, cycle, residual);
        if dot(&step, residual) >= 0.0 {
            pairs.clear();
            step = direction(&pairs, cycle, residual);
        }
        let Some((slope, step)) = descend(system, &mut least, step, passes) else { break };
        let change: Vec<DVec3> = slope.residual.iter().zip(&least.slope.residual).map(|(new, old)| *new - *old).collect();
        least.u.iter_mut().zip(&step).for_each(|(u, step)| *u += *step);
        least.slope = slope;
        if dot(&step, &change) > CURVATURE_MIN * (dot(&step, &step) * dot(&change, &change)).sqrt() {
            pairs.push([step, change]);
            if pairs.len() > PAIRS {
                pairs.remove(0);
            }
        }
    }
    least
}

/// The slope after the step, and the step, cut until the potential falls; none when the passes are used up.
fn descend(system: &System<'_>, least: &mut Least, mut step: Vec<DVec3>, passes: u32) -> Option<(Slope, Vec<DVec3>)> {
    while least.passes < passes {
        let there: Vec<DVec3> = least.u.iter().zip(&step).map(|(u, step)| *u + *step).collect();
        let slope = system.slope(&there);
        least.passes += 1;
        let (before, after) = (dot(&step, &least.slope.residual), dot(&step, &slope.residual));
        if slope.is_sound && after <= -before {
            return Some((slope, step));
        }
        least.rejected += 1;
        let cut = if slope.is_sound { (before / (before - after)).clamp(CUT[0], CUT[1]) } else { 0.5 * (CUT[0] + CUT[1]) };
        step.iter_mut().for_each(|step| *step *= cut);
    }
    None
}

/// Minus the approximate inverse of the curvature, times the residual.
fn direction(pairs: &[[Vec<DVec3>; 2]], cycle: &Multigrid, residual: &[DVec3]) -> Vec<DVec3> {
    let mut q = residual.to_vec();
    let mut shares = vec![];
    for [step, change] in pairs.iter().rev() {
        let share = dot(step, &q) / dot(step, change);
        q.iter_mut().zip(change).for_each(|(q, change)| *q -= share * *change);
        shares.push(share);
    }
    let mut z = cycle.cycle(&q);
    for ([step, change], share) in pairs.iter().zip(shares.iter().rev()) {
        let other = dot(change, &z) / dot(step, change);
        z.iter_mut().zip(step).for_each(|(z, step)| *z += (share - other) * *step);
    }
    z.iter_mut().for_each(|z| *z = -*z);
    z
}
