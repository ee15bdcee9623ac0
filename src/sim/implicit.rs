//! The numbers of the implicit step that its judge and engines share.

/// Mass [full cells] below which a field is no unknown. Forces on it fall as its weight, its stiffness as the
/// square of that, so that a step would fling it: with 1e-3 some runs blew up, 1e-1 costs 2 % of force.
pub(super) const ACTIVE_MASS: f64 = 1e-2;

/// Weight within a step that the first guess lets clay fall through [cells]: what rests is not thrown about
/// by more.
pub(super) const GUESS_FALL_MAX: f64 = 0.1;

/// Way of a node in the first guess \[cells\], at most.
pub(super) const GUESS_WAY_MAX: f64 = 0.7;

/// Least determinants of `I - H / 2` and of Cayley's turn at which no cell counts as turned inside out.
pub(super) const DETERMINANT_MIN: f64 = 0.05;

/// Share of a spring's stiffness that nodes take of it in the preconditioner, beside their weights [-]: their
/// own part of it is the square of the weight, and of a motion in common all of it.
pub(super) const CONTACT_SHARE: f64 = 0.5;

/// Pairs of step and change of slope that L-BFGS keeps.
pub(super) const PAIRS: usize = 2;

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

/// What multiplies a cycle of the preconditioner [-]: coarse cells that are full in part are stiffer than
/// they should be, and too long a step is rejected where too short a one is only slow.
pub(super) const CYCLE_SCALE: f64 = 0.85;

/// Least pivot of the exact solution, of the diagonal [-]: rounding alone can leave one that is not positive
/// where clay floats freely.
pub(super) const PIVOT_MIN: f64 = 1e-12;

/// What multiplies `r / diagonal` where the preconditioner smooths: 1.6 over the elements' own bound of the
/// greatest eigenvalue of `diagonal^-1 A`, whatever the fill.
pub(super) fn smoothing(mu: f64, lambda: f64) -> f64 {
    1.6 * (lambda + 4.0 * mu) / (4.5 * (lambda + 2.0 * mu))
}
