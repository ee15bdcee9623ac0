//! Where a hand is by its encoders.

use glam::DVec3;

/// Farthest that two readings may be apart to be neighbours \[m\]: a step of the Touch's encoders is 55 um in
/// the middle of its reach, and grows with the arm's length.
const STEP_MAX: f64 = 1.5e-4;

/// Finds a hand that stands at the edge between two readings.
///
/// A spring of 400 N/m bears .02 N more with each step, so a soft hand that holds it still is pushed from one
/// reading to the next and comes back, for ever: 6 to 11 % of the force of a ball in clay. A reading that
/// went and came back, and goes again, tells more than either: the hand is at the edge between them. There it
/// is taken to be until a third reading comes. A hand that moves on or swings by more is where its encoders
/// say: taken at the edge wherever it turned round, which is half a step late, hands did not stand at nine
/// tenths of the stiffest wall that they can hold.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reading {
    /// The reading, and the one that it came from \[m\].
    now: Option<DVec3>,
    before: Option<DVec3>,
    /// Whether it came back to where the one before had come from.
    came_back: bool,
    /// The edge between them, where the hand stands at it.
    edge: Option<DVec3>,
}

impl Reading {
    /// Where a hand is of which the encoders say `position` \[m\].
    pub(super) fn place(&mut self, position: DVec3) -> DVec3 {
        if self.now != Some(position) {
            let from = self.now.filter(|now| self.before == Some(position) && now.distance(position) < STEP_MAX);
            self.edge = from.filter(|_| self.came_back).map(|from| from.midpoint(position));
            (self.before, self.now, self.came_back) = (self.now, Some(position), from.is_some());
        }
        self.edge.unwrap_or(position)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hand at an edge stands there once it has come back twice; one that goes on or turns round is where
    /// its encoders say, as is one that jumps to and fro.
    #[test]
    fn hand_between_two_readings_stands_at_the_edge() {
        let step = 5.5e-5;
        let places = |readings: &[f64]| -> Vec<f64> {
            let mut reading = Reading::default();
            readings.iter().map(|n| (reading.place(DVec3::new(0.1, n * step, 0.0)).y / step * 8.0).round() / 8.0).collect()
        };
        let at_edge = places(&[0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0]);
        assert_eq!(at_edge, [0.0, 1.0, 1.0, 0.0, 0.0, 0.5, 0.5, 0.5, 0.5, 0.5]);
        assert_eq!(places(&[0.0, 1.0, 0.0, 1.0, 2.0, 3.0]), [0.0, 1.0, 0.0, 0.5, 2.0, 3.0]);
        assert_eq!(places(&[0.0, 1.0, 2.0, 1.0, 0.0, 1.0]), [0.0, 1.0, 2.0, 1.0, 0.0, 1.0]);
        assert_eq!(places(&[0.0, 4.0, 0.0, 4.0]), [0.0, 4.0, 0.0, 4.0]);
    }
}
