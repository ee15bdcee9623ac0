//! The numbers of the implicit step that its judge and engines share.

use glam::{DMat3, DVec3};

/// Mass [full cells] below which a field is no unknown: of so little rounding alone is left. What is heavier
/// must be one, however light: the preconditioner moves it, and a slope that does not see the forces there
/// takes steps up for steps down. With 1e-2 in its place crumbs at rest flew off at a metre a second, and a
/// ball's force with fifteen passes was off by 11 %, not 3.
pub(super) const ACTIVE_MASS: f64 = 1e-6;

/// Mass [full cells] of a field below which its way says nothing of clay's: what is lighter drags no particle
/// along.
pub(super) const DRAGGING_MASS: f64 = 1e-2;

/// Least velocity along gravity, over what gravity adds to it in a step [-], of clay that falls: the first
/// guess lets it fall on. What rests stays: in fine steps of resting clay a guess that let it fall left ten
/// times the forces out of balance that there were.
pub(super) const GUESS_FALL_MIN: f64 = 0.5;

/// Way of a node in the first guess \[cells\], at most.
pub(super) const GUESS_WAY_MAX: f64 = 0.7;

/// Least determinants of `I - H / 2` and of Cayley's turn at which no cell counts as turned inside out.
pub(super) const DETERMINANT_MIN: f64 = 0.05;

/// Way \[cells\] between the sides of a cut up to which they touch: what rounding to f32 leaves of none.
/// Over a cell of the clay it is the force below which a reaction counts as none.
pub(super) const CLOSED_GAP: f64 = 1e-6;

/// Share of a spring's stiffness that nodes take of it in the preconditioner, beside their weights [-]: their
/// own part of it is the square of the weight, and of a motion in common all of it.
pub(super) const CONTACT_SHARE: f64 = 0.5;

/// Pairs of step and change of slope that L-BFGS keeps: over five strokes with twelve passes two left 3 to
/// 7 % more error of the ways than four; three need less memory.
pub(super) const PAIRS: usize = 3;

/// How much of the sharing of volumes within cells is part of what is minimised [-]; all of it is done at the
/// step's end. The force of a ball, however many passes there were, was 5.5 % low with all of it within, 4.4
/// with .7, 3.2 with half, 2.5 with .3, where a strip's ways were off by 2.3 % (1.0 with half, 1.3 with .7);
/// none locks.
pub(super) const SHARED_WITHIN: f64 = 0.6;

/// Least cosine of a pair's step and change of slope: what is less curved tells nothing but rounding.
pub(super) const CURVATURE_MIN: f64 = 1e-6;

/// How much of a rejected step is tried next [-], at least and at most; of one that turned a cell inside out
/// the mean.
pub(super) const CUT: [f64; 2] = [0.1, 0.5];

/// Unknowns of a level of the preconditioner that is solved exactly, at most, unless no coarser one is
/// smaller: nodes that are free along some axis.
pub(super) const DIRECT_MAX: usize = 150;

/// Levels of the preconditioner, at most: the coarsest has cells of 512.
pub(super) const LEVELS_MAX: usize = 10;

/// What multiplies a cycle of the preconditioner [-]: too long a step is rejected where too short a one is
/// only slow.
pub(super) const CYCLE_SCALE: f64 = 0.85;

/// What multiplies the correction from a coarser level [-]. With 1 in its place ways were off by 5 to 20 %
/// more; perhaps since coarse cells that are full in part are softer than what stands in them.
pub(super) const COARSE_SCALE: f64 = 0.8;

/// Least pivot of the exact solution, of the diagonal [-]: rounding alone can leave one that is not positive
/// where clay floats freely.
pub(super) const PIVOT_MIN: f64 = 1e-12;

/// What multiplies `r / diagonal` where the preconditioner smooths: 1.8 over the elements' own bound of the
/// greatest eigenvalue of `diagonal^-1 A`, whatever the fill. 2 was as good, 2.2 worse, with 2.4 strokes
/// failed.
pub(super) fn smoothing(mu: f64, lambda: f64) -> f64 {
    1.8 * (lambda + 4.0 * mu) / (4.5 * (lambda + 2.0 * mu))
}

/// Part of the splines' diagonal that bears a node's motion where it is relaxed once more for the force on
/// tools [-]: of smooth motions their stiffness is less than the diagonal. Mean error of the force over five
/// strokes at fifteen passes, with each axis relaxed for itself: 3.4 %, without 6.1; in steps half as long
/// 1.7, without 1.4. Along the springs together plasticine's is 3.5 % with 0.5, and was higher with less.
pub(super) const RELAXED_STIFFNESS: f64 = 0.5;

/// Where a node with forces `residual` out of balance goes that springs of this stiffness bear, and clay of
/// this diagonal: what the springs would take of these forces moves it, along the springs alone.
pub(super) fn relaxed(springs: DMat3, clay: DVec3, residual: DVec3) -> DVec3 {
    let back = (springs + DMat3::from_diagonal(clay)).inverse();
    -(back * (springs * (back * residual)))
}

/// Travel of clay in a frame of implicit steps \[cells\] below which it stands: .001 cells a second.
pub(super) const STANDING_TRAVEL: f64 = 1e-5;

/// Forces out of balance over those that clay bears [-], below which it stands.
pub(super) const STANDING_RESIDUAL: f64 = 1e-2;
