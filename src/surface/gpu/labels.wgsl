// The rules of cuts: those of labels.rs, by their numbers there.

// 1: 0 none, 1 front, 2 back.
fn owner_of(total: f32, front: f32, back: f32) -> u32 {
    if front + back <= 0.5 * total { return 0u; }
    return select(2u, 1u, front >= back);
}

// 2.
fn side_value(total: f32, at_cut: f32, other: f32) -> f32 {
    if params.method == 1u { return total - other; }
    if total <= 0.0 { return total; }
    let x = clamp(2.0 * (at_cut / total) - 1.0, 0.0, 1.0);
    return total - x * x * (3.0 - 2.0 * x) * other;
}

// See closure.rs.
fn with_others(own: f32, total: f32, closure: f32) -> f32 {
    return own + closure * (total - own);
}

// Labels: bit 0 inside; then for each cut, by sheet number, 9 bits: side (front 1), sheet.
fn label_word(label: u32, k: u32) -> u32 {
    return (label >> (1u + 9u * k)) & 511u;
}

// 4: whether two nodes are of different bodies.
fn are_of_two(a: u32, b: u32) -> bool {
    return a != b && a != NOBODY && b != NOBODY;
}

// 4: whether a sheet parts two nodes of a body; words differ in the side alone.
fn is_parted(a: u32, b: u32) -> bool {
    for (var i = 0u; i < CUTS_MAX; i++) {
        let word = label_word(a, i);
        if word == 0u { return false; }
        if has_word(b, word ^ 1u) { return true; }
    }
    return false;
}

fn has_word(label: u32, word: u32) -> bool {
    return label_word(label, 0u) == word || label_word(label, 1u) == word || label_word(label, 2u) == word;
}
