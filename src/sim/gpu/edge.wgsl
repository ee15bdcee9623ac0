// The edges of blades (`tool::edge`), in the blade's own frame; that of a wire in the frame of the strip that
// it leaves behind.

// The part of an edge that a point is ahead of.
struct Ahead {
    is_there: bool,
    outward: vec3f, // normal of the edge, in the blade's surface
    ahead: f32,
    beside: f32, // the blade's surface
}

// The share [1/cell^2] of an edge's force that clay there bears.
fn edge_share(edge: Ahead) -> f32 {
    let along = clamp(min(edge.ahead, EDGE_REACH - edge.ahead) / EDGE_RAMP, 0.0, 1.0);
    return 2.0 * along * max(1.0 - edge.beside, 0.0);
}

// The side from a to b of a flat outline, anticlockwise, if q is ahead of it.
fn ahead_of_side(q: vec3f, a: vec2f, b: vec2f) -> Ahead {
    let way = normalize(b - a);
    let outward = vec2f(way.y, -way.x);
    let along = dot(q.xy - a, way);
    let ahead = dot(q.xy - a, outward);
    let is_there = ahead > 0.0 && along >= 0.0 && along <= length(b - a);
    return Ahead(is_there, vec3f(outward, 0.0), ahead, abs(q.z));
}

fn ahead_of_rectangle(t: Tool, q: vec3f) -> Ahead {
    var corners = array(vec2f(-1.0, -1.0), vec2f(1.0, -1.0), vec2f(1.0, 1.0), vec2f(-1.0, 1.0));
    var edge: Ahead;
    for (var i = 0u; i < 4u && !edge.is_there; i++) {
        edge = ahead_of_side(q, corners[i] * t.size.xy, corners[(i + 1u) % 4u] * t.size.xy);
    }
    return edge;
}

fn ahead_of_triangle(t: Tool, q: vec3f) -> Ahead {
    var corners = array(vec2f(0.0, -1.0), vec2f(1.0, 1.0), vec2f(-1.0, 1.0));
    var edge: Ahead;
    for (var i = 0u; i < 3u && !edge.is_there; i++) {
        edge = ahead_of_side(q, corners[i] * t.size.xy, corners[(i + 1u) % 3u] * t.size.xy);
    }
    return edge;
}

// Of a bent blade: its two bent edges, and its straight ends where it is open.
fn ahead_of_strip(t: Tool, q: vec3f) -> Ahead {
    let foot = profile_foot(t, vec3f(q.x, 0.0, q.z));
    let above = abs(q.y) - t.size.y;
    if above > 0.0 { return Ahead(foot.is_inside, vec3f(0.0, sign(q.y), 0.0), above, abs(foot.distance)); }
    let count = segment_count(t);
    var end = profile_point(t, 0u);
    var before = profile_point(t, 1u);
    if distance(q.xz, profile_point(t, count)) < distance(q.xz, end) {
        end = profile_point(t, count);
        before = profile_point(t, count - 1u);
    }
    let outward = normalize(end - before);
    let away = q.xz - end;
    let beside = abs(away.x * outward.y - away.y * outward.x);
    return Ahead(!foot.is_inside, vec3f(outward.x, 0.0, outward.y), dot(away, outward), beside);
}

// Of a wire that moves, the wire alone.
fn ahead_of_wire(t: Tool, q: vec3f) -> Ahead {
    var none: Ahead;
    if t.size.y < 0.0 || q.y * t.radius <= 0.0 || abs(q.y) <= abs(t.radius) { return none; }
    return ahead_of_rectangle(t, q);
}

fn edge_before(t: Tool, q: vec3f) -> Ahead {
    var none: Ahead;
    switch t.shape {
        case BLADE { return ahead_of_rectangle(t, q); }
        case POINTED_BLADE { return ahead_of_triangle(t, q); }
        case BENT_BLADE { return ahead_of_strip(t, q); }
        case WIRE { return ahead_of_wire(t, q); }
        case SPHERE, CAPSULE, BOX, CONE, default { return none; }
    }
}
