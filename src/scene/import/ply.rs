//! PLY 1.0, ASCII and binary: positions of element `vertex`, index lists of element `face`, everything else
//! skipped.

use super::soup::{Fault, Soup};
use glam::DVec3;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The number in little-endian `bytes`, padded with zeros to eight.
    fn value(self, bytes: [u8; 8]) -> f64 {
        let [a, b, c, d, ..] = bytes;
        match self {
            Self::I8 => f64::from(i8::from_le_bytes([a])),
            Self::U8 => f64::from(a),
            Self::I16 => f64::from(i16::from_le_bytes([a, b])),
            Self::U16 => f64::from(u16::from_le_bytes([a, b])),
            Self::I32 => f64::from(i32::from_le_bytes([a, b, c, d])),
            Self::U32 => f64::from(u32::from_le_bytes([a, b, c, d])),
            Self::F32 => f64::from(f32::from_le_bytes([a, b, c, d])),
            Self::F64 => f64::from_le_bytes(bytes),
        }
    }
}

#[derive(Debug)]
struct Property {
    name: String,
    scalar: Scalar,
    /// Type of the length where the property is a list.
    length: Option<Scalar>,
}

#[derive(Debug)]
struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

#[derive(Debug)]
struct Header {
    encoding: Encoding,
    elements: Vec<Element>,
    /// Lines it takes.
    lines: usize,
}

/// Where reading stands in the file.
struct Place<'a> {
    rest: &'a [u8],
    line: usize,
}

impl Place<'_> {
    /// The next line of text, without its end.
    fn text_line(&mut self) -> Option<String> {
        if self.rest.is_empty() {
            return None;
        }
        self.line += 1;
        let end = self.rest.iter().position(|b| *b == b'\n').unwrap_or(self.rest.len());
        let line = String::from_utf8_lossy(&self.rest[..end]).trim_end_matches('\r').to_string();
        self.rest = self.rest.get(end + 1..).unwrap_or_default();
        Some(line)
    }

    fn binary(&mut self, scalar: Scalar, encoding: Encoding) -> Result<f64, Fault> {
        let Some((number, rest)) = self.rest.split_at_checked(scalar.size()) else {
            return Err(Fault::new("the file is cut short within its data"));
        };
        let mut bytes = [0; 8];
        bytes[..number.len()].copy_from_slice(number);
        if encoding == Encoding::BigEndian {
            bytes[..number.len()].reverse();
        }
        self.rest = rest;
        Ok(scalar.value(bytes))
    }
}

fn read_header(place: &mut Place) -> Result<Header, Fault> {
    if place.text_line().is_none_or(|line| line.trim() != "ply") {
        return Err(Fault::at(1, "a PLY file begins with `ply`"));
    }
    let (mut encoding, mut elements) = (None, Vec::<Element>::new());
    while let Some(line) = place.text_line() {
        let bad = || Fault::at(place.line, format!("`{line}` is no line of a PLY header"));
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["format", "ascii", _] => encoding = Some(Encoding::Ascii),
            ["format", "binary_little_endian", _] => encoding = Some(Encoding::LittleEndian),
            ["format", "binary_big_endian", _] => encoding = Some(Encoding::BigEndian),
            ["element", name, count] => {
                let count = count.parse().map_err(|_| bad())?;
                elements.push(Element { name: (*name).into(), count, properties: Vec::new() });
            }
            ["property", kind @ .., name] => {
                let (length, scalar) = match kind {
                    ["list", length, scalar] => (Some(Scalar::from_name(length).ok_or_else(bad)?), *scalar),
                    [scalar] => (None, *scalar),
                    _ => return Err(bad()),
                };
                let scalar = Scalar::from_name(scalar).ok_or_else(bad)?;
                let element = elements.last_mut().ok_or_else(bad)?;
                element.properties.push(Property { name: (*name).into(), scalar, length });
            }
            ["end_header"] => {
                let encoding = encoding.ok_or_else(|| Fault::at(place.line, "the header names no format"))?;
                return Ok(Header { encoding, elements, lines: place.line });
            }
            ["comment" | "obj_info", ..] | [] => {}
            _ => return Err(bad()),
        }
    }
    Err(Fault::at(place.line, "the file ends within its header"))
}

/// One row of an element: a list of numbers per property, one number long where it is no list.
fn read_row(place: &mut Place, element: &Element, encoding: Encoding, row: &mut Vec<Vec<f64>>) -> Result<(), Fault> {
    row.clear();
    let mut text = String::new();
    if encoding == Encoding::Ascii {
        let line = place.line;
        let missing = || Fault::at(line, format!("the file ends before all of its {} `{}`", element.count, element.name));
        text = place.text_line().ok_or_else(missing)?;
    }
    let mut words = text.split_whitespace();
    let line = place.line;
    for property in &element.properties {
        let mut number = |scalar| match encoding {
            Encoding::Ascii => match words.next().map(str::parse::<f64>) {
                Some(Ok(number)) => Ok(number),
                _ => Err(Fault::at(line, format!("expected a number for `{}` of `{}`", property.name, element.name))),
            },
            _ => place.binary(scalar, encoding),
        };
        let length = match property.length {
            None => 1.0,
            Some(scalar) => number(scalar)?,
        };
        if !(length >= 0.0 && length.fract() == 0.0 && length <= f64::from(u32::MAX)) {
            return Err(Fault::new(format!("a list `{}` of length {length}", property.name)));
        }
        // Grown number by number: the length may be bogus.
        let mut numbers = Vec::new();
        for _ in 0..length as u32 {
            numbers.push(number(property.scalar)?);
        }
        row.push(numbers);
    }
    Ok(())
}

/// Reads the vertices and faces of a PLY file.
pub(super) fn read(bytes: &[u8]) -> Result<Soup, Fault> {
    let mut place = Place { rest: bytes, line: 0 };
    let header = read_header(&mut place)?;
    let (mut soup, mut row) = (Soup::default(), Vec::new());
    for element in &header.elements {
        let column = |names: &[&str]| element.properties.iter().position(|p| names.contains(&p.name.as_str()));
        let missing = |what| Fault::at(header.lines, format!("element `{}` has no property `{what}`", element.name));
        let takes_bytes = !element.properties.is_empty();
        let (is_vertex, is_face) = (element.name == "vertex", element.name == "face");
        let axes = match is_vertex {
            true => ["x", "y", "z"].map(|name| column(&[name]).ok_or_else(|| missing(name))),
            false => [Ok(0), Ok(0), Ok(0)],
        };
        let [x, y, z] = axes;
        let (x, y, z) = (x?, y?, z?);
        let corners = match is_face {
            true => column(&["vertex_indices", "vertex_index"]).ok_or_else(|| missing("vertex_indices"))?,
            false => 0,
        };
        // An element without properties takes no bytes: nothing to read, whatever count it announces.
        for _ in 0..if takes_bytes { element.count } else { 0 } {
            read_row(&mut place, element, header.encoding, &mut row)?;
            let line = (header.encoding == Encoding::Ascii).then_some(place.line);
            let fault = |reason| Fault { line, reason };
            if is_vertex {
                let first = |column: usize| row[column].first().copied().unwrap_or(f64::NAN);
                soup.push_position(DVec3::new(first(x), first(y), first(z))).map_err(fault)?;
            } else if is_face {
                let index = |i: &f64| if *i >= 0.0 && i.fract() == 0.0 { *i as u64 } else { u64::MAX };
                let polygon: Vec<u64> = row[corners].iter().map(index).collect();
                soup.push_polygon(&polygon).map_err(fault)?;
            }
        }
    }
    Ok(soup)
}
