//! From a clay frame's report to what the hand's loop reads, with the stiffness put right by what the clay
//! did in the frames before.

mod blade_fit;

use super::model::{ContactModel, NEAR_MAX, NearParticle};
use crate::sim::planner::RESIDUAL_MAX;
use crate::sim::touch::ToolTouch;
use blade_fit::BladeFit;
use glam::{DMat3, DVec3};

/// Frames that a stiffness is fitted to.
pub const FIT_FRAMES: usize = 8;

/// Ways \[m\] at which what frames show of a stiffness counts as much as what the patch says: forces of clay
/// waver by some .03 N, over this way a tenth of a stiffness. With half of it a held ball's fell by a third.
pub const FIT_WAY: f64 = 1e-4;

/// The same of what a yield force grows by: forces of clay waver by the unevenness of its particles.
pub const YIELD_WAY: f64 = 2e-4;

/// What a frame counts of that after another one [-].
pub const YIELD_DECAY: f64 = 0.8;

/// Greatest stiffness [N/m] that is believed: beyond it no spring can be felt at 1 kHz (a stylus's bound at
/// no delay is 20 kN/m).
pub const STIFFNESS_CAP: f64 = 20e3;

/// What a frame's report does not say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameClock {
    /// Clay frame.
    pub frame: u64,
    /// When it is published, by the host's clock \[s\].
    pub stamp: f64,
    /// Clay time that a second of wall time takes [-].
    pub rate: f64,
    /// Hand time that it took in \[s\].
    pub span: [f64; 2],
    /// Implicit steps in it, at whose ends their forces are; 0 of explicit ones.
    pub parts: u32,
    /// Whether the clay is known to rest.
    pub is_resting: bool,
}

/// Makes a tool's models from its touches, frame after frame.
#[derive(Clone, Debug, Default)]
pub struct ContactModels {
    fit: StiffnessFit,
    yields: YieldFit,
    blade: BladeFit,
    /// Of the last frame that was not poor and touched.
    last: Option<ContactModel>,
}

impl ContactModels {
    /// The model of a frame that ended with `touch` and the forces out of balance `residual`
    /// ([`FrameReport::residual`](crate::sim::frame::FrameReport::residual)). Clay at rest has frames too,
    /// and a touch in each.
    pub fn model(&mut self, touch: &ToolTouch, residual: f64, clock: &FrameClock) -> ContactModel {
        let FrameClock { frame, stamp, rate, span, parts, is_resting } = *clock;
        let mut model = ContactModel { frame, stamp, rate, span, parts, is_resting, ..contact_model(touch) };
        model.blade = self.blade.bounds(touch);
        if model.blade.is_some() {
            return model;
        }
        if let Some(last) = self.last.filter(|last| is_poor(last, &model, residual)) {
            // What it yields at is what it would have been, and nothing is learnt of it.
            let ContactModel { stiffness, yield_slope, .. } = last;
            return ContactModel { is_poor: true, yield_force: last.yield_at(model.position), yield_slope, stiffness, ..model };
        }
        if let Some(stiffness) = self.fit.stiffness(touch) {
            model.stiffness = stiffness;
        }
        model.yield_slope = self.yields.slope(touch);
        self.last = (model.gap == 0.0 && model.normal != DVec3::ZERO).then_some(model);
        model
    }

    /// Forgets all frames: other clay, another tool.
    pub fn forget(&mut self) {
        *self = Self::default();
    }
}

/// Part of the force of the frame before [-] below which that of a poor frame is taken for its want of steps.
const FALLEN: f64 = 0.7;

/// Whether a frame that did not leave the clay lost its force to what it left out of balance, `residual` of
/// it. Clay that the tool leaves is let go all the same, and force that rises is felt.
fn is_poor(last: &ContactModel, model: &ContactModel, residual: f64) -> bool {
    let goes_on = model.gap == 0.0 && (model.position - last.position).dot(model.normal) <= 0.0;
    let [before, now] = [last, model].map(|m| m.force.dot(m.normal));
    goes_on && residual * now > RESIDUAL_MAX * before && now < FALLEN * before
}

/// A touch about the mean place of its frame, where the mean force belongs.
fn contact_model(touch: &ToolTouch) -> ContactModel {
    // Out of the clay, from where the touch was read.
    let out = (touch.mean_position - touch.pose.position).dot(touch.normal);
    let mut near = [NearParticle::default(); NEAR_MAX];
    let mut near_count = 0;
    for (to, from) in near.iter_mut().zip(&touch.near) {
        *to = NearParticle { id: from.id, position: from.position.as_vec3().to_array(), radius: from.radius as f32 };
        near_count += 1;
    }
    ContactModel {
        position: touch.mean_position,
        rotation: touch.pose.rotation,
        force: touch.force,
        normal: touch.normal,
        gap: if touch.gap > 0.0 { (touch.gap + out).max(0.0) } else { 0.0 },
        stiffness: touch.stiffness,
        yield_force: touch.yield_force.unwrap_or(f64::INFINITY),
        yield_slope: touch.yield_slope,
        friction: touch.friction,
        density: touch.fill,
        density_gradient: touch.fill_gradient,
        near_count,
        near,
        ..ContactModel::NONE
    }
}

/// Stiffness of a patch from where the tool was and what it felt in its last [`FIT_FRAMES`] frames that told:
/// the symmetric part of the least `sum |K d_i + f_i|^2 + FIT_WAY^2 |K - K_0|^2` over steps d_i, f_i between
/// frames, `K = (FIT_WAY^2 K_0 - sum f_i d_i^T) (FIT_WAY^2 + sum d_i d_i^T)^-1`, with its eigenvalues clamped
/// to 0 and [`STIFFNESS_CAP`]. Only what touches and holds, or comes out, tells: clay that yields has another
/// slope.
#[derive(Clone, Debug, Default)]
struct StiffnessFit {
    /// Place and force of the frame before, where that touched, and whether it yielded.
    before: Option<(DVec3, DVec3, bool)>,
    /// Steps from frame to frame, a ring.
    steps: [Option<(DVec3, DVec3)>; FIT_FRAMES - 1],
    next: usize,
}

impl StiffnessFit {
    /// The stiffness after another frame; none where no number of it is one.
    fn stiffness(&mut self, touch: &ToolTouch) -> Option<DMat3> {
        let touches = touch.gap == 0.0 && touch.force.dot(touch.normal) > 0.0 && touch.force.is_finite();
        let now = touches.then_some((touch.mean_position, touch.force, touch.is_yielding));
        let step = self.before.zip(now).and_then(|(before, now)| {
            let way = now.0 - before.0;
            // Clay that yielded comes back as a spring; what goes on into it does not.
            let holds = !now.2 && (!before.2 || way.dot(touch.normal) > 0.0);
            holds.then_some((way, now.1 - before.1))
        });
        if touch.gap > 0.0 || touch.normal == DVec3::ZERO {
            // The next patch is another one.
            *self = Self::default();
        }
        if step.is_some() {
            self.steps[self.next] = step;
            self.next = (self.next + 1) % self.steps.len();
        }
        self.before = now;
        let weight = FIT_WAY * FIT_WAY;
        let (mut own, mut ways) = (touch.stiffness * weight, DMat3::from_diagonal(DVec3::splat(weight)));
        for (way, force) in self.steps.iter().flatten() {
            own -= outer(*force, *way);
            ways += outer(*way, *way);
        }
        let fitted = own * ways.inverse();
        let symmetric = (fitted + fitted.transpose()) * 0.5;
        symmetric.is_finite().then(|| clamped(symmetric, STIFFNESS_CAP))
    }
}

/// What a patch's yield force grows by, from what frames showed: the least `sum (s d_i - f_i)^2 + YIELD_WAY^2
/// (s - s_0)^2` over steps into the clay d_i and of the force along the normal f_i between frames that
/// yielded, s_0 what the patch says. Growth by the tool's shape alone leaves out that clay goes down before
/// it.
#[derive(Clone, Debug, Default)]
struct YieldFit {
    before: Option<(DVec3, DVec3)>,
    /// Of way times force \[N m\] and of way squared [m^2].
    sums: [f64; 2],
}

impl YieldFit {
    /// The growth after another frame [N/m].
    fn slope(&mut self, touch: &ToolTouch) -> f64 {
        let now = touch.is_yielding.then_some((touch.mean_position, touch.force));
        let step = self.before.zip(now).map(|(before, now)| [before.0 - now.0, now.1 - before.1].map(|d| d.dot(touch.normal)));
        if touch.gap > 0.0 || touch.normal == DVec3::ZERO {
            // The next patch is another one.
            *self = Self::default();
        }
        self.before = now;
        // A tool that is held or comes out does not make the clay yield: noise.
        if let Some([way, force]) = step.filter(|[way, _]| *way > 0.0) {
            self.sums = [self.sums[0] * YIELD_DECAY + way * force, self.sums[1] * YIELD_DECAY + way * way];
        }
        let weight = YIELD_WAY * YIELD_WAY;
        let [top, bottom] = [weight * touch.yield_slope + self.sums[0], weight + self.sums[1]];
        (top / bottom).max(0.0)
    }
}

/// `a b^T`.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

/// A symmetric matrix with its eigenvalues clamped to 0 and `cap`, by Jacobi's rotations.
fn clamped(matrix: DMat3, cap: f64) -> DMat3 {
    let (mut m, mut axes) = (matrix, DMat3::IDENTITY);
    // Each sweep squares what is left off the diagonal: six end at rounding from anywhere.
    for _ in 0..6 {
        for (i, j) in [(0, 1), (0, 2), (1, 2)] {
            let off = m.col(j)[i];
            if off == 0.0 {
                continue;
            }
            let half = 0.5 * (m.col(j)[j] - m.col(i)[i]) / off;
            let sign = if half < 0.0 { -1.0 } else { 1.0 };
            let tangent = sign / (half.abs() + half.hypot(1.0));
            let (cosine, sine) = (1.0 / tangent.hypot(1.0), tangent / tangent.hypot(1.0));
            let mut turn = DMat3::IDENTITY;
            (turn.col_mut(i)[i], turn.col_mut(j)[j]) = (cosine, cosine);
            (turn.col_mut(j)[i], turn.col_mut(i)[j]) = (sine, -sine);
            m = turn.transpose() * m * turn;
            axes *= turn;
        }
    }
    let values = DVec3::new(m.x_axis.x, m.y_axis.y, m.z_axis.z).clamp(DVec3::ZERO, DVec3::splat(cap));
    axes * DMat3::from_diagonal(values) * axes.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::tool::Pose;
    use crate::sim::touch::TouchParticle;
    use glam::DQuat;

    const CLOCK: FrameClock = FrameClock { frame: 3, stamp: 1.5, rate: 1.0, span: [1.0, 1.011], parts: 0, is_resting: false };

    fn near(found: DMat3, wanted: DMat3, part: f64) {
        let error = (found - wanted).to_cols_array().iter().fold(0.0f64, |e, x| e.max(x.abs()));
        let scale = wanted.to_cols_array().iter().fold(0.0f64, |e, x| e.max(x.abs()));
        assert!(error <= part * scale, "{found} is not {wanted}");
    }

    /// Clay of stiffness `truth` whose patch says `said`, at `at`.
    fn touch(truth: DMat3, said: DMat3, at: DVec3) -> ToolTouch {
        ToolTouch {
            normal: DVec3::Y,
            force: DVec3::Y * 0.5 - truth * at,
            mean_position: at,
            pose: Pose { position: at, rotation: DQuat::IDENTITY },
            stiffness: said,
            yield_force: Some(2.0),
            ..ToolTouch::default()
        }
    }

    fn places() -> impl Iterator<Item = DVec3> {
        (0..9).map(f64::from).map(|i| DVec3::new((1.7 * i).sin(), (2.9 * i).cos(), (0.6 * i).cos()) * 5e-4)
    }

    /// Frames that move show the stiffness whatever the patch said; frames that stand leave what it said; a
    /// yielding patch shows nothing, and another patch begins anew.
    #[test]
    fn stiffness_comes_from_what_frames_show() {
        let truth = DMat3::from_cols(DVec3::new(300.0, 50.0, 0.0), DVec3::new(50.0, 900.0, -80.0), DVec3::new(0.0, -80.0, 400.0));
        let said = DMat3::from_diagonal(DVec3::new(700.0, 500.0, 700.0));
        let run = |of: &dyn Fn(DVec3) -> ToolTouch, places: &mut dyn Iterator<Item = DVec3>| {
            let mut models = ContactModels::default();
            places.map(|at| models.model(&of(at), 0.0, &CLOCK)).last().expect("a model").stiffness
        };
        let moving = run(&|at| touch(truth, said, at), &mut places());
        near(moving, truth, 0.03);
        near(run(&|_| touch(truth, said, DVec3::X * 1e-3), &mut places()), said, 1e-12);
        near(run(&|at| ToolTouch { is_yielding: true, ..touch(truth, said, at) }, &mut places()), said, 1e-12);
        let mut models = ContactModels::default();
        places().for_each(|at| _ = models.model(&touch(truth, said, at), 0.0, &CLOCK));
        let away = ToolTouch { gap: 1e-3, force: DVec3::ZERO, ..touch(truth, said, DVec3::Y) };
        near(models.model(&away, 0.0, &CLOCK).stiffness, said, 1e-12);
    }

    /// Eigenvalues below 0 and beyond the cap go to these, the axes stay.
    #[test]
    fn eigenvalues_are_clamped() {
        let turn = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.4, -1.1, 0.7)));
        let of = |values: DVec3| turn * DMat3::from_diagonal(values) * turn.transpose();
        near(clamped(of(DVec3::new(-300.0, 5e4, 700.0)), 2e4), of(DVec3::new(0.0, 2e4, 700.0)), 1e-12);
        near(clamped(of(DVec3::new(3.0, 2.0, 1.0)), 2e4), of(DVec3::new(3.0, 2.0, 1.0)), 1e-12);
        let said = DMat3::from_diagonal(DVec3::splat(500.0));
        let (mut models, stiff) = (ContactModels::default(), DMat3::from_diagonal(DVec3::new(-400.0, 9e4, 500.0)));
        let last = places().map(|at| {
            let force = DVec3::Y * 100.0 - stiff * at;
            models.model(&ToolTouch { force, ..touch(stiff, said, at) }, 0.0, &CLOCK)
        });
        let found = last.last().expect("a model").stiffness;
        assert!(found.x_axis.x >= -1e-9 && found.y_axis.y <= STIFFNESS_CAP * (1.0 + 1e-12), "{found}");
    }

    /// A yield force that grows by another slope than the patch says is learnt while the tool goes in, and
    /// kept while it is held.
    #[test]
    fn yield_slope_comes_from_what_frames_show() {
        let at = |depth: f64| ToolTouch {
            normal: DVec3::Y,
            mean_position: DVec3::NEG_Y * depth,
            force: DVec3::Y * (0.1 + 300.0 * depth),
            is_yielding: true,
            yield_slope: 700.0,
            ..ToolTouch::default()
        };
        let mut models = ContactModels::default();
        assert_eq!(models.model(&at(0.0), 0.0, &CLOCK).yield_slope, 700.0);
        let slope = (1..8).map(|i| models.model(&at(4e-4 * f64::from(i)), 0.0, &CLOCK).yield_slope).last().expect("a model");
        assert!((300.0..330.0).contains(&slope), "{slope}");
        let held = models.model(&at(2.8e-3 - 1e-6), 0.0, &CLOCK).yield_slope;
        assert!((held - slope).abs() < 1e-9, "{held}");
        models.forget();
        assert_eq!(models.model(&at(0.0), 0.0, &CLOCK).yield_slope, 700.0);
    }

    /// A frame whose force fell to what it left out of balance says nothing of the next; one that leaves the
    /// clay, and one that is balanced, do.
    #[test]
    fn poor_frame_keeps_what_was_known() {
        let patch = |force: f64, depth: f64| ToolTouch {
            normal: DVec3::Y,
            mean_position: DVec3::NEG_Y * depth,
            force: DVec3::Y * force,
            is_yielding: true,
            yield_force: Some(force),
            yield_slope: 100.0,
            stiffness: DMat3::from_diagonal(DVec3::splat(900.0)),
            ..ToolTouch::default()
        };
        let after = |force: f64, depth: f64, residual: f64| {
            let mut models = ContactModels::default();
            models.model(&patch(1.0, 1e-3), 0.1, &CLOCK);
            models.model(&patch(force, depth), residual, &CLOCK)
        };
        let poor = after(0.2, 1.5e-3, 3.0);
        assert!(poor.is_poor && (poor.yield_force - 1.05).abs() < 1e-12 && poor.force.y == 0.2, "{}", poor.yield_force);
        for (force, depth, residual) in [(0.2, 1.5e-3, 0.1), (0.2, 0.9e-3, 3.0), (1.2, 1.5e-3, 3.0)] {
            assert!(!after(force, depth, residual).is_poor, "{force} {depth} {residual}");
        }
    }

    /// All is carried over, about the frame's mean place.
    #[test]
    fn model_is_of_the_frames_mean_place() {
        let mut touch = touch(DMat3::ZERO, DMat3::IDENTITY, DVec3::Y * 4e-3);
        touch.pose.position = DVec3::Y * 3e-3;
        (touch.gap, touch.friction, touch.fill, touch.yield_slope) = (2e-3, 0.3, 0.7, 40.0);
        touch.near = (0..300).map(|id| TouchParticle { id, position: DVec3::splat(0.5), radius: 1e-4 }).collect();
        let model = ContactModels::default().model(&touch, 0.0, &CLOCK);
        assert!((model.gap - 3e-3).abs() < 1e-15 && model.position == DVec3::Y * 4e-3, "{}", model.gap);
        assert_eq!((model.frame, model.stamp, model.span, model.rate), (3, 1.5, [1.0, 1.011], 1.0));
        assert_eq!((model.yield_force, model.yield_slope, model.friction, model.density), (2.0, 40.0, 0.3, 0.7));
        assert_eq!((model.near().len(), model.near()[255].id), (NEAR_MAX, 255));
        touch.yield_force = None;
        assert_eq!(ContactModels::default().model(&touch, 0.0, &CLOCK).yield_force, f64::INFINITY);
    }
}
