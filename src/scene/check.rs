//! Values checked where they stand in a file, so that the parser knows the line of the error.

use crate::sim::params::{Bounds, GRAVITY, LENGTH, ParamsError, TIME};
use glam::DVec3;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

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
        "particles_per_cell" => PARTICLES_PER_CELL.check(name, value),
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
    let value = u32::deserialize(deserializer)?;
    check_number("particles_per_cell", f64::from(value)).map_err(D::Error::custom)?;
    Ok(value)
}

pub(super) fn gravity<'de, D: Deserializer<'de>>(deserializer: D) -> Result<DVec3, D::Error> {
    let value = DVec3::deserialize(deserializer)?;
    GRAVITY.check_vector("gravity", value).map_err(D::Error::custom)?;
    Ok(value)
}
