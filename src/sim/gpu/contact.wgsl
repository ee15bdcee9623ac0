// Contact at a node: blades, the fields that kept cuts divide, bodies.

// A field is the clay of one body that is beyond the same divisions, DIVISIONS_MAX at most, from their
// owners' sides.
const NO_BLADE: u32 = 0xffffffffu;

// A sheet that divides a node: the side with which clay moves that has none, and the blade, if one divides it
// there.
struct Division { sheet: u32, owner: i32, blade: u32, distance: f32, normal: vec3f }

// Fields stand in the place of the first of their classes.
struct Node {
    division_count: u32,
    divisions: array<Division, DIVISIONS_MAX>,
    leader: array<u32, CLASSES>, // first class of the field in which a class moves
    place: array<u32, CLASSES>, // of a class: its body, then the divisions that it is beyond, a bit each
    has_fields: bool, // whether there may be more than one
    mass: array<f32, CLASSES>,
    v: array<vec3f, CLASSES>,
    pushed: vec3f, // impulse of blades on the node
}

// A blade brings one field to the velocity `after`, and feels the opposite impulse.
fn push(node: ptr<function, Node>, f: u32, arm: vec3f, after: vec3f, taken: ptr<function, Taken>) {
    let mass = (*node).mass[f];
    if mass <= 0.0 { return; }
    let before = (*node).v[f];
    let impulse = mass * (after - before);
    (*node).v[f] = after;
    (*node).pushed += impulse;
    (*taken).impulse += vec4f(-impulse, f32(any(after != before)));
    (*taken).angular += vec4f(-cross(arm, impulse), length(impulse));
}

// The lowest sheet above `last` among the block's classes and the blades near it; 0 if there is none.
fn next_sheet(slot: u32, near_dividers: u32, last: u32) -> u32 {
    var next = 256u;
    for (var c = 1u; c < CLASSES; c++) {
        let key = key_at(slot, c);
        if key == 0u { break; }
        let sheets = sheets_of(key);
        if sheets.x > last { next = min(next, sheets.x); }
        if sheets.y > last { next = min(next, sheets.y); }
    }
    for (var t = 0u; t < params.tool_count; t++) {
        if (near_dividers & (1u << t)) == 0u { continue; }
        let sheet = tool_now(t).sheet;
        if sheet > last { next = min(next, sheet); }
    }
    return select(next, 0u, next == 256u);
}

// Whether a sheet divides the node: in its blade's band, or where most of the mass is tagged by it, but for
// that of bodies without a side of it.
fn division_by(sheet: u32, slot: u32, n: vec3i, near_dividers: u32, sums_: Sums) -> Division {
    for (var t = 0u; t < params.tool_count; t++) {
        if (near_dividers & (1u << t)) == 0u { continue; }
        let tool = tool_now(t);
        if tool.sheet != sheet { continue; }
        let foot = foot_on(tool, local_end(tool, n, vec3f(0.0)));
        if is_in_band(tool, foot) {
            return Division(sheet, select(1, -1, foot.distance < 0.0), t, foot.distance, tool.end_rotation * foot.normal);
        }
    }
    var front = 0.0;
    var back = 0.0;
    var all_ = 0.0;
    var of_body = 0.0;
    var is_tagged = false;
    var body = body_of(key_at(slot, 1u));
    // The classes of a body stand together, the first body's last.
    for (var i = 1u; i <= CLASSES; i++) {
        let c = i % CLASSES;
        let key = key_at(slot, c);
        if c > 0u && key == 0u { continue; }
        if body_of(key) != body {
            all_ += select(0.0, of_body, is_tagged);
            of_body = 0.0;
            is_tagged = false;
            body = body_of(key);
        }
        let side = side_of(key, sheet);
        let mass = sums_.c[c].w;
        of_body += mass;
        is_tagged = is_tagged || (side != 0 && mass > 0.0);
        if side > 0 { front += mass; }
        if side < 0 { back += mass; }
    }
    all_ += select(0.0, of_body, is_tagged);
    let is_split = front + back > 0.5 * all_;
    return Division(select(0u, sheet, is_split), select(-1, 1, front >= back), NO_BLADE, 0.0, vec3f(0.0));
}

fn divide(node: ptr<function, Node>, slot: u32, n: vec3i, near_dividers: u32, sums_: Sums) {
    if CLASSES == 1u { return; }
    var sheet = next_sheet(slot, near_dividers, 0u);
    while sheet != 0u && (*node).division_count < DIVISIONS_MAX {
        let division = division_by(sheet, slot, n, near_dividers, sums_);
        if division.sheet != 0u {
            (*node).divisions[(*node).division_count] = division;
            (*node).division_count += 1u;
        }
        sheet = next_sheet(slot, near_dividers, sheet);
    }
    for (var c = 1u; c < CLASSES; c++) {
        let key = key_at(slot, c);
        var beyond = 0u;
        for (var i = 0u; i < (*node).division_count; i++) {
            beyond |= u32(side_of(key, (*node).divisions[i].sheet) == -(*node).divisions[i].owner) << i;
        }
        let place = (body_of(key) << DIVISIONS_MAX) | beyond;
        (*node).place[c] = place;
        (*node).leader[c] = c;
        for (var a = 0u; a < c; a++) {
            if (*node).place[a] == place {
                (*node).leader[c] = a;
                break;
            }
        }
        (*node).has_fields = (*node).has_fields || (*node).leader[c] == c;
    }
}

// The side of division i on which a field is.
fn field_side(node: ptr<function, Node>, i: u32, place: u32) -> i32 {
    let owner = (*node).divisions[i].owner;
    return select(owner, -owner, ((place >> i) & 1u) == 1u);
}

// What blade t takes from the node: each field is bounded by it where it reaches beyond it; a sticking one
// takes it along.
fn against_blade(node: ptr<function, Node>, t: u32, n: vec3i, slot: u32, k: u32) -> Taken {
    var taken: Taken;
    let tool = tool_now(t);
    // A plate presses on particles.
    if is_solid(tool) { return taken; }
    let q = local_end(tool, n, vec3f(0.0));
    let arm = vec3f(n - tool.end_cell) - tool.end_offset;
    for (var i = 0u; i < (*node).division_count; i++) {
        if (*node).divisions[i].blade != t { continue; }
        for (var f = 0u; f < CLASSES; f++) {
            if (*node).leader[f] != f { continue; }
            let sign_ = f32(field_side(node, i, (*node).place[f]));
            let normal = sign_ * (*node).divisions[i].normal;
            let distance_ = sign_ * (*node).divisions[i].distance;
            if sticks(tool) {
                let adhesion = params.adhesion * max(1.0 - strength_lost((*node).leader, f, slot, k), 0.0);
                push(node, f, arm, stick(tool, (*node).v[f], q, normal, distance_, adhesion), &taken);
            } else if distance_ <= CONTACT_OFFSET {
                push(node, f, arm, contact(tool, (*node).v[f], q, normal), &taken);
            }
        }
    }
    return taken;
}

// How the field in place b faces that in place a: across the one cut between them, or both of two, or from
// body to body; without a normal where a blade stands between them, which acts on both.
fn pair_facing(node: ptr<function, Node>, n: vec3i, a: u32, b: u32) -> Facing {
    for (var i = 0u; i < (*node).division_count; i++) {
        let is_between = (((a ^ b) >> i) & 1u) == 1u;
        if is_between && (*node).divisions[i].blade != NO_BLADE { return Facing(vec3f(0.0), 0.0); }
    }
    let bodies = vec2u(a, b) >> vec2u(DIVISIONS_MAX);
    if bodies.x != bodies.y { return mean_facing(n, between_bodies(bodies.x, bodies.y)); }
    var sum = vec3f(0.0);
    var gap = -3.0;
    for (var i = 0u; i < (*node).division_count; i++) {
        if (((a ^ b) >> i) & 1u) == 0u { continue; }
        let facing = mean_facing(n, (*node).divisions[i].sheet);
        if all(facing.normal == vec3f(0.0)) { return facing; }
        sum += f32(field_side(node, i, b)) * facing.normal;
        gap = max(gap, facing.gap);
    }
    let size = length(sum);
    return Facing(select(sum / size, vec3f(0.0), size == 0.0), gap);
}

// Two fields exchange momentum while they approach, from a to b, by more than there is room for.
fn exchange(node: ptr<function, Node>, a: u32, b: u32, facing: Facing) {
    let masses = vec2f((*node).mass[a], (*node).mass[b]);
    let relative = (*node).v[b] - (*node).v[a];
    let approach = dot(relative, facing.normal);
    // Velocities are in cells a substep.
    let excess = approach + max(facing.gap, 0.0);
    if excess >= 0.0 { return; }
    let slide = relative - approach * facing.normal;
    let speed = length(slide);
    var push = -excess * facing.normal;
    if speed > 0.0 { push -= slide / speed * min(speed, -excess * CUT_FRICTION); }
    let impulse = masses.x * masses.y / (masses.x + masses.y) * push;
    (*node).v[b] += impulse / masses.y;
    (*node).v[a] -= impulse / masses.x;
}

// All pairs of fields in the order of their places.
fn exchange_all(node: ptr<function, Node>, n: vec3i) {
    if !(*node).has_fields { return; }
    let first = field_from(node, 0u);
    for (var b = first; b != CLASSES; b = field_from(node, (*node).place[b] + 1u)) {
        for (var a = first; a != b; a = field_from(node, (*node).place[a] + 1u)) {
            let facing = pair_facing(node, n, (*node).place[a], (*node).place[b]);
            if any(facing.normal != vec3f(0.0)) { exchange(node, a, b, facing); }
        }
    }
}

// The first field with mass whose place is this or a later one; CLASSES if there is none.
fn field_from(node: ptr<function, Node>, place: u32) -> u32 {
    var next = CLASSES;
    var least = 0xffffffffu;
    for (var f = 0u; f < CLASSES; f++) {
        let here = (*node).place[f];
        if (*node).leader[f] != f || (*node).mass[f] <= 0.0 || here < place || here >= least { continue; }
        next = f;
        least = here;
    }
    return next;
}
