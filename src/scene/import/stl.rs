//! STL, ASCII and binary, by `stl_io`.

use super::soup::{Fault, Soup};
use glam::DVec3;
use std::io::Cursor;

/// Bytes before the first facet of a binary file: a header of 80 and the number of facets.
const HEADER: usize = 84;
/// Bytes of one facet.
const FACET: usize = 50;

/// The facets a binary file announces.
fn facet_count(bytes: &[u8]) -> Option<usize> {
    let count = <[u8; 4]>::try_from(bytes.get(80..HEADER)?).ok()?;
    usize::try_from(u32::from_le_bytes(count)).ok()
}

/// Reads the facets of an STL file.
pub(super) fn read(bytes: &[u8]) -> Result<Soup, Fault> {
    let announced = facet_count(bytes);
    // The first bytes of a binary file hold zeros: at least the high ones of its count, mostly its header
    // too.
    let is_text = bytes.starts_with(b"solid") && !bytes[..bytes.len().min(HEADER)].contains(&0);
    let is_whole_binary = announced.is_some_and(|count| count.checked_mul(FACET).is_some_and(|n| n + HEADER == bytes.len()));
    // Some programs begin binary files with `solid`, the mark of ASCII: the length tells better. A header
    // without the mark is read as binary.
    let mut data = bytes.to_vec();
    if is_whole_binary {
        data[..80].fill(0);
    } else if !is_text {
        let Some(count) = announced else {
            return Err(Fault::new(format!("{} bytes are too few for an STL file", bytes.len())));
        };
        let held = (bytes.len() - HEADER) / FACET;
        if held < count {
            return Err(Fault::new(format!("the file is cut short: {count} facets announced, {held} there")));
        }
    } else if let Some(rest) = data.get(5..).filter(|rest| rest.first().is_none_or(|b| *b != b' ')) {
        // `solid` without a name and without the blank that stl_io asks for.
        data = [b"solid ", rest].concat();
    }
    let mesh = stl_io::read_stl(&mut Cursor::new(data)).map_err(|error| Fault::new(error.to_string()))?;
    let mut soup = Soup::default();
    for vertex in &mesh.vertices {
        soup.push_position(DVec3::from_array(vertex.0.map(f64::from))).map_err(Fault::new)?;
    }
    for face in &mesh.faces {
        soup.push_polygon(&face.vertices.map(|i| i as u64)).map_err(Fault::new)?;
    }
    Ok(soup)
}
