//! From the text of a clay file to its entries, each with its place; keys that nobody knows are kept apart.

use super::field::{FIELDS, Field, Kind, LAW_NUMBERS, LAWS, WELDS};
use crate::scene::error::SceneError;
use crate::scene::line::short;
use crate::scene::text::fault;
use crate::sim::material::{ClayLaw, Weld};
use serde::de::{DeserializeSeed, Deserializer, EnumAccess, Error, IgnoredAny, MapAccess, VariantAccess, Visitor};
use std::fmt;

/// Line and column, from 1.
pub(super) type Place = (usize, usize);

/// What stands behind a key.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Number(f64),
    Text(String),
    /// A law by name, with the numbers given for it.
    Law(&'static str, Vec<Entry>),
    Weld(Weld),
}

/// A key that is known, and what stands behind it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Entry {
    pub(super) field: &'static Field,
    pub(super) place: Place,
    pub(super) value: Value,
}

/// What a file says.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Sheet {
    pub(super) entries: Vec<Entry>,
    /// Keys that are not known, with a guess at what was meant.
    pub(super) unknown: Vec<(Place, String, Option<&'static str>)>,
}

impl Sheet {
    /// Reads the text of `file`.
    pub(super) fn read(text: &str, file: &str) -> Result<Self, SceneError> {
        let mut sheet = Self::default();
        let top = Struct { text, known: &FIELDS, unknown: &mut sheet.unknown };
        let entries = ron::Options::default().from_str_seed(text, top).map_err(|error| fault(file, &error, ""))?;
        sheet.entries = entries;
        Ok(sheet)
    }
}

/// Where `part`, a piece of `text` itself, begins.
fn place(text: &str, part: &str) -> Place {
    let offset = (part.as_ptr() as usize).saturating_sub(text.as_ptr() as usize);
    let before = text.get(..offset).unwrap_or_default();
    let line = before.rsplit('\n').next().unwrap_or_default();
    (before.matches('\n').count() + 1, line.chars().count() + 1)
}

/// A key, as it stands in the text.
struct Key;

impl<'de> DeserializeSeed<'de> for Key {
    type Value = &'de str;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<&'de str, D::Error> {
        deserializer.deserialize_identifier(self)
    }
}

impl<'de> Visitor<'de> for Key {
    type Value = &'de str;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("a name")
    }

    fn visit_borrowed_str<E: Error>(self, name: &'de str) -> Result<&'de str, E> {
        Ok(name)
    }
}

/// Keys and values in brackets.
struct Struct<'a> {
    text: &'a str,
    known: &'static [Field],
    unknown: &'a mut Vec<(Place, String, Option<&'static str>)>,
}

impl<'de> DeserializeSeed<'de> for Struct<'_> {
    type Value = Vec<Entry>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Vec<Entry>, D::Error> {
        deserializer.deserialize_struct("Clay", &[], self)
    }
}

impl<'de> Visitor<'de> for Struct<'_> {
    type Value = Vec<Entry>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("keys and values in round brackets")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Vec<Entry>, A::Error> {
        let mut entries: Vec<Entry> = vec![];
        while let Some(key) = map.next_key_seed(Key)? {
            let place = place(self.text, key);
            let Some(field) = self.known.iter().find(|field| field.name == key) else {
                map.next_value::<IgnoredAny>()?;
                self.unknown.push((place, key.to_string(), meant(key, self.known)));
                continue;
            };
            if entries.iter().any(|entry| entry.field.name == key) {
                return Err(A::Error::custom(format!("`{key}` is given twice")));
            }
            let seed = Content { text: self.text, field, unknown: &mut *self.unknown };
            let value = map.next_value_seed(seed).map_err(|error| A::Error::custom(format!("{key}: {error}")))?;
            entries.push(Entry { field, place, value });
        }
        Ok(entries)
    }
}

/// The value of a known key.
struct Content<'a> {
    text: &'a str,
    field: &'static Field,
    unknown: &'a mut Vec<(Place, String, Option<&'static str>)>,
}

impl<'de> DeserializeSeed<'de> for Content<'_> {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Value, D::Error> {
        match self.field.kind {
            Kind::Text => deserializer.deserialize_str(self),
            Kind::Number(_) => deserializer.deserialize_any(self),
            Kind::Law => deserializer.deserialize_enum("ClayLaw", &LAWS, self),
            Kind::Weld => deserializer.deserialize_enum("Weld", &WELDS, self),
        }
    }
}

impl<'de> Visitor<'de> for Content<'_> {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self.field.kind {
            Kind::Text => "a text in quotes",
            Kind::Number(_) => "a number in SI units, or one with a unit in quotes",
            Kind::Law => "a law",
            Kind::Weld => "a weld rule",
        })
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Value, E> {
        Ok(Value::Text(text.to_string()))
    }

    fn visit_f64<E: Error>(self, number: f64) -> Result<Value, E> {
        Ok(Value::Number(number))
    }

    fn visit_i64<E: Error>(self, number: i64) -> Result<Value, E> {
        Ok(Value::Number(number as f64))
    }

    fn visit_u64<E: Error>(self, number: u64) -> Result<Value, E> {
        Ok(Value::Number(number as f64))
    }

    fn visit_enum<A: EnumAccess<'de>>(self, data: A) -> Result<Value, A::Error> {
        let (name, content) = data.variant_seed(Key)?;
        if self.field.kind == Kind::Weld {
            let Some((_, weld)) = WELDS.into_iter().zip(Weld::ALL).find(|weld| weld.0 == name) else {
                return Err(A::Error::custom(format!("`{}` is no weld rule; known are {}", short(name), WELDS.join(", "))));
            };
            content.unit_variant()?;
            return Ok(Value::Weld(weld));
        }
        let Some(mut law) = ClayLaw::ALL.into_iter().find(|law| law.identifier() == name) else {
            return Err(A::Error::custom(format!("`{}` is no law; known are {}", short(name), LAWS.join(", "))));
        };
        if law.numbers_mut().is_empty() {
            content.unit_variant()?;
            return Ok(Value::Law(law.identifier(), vec![]));
        }
        let numbers = Struct { text: self.text, known: &LAW_NUMBERS, unknown: self.unknown };
        Ok(Value::Law(law.identifier(), content.struct_variant(&[], numbers)?))
    }
}

/// The known name that `key` is most like, if it is like one: at most two letters, and at most a third of
/// them, are to be changed.
fn meant(key: &str, known: &'static [Field]) -> Option<&'static str> {
    let lower = key.to_lowercase();
    let near = known.iter().map(|field| (distance(&lower, field.name), field.name)).min()?;
    (near.0 <= 2 && 3 * near.0 <= near.1.len()).then_some(near.1)
}

/// Letters to insert, drop or replace to make `a` of `b` (Levenshtein). Very long keys are like nothing.
fn distance(a: &str, b: &str) -> usize {
    const LONG: usize = 64;
    if a.len() > LONG {
        return usize::MAX;
    }
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_are_nearly_right_are_guessed() {
        let cases = [
            ("yeild_stress", Some("yield_stress")),
            ("Density", Some("density")),
            ("youngs_modulus", Some("young_modulus")),
            ("poisson_ration", Some("poisson_ratio")),
            ("lwa", None),
            ("colour", None),
        ];
        for (key, guess) in cases {
            assert_eq!(meant(key, &FIELDS), guess, "{key}");
        }
        assert_eq!(meant(&"density".repeat(1000), &FIELDS), None);
        assert_eq!((distance("kitten", "sitting"), distance("", "abc"), distance("abc", "abc")), (3, 3, 0));
    }

    #[test]
    fn places_count_characters() {
        let text = "(\n  // é\n  é: 1)";
        assert_eq!(place(text, &text[text.rfind('é').expect("é")..]), (3, 3));
        assert_eq!(place(text, text), (1, 1));
    }
}
