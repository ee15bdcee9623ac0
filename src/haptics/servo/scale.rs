//! What a hand feels of the clay's force.

use glam::DVec3;

/// The clay's force times a gain; beyond a knee less and less, up to a ceiling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceScale {
    /// Force felt over force of the clay, below the knee [-].
    pub gain: f64,
    /// Force felt up to which nothing else is done to it \[N\].
    pub knee: f64,
    /// Force felt that is never reached \[N\].
    pub ceiling: f64,
}

impl Default for ForceScale {
    /// One to one up to 1.5 N; a Touch drives 3.3 N at most, and 0.9 of it is left to be asked for.
    fn default() -> Self {
        Self { gain: 1.0, knee: 1.5, ceiling: 2.97 }
    }
}

impl ForceScale {
    /// The force felt \[N\], of the same direction: with slope 1 at the knee, `knee + r tanh((f - knee) / r)`
    /// with `r = ceiling - knee`.
    pub fn of(&self, clay: DVec3) -> DVec3 {
        let force = self.gain * clay;
        let length = force.length();
        if length <= self.knee {
            return force;
        }
        let room = (self.ceiling - self.knee).max(0.0);
        let felt = if room > 0.0 { self.knee + room * ((length - self.knee) / room).tanh() } else { self.knee };
        force * (felt / length)
    }
}
