//! Controllers that shake and do not push: what a force becomes there.

use glam::DVec3;

/// A shake: short, and renewed as long as it lasts, so that it ends with whoever renews it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shake {
    /// From nothing, 0, to all, 1.
    pub amplitude: f64,
    /// \[Hz\]
    pub frequency: f64,
    /// \[s\]
    pub duration: f64,
}

/// Something that shakes in a hand.
pub trait VibrationSink: Send {
    /// Shakes, in place of the shake before.
    ///
    /// # Errors
    /// The controller's own words: it went, or has no motor.
    fn shake(&mut self, shake: &Shake) -> Result<(), String>;
}

/// Change of force that shakes with all \[N/s\]: half of what a Touch may be given; a contact at 200 mm/s on
/// firm clay makes 160.
const FORCE_RATE_FULL: f64 = 150.0;
/// Slip that shakes with all \[m/s\]: a fast stroke.
const SLIP_FULL: f64 = 0.2;
/// Share of a slip's shake: beside a contact it is a background.
const SLIP_SHARE: f64 = 0.4;
/// Length of the clay's roughness that slip is felt by \[m\]: a grain.
const GRAIN: f64 = 1e-3;
/// What hands feel best and small motors make \[Hz\]: Pacinian corpuscles from 40 to 400, best at 250, where
/// motors of controllers end.
const FREQUENCIES: (f64, f64) = (40.0, 250.0);
/// Frequency of a contact \[Hz\].
const CONTACT: f64 = 160.0;
/// Below it nothing is felt \[-\].
const LEAST: f64 = 0.02;

/// Makes shakes of forces. A force that stands is not felt as a shake: it is its change that is, and the
/// slip along clay.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shaker {
    force: Option<DVec3>,
}

impl Shaker {
    /// The shake of a frame of `dt` \[s\] with that force \[N\] at its end, and that slip \[m/s\]; it lasts for
    /// two frames, so that none is missed and it stops when frames do. None where nothing is felt.
    pub fn shake(&mut self, force: DVec3, slip: f64, dt: f64) -> Option<Shake> {
        let before = self.force.replace(force).unwrap_or(force);
        let change = force.distance(before) / dt;
        let [by_force, by_slip] = [change / FORCE_RATE_FULL, SLIP_SHARE * slip / SLIP_FULL];
        // Slip is felt while something presses.
        let by_slip = if force.length() > 0.0 { by_slip.clamp(0.0, SLIP_SHARE) } else { 0.0 };
        let amplitude = by_force.max(by_slip).min(1.0);
        if !(amplitude > LEAST && amplitude.is_finite() && dt > 0.0) {
            self.force = self.force.filter(|force| force.is_finite());
            return None;
        }
        let frequency = if by_force > by_slip { CONTACT } else { (slip / GRAIN).clamp(FREQUENCIES.0, FREQUENCIES.1) };
        Some(Shake { amplitude, frequency, duration: 2.0 * dt })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame \[s\].
    const DT: f64 = 0.0111;

    #[test]
    fn a_force_that_stands_is_silent_and_one_that_changes_shakes() {
        let mut shaker = Shaker::default();
        assert_eq!(shaker.shake(DVec3::X, 0.0, DT), None, "the first has no change");
        assert_eq!(shaker.shake(DVec3::X, 0.0, DT), None);
        let shake = shaker.shake(DVec3::X * (1.0 + 75.0 * DT), 0.0, DT).unwrap();
        assert!((shake.amplitude - 0.5).abs() < 1e-9 && shake.duration == 2.0 * DT, "{shake:?}");
        assert_eq!(shaker.shake(DVec3::X * 90.0, 0.0, DT).unwrap().amplitude, 1.0);
    }

    #[test]
    fn slip_shakes_with_the_grains_that_it_passes() {
        let mut shaker = Shaker { force: Some(DVec3::Y) };
        let shake = shaker.shake(DVec3::Y, 0.1, DT).unwrap();
        assert!((shake.amplitude - 0.2).abs() < 1e-12 && (shake.frequency - 100.0).abs() < 1e-9, "{shake:?}");
        assert_eq!(shaker.shake(DVec3::Y, 9.0, DT).unwrap().frequency, 250.0);
        shaker.shake(DVec3::ZERO, 0.0, DT);
        assert_eq!(shaker.shake(DVec3::ZERO, 0.1, DT), None, "in the air");
    }

    #[test]
    fn what_is_no_number_does_not_shake() {
        let mut shaker = Shaker { force: Some(DVec3::ZERO) };
        assert_eq!(shaker.shake(DVec3::NAN, f64::NAN, DT), None);
        assert_eq!(shaker.shake(DVec3::ZERO, 0.0, DT), None, "and is forgotten");
        assert_eq!(shaker.shake(DVec3::ZERO, 0.0, 0.0), None);
    }
}
