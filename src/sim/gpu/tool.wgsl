// Tools as the native engine meets them: poses of the present substep's start and end, in cells.

// No tool is nearer.
const NOWHERE: f32 = 1e30;

@group(0) @binding(10) var<storage, read> tools: array<Tool>;

fn tool_now(index: u32) -> Tool {
    return tools[(atomicLoad(&status.substep) - 1u) * params.tool_count + index];
}

// A point given as cell and offset, in the tool's frame at the substep's end and start.
fn local_end(t: Tool, cell: vec3i, offset: vec3f) -> vec3f {
    return (vec3f(cell - t.end_cell) + (offset - t.end_offset)) * t.end_rotation;
}

fn local_start(t: Tool, cell: vec3i, offset: vec3f) -> vec3f {
    return (vec3f(cell - t.start_cell) + (offset - t.start_offset)) * t.start_rotation;
}

// Whether the tool presses on particles; else it is a blade or a wire.
fn is_solid(t: Tool) -> bool {
    switch t.shape {
        case SPHERE, CAPSULE, BOX, CONE { return true; }
        case BLADE, POINTED_BLADE, BENT_BLADE, WIRE, default { return false; }
    }
}

// Whether the tool is a wire: it parts the clay and holds none off.
fn is_wire(t: Tool) -> bool {
    switch t.shape {
        case WIRE { return true; }
        case SPHERE, CAPSULE, BOX, CONE, BLADE, POINTED_BLADE, BENT_BLADE, default { return false; }
    }
}

// Whether clay can leave the tool.
fn can_part(t: Tool) -> bool {
    switch t.contact {
        case SEPARATE { return true; }
        case STICK, SLIP, default { return false; }
    }
}

// Whether the clay along a blade is taken along by it.
fn sticks(t: Tool) -> bool {
    switch t.contact {
        case STICK { return true; }
        case SLIP, SEPARATE, default { return false; }
    }
}

// The greatest friction of the tool on clay of that shear strength that it pushes so.
fn friction_limit(t: Tool, strength: f32, push: f32) -> f32 {
    switch t.contact {
        case STICK { return strength + STICK_FRICTION * max(push, 0.0); }
        case SLIP { return 0.0; }
        case SEPARATE { return t.friction * push; }
        default { return 0.0; }
    }
}

// Direction of the gradient of the distance to a cone, and the distance: as the engines on the processor have
// it.
fn cone(t: Tool, p: vec3f) -> vec4f {
    let q = vec2f(length(p.xz), p.y);
    var outward = vec3f(1.0, 0.0, 0.0);
    if q.x > 0.0 { outward = vec3f(p.x, 0.0, p.z) / q.x; }
    let tip = vec2f(0.0, -t.size.y);
    let rim = vec2f(t.radius, t.size.y);
    let slant = length(rim - tip);
    let along = (rim - tip) / slant;
    let s = dot(q - tip, along);
    let beyond = dot(q - tip, vec2f(along.y, -along.x));
    let above = q.y - t.size.y;
    let flank = vec4f(outward * along.y - vec3f(0.0, along.x, 0.0), beyond);
    let end = vec4f(0.0, 1.0, 0.0, above);
    if above < 0.0 && beyond < 0.0 {
        if above > beyond { return end; }
        return flank;
    }
    if above >= 0.0 && q.x <= t.radius { return end; }
    if above < 0.0 && s > 0.0 && s < slant { return flank; }
    var edge = rim;
    if above < 0.0 && s <= 0.0 { edge = tip; }
    let d = q - edge;
    return vec4f(outward * d.x + vec3f(0.0, d.y, 0.0), length(d));
}

// Signed distance to a solid shape; to a blade or a wire, the unsigned one.
fn distance_to(t: Tool, q: vec3f) -> f32 {
    switch t.shape {
        case SPHERE { return length(q) - t.radius; }
        case CAPSULE { return length(q - vec3f(0.0, clamp(q.y, -t.size.y, t.size.y), 0.0)) - t.radius; }
        case BOX {
            let d = abs(q) - t.size;
            return length(max(d, vec3f(0.0))) + min(max(d.x, max(d.y, d.z)), 0.0);
        }
        case CONE { return cone(t, q).w; }
        case BLADE { return length(q - vec3f(clamp(q.xy, -t.size.xy, t.size.xy), 0.0)); }
        case POINTED_BLADE { return pointed_distance(t, q); }
        case BENT_BLADE { return length(vec2f(profile_foot(t, q).distance, max(abs(q.y) - t.size.y, 0.0))); }
        case WIRE { return length(q - vec3f(clamp(q.x, -t.size.x, t.size.x), t.radius, 0.0)); }
        default { return NOWHERE; }
    }
}

// Direction of the outward normal of a box.
fn box_slope(t: Tool, q: vec3f) -> vec3f {
    let d = abs(q) - t.size;
    var g = max(d, vec3f(0.0));
    if all(g == vec3f(0.0)) {
        if d.x >= d.y && d.x >= d.z { g = vec3f(1.0, 0.0, 0.0); } else if d.y >= d.z { g = vec3f(0.0, 1.0, 0.0); } else { g = vec3f(0.0, 0.0, 1.0); }
    }
    return g * select(vec3f(-1.0), vec3f(1.0), q >= vec3f(0.0));
}

// Outward normal of a solid shape in its own frame; +Y where there is none.
fn normal_at(t: Tool, q: vec3f) -> vec3f {
    var g = vec3f(0.0);
    switch t.shape {
        case SPHERE { g = q; }
        case CAPSULE { g = q - vec3f(0.0, clamp(q.y, -t.size.y, t.size.y), 0.0); }
        case BOX { g = box_slope(t, q); }
        case CONE { g = cone(t, q).xyz; }
        case BLADE, POINTED_BLADE, BENT_BLADE, WIRE { g = vec3f(0.0, 0.0, 1.0); }
        default {}
    }
    let l = length(g);
    if l > 0.0 { return g / l; }
    return vec3f(0.0, 1.0, 0.0);
}

// Velocity over the substep of the tool's material point that ends at local q.
fn velocity_at(t: Tool, q: vec3f) -> vec3f {
    return t.travel + t.turn * q;
}

// Velocity after contact of clay that moves at v, with the surface normal n towards the clay.
fn contact(t: Tool, v: vec3f, q: vec3f, n: vec3f) -> vec3f {
    let tool = velocity_at(t, q);
    let relative = v - tool;
    let normal = dot(relative, n);
    switch t.contact {
        case STICK { return tool; }
        case SLIP { return v - normal * n; }
        case SEPARATE {
            if normal >= 0.0 { return v; }
            let slide = relative - normal * n;
            let speed = length(slide);
            if speed == 0.0 { return tool; }
            return tool + slide * max(1.0 + t.friction * normal / speed, 0.0);
        }
        default { return v; }
    }
}

// Acceleration of a node before a plane by a traction t of the plane, over t / (rho_s dx): the spline at the
// plane over its part in the clay.
fn traction_share(d: f32) -> f32 {
    let reach = BAND - abs(d);
    if reach <= 0.0 { return 0.0; }
    if d > 0.5 { return 0.5 * reach * reach / (1.0 - reach * reach * reach / 6.0); }
    if d < -0.5 { return 3.0 / max(reach, TRACTION_REACH_MIN); }
    return (0.75 - d * d) / (0.5 + 0.75 * d - d * d * d / 3.0);
}

// Velocity that a sticking blade leaves of v at a node `distance_` before it: along the plane it takes the
// clay along with at most its shear strength, and what viscosity adds at its speed.
fn stick(t: Tool, v: vec3f, q: vec3f, n: vec3f, distance_: f32, adhesion: f32) -> vec3f {
    let surface = velocity_at(t, q);
    let relative = v - surface;
    let leaving = dot(relative, n);
    let slide = relative - leaving * n;
    let speed = length(slide);
    var most = adhesion;
    if params.viscous_adhesion > 0.0 && speed > 0.0 { most += params.viscous_adhesion * pow(speed, params.flow_index); }
    most *= traction_share(distance_);
    var after = surface;
    if distance_ > CONTACT_OFFSET { after += leaving * n; }
    if speed > most { after += (1.0 - most / speed) * slide; }
    return after;
}

// Whether the tool can touch nodes or particles of a block, with a particle's margin and a blade's band about
// it.
fn is_near_block(t: Tool, block: vec3i) -> bool {
    let reach = 3.0 * sqrt(3.0) + band_of(t);
    let centre = block * 4;
    let a = distance_to(t, local_start(t, centre, vec3f(2.0)));
    let b = distance_to(t, local_end(t, centre, vec3f(2.0)));
    return min(a, b) <= reach + length(t.travel);
}
