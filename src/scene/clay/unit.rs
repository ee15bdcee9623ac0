//! Numbers with units: `"1.65 MPa"` is 1.65e6.

/// What a number of a clay file measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dimension {
    Stress,
    Density,
    Length,
    Time,
    /// Of Herschel-Bulkley flow; its unit depends on the flow index n.
    Consistency,
    /// Work per new area.
    Toughness,
    Ratio,
}

/// The longest text that is read as a number with a unit \[bytes\].
const TEXT_MAX: usize = 64;

/// A unit: its symbol and how many SI units it is, as a factor and a divisor so that `"45 %"` is 0.45 to the
/// last bit.
type Unit = (&'static str, f64, f64);

impl Dimension {
    const ALL: [Self; 7] =
        [Self::Stress, Self::Density, Self::Length, Self::Time, Self::Consistency, Self::Toughness, Self::Ratio];

    fn name(self) -> &'static str {
        match self {
            Self::Stress => "stress",
            Self::Density => "density",
            Self::Length => "length",
            Self::Time => "time",
            Self::Consistency => "viscosity",
            Self::Toughness => "toughness",
            Self::Ratio => "ratio",
        }
    }

    /// The units it may be given in.
    fn units(self) -> &'static [Unit] {
        match self {
            Self::Stress => &[("Pa", 1.0, 1.0), ("kPa", 1e3, 1.0), ("MPa", 1e6, 1.0), ("GPa", 1e9, 1.0)],
            Self::Density => &[("kg/m^3", 1.0, 1.0), ("g/cm^3", 1e3, 1.0)],
            Self::Length => &[("mm", 1.0, 1e3), ("cm", 1.0, 1e2), ("m", 1.0, 1.0)],
            Self::Time => &[("s", 1.0, 1.0), ("min", 60.0, 1.0), ("h", 3600.0, 1.0)],
            Self::Consistency => &[("Pa s^n", 1.0, 1.0), ("kPa s^n", 1e3, 1.0)],
            Self::Toughness => &[("J/m^2", 1.0, 1.0), ("kJ/m^2", 1e3, 1.0), ("N/m", 1.0, 1.0)],
            Self::Ratio => &[("%", 1.0, 100.0)],
        }
    }

    fn find(self, symbol: &str) -> Option<Unit> {
        self.units().iter().copied().find(|unit| plain(unit.0) == symbol)
    }

    /// The units in words.
    fn units_text(self) -> String {
        self.units().iter().map(|unit| unit.0).collect::<Vec<_>>().join(", ")
    }

    /// The number that `text` says, in SI units.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub(super) fn read(self, text: &str) -> Result<f64, String> {
        let Some((number, symbol)) = split(text.trim()) else { return Err("must begin with a number".into()) };
        if symbol.starts_with(',') {
            return Err("must be written with a decimal point".into());
        }
        if let Some((_, times, over)) = self.find(&plain(symbol)) {
            return Ok(number * times / over);
        }
        if symbol.is_empty() {
            return if self == Self::Ratio { Ok(number) } else { Err(format!("needs a unit: {}", self.units_text())) };
        }
        let other = Self::ALL.into_iter().find(|dimension| dimension.find(&plain(symbol)).is_some());
        let known = self.units_text();
        Err(match other {
            Some(other) => format!("`{symbol}` is a unit of {}; a {} is given in {known}", other.name(), self.name()),
            None => format!("`{symbol}` is no unit that is known here; a {} is given in {known}", self.name()),
        })
    }
}

/// A symbol without what may be written in more than one way: blanks, multiplication dots, raised digits.
fn plain(symbol: &str) -> String {
    let skipped = |c: &char| !(c.is_whitespace() || matches!(c, '*' | '·'));
    symbol.replace('²', "^2").replace('³', "^3").replace('ⁿ', "^n").chars().filter(skipped).collect()
}

/// The number that a text begins with, and the rest.
fn split(text: &str) -> Option<(f64, &str)> {
    if text.len() > TEXT_MAX {
        return None;
    }
    // The longest beginning that is a number: "1e3Pa" is 1000 Pa.
    let ends = (1..=text.len()).rev().filter(|end| text.is_char_boundary(*end));
    ends.map(|end| text.split_at(end)).find_map(|(number, rest)| Some((number.trim_end().parse().ok()?, rest.trim_start())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_read_to_the_last_bit() {
        let cases = [
            (Dimension::Stress, "30 kPa", 30e3),
            (Dimension::Stress, "1.65 MPa", 1.65e6),
            (Dimension::Stress, " 1e3Pa ", 1e3),
            (Dimension::Stress, "0.2GPa", 2e8),
            (Dimension::Stress, "inf Pa", f64::INFINITY),
            (Dimension::Density, "1700 kg/m^3", 1700.0),
            (Dimension::Density, "1.7 g/cm³", 1700.0),
            (Dimension::Length, "3 mm", 0.003),
            (Dimension::Length, "0.3 cm", 0.003),
            (Dimension::Length, "2m", 2.0),
            (Dimension::Time, "10 min", 600.0),
            (Dimension::Time, "1.5 h", 5400.0),
            (Dimension::Consistency, "20 Pa s^n", 20.0),
            (Dimension::Consistency, "3 kPa·sⁿ", 3e3),
            (Dimension::Toughness, "15 J/m²", 15.0),
            (Dimension::Toughness, "0.2 kJ/m^2", 200.0),
            (Dimension::Ratio, "45 %", 0.45),
            (Dimension::Ratio, "2", 2.0),
        ];
        for (dimension, text, value) in cases {
            assert_eq!(dimension.read(text), Ok(value), "{text}");
        }
    }

    #[test]
    fn other_texts_are_refused_in_words() {
        let long = "1".repeat(1 << 20);
        let cases = [
            (Dimension::Stress, "", "must begin with a number"),
            (Dimension::Stress, "kPa", "must begin with a number"),
            (Dimension::Stress, &long, "must begin with a number"),
            (Dimension::Stress, "30", "needs a unit: Pa, kPa, MPa, GPa"),
            (Dimension::Stress, "1,65 MPa", "decimal point"),
            (Dimension::Stress, "30 mm", "`mm` is a unit of length; a stress is given in Pa"),
            (Dimension::Stress, "30 KPa", "`KPa` is no unit that is known here; a stress is given in Pa, kPa"),
            (Dimension::Stress, "30 k Pa Pa", "no unit that is known"),
            (Dimension::Density, "1.7 t/m^3", "a density is given in kg/m^3, g/cm^3"),
            (Dimension::Consistency, "20 Pa s", "a viscosity is given in Pa s^n, kPa s^n"),
            (Dimension::Toughness, "15 J", "a toughness is given in J/m^2, kJ/m^2, N/m"),
            (Dimension::Time, "10 m", "`m` is a unit of length"),
            (Dimension::Ratio, "3 Pa", "`Pa` is a unit of stress; a ratio is given in %"),
        ];
        for (dimension, text, part) in cases {
            let error = dimension.read(text).expect_err(text);
            assert!(error.contains(part), "`{text}` gave `{error}`");
        }
    }
}
