// Where vertices at the rims of closed cuts stand: see cells/rims.rs.

fn excess_at(low: vec3i, axis: u32, t: f32) -> f32 {
    return mix(field_at(low, 0u), field_at(low + axis_vector(axis), 0u), t) - params.iso;
}

fn inside_count(low: vec3i, axis: u32) -> u32 {
    return (label_at(low) & 1u) + (label_at(low + axis_vector(axis)) & 1u);
}

// To the plane through where all clay ends on the way to the edges beside that have fewer nodes inside.
fn to_free_surface(low: vec3i, axis: u32, t: f32) -> vec3f {
    let here = excess_at(low, axis, t);
    let count = inside_count(low, axis);
    if here <= 0.0 { return vec3f(0.0); }
    var slope = vec3f(0.0);
    for (var d = 0u; d < 3u; d++) {
        if d == axis { continue; }
        var nearness = vec2f(0.0);
        for (var side = 0u; side < 2u; side++) {
            let beside = low + (2 * i32(side) - 1) * axis_vector(d);
            let there = excess_at(beside, axis, t);
            let is_free = there <= 0.0 && inside_count(beside, axis) < count;
            if is_free { nearness[side] = 1.0 / min(here / (here - there), 1.0 - CROSSING_MIN); }
        }
        // Clay of one node ends on both sides.
        if nearness.x == 0.0 || nearness.y == 0.0 { slope[d] = nearness.y - nearness.x; }
    }
    if all(slope == vec3f(0.0)) { return slope; }
    return slope / dot(slope, slope);
}

// Point of a vertex at t of an edge, from the edge's low node.
fn point_of(low: vec3i, axis: u32, t: f32) -> vec3f {
    let high = low + axis_vector(axis);
    let on_edge = t * vec3f(axis_vector(axis));
    if !are_of_two(body_at(low), body_at(high)) && !is_parted(label_at(low), label_at(high)) { return on_edge; }
    let closure = mix(closure_at(low), closure_at(high), t);
    if closure <= 0.0 { return on_edge; }
    return on_edge + closure * to_free_surface(low, axis, t);
}
