//! Random fields against the count of their nodes.

use super::clay::Random;
use crate::lab::Size;
use crate::report::Row;
use bevy_clay::surface::check::MeshCheck;
use bevy_clay::surface::extract::extract_field;
use bevy_clay::surface::field::Field;
use bevy_clay::surface::oracle::euler_number_of_nodes;

/// Random fields of 7^3 nodes between empty ones; every other one of whole numbers, with many values that
/// equal the threshold.
pub fn random_fields(size: Size) -> Vec<Row> {
    let mut random = Random(1);
    let extent = [9; 3];
    let (mut open, mut edges, mut vertices, mut turned, mut degenerate, mut euler) = (0, 0, 0, 0, 0, 0);
    for case in 0..size.pick(200, 1000, 10_000) {
        let mut values = vec![-1.0f32; 729];
        for i in 0..343 {
            let value = random.range(-1.0, 1.0);
            let at = i % 7 + 1 + 9 * (i / 7 % 7 + 1 + 9 * (i / 49 + 1));
            values[at] = if case % 2 == 0 { value as f32 } else { (value * 3.5).round() as f32 };
        }
        let mesh = extract_field(&Field::from_nodes(extent, &values, None), 0.0);
        let check = MeshCheck::of(&mesh);
        open += check.open_edges;
        edges += check.nonmanifold_edges;
        vertices += check.nonmanifold_vertices;
        turned += check.misoriented_edges;
        degenerate += check.degenerate_triangles;
        euler += usize::from(check.euler != euler_number_of_nodes(extent, &values, 0.0));
    }
    let row = |what: &str, count: usize| Row::at_most(format!("random fields: {what}"), count as f64, "count", 0.0);
    vec![
        row("open edges", open),
        row("edges of more than two triangles", edges),
        row("vertices of more than one fan", vertices),
        row("misoriented edges", turned),
        row("degenerate triangles", degenerate),
        row("fields whose Euler number is not that of their nodes", euler),
    ]
}
