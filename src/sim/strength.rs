//! The present shear strength of clay at a tool: worked, hardened, flowing.

use super::material::{ClayLaw, ClayMaterial};

/// How the shear strength of clay at a tool falls with what the clay has gone through, of that of fresh clay.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StrengthLoss {
    /// What fully worked clay loses [-].
    pub loss: f64,
    /// What clay gains per plastic strain [-].
    pub gain: f64,
}

impl StrengthLoss {
    /// Whether clay remembers anything in its strength.
    pub fn is_any(&self) -> bool {
        self.loss > 0.0 || self.gain > 0.0
    }

    /// What is lost [-] of clay that was worked to D = `structure` [-] and has the plastic strain `hardening`
    /// [-]: less than 0 where it has gained.
    pub fn of(&self, structure: f64, hardening: f64) -> f64 {
        self.loss * structure - self.gain * hardening
    }
}

impl ClayMaterial {
    /// Shear strength k \[Pa\] of fresh clay at a tool, which may [soften](Self::softening) it.
    pub fn shear_strength_at_tool(&self) -> f64 {
        if self.law.is_as_published() { self.shear_strength() } else { self.yield_stress_at(0.0, 1.0) / 3f64.sqrt() }
    }

    /// What flow adds to it \[Pa\] at a shear rate [1/s], in clay of this viscosity.
    pub fn viscous_shear_stress(&self, rate: f64) -> f64 {
        self.viscosity * (rate / 3f64.sqrt()).powf(self.flow_index) / 3f64.sqrt()
    }

    /// How it falls with what clay has gone through.
    pub fn strength_loss(&self) -> StrengthLoss {
        let fresh = self.yield_stress_at(0.0, 1.0);
        if fresh.is_infinite() {
            return StrengthLoss::default();
        }
        let loss = match self.law {
            ClayLaw::Worked { loss, .. } => loss,
            ClayLaw::Softened | ClayLaw::AsPublished | ClayLaw::AsPublishedDefaultD => 0.0,
        };
        StrengthLoss { loss, gain: self.hardening_modulus / fresh }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is lost of the strength at a tool is what the flow stress there has less than fresh clay's; shear
    /// and tension of viscous flow are von Mises'.
    #[test]
    fn strength_at_tools_is_the_flow_stress() {
        let law = ClayLaw::Worked { loss: 0.4, rate: 1.0, rest_time: 9.0 };
        let clay = ClayMaterial {
            law,
            softening: 0.3,
            hardening_modulus: 2e3,
            viscosity: 50.0,
            flow_index: 0.5,
            ..ClayMaterial::default()
        };
        let found = clay.shear_strength_at_tool() * (1.0 - clay.strength_loss().of(0.6, 0.2));
        assert!((found - clay.flow_stress_at(0.0, 1.0, 0.6, 0.2) / 3f64.sqrt()).abs() < 1e-9, "{found}");
        // The rate 4 sqrt 3 of shear is the rate 4 of strain.
        assert!((clay.viscous_shear_stress(4.0 * 3f64.sqrt()) - 100.0 / 3f64.sqrt()).abs() < 1e-9);
        let elastic = ClayMaterial { yield_stress: f64::INFINITY, ..clay };
        assert_eq!((elastic.shear_strength_at_tool(), elastic.strength_loss().is_any()), (f64::INFINITY, false));
    }
}
