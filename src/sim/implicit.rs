//! The numbers of the implicit step that its judge and engines share.

use super::tool::Motion;
use glam::DVec3;

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
/// times the forces out of balance that there were. What a tool presses down comes as fast, and does not
/// fall: a board at 30 mm/s in steps of 5.6 ms left a hundred times what clay bears.
pub(super) const GUESS_FALL_MIN: f64 = 0.5;

/// Forces out of balance over those that clay bears [-] beyond which a step is no answer, and gets
/// [`OVERTIME`] times its passes. A held ball's bore .018 N of .52 after fifteen with a residual of 15, .52
/// after thirty; a board's that had slowed down was off by 31 % with one of 1.44. With 0.4, where the next
/// frame has more steps, half of a ball's at 100 mm/s took them, with 1 a strip's first; with 3 debris under
/// a ball was off by 95 %, not 20.
pub(super) const RESIDUAL_LOST: f64 = 1.2;

/// The acceleration whose forces are the least that those out of balance are judged by [m/s^2]: half of what
/// weighs on Earth. Without gravity clay at rest was judged by rounding: it had a residual of 1e4, twice the
/// passes and no rest.
pub(super) const IDLE_GRAVITY: f64 = 5.0;

/// How many times its passes a step has at most.
pub(super) const OVERTIME: u32 = 2;

/// Way of a node in the first guess \[cells\], at most.
pub(super) const GUESS_WAY_MAX: f64 = 0.7;

/// Least determinants of `I - H / 2` and of Cayley's turn at which no cell counts as turned inside out.
pub(super) const DETERMINANT_MIN: f64 = 0.05;

/// Way \[cells\] between the sides of a cut up to which they touch: what rounding to f32 leaves of none.
/// Over a cell of the clay it is the force below which a reaction counts as none.
pub(super) const CLOSED_GAP: f64 = 1e-6;

/// Way \[cells\] along a cut in a step from which on its sides slide; below they stick where they are. Fifteen
/// passes know no way better: with half of it one slope of four on which clay should have stayed gave way,
/// with twice or more clay slid too fast down a steeper one, or crept. In steps of 5 ms on cells of 2 mm it
/// is a creep of .08 mm/s.
pub(super) const SLIDING_WAY: f64 = 2e-4;

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

/// Slope at the end of a step over that at its start [-] from which on the step goes on: along it the
/// potential curved too little to tell where its least is. Clay that flowed and is let go curves 400 times as
/// much once it springs back; steps that stop before leave pairs that lead far beyond. Of boards that slowed
/// down from 30 and 50 mm/s to a tenth frames were off by up to 65 % without, by up to 6 with 0.7 to 0.8;
/// with 0.9 by 65 again, with 0.5, which lengthens ordinary steps too, by 39.
const FLAT: f64 = 0.75;

/// How many times longer it becomes, at most: with 14 to 50 those frames were the same, with 8 off by 31 %.
const LONGER_MAX: f64 = 16.0;

/// How much of the way to where a step was rejected it goes on [-]. A block let go .3 cells above a floor
/// left .04 of what it bears out of balance in its first step of 17 ms, 4 where nothing bounded the way.
const HALFWAY: f64 = 0.5;

/// How many times its length a step goes on along which the slope went from the first of these to the second,
/// if one that led `beyond` times as far was rejected. None where it has gone far enough.
pub(super) fn longer([old, new]: [f64; 2], beyond: f64) -> Option<f64> {
    let most = LONGER_MAX.min(HALFWAY * (beyond - 1.0));
    let by = if new <= old { most } else { (old / (old - new)).min(most) };
    (new < FLAT * old && by > HALFWAY).then_some(by)
}

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

/// Way in a step \[cells\] from which on a force is read from the work that it does.
const WORKING_WAY_MIN: f64 = 1e-3;

/// The same of the way that clay came with, where a tool has stopped. A tilted blade's came by 1.2e-3 two
/// steps after, and what was left of its force on that way was 21 % of it, where springs were right.
const CAME_WAY_MIN: f64 = 1e-2;

/// What the work of a tool may be of the work of its springs [-], at most; none at least. A strip that comes
/// to clay at rest bears half of what it should in its springs at fifteen passes.
const WORK_MAX: f64 = 3.0;

/// How many times as far as a tool goes the clay that it touches would have gone as it came, along the force,
/// where the tool has slowed down so much that this way tells more of the force than its own.
const SLOWED: f64 = 2.0;

/// A tool that clay touches: what its springs bore in a step, and how it goes.
pub(super) struct Working<'a> {
    pub(super) motion: &'a Motion,
    /// Impulse of the clay on the tool.
    pub(super) impulse: DVec3,
    /// The same about its place at the step's end.
    pub(super) angular_impulse: DVec3,
}

/// Work on the clay about a tool.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Work {
    /// Of forces that are left out of balance, on the clay's way in the step.
    pub(super) left: f64,
    /// The same on the way that clay would have gone as it came.
    pub(super) left_as_it_came: f64,
    /// Of what the tool gives clay, on that way.
    pub(super) given: f64,
}

impl Working<'_> {
    /// Impulse and angular impulse that the tool feels besides, for the work of forces that are left out of
    /// balance; `cell` is a cell as a length.
    ///
    /// A tool gives the work that clay takes. The clay's way over the tool's is how the answer changes with
    /// the tool's place, so that of what the iterations left the force has an error of second order; its
    /// springs, which are stiffer than clay, have most of it. Over seven strokes with fifteen passes a step,
    /// against the same steps with 400, strips' springs were off by 4 to 17 % (rms), their work by .4 to .8;
    /// balls' by 11 and 9. Where a tool has stopped, or slowed down by half, the way that clay came with is
    /// taken in its place, and all of the force scaled by it: of a ball that had just been stopped springs
    /// were off by -4 to 5 % with twelve to 48 passes, work by 0 to 2. One that is held feels its springs.
    pub(super) fn owed(&self, work: Work, cell: f64) -> [DVec3; 2] {
        let lever = self.impulse.cross(self.angular_impulse) / self.impulse.length_squared();
        if !lever.is_finite() {
            return [DVec3::ZERO; 2];
        }
        let velocity = self.motion.velocity_at(self.motion.end.position + lever);
        let way = velocity.length() * self.motion.duration;
        if work.given * self.motion.duration > self.impulse.length() * (SLOWED * way).max(CAME_WAY_MIN * cell) {
            let more = (work.left_as_it_came / work.given).clamp(-1.0, WORK_MAX - 1.0);
            return [more * self.impulse, more * self.angular_impulse];
        }
        if way < WORKING_WAY_MIN * cell {
            return [DVec3::ZERO; 2];
        }
        let power = self.impulse.dot(velocity);
        let [none, most] = [-power, (WORK_MAX - 1.0) * power];
        let more = (-work.left).clamp(none.min(most), none.max(most));
        let impulse = velocity * (more / velocity.length_squared());
        [impulse, lever.cross(impulse)]
    }
}

/// Whether forces out of balance at a place may be those of a tool \[cells\]: as far from it as clay flows
/// about it. What falls elsewhere is not its work.
pub(super) fn is_about(distance: f64, bounding_radius: f64) -> bool {
    distance < 2.0 * bounding_radius + 4.0
}

/// Time \[s\] in which clay that stands hardly moves.
pub(super) const STANDING_TIME: f64 = 1.0 / 60.0;

/// Travel of clay in that \[cells\] below which it stands.
pub(super) const STANDING_TRAVEL: f64 = 1e-5;

/// The same over the way by which forces out of balance would strain a cell [-]: what moves no further goes
/// to and fro by what the iterations leave. Clay that a ball had pressed moved by 1 to 5 times that in each
/// frame, for good, and .0005 cells in 100 frames.
pub(super) const STANDING_WAYS: f64 = 8.0;

/// That way \[cells\], up to which clay stands: of soft clay it is a third of a hundredth of its strength.
pub(super) const STANDING_LEFT: f64 = 1e-4;

#[cfg(test)]
mod tests {
    use super::super::tool::Pose;
    use super::*;
    use glam::DQuat;

    /// A step goes on where the slope has hardly changed, or is steeper, up to sixteen times its length and
    /// half of the way to where one was rejected; not where a quarter of it is gone, or it leads up.
    #[test]
    fn steps_go_on_where_nothing_curves() {
        let free = f64::INFINITY;
        let steeper = [(-1.0, free, Some(16.0)), (-1.2, free, Some(16.0)), (-1.2, 5.0, Some(2.0)), (-1.2, 2.0, None)];
        let flatter = [(-0.8, free, Some(5.0)), (-0.97, free, Some(16.0)), (-0.8, 7.0, Some(3.0)), (-0.7, free, None)];
        for (new, beyond, expected) in steeper.into_iter().chain(flatter).chain([(0.5, free, None)]) {
            let found = longer([-1.0, new], beyond);
            assert!(found.is_some() == expected.is_some(), "{new} {beyond}: {found:?}");
            assert!(
                found.is_none_or(|by| expected.is_some_and(|expected: f64| (by - expected).abs() < 1e-9)),
                "{new}: {found:?}"
            );
        }
    }

    /// What a tool is owed does the work that was left, at the clay that it touches; it is never drawn in,
    /// nor does it get more than three times what it bore; held, or untouched, it is owed nothing.
    #[test]
    fn owed_impulse_does_the_work_that_was_left() {
        let start = Pose { position: DVec3::new(1.0, 2.0, 3.0), ..Pose::default() };
        let end = Pose { position: start.position - 0.1 * DVec3::Y, rotation: DQuat::from_rotation_z(0.02) };
        let motion = Motion { start, end, duration: 0.5 };
        // Clay bears it a cell beside its place.
        let (lever, impulse) = (DVec3::X, DVec3::Y * 4.0);
        let working = |motion| Working { motion, impulse, angular_impulse: lever.cross(impulse) };
        let work = |left, [left_as_it_came, given]: [f64; 2]| Work { left, left_as_it_came, given };
        let velocity = motion.velocity_at(end.position + lever);
        let bore = impulse.dot(velocity);
        assert!(bore < 0.0, "it presses");
        for (left, expected) in [(0.01, -0.01), (-0.02, 0.02), (-9.0, -bore), (9.0, 2.0 * bore)] {
            let [more, turn] = working(&motion).owed(work(left, [0.0; 2]), 1.0);
            assert!((more.dot(velocity) - expected).abs() < 1e-12, "{left}: {more}");
            assert!((turn - lever.cross(more)).length() < 1e-12 && more.reject_from(velocity).length() < 1e-12);
        }
        let held = Motion { start: end, ..motion };
        assert_eq!(working(&held).owed(work(0.1, [0.0; 2]), 1.0), [DVec3::ZERO; 2]);
        let untouched = Working { impulse: DVec3::ZERO, angular_impulse: DVec3::ZERO, motion: &motion };
        assert_eq!(untouched.owed(work(0.1, [0.0; 2]), 1.0), [DVec3::ZERO; 2]);
        // Clay that came with it by a cell was given 8 units of work, and left with 1 of them; the least of
        // ways tells nothing.
        for (motion, came, more) in
            [(&held, [-1.0, 8.0], -0.125), (&held, [40.0, 8.0], 2.0), (&motion, [1.0, 8.0], 0.125), (&held, [-0.01, 0.07], 0.0)]
        {
            let impulses = [impulse, lever.cross(impulse)];
            assert_eq!(working(motion).owed(work(0.0, came), 1.0), impulses.map(|whole| more * whole), "{came:?}");
        }
    }
}
