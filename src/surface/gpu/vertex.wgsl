// Rule 7: where a vertex stands on its edge, and its normal. See cells.rs.

fn field_at(node: vec3i, plane: u32) -> f32 {
    let slot = slot_near(node);
    if slot == 0u { return 0.0; }
    return kept[plane_first(slot - 1u, plane) + local_index(node)];
}

// The clay of a body, which is all there is to it.
fn whole_at(node: vec3i, body: u32) -> f32 {
    let slot = slot_near(node);
    if slot == 0u { return 0.0; }
    let first = body_first(slot - 1u, body);
    if first == NONE { return 0.0; }
    return kept[first + local_index(node)];
}

fn own_at(node: vec3i) -> f32 {
    return bitcast<f32>(cell_word(node, 1u));
}

// Number of a body's sheet among those with fields.
fn sheet_number(body: u32, sheet: u32) -> u32 {
    let count = min(status.sheet_count, params.sheet_capacity);
    for (var s = 0u; s < count; s++) {
        if is_cut_of(s, body, sheet) { return s; }
    }
    return 0u;
}

// A body's clay at a node, and what counts of the others'.
fn whole_closed(node: vec3i, body: u32) -> f32 {
    return with_others(whole_at(node, body), field_at(node, 0u), closure_at(node));
}

// Value of the side that a label's word names, at a node, whoever owns it: of its clay alone.
fn value_on(node: vec3i, body: u32, word: u32) -> f32 {
    let s = sheet_number(body, word >> 1u);
    let front = field_at(node, 2u * s + 1u);
    let back = field_at(node, 2u * s + 2u);
    return side_value(whole_at(node, body), front + back, select(front, back, (word & 1u) == 1u));
}

// And of what counts of the other's.
fn value_of_side(node: vec3i, body: u32, word: u32) -> f32 {
    return with_others(value_on(node, body, word), whole_at(node, body), closure_at(node));
}

// Least value at a node of the sides that `label` names, and of its body, of their clay alone.
fn value_alone(node: vec3i, body: u32, label: u32) -> f32 {
    var least = whole_at(node, body);
    for (var i = 0u; i < CUTS_MAX; i++) {
        let word = label_word(label, i);
        if word == 0u { break; }
        least = min(least, value_on(node, body, word));
    }
    return least;
}

// Least value at a node of the sides that `label` names, but for sheets that part it from `across`, and of
// its body.
fn value_beside(node: vec3i, body: u32, label: u32, across: u32) -> f32 {
    var least = whole_closed(node, body);
    for (var i = 0u; i < CUTS_MAX; i++) {
        let word = label_word(label, i);
        if word == 0u { break; }
        if !has_word(across, word ^ 1u) { least = min(least, value_of_side(node, body, word)); }
    }
    return least;
}

fn crossing_of(a: f32, b: f32) -> f32 {
    return (params.iso - a) / (b - a);
}

// Zero of (P - M) / (P + M) from a on towards b.
fn sheet_crossing(body: u32, word: u32, a: vec3i, b: vec3i) -> f32 {
    let s = sheet_number(body, word >> 1u);
    let fa = vec2f(field_at(a, 2u * s + 1u), field_at(a, 2u * s + 2u));
    return zero_between(fa, vec2f(field_at(b, 2u * s + 1u), field_at(b, 2u * s + 2u)));
}

// The same of two bodies, that of a and that of b.
fn body_crossing(a: vec3i, b: vec3i) -> f32 {
    let own = body_at(a);
    let other = body_at(b);
    return zero_between(vec2f(whole_at(a, own), whole_at(a, other)), vec2f(whole_at(b, own), whole_at(b, other)));
}

// Where the lip of the kept end ends at the sheet; f is what there is of its own and of the other's.
fn lip_end(kept: vec3i, other: vec3i, f_kept: vec2f, f_other: vec2f) -> f32 {
    let reach = LIP_REACH * min(closure_at(kept), closure_at(other));
    let q_kept = (f_kept.x - f_kept.y) / (f_kept.x + f_kept.y) + reach;
    let q_other = (f_other.x - f_other.y) / (f_other.x + f_other.y) + reach;
    if q_other >= 0.0 { return 1.0; }
    return q_kept / (q_kept - q_other);
}

// The same of a sheet, from the side that a label's word names, and of two bodies.
fn lip_end_at_sheet(body: u32, word: u32, kept: vec3i, other: vec3i) -> f32 {
    let s = sheet_number(body, word >> 1u);
    let own = 2u * s + select(2u, 1u, (word & 1u) == 1u);
    let others = 4u * s + 3u - own;
    let f_kept = vec2f(field_at(kept, own), field_at(kept, others));
    return lip_end(kept, other, f_kept, vec2f(field_at(other, own), field_at(other, others)));
}

fn lip_end_at_body(kept: vec3i, other: vec3i) -> f32 {
    let own = body_at(kept);
    let others = body_at(other);
    let f_kept = vec2f(whole_at(kept, own), whole_at(kept, others));
    return lip_end(kept, other, f_kept, vec2f(whole_at(other, own), whole_at(other, others)));
}

fn zero_between(fa: vec2f, fb: vec2f) -> f32 {
    let qa = (fa.x - fa.y) / (fa.x + fa.y);
    let qb = (fb.x - fb.y) / (fb.x + fb.y);
    if qa == qb { return 0.5; }
    return qa / (qa - qb);
}

// Where both lips stand between two inside nodes: the mean over the sheets that part them, if it is
// not two bodies that meet there.
fn pinned_crossing(low: vec3i, high: vec3i) -> f32 {
    let a = label_at(low);
    let b = label_at(high);
    let body = body_at(low);
    if are_of_two(body, body_at(high)) { return body_crossing(low, high); }
    var sum = 0.0;
    var count = 0.0;
    for (var i = 0u; i < CUTS_MAX; i++) {
        let word = label_word(a, i);
        if word != 0u && has_word(b, word ^ 1u) {
            sum += sheet_crossing(body, word, low, high);
            count += 1.0;
        }
    }
    if count == 0.0 { return 0.5; }
    return sum / count;
}

// From `kept`, which is inside, on towards `other`, which is not.
fn lip_crossing(kept: vec3i, other: vec3i) -> f32 {
    let label = label_at(kept);
    let across = label_at(other);
    let body = body_at(kept);
    if are_of_two(body, body_at(other)) {
        let a = value_beside(kept, body, label, 0u);
        let b = value_beside(other, body, label, 0u);
        let face = lip_end_at_body(kept, other);
        return select(face, min(face, crossing_of(a, b)), b <= params.iso);
    }
    if !is_parted(label, across) { return crossing_of(own_at(kept), own_at(other)); }
    var nearest = 1.0;
    for (var i = 0u; i < CUTS_MAX; i++) {
        let word = label_word(label, i);
        if word == 0u || !has_word(across, word ^ 1u) { continue; }
        let a = value_of_side(kept, body, word);
        let b = value_of_side(other, body, word);
        nearest = min(nearest, lip_end_at_sheet(body, word, kept, other));
        if a > params.iso && b <= params.iso { nearest = min(nearest, crossing_of(a, b)); }
    }
    let a = value_beside(kept, body, label, across);
    let b = value_beside(other, body, across, label);
    if a > params.iso && b <= params.iso { nearest = min(nearest, crossing_of(a, b)); }
    return nearest;
}

fn crossing(low: vec3i, axis: u32) -> f32 {
    let high = low + axis_vector(axis);
    let low_in = (label_at(low) & 1u) == 1u;
    let high_in = (label_at(high) & 1u) == 1u;
    var t = 0.5;
    if low_in && !high_in {
        t = lip_crossing(low, high);
    } else if high_in && !low_in {
        t = 1.0 - lip_crossing(high, low);
    } else {
        t = pinned_crossing(low, high);
    }
    return clamp(t, CROSSING_MIN, 1.0 - CROSSING_MIN);
}

// Minus the slope of the field that the kept end sees.
fn normal_at(low: vec3i, axis: u32, variant: u32, t: f32) -> vec3f {
    let high = low + axis_vector(axis);
    let keeps_low = variant == 1u || (variant == 0u && (label_at(low) & 1u) == 1u);
    let own = select(high, low, vec3<bool>(keeps_low));
    return -mix(slope_at(low, body_at(own), label_at(own)), slope_at(high, body_at(own), label_at(own)), t);
}

fn slope_at(node: vec3i, body: u32, label: u32) -> vec3f {
    var sum = vec3f(0.0);
    for (var n = 0; n < 27; n++) {
        let d = vec3i(n % 3, (n / 3) % 3, n / 9) - 1;
        let across = vec3f(vec3i(2) - abs(d)) * 0.25;
        var v = 0.0;
        if params.method == 1u { v = own_at(node + d); } else { v = value_alone(node + d, body, label); }
        sum += vec3f(d) * v * vec3f(across.y * across.z, across.x * across.z, across.x * across.y);
    }
    return 0.5 * sum;
}
