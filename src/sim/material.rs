//! What the clay is made of: Hencky elasticity and a von Mises yield stress that may harden, creep and
//! soften.

use super::params::{Bounds, LENGTH, ParamsError};
use super::variants::variants;
use serde::{Deserialize, Serialize};

/// Distance from a tool \[cells\] within which Eq. 5 takes clay for near.
pub const SOFTENING_REACH: f64 = 3.0;

/// sqrt(2/3) [-]: |deviator| over equivalent stress, plastic strain over what flow shortens the deviator by.
pub(crate) const SQRT_2_3: f64 = 0.816_496_580_927_726;
/// The softening length tau of Eq. 5 where none is given \[cells\]: the paper names none.
pub const SOFTENING_LENGTH: f64 = 3.0;

/// The material parameters of clay. All SI.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClayMaterial {
    /// Density rho [kg/m^3].
    pub density: f64,
    /// Young's modulus E \[Pa\].
    pub young_modulus: f64,
    /// Poisson's ratio nu [-], -0.99 to 0.4999.
    pub poisson_ratio: f64,
    /// Yield stress sY in uniaxial tension \[Pa\]; infinite for purely elastic clay.
    pub yield_stress: f64,
    /// Softening s [-] in [0, 1): yield stress near the tool is sY (1 - s). 0 is uniform clay.
    #[serde(default)]
    pub softening: f64,
    /// Softening length tau \[m\] of Eq. 5; 0 stands for [`SOFTENING_LENGTH`].
    #[serde(default)]
    pub softening_length: f64,
    /// Hardening modulus H \[Pa\]: what the yield stress gains per plastic strain.
    #[serde(default)]
    pub hardening_modulus: f64,
    /// Consistency eta [Pa s^n] of Herschel-Bulkley flow: beyond yield the stress is
    /// `sY + H a + eta (da/dt)^n`. 0 is rate-independent clay.
    #[serde(default)]
    pub viscosity: f64,
    /// Flow index n [-] in (0, 1]; 1 is linear viscosity.
    #[serde(default = "one")]
    pub flow_index: f64,
    /// Toughness R [J/m^2]: the work that a blade's edge does for each new area that it cuts, so the force R
    /// per length of edge along its way. 0 is clay that an edge parts for nothing, as files without it mean
    /// it.
    #[serde(default)]
    pub toughness: f64,
    /// What softens the clay besides.
    #[serde(default)]
    pub law: ClayLaw,
    /// How the two sides of a cut grow together.
    #[serde(default)]
    pub weld: Weld,
}

/// How the two sides of a kept cut, pressed on each other, grow together to whole clay.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Weld {
    /// Pressed firmly for a while: at more than 0.5 k across the cut, k the shear strength, for 0.3 s. What
    /// cutting left pressed counts once it was released.
    #[default]
    Pressed,
    /// Almost at a touch, as wet clay does: at more than 0.05 k for 0.05 s.
    Sticky,
    /// Never: what is cut stays cut.
    Off,
}

variants! {
    /// Every rule.
    Weld: Pressed, Sticky, Off
}

impl Weld {
    /// The compressive stress across the cut \[k\] and the time \[s\] that it takes.
    pub(crate) fn rule(self) -> Option<(f64, f64)> {
        match self {
            Self::Pressed => Some((0.5, 0.3)),
            Self::Sticky => Some((0.05, 0.05)),
            Self::Off => None,
        }
    }
}

/// What a tool or the working of clay does to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub enum ClayLaw {
    /// The yield stress near a tool is `sY (1 - s zeta(d))`, zeta of Eq. 5. The elastic law does not know the
    /// tool.
    #[default]
    Softened,
    /// The same, and worked clay softens and stiffens again as it rests (thixotropy): the yield stress is
    /// also multiplied by `1 - loss D`, where the working D [-] follows
    /// `dD/dt = rate (1 - D) da/dt - D / rest_time` with the plastic strain a.
    Worked {
        /// Share of the yield stress that fully worked clay loses [-], in [0, 1).
        loss: f64,
        /// How fast working softens [1 per plastic strain].
        rate: f64,
        /// Time in which rest brings back all but 1/e of what was lost \[s\]; infinite for never.
        rest_time: f64,
    },
    /// Eq. 4-5 to the letter: no yield, the *stress* multiplied by zeta. Far clay loses its stress and energy
    /// is created: kept for reproduction, on the native engine and the oracle only. **Unstable.**
    AsPublished,
    /// The same with the usual default distance 0 where no tool is within 3 cells, which Eq. 5's second
    /// branch takes to a zeta above 1. **Unstable.**
    AsPublishedDefaultD,
}

variants! {
    /// Every law, with the numbers of plasticine where it has any.
    ClayLaw: Softened, Worked { loss: 0.3, rate: 2.0, rest_time: 600.0 }, AsPublished, AsPublishedDefaultD
}

impl ClayLaw {
    /// What to call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Softened => "softens near tools",
            Self::Worked { .. } => "softens when worked",
            Self::AsPublished => "Eq. 4-5 (unstable, for comparison)",
            Self::AsPublishedDefaultD => "Eq. 4-5, d = 0 (unstable, for comparison)",
        }
    }

    /// Its numbers by their names in files.
    pub fn numbers_mut(&mut self) -> Vec<(&'static str, &mut f64)> {
        match self {
            Self::Softened | Self::AsPublished | Self::AsPublishedDefaultD => vec![],
            Self::Worked { loss, rate, rest_time } => vec![("loss", loss), ("rate", rate), ("rest_time", rest_time)],
        }
    }

    /// Whether the law is Eq. 4-5 to the letter, in either reading.
    pub fn is_as_published(self) -> bool {
        match self {
            Self::Softened | Self::Worked { .. } => false,
            Self::AsPublished | Self::AsPublishedDefaultD => true,
        }
    }
}

/// Density. The greatest is far from clay's, and yet of use: clay of 1e15 kg/m^3 keeps the motion that a
/// validation case gives it, whatever its stresses. A kilometre of it has a mass that f32 holds.
const DENSITY: Bounds =
    Bounds::new(1e-3, 1e18, " kg/m^3", "must be finite and positive", "a thousandth of air's, and a neutron star's");
/// Young's modulus: diamond has 1.2e12 Pa. The f32 of the engines squares ratios of stresses, and 1e19 is the
/// root of what it holds.
const STIFFNESS: Bounds = Bounds::new(1e-6, 1e13, " Pa", "must be finite and positive", "diamond has 1.2e12 Pa");
/// Poisson's ratio: at the greatest, a frame takes 22 times the substeps that it takes at 0.45, the preset
/// clays'; near the least, frames are redone until the step is halved a few times.
const POISSON_RATIOS: (f64, f64) = (-0.99, 0.4999);
/// Yield stress.
const STRENGTH: Bounds = Bounds::new(1e-6, 1e13, " Pa", "must be positive (inf for elastic clay)", "diamond yields at 1e11 Pa");
/// Hardening modulus.
const HARDENING: Bounds = Bounds::new(0.0, 1e13, " Pa", "must be finite and not negative", "diamond yields at 1e11 Pa");
/// Consistency of flow: glass counts as solid at 1e12 Pa s.
const VISCOSITY: Bounds =
    Bounds::new(0.0, 1e13, " Pa s^n", "must be finite and not negative", "glass counts as solid at 1e12 Pa s");
/// Toughness: nacre and bone take some 1e4 J/m^2, the toughest metals 1e6.
const TOUGHNESS: Bounds =
    Bounds::new(0.0, 1e7, " J/m^2", "must be finite and not negative", "the toughest metals have 1e6 J/m^2");
/// Rate of working: at the greatest, a plastic strain of one in a million works the clay through.
const WORKING_RATE: Bounds =
    Bounds::new(0.0, 1e6, " per plastic strain", "must be finite and not negative", "a strain of 1e-6 works the clay through");
/// Softening length, where one is given.
const SOFTENING_LENGTHS: Bounds = Bounds::new(
    LENGTH.low,
    LENGTH.high,
    " m",
    "must be 0 (3 cells) or a positive length in metres",
    "a sheet in a grain of clay, and 10 km",
);

fn one() -> f64 {
    1.0
}

/// Named clays. But for the two taken from elsewhere, Young's modulus is 55 times the yield stress: a stiffer
/// clay costs substeps and adds under 10 % to shallow forces (slip-line indentation, rigidity index 33
/// against 100). What each number rests on: docs/EVIDENCE.md.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Preset {
    /// 8 kPa yield: worked pottery clay.
    SoftClay,
    /// 30 kPa yield, more when pressed fast, less when worked: modelling plasticine at room temperature.
    Plasticine,
    /// 100 kPa yield: leather-hard.
    StiffClay,
    /// 60 kPa yield, much more when pressed fast: modelling wax warmed in the hand.
    Wax,
    /// 2 kPa yield and viscous (Bingham): silicone putty, which gives way slowly.
    Putty,
    /// Young's modulus and Poisson's ratio of Yu et al.; the paper has neither yield stress nor density, and
    /// these, like the law, are of this crate.
    Paper,
    /// The default clay of VR-Doh (Luo et al. 2025), under the law of this crate.
    VrDoh,
}

impl Preset {
    /// Every preset.
    pub const ALL: [Self; 7] =
        [Self::SoftClay, Self::Plasticine, Self::StiffClay, Self::Wax, Self::Putty, Self::Paper, Self::VrDoh];

    /// What to call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::SoftClay => "soft clay",
            Self::Plasticine => "plasticine",
            Self::StiffClay => "leather-hard clay",
            Self::Wax => "warm wax",
            Self::Putty => "putty",
            Self::Paper => "paper (stiffness only)",
            Self::VrDoh => "VR-Doh default",
        }
    }

    /// The preset's parameters.
    pub fn material(self) -> ClayMaterial {
        let clay = ClayMaterial {
            density: 1700.0,
            young_modulus: 440e3,
            poisson_ratio: 0.45,
            yield_stress: 8e3,
            softening: 0.0,
            softening_length: 0.0,
            hardening_modulus: 0.0,
            viscosity: 0.0,
            flow_index: 1.0,
            toughness: 15.0,
            law: ClayLaw::Softened,
            weld: Weld::Pressed,
        };
        match self {
            Self::SoftClay => clay,
            Self::Plasticine => ClayMaterial {
                young_modulus: 1.65e6,
                yield_stress: 30e3,
                viscosity: 3e3,
                flow_index: 0.3,
                toughness: 55.0,
                law: ClayLaw::Worked { loss: 0.3, rate: 2.0, rest_time: 600.0 },
                ..clay
            },
            Self::StiffClay => ClayMaterial { young_modulus: 5.5e6, yield_stress: 100e3, toughness: 180.0, ..clay },
            Self::Wax => ClayMaterial {
                density: 960.0,
                young_modulus: 3.3e6,
                yield_stress: 60e3,
                viscosity: 30e3,
                flow_index: 0.4,
                toughness: 110.0,
                ..clay
            },
            Self::Putty => {
                ClayMaterial { density: 1520.0, young_modulus: 110e3, yield_stress: 2e3, viscosity: 5e3, toughness: 4.0, ..clay }
            }
            Self::Paper => ClayMaterial { young_modulus: 1e5, poisson_ratio: 0.1, yield_stress: 2e3, toughness: 5.0, ..clay },
            Self::VrDoh => ClayMaterial {
                density: 1000.0,
                young_modulus: 1e4,
                poisson_ratio: 0.3,
                yield_stress: 1e3,
                toughness: 11.0,
                ..clay
            },
        }
    }
}

impl Default for ClayMaterial {
    fn default() -> Self {
        Preset::SoftClay.material()
    }
}

impl ClayMaterial {
    /// Shear modulus mu \[Pa\].
    pub fn lame_mu(&self) -> f64 {
        self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))
    }

    /// First Lame parameter lambda \[Pa\].
    pub fn lame_lambda(&self) -> f64 {
        self.young_modulus * self.poisson_ratio / ((1.0 + self.poisson_ratio) * (1.0 - 2.0 * self.poisson_ratio))
    }

    /// Bulk modulus K \[Pa\].
    pub fn bulk_modulus(&self) -> f64 {
        self.young_modulus / (3.0 * (1.0 - 2.0 * self.poisson_ratio))
    }

    /// Speed of the dilatational wave c [m/s] at `density` [kg/m^3].
    pub fn wave_speed(&self, density: f64) -> f64 {
        ((self.lame_lambda() + 2.0 * self.lame_mu()) / density).sqrt()
    }

    /// Shear strength k = sY / sqrt 3 \[Pa\].
    pub fn shear_strength(&self) -> f64 {
        self.yield_stress / 3f64.sqrt()
    }

    /// Largest stable time step \[s\] of an isolated particle, the stiffest case of explicit MLS-MPM with
    /// quadratic splines: `dx sqrt(rho / (3 K))`. From `C' = C - 4 dt tau / (rho dx^2)`; a test bisects for
    /// it.
    pub fn time_step_limit(&self, cell_width: f64, density: f64) -> f64 {
        cell_width * (density / (3.0 * self.bulk_modulus())).sqrt()
    }

    /// Softening length tau \[m\] with 0 read as [`SOFTENING_LENGTH`].
    pub fn softening_length_or_default(&self, cell_width: f64) -> f64 {
        if self.softening_length > 0.0 { self.softening_length } else { SOFTENING_LENGTH * cell_width }
    }

    /// zeta [-] of Eq. 5 at `distance` \[m\] from the nearest tool, read so that clay within
    /// [`SOFTENING_REACH`] is near, d = 0 too.
    pub fn softening_zeta(&self, distance: f64, cell_width: f64) -> f64 {
        let beyond = distance.abs() - SOFTENING_REACH * cell_width;
        if beyond <= 0.0 { 1.0 } else { (-beyond / self.softening_length_or_default(cell_width)).exp() }
    }

    /// Yield stress \[Pa\] of fresh clay at `distance` \[m\] from the nearest tool: `sY (1 - s zeta)`;
    /// infinite under the laws as published.
    pub fn yield_stress_at(&self, distance: f64, cell_width: f64) -> f64 {
        if self.law.is_as_published() {
            return f64::INFINITY;
        }
        self.yield_stress * (1.0 - self.softening * self.softening_zeta(distance, cell_width))
    }

    /// Present yield stress \[Pa\] at `distance` \[m\] from the nearest tool of clay that was worked to D =
    /// `structure` [-] and has the plastic strain `hardening` [-]:
    /// `sY (1 - s zeta) (1 - loss D) + H hardening`.
    pub fn flow_stress_at(&self, distance: f64, cell_width: f64, structure: f64, hardening: f64) -> f64 {
        let lost = match self.law {
            ClayLaw::Worked { loss, .. } => loss * structure,
            ClayLaw::Softened | ClayLaw::AsPublished | ClayLaw::AsPublishedDefaultD => 0.0,
        };
        self.yield_stress_at(distance, cell_width) * (1.0 - lost) + self.hardening_modulus * hardening
    }

    /// The working D [-] after a substep of `dt` \[s\] with `plastic_strain` [-], from `structure` [-]
    /// before: exact for a constant rate in turn with rest, `1 - D *= exp(-rate a)`, then `D *= exp(-dt /
    /// rest_time)`. Clay of other laws keeps what it has.
    pub fn structure_after(&self, structure: f64, plastic_strain: f64, dt: f64) -> f64 {
        match self.law {
            ClayLaw::Worked { rate, rest_time, .. } => {
                (1.0 - (1.0 - structure) * (-rate * plastic_strain).exp()) * (-dt / rest_time).exp()
            }
            ClayLaw::Softened | ClayLaw::AsPublished | ClayLaw::AsPublishedDefaultD => structure,
        }
    }

    /// What multiplies the stress [-] at `distance` \[m\] from the nearest tool: 1 but for the laws as
    /// published, where it is zeta of Eq. 5 to the letter.
    pub fn stress_factor_at(&self, distance: f64, cell_width: f64) -> f64 {
        let (reach, length) = (SOFTENING_REACH * cell_width, self.softening_length_or_default(cell_width));
        match self.law {
            ClayLaw::Softened | ClayLaw::Worked { .. } => 1.0,
            // The branch for near clay excludes d = 0.
            ClayLaw::AsPublished if distance > 0.0 && distance <= reach => 1.0,
            ClayLaw::AsPublished => (-(distance - reach) / length).exp(),
            ClayLaw::AsPublishedDefaultD if distance <= reach => 1.0,
            ClayLaw::AsPublishedDefaultD => (reach / length).exp(),
        }
    }

    /// Checks every parameter.
    ///
    /// # Errors
    /// The first parameter that is out of its range, by name.
    pub fn validate(&self) -> Result<(), ParamsError> {
        DENSITY.check("density", self.density)?;
        STIFFNESS.check("young_modulus", self.young_modulus)?;
        let (low, high) = POISSON_RATIOS;
        if !(low..=high).contains(&self.poisson_ratio) {
            let reason = format!(
                "must lie in {low} to {high}: at -1 the shear modulus is infinite, at 0.5 the bulk modulus, and the time step is 0"
            );
            return Err(ParamsError::new("poisson_ratio", self.poisson_ratio, reason));
        }
        if self.yield_stress != f64::INFINITY {
            STRENGTH.check("yield_stress", self.yield_stress)?;
        }
        if !(0.0..1.0).contains(&self.softening) {
            return Err(ParamsError::new("softening", self.softening, "must lie in [0, 1)"));
        }
        if self.softening_length != 0.0 {
            SOFTENING_LENGTHS.check("softening_length", self.softening_length)?;
        }
        self.validate_flow()
    }

    fn validate_flow(&self) -> Result<(), ParamsError> {
        HARDENING.check("hardening_modulus", self.hardening_modulus)?;
        VISCOSITY.check("viscosity", self.viscosity)?;
        // Below 0.05 the stress hardly knows the rate, and the return map's powers leave the range of f32.
        if !(0.05..=1.0).contains(&self.flow_index) {
            return Err(ParamsError::new("flow_index", self.flow_index, "must lie in [0.05, 1]"));
        }
        TOUGHNESS.check("toughness", self.toughness)?;
        match self.law {
            ClayLaw::Softened | ClayLaw::AsPublished | ClayLaw::AsPublishedDefaultD => Ok(()),
            ClayLaw::Worked { loss, .. } if !(0.0..1.0).contains(&loss) => {
                Err(ParamsError::new("loss", loss, "must lie in [0, 1)"))
            }
            ClayLaw::Worked { rest_time, .. } if rest_time.is_nan() || rest_time <= 0.0 => {
                Err(ParamsError::new("rest_time", rest_time, "must be a positive time in seconds, or inf"))
            }
            ClayLaw::Worked { rate, .. } => WORKING_RATE.check("rate", rate),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eq. 5 to the letter excludes d = 0 from its near branch and takes it to a zeta above 1; as meant, clay
    /// at the tool is near. With the distance that far particles hold by default, far clay is stiffer than
    /// near clay.
    #[test]
    fn zeta_to_the_letter_and_as_meant() {
        let clay = |law| ClayMaterial { law, softening: 0.5, softening_length: 0.3, ..ClayMaterial::default() };
        let cell = 1.0 / 60.0;
        let published = clay(ClayLaw::AsPublished);
        let far = (0.3 - 3.0 * cell) / 0.3;
        let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
        assert!(close(published.stress_factor_at(0.0, cell), (3.0 * cell / 0.3).exp()));
        assert!(close(published.stress_factor_at(1e-9, cell), 1.0) && close(published.stress_factor_at(3.0 * cell, cell), 1.0));
        assert!(close(published.stress_factor_at(0.3, cell), (-far).exp()));
        assert_eq!(published.yield_stress_at(0.0, cell), f64::INFINITY);
        let default_d = clay(ClayLaw::AsPublishedDefaultD);
        assert!((default_d.stress_factor_at(0.3, cell) - 1.18).abs() < 0.01 && close(default_d.stress_factor_at(0.0, cell), 1.0));
        let meant = clay(ClayLaw::Softened);
        assert!(close(meant.stress_factor_at(0.0, cell), 1.0));
        assert!(close(meant.yield_stress_at(0.0, cell), 0.5 * meant.yield_stress));
        assert!(close(meant.yield_stress_at(0.3, cell), meant.yield_stress * (1.0 - 0.5 * (-far).exp())));
    }

    /// Each parameter out of its range is named.
    #[test]
    fn bad_flow_is_named() {
        let fresh = ClayMaterial::default();
        let worked = |loss, rate, rest_time| ClayMaterial { law: ClayLaw::Worked { loss, rate, rest_time }, ..fresh };
        let bad = [
            ("hardening_modulus", ClayMaterial { hardening_modulus: -1.0, ..fresh }),
            ("viscosity", ClayMaterial { viscosity: f64::NAN, ..fresh }),
            ("flow_index", ClayMaterial { flow_index: 0.0, ..fresh }),
            ("flow_index", ClayMaterial { flow_index: 1.5, ..fresh }),
            ("toughness", ClayMaterial { toughness: -1.0, ..fresh }),
            ("toughness", ClayMaterial { toughness: f64::INFINITY, ..fresh }),
            ("loss", worked(1.0, 1.0, 1.0)),
            ("rate", worked(0.5, -1.0, 1.0)),
            ("rest_time", worked(0.5, 1.0, 0.0)),
        ];
        for (name, material) in bad {
            assert_eq!(material.validate().map_err(|e| e.name), Err(name));
        }
        assert_eq!(worked(0.5, 1.0, f64::INFINITY).validate(), Ok(()));
    }
}
