//! Wavefront OBJ, by `tobj`.

use super::soup::{Fault, Soup};
use glam::DVec3;
use std::cell::Cell;
use std::io::{BufRead, Read};

/// A text reader that knows how many lines it has handed out, so that a parser's error gets its line.
struct CountedLines<'a> {
    text: &'a [u8],
    lines: &'a Cell<usize>,
}

impl Read for CountedLines<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.text.read(buffer)?;
        self.lines.set(self.lines.get() + buffer[..count].iter().filter(|b| **b == b'\n').count());
        Ok(count)
    }
}

impl BufRead for CountedLines<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        Ok(self.text)
    }

    fn consume(&mut self, count: usize) {
        let (taken, rest) = self.text.split_at(count.min(self.text.len()));
        self.lines.set(self.lines.get() + taken.iter().filter(|b| **b == b'\n').count());
        self.text = rest;
    }
}

/// The geometry of an OBJ file alone, line for line: `v` with three coordinates, `f` with position indices;
/// other lines become empty. Colours, texture and normal indices say nothing about the solid, and huge ones
/// overflow inside `tobj`.
fn geometry_lines(bytes: &[u8]) -> String {
    let mut out = String::with_capacity(bytes.len());
    for line in String::from_utf8_lossy(bytes).lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                out.push('v');
                words.take(3).for_each(|word| out.extend([" ", word]));
            }
            Some("f") => {
                out.push('f');
                words.for_each(|word| out.extend([" ", word.split('/').next().unwrap_or_default()]));
            }
            _ => {}
        }
        out.push('\n');
    }
    out
}

/// Line of the first face that refers to a vertex beyond the file's, and what to say of it.
fn face_beyond_vertices(text: &str) -> Fault {
    let count = text.lines().filter(|line| line.starts_with("v ")).count();
    let in_range = |word: &str| match word.parse::<i64>() {
        Ok(index) => index != 0 && index.unsigned_abs() <= count as u64,
        Err(_) => true,
    };
    for (line, words) in text.lines().enumerate().filter(|(_, line)| line.starts_with("f ")) {
        if let Some(word) = words.split_whitespace().skip(1).find(|word| !in_range(word)) {
            return Fault::at(line + 1, format!("a face refers to vertex {word}, but there are {count}"));
        }
    }
    Fault::new(format!("a face refers to a vertex beyond the {count} there are"))
}

/// Line of the first vertex with a coordinate that is not finite.
fn vertex_not_finite(text: &str) -> Option<usize> {
    let is_bad =
        |line: &str| line.starts_with("v ") && line.split(' ').skip(1).any(|w| w.parse::<f32>().is_ok_and(|x| !x.is_finite()));
    text.lines().position(is_bad).map(|line| line + 1)
}

/// Reads the vertices and faces of an OBJ file.
pub(super) fn read(bytes: &[u8]) -> Result<Soup, Fault> {
    let text = geometry_lines(bytes);
    if let Some(line) = vertex_not_finite(&text) {
        return Err(Fault::at(line, "a vertex is not finite"));
    }
    let lines = Cell::new(0);
    let options = tobj::LoadOptions { triangulate: true, ignore_points: true, ignore_lines: true, ..Default::default() };
    let mut reader = CountedLines { text: text.as_bytes(), lines: &lines };
    let no_materials = |_: &std::path::Path| Err(tobj::LoadError::MaterialParseError);
    let (models, _) = tobj::load_obj_buf(&mut reader, &options, no_materials).map_err(|error| match error {
        tobj::LoadError::FaceVertexOutOfBounds => face_beyond_vertices(&text),
        other => Fault::at(lines.get(), other.to_string()),
    })?;
    let mut soup = Soup::default();
    for model in &models {
        let first = soup.positions.len() as u64;
        for p in model.mesh.positions.chunks_exact(3) {
            soup.push_position(DVec3::new(p[0].into(), p[1].into(), p[2].into())).map_err(Fault::new)?;
        }
        for t in model.mesh.indices.chunks_exact(3) {
            soup.push_polygon(&[t[0], t[1], t[2]].map(|i| first + u64::from(i))).map_err(Fault::new)?;
        }
    }
    Ok(soup)
}
