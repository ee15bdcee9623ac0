//! Values checked where they stand in a file, so that the parser knows the line of the error.

use crate::sim::params::{Bounds, GRAVITY, LENGTH, ParamsError, TIME};
use glam::DVec3;
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt;

/// Factors of a mesh's lengths: from kilometres to nanometres. What comes of them is checked by itself.
const SCALE: Bounds = Bounds::new(1e-9, 1e9, "", "must be positive", "from kilometres to less than nanometres");
/// Particles per cell: more than 4 along an edge add cost and no accuracy.
const PARTICLES_PER_CELL: Bounds = Bounds::new(1.0, 64.0, "", "must lie in 1 to 64", "4 along each edge of a cell");

/// A value that knows its own bounds.
pub(super) trait Check {
    fn check(&self) -> Result<(), ParamsError>;
}

/// Checks a number by the name of its field.
pub(super) fn check_number(name: &'static str, value: f64) -> Result<(), ParamsError> {
    match name {
        "jitter" if !(0.0..0.5).contains(&value) => Err(ParamsError::new(name, value, "must lie in [0, 0.5)")),
        "softening" if !(0.0..1.0).contains(&value) => Err(ParamsError::new(name, value, "must lie in [0, 1)")),
        "jitter" | "softening" => Ok(()),
        "particles_per_cell" => {
            PARTICLES_PER_CELL.check(name, value)?;
            if value.fract() == 0.0 { Ok(()) } else { Err(ParamsError::new(name, value, "must be a whole number")) }
        }
        "scale" => SCALE.check(name, value),
        "frame_time" | "duration" | "time_step" => TIME.check(name, value),
        _ => LENGTH.check(name, value),
    }
}

/// Checks a place by the name of its field.
pub(super) fn check_place(name: &'static str, place: DVec3) -> Result<(), ParamsError> {
    LENGTH.check_vector(name, place)
}

/// Reads a value and checks it.
pub(super) fn checked<'de, D: Deserializer<'de>, T: Deserialize<'de> + Check>(deserializer: D) -> Result<T, D::Error> {
    let value = T::deserialize(deserializer)?;
    value.check().map_err(D::Error::custom)?;
    Ok(value)
}

struct Checked<T>(T);

impl<'de, T: Deserialize<'de> + Check> Deserialize<'de> for Checked<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        checked(deserializer).map(Self)
    }
}

/// [`checked`] for each of a list.
pub(super) fn checked_list<'de, D: Deserializer<'de>, T: Deserialize<'de> + Check>(deserializer: D) -> Result<Vec<T>, D::Error> {
    Ok(Vec::<Checked<T>>::deserialize(deserializer)?.into_iter().map(|checked| checked.0).collect())
}

/// [`checked`] for what may be left out.
pub(super) fn checked_option<'de, D: Deserializer<'de>, T: Deserialize<'de> + Check>(
    deserializer: D,
) -> Result<Option<T>, D::Error> {
    Ok(Option::<Checked<T>>::deserialize(deserializer)?.map(|checked| checked.0))
}

macro_rules! checked_numbers {
    ($($name:ident),*) => {$(
        pub(super) fn $name<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
            let value = f64::deserialize(deserializer)?;
            check_number(stringify!($name), value).map_err(D::Error::custom)?;
            Ok(value)
        }
    )*};
}

checked_numbers!(cell_width, jitter, frame_time, duration);

macro_rules! checked_options {
    ($($name:ident),*) => {$(
        pub(super) fn $name<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<f64>, D::Error> {
            let value = Option::<f64>::deserialize(deserializer)?;
            value.map_or(Ok(()), |value| check_number(stringify!($name), value)).map_err(D::Error::custom)?;
            Ok(value)
        }
    )*};
}

checked_options!(time_step, softening);

pub(super) fn particles_per_cell<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    // As any number: a parser of whole numbers stops at the point, and says nothing of the field.
    let value = f64::deserialize(deserializer)?;
    check_number("particles_per_cell", value).map_err(D::Error::custom)?;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number within its bounds")]
    Ok(value as u32)
}

pub(super) fn seed<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u64, D::Error> {
    deserializer.deserialize_any(Seed)
}

/// Reads a seed out of any number.
struct Seed;

impl Visitor<'_> for Seed {
    type Value = u64;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a whole number")
    }

    fn visit_u64<E: Error>(self, seed: u64) -> Result<u64, E> {
        Ok(seed)
    }

    fn visit_i64<E: Error>(self, seed: i64) -> Result<u64, E> {
        u64::try_from(seed).map_err(|_| no_seed(seed))
    }

    fn visit_f64<E: Error>(self, seed: f64) -> Result<u64, E> {
        Err(no_seed(seed))
    }
}

fn no_seed<E: Error>(value: impl fmt::Display) -> E {
    E::custom(ParamsError::new("seed", value, format!("must be a whole number from 0 to {}", u64::MAX)))
}

pub(super) fn gravity<'de, D: Deserializer<'de>>(deserializer: D) -> Result<DVec3, D::Error> {
    let value = DVec3::deserialize(deserializer)?;
    GRAVITY.check_vector("gravity", value).map_err(D::Error::custom)?;
    Ok(value)
}
