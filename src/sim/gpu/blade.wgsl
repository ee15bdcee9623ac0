// Blades and plates: what divides the clay (`tool::Blade`). Poses of a wire are those of the strip that it
// leaves behind.

// The point of a blade nearest to another, in the blade's frame.
struct Foot {
    distance: f32, // signed, positive in front
    normal: vec3f, // of the front there
    is_inside: bool, // inside the blade's outline
}

// Point i of a bent blade's profile, in its XZ plane.
fn profile_point(t: Tool, i: u32) -> vec2f {
    let pair = params.profiles[t.profile & 255u][i / 2u];
    return select(pair.zw, pair.xy, (i & 1u) == 0u);
}

fn segment_count(t: Tool) -> u32 {
    return (t.profile >> 8u) - 1u;
}

// Unit normal of segment i towards the front.
fn segment_normal(t: Tool, i: u32) -> vec2f {
    let way = normalize(profile_point(t, i + 1u) - profile_point(t, i));
    return vec2f(-way.y, way.x);
}

// The profile as seen from q: at a corner the front is that of both its segments.
fn profile_foot(t: Tool, q: vec3f) -> Foot {
    let at_ = q.xz;
    let count = segment_count(t);
    var best = 0u;
    var along = 0.0;
    var away = vec2f(NOWHERE);
    for (var i = 0u; i < count; i++) {
        let a = profile_point(t, i);
        let way = profile_point(t, i + 1u) - a;
        let s = dot(at_ - a, way) / dot(way, way);
        let d = at_ - (a + clamp(s, 0.0, 1.0) * way);
        if i == 0u || dot(d, d) < dot(away, away) {
            best = i;
            along = s;
            away = d;
        }
    }
    let is_at_height = abs(q.y) <= t.size.y;
    let own = segment_normal(t, best);
    if along >= 0.0 && along <= 1.0 { return Foot(dot(away, own), vec3f(own.x, 0.0, own.y), is_at_height); }
    // A corner or an end.
    let is_closed = all(profile_point(t, 0u) == profile_point(t, count));
    var other = select(best + 1u, best - 1u, along < 0.0);
    if along < 0.0 && best == 0u { other = select(count, count - 1u, is_closed); }
    if along > 1.0 && best + 1u == count { other = select(count, 0u, is_closed); }
    var both = own;
    if other < count { both += segment_normal(t, other); }
    let sign_ = select(1.0, -1.0, dot(away, both) < 0.0);
    let size = length(away);
    var normal = normalize(both);
    if size > 0.0 { normal = sign_ * away / size; }
    return Foot(sign_ * size, vec3f(normal.x, 0.0, normal.y), is_at_height && other < count);
}

// The foot on a flat blade of this width at the height of q.
fn flat_foot(t: Tool, q: vec3f, half_width: f32) -> Foot {
    return Foot(q.z, vec3f(0.0, 0.0, 1.0), abs(q.x) <= half_width && abs(q.y) <= t.size.y);
}

// Normal of the middle of a plate, across its shortest edge.
fn plate_normal(t: Tool) -> vec3f {
    if t.size.x <= t.size.y && t.size.x <= t.size.z { return vec3f(1.0, 0.0, 0.0); }
    if t.size.y <= t.size.z { return vec3f(0.0, 1.0, 0.0); }
    return vec3f(0.0, 0.0, 1.0);
}

fn plate_foot(t: Tool, q: vec3f) -> Foot {
    let n = plate_normal(t);
    return Foot(dot(q, n), n, all((abs(q) <= t.size) | (n != vec3f(0.0))));
}

fn foot_on(t: Tool, q: vec3f) -> Foot {
    switch t.shape {
        case BLADE, WIRE { return flat_foot(t, q, t.size.x); }
        case POINTED_BLADE { return flat_foot(t, q, t.size.x * ((q.y + t.size.y) / (2.0 * t.size.y))); }
        case BENT_BLADE { return profile_foot(t, q); }
        case BOX { return plate_foot(t, q); }
        default { return Foot(NOWHERE, vec3f(0.0, 0.0, 1.0), false); }
    }
}

// Whether a point with this foot is within the band: splines reach BAND along each axis, further across what
// stands askew (`Blade::is_near`).
fn is_in_band(t: Tool, foot: Foot) -> bool {
    return foot.is_inside && abs(foot.distance) <= band_along(t, foot.normal);
}

fn band_along(t: Tool, normal: vec3f) -> f32 {
    let n = abs(t.end_rotation * normal);
    return BAND * (n.x + n.y + n.z);
}

// How far beside it a tool parts clay at most; the reach of a particle's nodes if it parts none.
fn band_of(t: Tool) -> f32 {
    if t.sheet == 0u { return BAND; }
    switch t.shape {
        case BLADE, POINTED_BLADE, WIRE { return band_along(t, vec3f(0.0, 0.0, 1.0)); }
        case BOX { return band_along(t, plate_normal(t)); }
        // Its normals are many.
        case BENT_BLADE { return BAND * sqrt(3.0); }
        default { return BAND; }
    }
}

// Whether the straight way from a to b, in the blade's frame, passes through it.
fn is_crossed(t: Tool, a: vec3f, b: vec3f) -> bool {
    switch t.shape {
        case BLADE, POINTED_BLADE, WIRE, BOX {
            let from_ = foot_on(t, a).distance;
            let to = foot_on(t, b).distance;
            return (from_ < 0.0) != (to < 0.0) && foot_on(t, mix(a, b, from_ / (from_ - to))).is_inside;
        }
        case BENT_BLADE { return is_strip_crossed(t, a, b); }
        default { return false; }
    }
}

fn is_strip_crossed(t: Tool, a: vec3f, b: vec3f) -> bool {
    let way = b.xz - a.xz;
    for (var i = 0u; i < segment_count(t); i++) {
        let from_ = profile_point(t, i);
        let segment = profile_point(t, i + 1u) - from_;
        let to = from_ - a.xz;
        let area = way.x * segment.y - way.y * segment.x;
        if area == 0.0 { continue; }
        let s = vec2f(to.x * segment.y - to.y * segment.x, to.x * way.y - to.y * way.x) / area;
        if all(s >= vec2f(0.0)) && all(s <= vec2f(1.0)) && abs(mix(a.y, b.y, s.x)) <= t.size.y { return true; }
    }
    return false;
}

// Distance to a triangle in its plane, from outside.
fn triangle_distance(t: Tool, q: vec2f) -> f32 {
    let tip = vec2f(0.0, -t.size.y);
    let base = t.size.xy;
    let p = vec2f(abs(q.x), q.y);
    let flank = base - tip;
    let s = clamp(dot(p - tip, flank) / dot(flank, flank), 0.0, 1.0);
    let to_base = length(p - vec2f(min(p.x, base.x), base.y));
    return min(length(p - (tip + s * flank)), to_base);
}

// The unsigned distance to a pointed blade.
fn pointed_distance(t: Tool, q: vec3f) -> f32 {
    if foot_on(t, q).is_inside { return abs(q.z); }
    return length(vec2f(triangle_distance(t, q.xy), q.z));
}
