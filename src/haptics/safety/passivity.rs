//! Passivity observer and controller (Hannaford and Ryu 2002), on position increments.

use glam::DVec3;

/// Play to either side, in steps of the encoder: to and fro by one step is within it, by two is not.
const PLAY: f64 = 0.75;

/// Counts the energy that goes between hand and loop, and damps the hand where the loop gave more than it
/// had.
///
/// # Equation
/// A force is held from tick to tick, so what it does on the hand is exact in the increments of its way:
/// `E(n) = E(n-1) - f(n-1) . (x(n) - x(n-1))`. Where `E < -|f| d` the force gets `-a v`, `a = min(-E / (T
/// |v|^2), a_max)`: if the hand goes on as it did, the next tick takes out what is missing. v is the
/// driver's smoothed velocity: one step of 55 um in a tick is 55 mm/s, and with increments for v the
/// controller itself shook a hand that stood still, by .2 N.
///
/// x is the hand's place behind a play of d to either side, three quarters of the least motion that is
/// sensed. A hand that stands between two steps of its encoder goes to and fro between them; a spring of 400
/// N/m seems to give 1.2 uJ each time, which it does not.
///
/// Clay takes energy and keeps it, and what it kept must not pay for a loop that shakes later. So no more is
/// counted than a spring can hold at the greatest force, `F^2 / (2 K_min)`: a spring with its true store S
/// has `E >= S` before the cut and, as S is not above that, after it. A passive loop is left alone. A debt
/// is counted to the same amount.
#[derive(Clone, Copy, Debug)]
pub struct Passivity {
    /// Energy counted \[J\].
    energy: f64,
    /// The most that is counted, either way \[J\].
    energy_max: f64,
    /// Greatest damping \[N s/m\].
    damping_max: f64,
    /// Motion to either side that is not counted \[m\].
    play: f64,
    /// Where the hand was, behind the play \[m\].
    position: Option<DVec3>,
}

impl Passivity {
    /// A loop that has no energy yet, forces up to `force_max` \[N\], no spring softer than `stiffness_min`
    /// \[N/m\]; it is damped with `damping_max` \[N s/m\] at most, and its hand seen in steps of `resolution`
    /// \[m\].
    pub fn new(force_max: f64, stiffness_min: f64, damping_max: f64, resolution: f64) -> Self {
        let energy_max = 0.5 * force_max * force_max / stiffness_min;
        Self { energy: 0.0, energy_max, damping_max, play: PLAY * resolution, position: None }
    }

    /// Other limits, as in [`Passivity::new`].
    pub fn limit(&mut self, force_max: f64, stiffness_min: f64, damping_max: f64) {
        (self.energy_max, self.damping_max) = (0.5 * force_max * force_max / stiffness_min, damping_max);
    }

    /// Energy counted \[J\].
    pub fn energy(&self) -> f64 {
        self.energy
    }

    /// The hand's place was lost: what it does till the next is not counted.
    pub fn forget(&mut self) {
        self.position = None;
    }

    /// The force comes or goes by itself: a spring that grows under a hand gives energy that is meant to be
    /// given.
    pub fn forgive(&mut self) {
        self.energy = self.energy.max(0.0);
    }

    /// The damping force \[N\] for a hand at `position` \[m\] with `velocity` \[m/s\] that got `held` \[N\] for the
    /// `dt` \[s\] before.
    pub fn damping(&mut self, held: DVec3, position: DVec3, velocity: DVec3, dt: f64) -> DVec3 {
        let before = *self.position.get_or_insert(position);
        let gap = position - before;
        let way = gap - gap.clamp_length_max(self.play);
        self.position = Some(before + way);
        self.energy = (self.energy - held.dot(way)).clamp(-self.energy_max, self.energy_max);
        let square = velocity.length_squared();
        if self.energy >= -held.length() * self.play || square == 0.0 || dt <= 0.0 {
            return DVec3::ZERO;
        }
        let damping = (-self.energy / (dt * square)).min(self.damping_max);
        -damping * velocity
    }
}
