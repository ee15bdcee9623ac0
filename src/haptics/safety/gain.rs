//! How force comes and goes.

/// Time in which the whole force goes when it is asked to \[s\].
const FALL: f64 = 0.02;

/// The share of the force that comes through.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gain {
    value: f64,
    /// Where it goes, of the whole \[-\].
    top: f64,
    /// How long the whole takes to come \[s\].
    rise: f64,
    is_on: bool,
    /// It goes down to zero before it comes.
    is_restarting: bool,
    is_moving: bool,
}

impl Gain {
    pub(crate) fn new(rise: f64) -> Self {
        Self { value: 0.0, top: 1.0, rise: rise.max(FALL), is_on: true, is_restarting: false, is_moving: false }
    }

    pub(crate) fn set_rise(&mut self, rise: f64) {
        self.rise = rise.max(FALL);
    }

    pub(crate) fn value(&self) -> f64 {
        self.value
    }

    pub(crate) fn is_on(&self) -> bool {
        self.is_on
    }

    /// Whether it moved in the latest step, or stays at nothing.
    pub(crate) fn is_moving(&self) -> bool {
        self.is_moving
    }

    pub(crate) fn switch(&mut self, is_on: bool) {
        self.is_on = is_on;
    }

    pub(crate) fn restart(&mut self) {
        self.is_restarting = true;
    }

    /// Nothing, at once.
    pub(crate) fn trip(&mut self) {
        self.value = 0.0;
        self.is_restarting = false;
    }

    /// The most that comes through from now on.
    pub(crate) fn limit(&mut self, top: f64) {
        self.top = top;
    }

    /// A step of `dt` \[s\]: by how much it moved.
    pub(crate) fn advance(&mut self, dt: f64) -> f64 {
        let goal = if self.is_on && !self.is_restarting { self.top } else { 0.0 };
        let before = self.value;
        self.value = if goal > before { (before + dt / self.rise).min(goal) } else { (before - dt / FALL).max(goal) };
        self.is_restarting &= self.value > 0.0;
        self.is_moving = self.value != before || goal == 0.0;
        self.value - before
    }
}
