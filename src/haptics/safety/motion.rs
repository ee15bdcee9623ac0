//! What a hand's motion says of the loop: that it flies, that it is shaken.

use crate::haptics::device::DeviceState;
use glam::DVec3;

/// Ticks over which a place is differenced: at 1 kHz a device's least motion of 55 um is then 11 mm/s, not
/// 55.
const TICKS: usize = 5;

/// Trips where the hand is too fast, by the driver's speed or by the places themselves, and until it has
/// half the speed.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Speed {
    is_tripped: bool,
    places: [DVec3; TICKS],
    times: [f64; TICKS],
    /// How many there are, and where the next goes.
    count: usize,
    time: f64,
}

impl Speed {
    pub(crate) fn is_tripped(&mut self, state: &DeviceState, speed_max: f64, dt: f64) -> bool {
        self.time += dt;
        let at = self.count % TICKS;
        let span = self.time - self.times[at];
        let by_places = if self.count >= TICKS && span > 0.0 { state.position.distance(self.places[at]) / span } else { 0.0 };
        (self.places[at], self.times[at]) = (state.position, self.time);
        self.count += 1;
        let speed = state.velocity.length().max(by_places);
        self.is_tripped = if self.is_tripped { speed > 0.5 * speed_max } else { speed > speed_max };
        self.is_tripped
    }
}

/// Least way between two turns \[m\]: above what a device's least motion and its noise make.
const SWING: f64 = 3e-4;
/// Time that is looked at \[s\].
const WINDOW: f64 = 0.2;
/// Turns in it: those of 25 Hz, two a cycle. Hands tremble with 8 to 12 Hz and are shaken by will with 5.
const TURNS: u32 = 10;
/// The least share of the force that is left \[-\].
const SHARE_MIN: f64 = 0.125;
/// Force below which the loop shakes nothing \[N\].
const FORCE_MIN: f64 = 0.05;

/// Halves the force each time the hand is shaken by it. As the force is a spring's, that is half its
/// stiffness.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Buzz {
    share: f64,
    /// By axis: the last extreme \[m\], which way it goes from there, how many turns the window has.
    extreme: DVec3,
    way: [f64; 3],
    turns: [u32; 3],
    /// How long ago the window began \[s\].
    window: f64,
    /// For how long a force that was felt may yet be what shakes \[s\].
    felt: f64,
    has_place: bool,
}

impl Default for Buzz {
    fn default() -> Self {
        Self { share: 1.0, extreme: DVec3::ZERO, way: [0.0; 3], turns: [0; 3], window: 0.0, felt: 0.0, has_place: false }
    }
}

impl Buzz {
    /// Share of the force that is left \[-\].
    pub(crate) fn share(&self) -> f64 {
        self.share
    }

    /// Watches a tick of a hand that felt `force`; whether the force is less for it, now or since before.
    pub(crate) fn watch(&mut self, position: DVec3, force: DVec3, dt: f64) -> bool {
        if !self.has_place {
            (self.extreme, self.has_place) = (position, true);
        }
        self.felt = if force.length() > FORCE_MIN { WINDOW } else { self.felt - dt };
        for axis in 0..3 {
            let way = position[axis] - self.extreme[axis];
            if way * self.way[axis] >= 0.0 && self.way[axis] != 0.0 {
                self.extreme[axis] = position[axis];
            } else if way.abs() > SWING {
                self.turns[axis] += u32::from(self.felt > 0.0);
                self.way[axis] = way.signum();
                self.extreme[axis] = position[axis];
            }
        }
        self.window += dt;
        if self.window > WINDOW {
            if self.turns.iter().any(|turns| *turns >= TURNS) {
                self.share = (0.5 * self.share).max(SHARE_MIN);
            }
            (self.turns, self.window) = ([0; 3], 0.0);
        }
        self.share < 1.0
    }
}
