// Contact at a node: blades, the fields that kept cuts divide.

// A field is the clay that is beyond the same divisions, DIVISIONS_MAX at most, from their owners' sides.
const NO_BLADE: u32 = 0xffffffffu;

// A sheet that divides a node: the side with which clay moves that has none, and the blade, if one divides it
// there.
struct Division { sheet: u32, owner: i32, blade: u32, distance: f32, normal: vec3f }

// Fields stand in the place of the first of their classes.
struct Node {
    division_count: u32,
    divisions: array<Division, DIVISIONS_MAX>,
    leader: array<u32, CLASSES>, // first class of the field in which a class moves
    beyond: array<u32, CLASSES>, // divisions that a class is beyond, a bit each
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
        let a = key >> 17u;
        let b = (key & 0xffffu) >> 1u;
        if a > last { next = min(next, a); }
        if b > last { next = min(next, b); }
    }
    for (var t = 0u; t < params.tool_count; t++) {
        if (near_dividers & (1u << t)) == 0u { continue; }
        let sheet = tool_now(t).sheet;
        if sheet > last { next = min(next, sheet); }
    }
    return select(next, 0u, next == 256u);
}

// Whether a sheet divides the node: in its blade's band, or where most of the mass is tagged by it.
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
    for (var c = 0u; c < CLASSES; c++) {
        let side = side_of(key_at(slot, c), sheet);
        let mass = sums_.c[c].w;
        all_ += mass;
        if side > 0 { front += mass; }
        if side < 0 { back += mass; }
    }
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
        (*node).beyond[c] = beyond;
        (*node).leader[c] = c;
        for (var a = 0u; a < c; a++) {
            if (*node).beyond[a] == beyond {
                (*node).leader[c] = a;
                break;
            }
        }
    }
}

// The side of division i on which a field is.
fn field_side(node: ptr<function, Node>, i: u32, beyond: u32) -> i32 {
    let owner = (*node).divisions[i].owner;
    return select(owner, -owner, ((beyond >> i) & 1u) == 1u);
}

// What blade t takes from the node: each field is bounded by it where it reaches beyond it; a sticking one
// takes it along.
fn against_blade(node: ptr<function, Node>, t: u32, n: vec3i) -> Taken {
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
            let sign_ = f32(field_side(node, i, (*node).beyond[f]));
            let normal = sign_ * (*node).divisions[i].normal;
            let distance_ = sign_ * (*node).divisions[i].distance;
            if sticks(tool) {
                push(node, f, arm, stick(tool, (*node).v[f], q, normal, distance_, params.adhesion), &taken);
            } else if distance_ <= CONTACT_OFFSET {
                push(node, f, arm, contact(tool, (*node).v[f], q, normal), &taken);
            }
        }
    }
    return taken;
}

// Folded masses at a node, in any block, of the clay in front of a sheet and behind it.
fn masses_about(n: vec3i, sheet: u32) -> vec2f {
    var m = vec2f(0.0);
    let slot = slot_of(n);
    if slot == 0u { return m; }
    for (var c = 1u; c < CLASSES; c++) {
        let key = key_at(slot - 1u, c);
        if key == 0u { break; }
        let side = side_of(key, sheet);
        let mass = bitcast<f32>(cuts[masses_place(slot - 1u, c, local_index(n))]);
        m += vec2f(select(0.0, mass, side > 0), select(0.0, mass, side < 0));
    }
    return m;
}

// Normal of a kept cut at a node, from back to front, not normalised: the slope of the front's share of the
// tagged mass, fitted to the nodes about it, or the way from the back's centre to the front's
// (`cut::fitted_normal`). 0 where there is none.
fn cut_slope(n: vec3i, sheet: u32) -> vec3f {
    var weight = 0.0;
    var share_sum = 0.0;
    var offset_sum = vec3f(0.0);
    var slope_sum = vec3f(0.0);
    var moment = mat3x3f();
    var front = vec4f(0.0);
    var back = vec4f(0.0);
    for (var i = 0; i < 27; i++) {
        let o = vec3i(i / 9, (i / 3) % 3, i % 3) - 1;
        let m = masses_about(n + o, sheet);
        let offset = vec3f(o);
        let off = abs(o);
        let near = 1.0 / f32(1u << u32(off.x + off.y + off.z));
        front += near * m.x * vec4f(offset, 1.0);
        back += near * m.y * vec4f(offset, 1.0);
        if min(m.x, m.y) <= 0.0 { continue; }
        let share = m.x / (m.x + m.y);
        let w = share * m.y * near;
        weight += w;
        share_sum += w * share;
        offset_sum += w * offset;
        slope_sum += w * share * offset;
        moment += mat3x3f(w * offset.x * offset, w * offset.y * offset, w * offset.z * offset);
    }
    if weight == 0.0 { return vec3f(0.0); }
    let mean = offset_sum / weight;
    moment -= weight * mat3x3f(mean.x * mean, mean.y * mean, mean.z * mean);
    let more = NORMAL_REGULARISATION * (moment[0].x + moment[1].y + moment[2].z);
    moment += mat3x3f(vec3f(more, 0.0, 0.0), vec3f(0.0, more, 0.0), vec3f(0.0, 0.0, more));
    // The matrix is symmetric: its inverse is that of its cofactors, over its determinant.
    let sum = slope_sum - mean * share_sum;
    let cofactors = array(cross(moment[1], moment[2]), cross(moment[2], moment[0]), cross(moment[0], moment[1]));
    let slope = vec3f(dot(cofactors[0], sum), dot(cofactors[1], sum), dot(cofactors[2], sum));
    let determinant = dot(moment[0], cofactors[0]);
    if determinant > 0.0 && length(slope) >= SHARE_SLOPE_MIN * determinant { return slope; }
    return front.xyz / front.w - back.xyz / back.w;
}

// The normal between two fields: across the one cut between them, or the mean of two; 0 where a blade stands
// between them, which acts on both.
fn pair_normal(node: ptr<function, Node>, n: vec3i, a: u32, b: u32) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = 0u; i < (*node).division_count; i++) {
        if (((a ^ b) >> i) & 1u) == 0u { continue; }
        if (*node).divisions[i].blade != NO_BLADE { return vec3f(0.0); }
        let slope = cut_slope(n, (*node).divisions[i].sheet);
        let size = length(slope);
        if size == 0.0 { return vec3f(0.0); }
        sum += f32(field_side(node, i, b)) / size * slope;
    }
    let size = length(sum);
    return select(sum / size, vec3f(0.0), size == 0.0);
}

// Two fields exchange momentum while they approach along the normal, from a to b.
fn exchange(node: ptr<function, Node>, a: u32, b: u32, normal: vec3f) {
    let masses = vec2f((*node).mass[a], (*node).mass[b]);
    let relative = (*node).v[b] - (*node).v[a];
    let approach = dot(relative, normal);
    if approach >= 0.0 { return; }
    let slide = relative - approach * normal;
    let speed = length(slide);
    var push = -approach * normal;
    if speed > 0.0 { push -= slide / speed * min(speed, -approach * CUT_FRICTION); }
    let impulse = masses.x * masses.y / (masses.x + masses.y) * push;
    (*node).v[b] += impulse / masses.y;
    (*node).v[a] -= impulse / masses.x;
}

// All pairs of fields in the order of what they are beyond.
fn exchange_all(node: ptr<function, Node>, n: vec3i) {
    for (var b = 1u; b < (1u << (*node).division_count); b++) {
        let to = field_beyond(node, b);
        if to == CLASSES { continue; }
        for (var a = 0u; a < b; a++) {
            let from_ = field_beyond(node, a);
            if from_ == CLASSES { continue; }
            let normal = pair_normal(node, n, a, b);
            if any(normal != vec3f(0.0)) { exchange(node, from_, to, normal); }
        }
    }
}

// The field with mass that is beyond these divisions; CLASSES if there is none.
fn field_beyond(node: ptr<function, Node>, beyond: u32) -> u32 {
    for (var f = 0u; f < CLASSES; f++) {
        if (*node).leader[f] == f && (*node).beyond[f] == beyond && (*node).mass[f] > 0.0 { return f; }
    }
    return CLASSES;
}
