// Rules 0 to 3: which body a node is of, who owns it, how closed what parts it is, its own value, whether it
// is inside.

@group(0) @binding(10) var<storage, read> kept: array<f32>;

const EDGE: i32 = 10; // cells of 2^3 nodes from -3 to 6
const EACH: u32 = 4u; // that an invocation takes

var<workgroup> clay: array<f32, 1000>; // by cell: at faces, the greatest nearby, then k

fn load_clay(k: u32) {
    for (var i = i32(k); i < 1000; i += 256) {
        let cell = vec3u(vec3i(i % EDGE, (i / EDGE) % EDGE, i / (EDGE * EDGE)) + 1);
        let b = cell >> vec3u(2u);
        let at = cell & vec3u(3u);
        let slot = near[b.x + 3u * (b.y + 3u * b.z)];
        var value = 0.0;
        if slot != 0u { value = bitcast<f32>(cells[cells_first(slot - 1u) + CLOSURE_FIRST + at.x + 4u * (at.y + 4u * at.z)]); }
        clay[i] = value;
    }
    workgroupBarrier();
}

// The greatest within 2 cells along an axis.
fn spread_clay(k: u32, step: i32) {
    var found: array<f32, EACH>;
    for (var n = 0u; n < EACH; n++) {
        let i = i32(k + 256u * n);
        let at = (i / step) % EDGE;
        for (var c = max(at - 2, 0); c <= min(at + 2, EDGE - 1) && i < 1000; c++) {
            found[n] = max(found[n], clay[i + (c - at) * step]);
        }
    }
    workgroupBarrier();
    for (var n = 0u; n < EACH; n++) {
        if k + 256u * n < 1000u { clay[k + 256u * n] = found[n]; }
    }
    workgroupBarrier();
}

fn closure_of(most: f32) -> f32 {
    if most == SEVERAL { return 0.0; }
    let x = clamp((most - CLAY_OPEN) / (CLAY_CLOSED - CLAY_OPEN), 0.0, 1.0);
    return x * x * (3.0 - 2.0 * x);
}

// Linear between the middles of cells: a node stands a quarter of a cell from its own's.
fn closure_between(node: vec3i) -> f32 {
    let own = (node >> vec3u(1u)) + 3;
    let beside = (node & vec3i(1)) * 2 - 1;
    var sum = 0.0;
    for (var i = 0u; i < 8u; i++) {
        let d = corner_of(i);
        let at = own + d * beside;
        let share = select(vec3f(0.75), vec3f(0.25), d == vec3i(1));
        sum += share.x * share.y * share.z * closure_of(clay[at.x + EDGE * (at.y + EDGE * at.z)]);
    }
    return sum;
}

// 0.
fn fullest_body(slot: u32, j: u32) -> u32 {
    if status.has_bodies == 0u { return 0u; }
    let list = list_first(slot);
    var body = NOBODY;
    var greatest = 0.0;
    for (var i = 0u; i < cells[list + 1u]; i++) {
        let value = kept[body_first(slot, cells[list + 2u + i]) + j];
        if value > greatest {
            greatest = value;
            body = cells[list + 2u + i];
        }
    }
    return body;
}

// What a node is of: its label but for whether it is inside, and its own value with and without what others
// have there.
struct Part { label: u32, body: u32, own: f32, alone: f32 }

fn part_at(slot: u32, j: u32, closure: f32) -> Part {
    let first = plane_first(slot, 0u) + j;
    let sheet_count = min(status.sheet_count, params.sheet_capacity);
    let body = fullest_body(slot, j);
    var total = kept[first];
    if body != NOBODY { total = kept[body_first(slot, body) + j]; }
    var least = total;
    for (var s = 0u; s < sheet_count; s++) {
        if !is_cut_in(s, body) { continue; }
        let front = kept[first + (2u * s + 1u) * 512u];
        let back = kept[first + (2u * s + 2u) * 512u];
        let owner = owner_of(total, front, back);
        if owner != 0u { least = min(least, side_value(total, front + back, select(front, back, owner == 1u))); }
    }
    var part = Part(0u, body, with_others(total, kept[first], closure), total);
    var count = 0u;
    for (var s = 0u; s < sheet_count; s++) {
        if !is_cut_in(s, body) { continue; }
        let front = kept[first + (2u * s + 1u) * 512u];
        let back = kept[first + (2u * s + 2u) * 512u];
        let owner = owner_of(least, front, back);
        if owner == 0u || count == CUTS_MAX { continue; }
        part.label |= (((status.sheets[s] & 255u) << 1u) | select(0u, 1u, owner == 1u)) << (1u + 9u * count);
        count++;
        let value = side_value(total, front + back, select(front, back, owner == 1u));
        part.own *= with_others(value, total, closure) / total;
        part.alone *= value / total;
    }
    return part;
}

fn beside(node: vec3i, i: u32) -> vec3i {
    var d = vec3i(0);
    d[i >> 1u] = 1 - 2 * i32(i & 1u);
    return node + d;
}

// A node of this block or a neighbour's, where others have so much; that of no part where there is none.
fn part_near(node: vec3i, closure: f32) -> Part {
    let slot = slot_near(node);
    if slot == 0u { return Part(0u, NOBODY, 0.0, 0.0); }
    return part_at(slot - 1u, local_index(node), closure);
}

fn are_one(a: Part, b: Part) -> bool {
    return a.label == b.label && a.body == b.body;
}

// Whether a node that is inside by others' clay is beside one that is so by its part's own, or by others' and
// beside such a one.
fn is_held(node: vec3i, part: Part) -> bool {
    for (var i = 0u; i < 6u; i++) {
        let next = part_near(beside(node, i), 0.0);
        if next.alone > params.iso && are_one(next, part) { return true; }
    }
    for (var i = 0u; i < 6u; i++) {
        let at = beside(node, i);
        let next = part_near(at, closure_between(at));
        if next.own <= params.iso || !are_one(next, part) { continue; }
        for (var k = 0u; k < 6u; k++) {
            let last = part_near(beside(at, k), 0.0);
            if last.alone > params.iso && are_one(last, part) { return true; }
        }
    }
    return false;
}

fn label_node(slot: u32, j: u32, closure: f32) {
    var part = part_at(slot, j, closure);
    if part.own > params.iso && part.alone <= params.iso && !is_held(local_node(j), part) {
        // As much as there may be without being inside: the surface stays where all clay ends.
        part.own = params.iso;
    }
    // To Equation 9 a cut makes values, and parts nothing.
    if params.method == 1u {
        part.label = 0u;
        part.body = 0u;
    }
    let cell = cells_first(slot) + j;
    cells[cell] = part.label | u32(part.own > params.iso);
    cells[cell + 512u] = bitcast<u32>(part.own);
    cells[cell + 1536u] = part.body;
    cells[cell + 2048u] = bitcast<u32>(closure);
}

@compute @workgroup_size(256)
fn label(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = work[group.x].slot;
    let entry = work[group.x].entry;
    if entry == NONE { return; }
    // To Equation 9 a side is its own clay alone; the coarse grid shows no sharp edges.
    if !has_parts() || params.method == 1u || params.scale == 1.0 {
        if work[group.x].values == 0u { return; }
        for (var j = k; j < 512u; j += 256u) { label_node(slot, j, 0.0); }
        return;
    }
    find_neighbours(block_of(entry), k);
    load_clay(k);
    spread_clay(k, 1);
    spread_clay(k, EDGE);
    spread_clay(k, EDGE * EDGE);
    for (var j = k; j < 512u; j += 256u) { label_node(slot, j, closure_between(local_node(j))); }
}
