//! The keys of a clay file.

use super::unit::Dimension;
use crate::sim::material::{ClayLaw, ClayMaterial};

/// What stands behind a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Text,
    Number(Dimension),
    Law,
    Weld,
}

/// A key.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Field {
    pub(super) name: &'static str,
    pub(super) kind: Kind,
}

const fn number(name: &'static str, dimension: Dimension) -> Field {
    Field { name, kind: Kind::Number(dimension) }
}

/// The keys of a file: where it starts from, its name, and the fields of [`ClayMaterial`].
pub(super) const FIELDS: [Field; 14] = [
    Field { name: "extends", kind: Kind::Text },
    Field { name: "name", kind: Kind::Text },
    number("density", Dimension::Density),
    number("young_modulus", Dimension::Stress),
    number("poisson_ratio", Dimension::Ratio),
    number("yield_stress", Dimension::Stress),
    number("softening", Dimension::Ratio),
    number("softening_length", Dimension::Length),
    number("hardening_modulus", Dimension::Stress),
    number("viscosity", Dimension::Consistency),
    number("flow_index", Dimension::Ratio),
    number("toughness", Dimension::Toughness),
    Field { name: "law", kind: Kind::Law },
    Field { name: "weld", kind: Kind::Weld },
];

/// The laws by name.
pub(super) const LAWS: [&str; ClayLaw::ALL.len()] = {
    let mut names = [""; ClayLaw::ALL.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = ClayLaw::ALL[i].identifier();
        i += 1;
    }
    names
};

/// The weld rules by name, in the order of [`Weld::ALL`](crate::sim::material::Weld::ALL).
pub(super) const WELDS: [&str; 3] = ["Pressed", "Sticky", "Off"];

/// The numbers of laws.
pub(super) const LAW_NUMBERS: [Field; 3] =
    [number("loss", Dimension::Ratio), number("rate", Dimension::Ratio), number("rest_time", Dimension::Time)];

/// The number of `material` with this name.
pub(super) fn number_mut<'a>(material: &'a mut ClayMaterial, name: &str) -> Option<&'a mut f64> {
    Some(match name {
        "density" => &mut material.density,
        "young_modulus" => &mut material.young_modulus,
        "poisson_ratio" => &mut material.poisson_ratio,
        "yield_stress" => &mut material.yield_stress,
        "softening" => &mut material.softening,
        "softening_length" => &mut material.softening_length,
        "hardening_modulus" => &mut material.hardening_modulus,
        "viscosity" => &mut material.viscosity,
        "flow_index" => &mut material.flow_index,
        "toughness" => &mut material.toughness,
        _ => return None,
    })
}

/// The law of this name with the numbers that `numbers` gives or `before`, a law of the same name, has; else
/// the name of the one that is missing.
pub(super) fn law(name: &str, numbers: impl Fn(&str) -> Option<f64>, mut before: ClayLaw) -> Result<ClayLaw, &'static str> {
    let mut law = ClayLaw::ALL.into_iter().find(|law| law.identifier() == name).unwrap_or_default();
    let is_same = before.identifier() == law.identifier();
    let mut kept = before.numbers_mut().into_iter().map(|(_, number)| *number).filter(|_| is_same);
    for (name, number) in law.numbers_mut() {
        *number = numbers(name).or(kept.next()).ok_or(name)?;
    }
    Ok(law)
}
