//! Impulse that the hand has felt too little or too much, made good while it touches.
//!
//! What a frame of the clay took, its mean force (at the ends of implicit steps) times the hand's time of it,
//! is known some frames later. What the hand felt less in the same time is owed to it; what was paid since is
//! not counted twice. The force felt is then off the clay's by a twentieth at most, and its impulse over a
//! stroke is the clay's.

use glam::DVec3;

/// Time in which what is owed is paid \[s\].
const TIME: f64 = 0.05;

/// Part of the force that is paid at most [-]: less than the 7 % by which a hand tells forces apart
/// (Pang, Tan and Durlach 1991).
const SHARE: f64 = 0.05;

/// What the clay's impulse is ahead of the hand's.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ledger {
    /// By the frames that have come \[N s\].
    found: DVec3,
    /// Paid in all, and of that up to the end of the last frame \[N s\].
    paid: DVec3,
    paid_before: DVec3,
}

impl Ledger {
    /// Paid in all \[N s\].
    pub(super) fn paid(&self) -> DVec3 {
        self.paid
    }

    /// Takes in a frame: by how much its impulse was more than the one felt, payments included, and what
    /// was paid up to its start and its end \[N s\]. What was paid in frames that were lost is paid.
    pub(super) fn enter(&mut self, more: DVec3, [start, end]: [DVec3; 2]) {
        self.found += more - (start - self.paid_before);
        self.paid_before = end;
    }

    /// A stroke has ended, and nothing is owed any more.
    pub(super) fn close(&mut self) {
        (self.found, self.paid_before) = (DVec3::ZERO, self.paid);
    }

    /// What is added to a force for `dt` \[s\].
    pub(super) fn pay(&mut self, force: DVec3, dt: f64) -> DVec3 {
        let owed = self.found - (self.paid - self.paid_before);
        let part = (owed / TIME).clamp_length_max(SHARE * force.length());
        self.paid += part * dt;
        part
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What frames say 30 ms late is paid once, never by more than a share of the force, and never without
    /// one.
    #[test]
    fn owed_impulse_is_paid_once() {
        const LATE: usize = 30;
        let (mut ledger, force) = (Ledger::default(), DVec3::Y);
        let (mut extra, mut paid) = (vec![], vec![ledger.paid()]);
        for tick in 0..1000usize {
            // The clay presses by a tenth more than the hand feels, for 100 ms.
            extra.push(if tick < 100 { DVec3::Y * 1e-4 } else { DVec3::ZERO });
            let part = ledger.pay(force, 1e-3);
            assert!(part.length() <= SHARE * force.length() + 1e-15);
            paid.push(ledger.paid());
            assert!(ledger.paid().y < 1.001e-2, "what frames do not know yet is not paid again");
            // Some of the frames after the clay has pressed are lost.
            let is_lost = tick > 200 && tick % 30 == 9;
            if tick % 10 == 9 && tick >= LATE + 9 && !is_lost {
                let [from, to] = [tick - LATE - 9, tick - LATE + 1];
                let more: DVec3 = extra[from..to].iter().sum();
                ledger.enter(more - (paid[to] - paid[from]), [paid[from], paid[to]]);
            }
        }
        let total = ledger.paid().y;
        assert!((total - 100.0 * 1e-4).abs() < 1e-6, "{total}");
        assert_eq!(ledger.pay(DVec3::ZERO, 1e-3), DVec3::ZERO);
        ledger.enter(DVec3::Y, [ledger.paid(); 2]);
        ledger.close();
        assert_eq!(ledger.pay(force, 1e-3), DVec3::ZERO);
    }
}
