//! The arm in a hand: a mass with its drag, a spring and a damper to where the hand wants to be.

/// Mass of arm and fingers \[kg\]: 45 g seen at the tip, 6 g of two fingers.
const MASS: f64 = 0.051;
/// Drag of the arm \[N s/m\].
const DRAG: f64 = 0.2;
/// Damping \[N s/m\] and stiffness \[N/m\] of a pinch of two fingers.
const PINCH: (f64, f64) = (2.0, 200.0);
/// Least motion that encoders see \[m\]: 450 to the inch.
const LEAST: f64 = 55e-6;
/// Step of the motion \[s\].
const STEP: f64 = 2e-5;
/// Corner of the driver's filter of the velocity \[rad/s\]: 57 Hz.
const CORNER: f64 = 358.0;

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Arm {
    /// Where the hand wants to be, and how fast that moves \[m\], \[m/s\].
    pub(crate) goal: [f64; 3],
    pub(crate) goal_velocity: [f64; 3],
    /// True place and velocity.
    pub(crate) place: [f64; 3],
    velocity: [f64; 3],
    /// What the encoders say.
    pub(crate) seen: [f64; 3],
    pub(crate) seen_velocity: [f64; 3],
}

impl Arm {
    /// Moves for `span` \[s\] with a force \[N\] of the motors.
    pub(crate) fn advance(&mut self, force: [f64; 3], span: f64) {
        let steps = (span / STEP).round().max(1.0);
        let dt = span / steps;
        for _ in 0..steps as usize {
            for axis in 0..3 {
                self.goal[axis] += self.goal_velocity[axis] * dt;
                let pull = PINCH.1 * (self.goal[axis] - self.place[axis])
                    + PINCH.0 * (self.goal_velocity[axis] - self.velocity[axis])
                    - DRAG * self.velocity[axis];
                self.velocity[axis] += (force[axis] + pull) / MASS * dt;
                self.place[axis] += self.velocity[axis] * dt;
            }
        }
        for axis in 0..3 {
            let seen = (self.place[axis] / LEAST).round() * LEAST;
            let raw = (seen - self.seen[axis]) / span;
            self.seen[axis] = seen;
            self.seen_velocity[axis] += (1.0 - (-CORNER * span).exp()) * (raw - self.seen_velocity[axis]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Five millimetres for a newton, on encoders of 55 um; and back.
    #[test]
    fn a_hand_gives_way_as_its_spring_does() {
        let mut arm = Arm::default();
        (0..500).for_each(|_| arm.advance([1.0, 0.0, 0.0], 1e-3));
        assert!((arm.place[0] - 1.0 / PINCH.1).abs() < 1e-6, "{:?}", arm.place);
        assert!((arm.seen[0] - arm.place[0]).abs() <= 0.5 * LEAST && (arm.seen[0] / LEAST).fract().abs() < 1e-6);
        (0..500).for_each(|_| arm.advance([0.0; 3], 1e-3));
        assert!(arm.place[0].abs() < 1e-6 && arm.seen_velocity[0].abs() < 1e-3);
    }

    #[test]
    fn a_thrown_hand_is_as_fast_as_its_goal() {
        let mut arm = Arm { goal_velocity: [1.5, 0.0, 0.0], ..Arm::default() };
        (0..300).for_each(|_| arm.advance([0.0; 3], 1e-3));
        assert!((arm.seen_velocity[0] - 1.5).abs() < 0.05, "{}", arm.seen_velocity[0]);
    }
}
