//! What can go wrong in a frame, as bits that the engine acts on before it reports them.

use serde::{Deserialize, Serialize};

/// Health bits of a frame. Zero is healthy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Health(u32);

impl Health {
    /// Nothing to report.
    pub const OK: Self = Self(0);
    /// A node moved further than a particle's margin in one substep, or a particle further than its stencil
    /// follows in one implicit step; the frame was redone with half the time step.
    pub const SPEED: Self = Self(1);
    /// A value that is not finite appeared; the frame was redone with half the time step.
    pub const NON_FINITE: Self = Self(1 << 1);
    /// A principal stretch of a particle left 0.05 .. 20 and was clamped.
    pub const STRAIN: Self = Self(1 << 2);
    /// The frame could not be run even after halving the step: the clay stands as it was before the frame.
    pub const GIVEN_UP: Self = Self(1 << 3);
    /// Particles were not finite when loaded; they are frozen out and counted.
    pub const QUARANTINED: Self = Self(1 << 4);
    /// The grid mass differs from the particle mass: a particle lies outside the room.
    pub const MASS_LOST: Self = Self(1 << 5);
    /// More cuts met in one place than the engine tells apart, or there are more in the clay than there are
    /// sheets: where they meet, the clay of some of them moves as if it was not cut.
    pub const CROWDED: Self = Self(1 << 6);
    /// The clay asked for more room, or for a greater range of sums, than the graphics device gave it however
    /// often it asked; the frame was redone with half the time step.
    pub const CAPACITY: Self = Self(1 << 7);

    /// Whether all bits of `other` are set.
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Whether nothing is wrong.
    pub fn is_ok(self) -> bool {
        self.0 == 0
    }

    /// The bits that `other` does not have.
    #[must_use]
    pub fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Sets the bits of `other`.
    pub fn insert(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

impl std::fmt::Display for Health {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        const NAMES: [(Health, &str); 8] = [
            (Health::SPEED, "the clay moved too far in one step (frame redone with a smaller one)"),
            (Health::NON_FINITE, "a value was not finite (frame redone with a smaller step)"),
            (Health::STRAIN, "a particle's stretch was clamped to 0.05 .. 20"),
            (Health::GIVEN_UP, "the frame was given up: the clay stands as before it"),
            (Health::QUARANTINED, "particles that are not finite were frozen out"),
            (Health::MASS_LOST, "grid mass differs from particle mass"),
            (Health::CROWDED, "too many cuts: where they meet some of them act as if they had grown together"),
            (Health::CAPACITY, "the clay outgrew its room on the graphics device (frame redone with a smaller step)"),
        ];
        if self.is_ok() {
            return f.write_str("healthy");
        }
        let mut separator = "";
        for (bit, text) in NAMES {
            if self.contains(bit) {
                write!(f, "{separator}{text}")?;
                separator = "; ";
            }
        }
        Ok(())
    }
}
