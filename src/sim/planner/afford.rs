//! How long a frame the engine affords, by what the frames before took.

use super::super::frame::FrameReport;

/// The longest frame that is planned of a clock \[s\]: what a clock is ahead by more is given up, so that a
/// slow machine shows slow motion.
pub const FRAME_MAX: f64 = 1.0 / 30.0;
/// The same of implicit steps \[s\], none of which is longer than [`FRAME_MAX`]: where a window takes long to
/// draw, a frame that covers that time costs no more than a short one, and nothing has to be given up.
pub(super) const IMPLICIT_FRAME_MAX: f64 = 0.1;
/// Wall time that frames may take \[s\], within these bounds: that of a frame of the app. On a slow machine
/// frames of clay are shorter, not later, and the clay answers a tool as soon.
pub const FRAME_WALL: (f64, f64) = (1.0 / 60.0, 0.1);
/// The shortest frame that is planned for that \[s\].
pub(super) const FRAME_MIN: f64 = 1e-4;
/// The first frame of an engine of which nothing is known \[s\].
const FRAME_FIRST: f64 = 1e-3;

/// What the last frame took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cost {
    /// Wall time per simulated time: of explicit steps, whose length is the material's.
    PerTime(f64),
    /// Wall time of a step \[s\]: of implicit steps, which are as long as the tools allow.
    PerStep(f64),
}

impl Cost {
    /// That of a frame which took steps.
    pub(super) fn of(report: &FrameReport) -> Option<Self> {
        let (duration, wall) = (report.duration(), report.timings.total);
        let is_known = duration > 0.0 && wall > 0.0 && !report.is_resting();
        let cost = || match report.passes {
            0 => Self::PerTime(wall / duration),
            _ => Self::PerStep(wall / f64::from(report.steps)),
        };
        is_known.then(cost)
    }

    /// The longest frame \[s\] that ends within `wall` \[s\] of time, at `rate` implicit steps a second [1/s].
    /// One step is taken in any case, and a short one takes as long as a long one.
    pub(super) fn frame_max(cost: Option<Self>, wall: f64, rate: f64) -> f64 {
        let wall = wall.clamp(FRAME_WALL.0, FRAME_WALL.1);
        let (longest, most) = match cost {
            None => (FRAME_FIRST, FRAME_MAX),
            Some(Self::PerTime(cost)) => (wall / cost.max(f64::MIN_POSITIVE), FRAME_MAX),
            Some(Self::PerStep(cost)) => {
                let steps = (wall / cost.max(f64::MIN_POSITIVE)).floor().max(1.0);
                (steps / rate.max(1.0 / FRAME_MAX), IMPLICIT_FRAME_MAX)
            }
        };
        longest.clamp(FRAME_MIN, most)
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::frame::FramePlan;
    use super::super::super::integrator::Integrator;
    use super::super::super::material::ClayMaterial;
    use super::*;

    /// The report of a frame of `steps` implicit steps over `duration` \[s\] that took 20 ms each.
    fn slow(duration: f64, steps: u32) -> FrameReport {
        let plan = FramePlan {
            integrator: Integrator::Implicit { passes: 10 },
            ..FramePlan::new(ClayMaterial::default(), duration / f64::from(steps), steps)
        };
        let mut report = FrameReport { steps, passes: 10 * steps, ..FrameReport::new(&plan) };
        report.timings.total = 0.02 * f64::from(steps);
        report
    }

    /// A short frame of one step tells that a step is dear, not that time is: the next may be as long as a
    /// step can be. Explicit frames of the same cost would get shorter and shorter.
    #[test]
    fn dear_steps_make_no_short_frames() {
        let cost = Cost::of(&slow(1e-3, 1));
        assert_eq!(Cost::frame_max(cost, 0.015, 0.0), FRAME_MAX);
        // As long as a window takes to draw, in steps that are no longer.
        assert_eq!(Cost::frame_max(cost, 0.045, 0.0), 2.0 * FRAME_MAX);
        assert_eq!(Cost::frame_max(cost, 1.0, 0.0), IMPLICIT_FRAME_MAX);
        assert_eq!(Cost::frame_max(cost, 0.015, 50.0), 0.02);
        assert_eq!(Cost::frame_max(cost, 0.015, 1e6), FRAME_MIN);
        // Five of them end within a tenth of a second.
        assert!((Cost::frame_max(Cost::of(&slow(1e-2, 3)), 0.1, 200.0) - 0.025).abs() < 1e-12);
        let explicit = FrameReport { passes: 0, ..slow(1e-3, 1) };
        assert!((Cost::frame_max(Cost::of(&explicit), 0.02, 50.0) - 1e-3).abs() < 1e-12);
    }

    /// A frame that ran no step, or rested, tells nothing.
    #[test]
    fn rest_costs_nothing() {
        let given_up = FrameReport { steps: 0, passes: 0, ..slow(1e-2, 1) };
        let resting = FrameReport { is_standing: true, passes: 0, ..slow(1e-2, 1) };
        assert_eq!((Cost::of(&given_up), Cost::of(&resting)), (None, None));
    }
}
