// How the sides of cuts, and bodies, face each other at each node that both have reached, by what it and
// those about it know (`facing`). One workgroup a block, one invocation a node.

@group(0) @binding(7) var<storage, read> blocks: array<u32>;

var<workgroup> head: vec2u; // is over, packed block
var<workgroup> next: u32;
var<workgroup> shared_count: atomic<u32>;
var<workgroup> is_shared: u32;
var<workgroup> masses: array<vec2f, 512>; // in front and behind, of the nodes of the block and two about it
var<workgroup> middles: array<vec3f, 216>; // where the clay of a node is from it, of the block and one about it

// The least, above `last`, of what stands on two sides of something here; 0 if there is none.
fn next_between(slot: u32, last: u32) -> u32 {
    var least = 0xffffffffu;
    for (var c = 0u; c < CLASSES; c++) {
        let key = key_at(slot, c);
        if c > 0u && key == 0u { break; }
        let sheets = sheets_of(key);
        if sheets.x > last { least = min(least, sheets.x); }
        if sheets.y > last { least = min(least, sheets.y); }
        for (var d = 0u; d < c; d++) {
            let bodies = vec2u(body_of(key_at(slot, d)), body_of(key));
            let between = between_bodies(min(bodies.x, bodies.y), max(bodies.x, bodies.y));
            if bodies.x != bodies.y && between > last { least = min(least, between); }
        }
    }
    return select(least, 0u, least == 0xffffffffu);
}

// Folded masses at a node, in any block, of the clay in front and behind.
fn masses_at(n: vec3i, between: u32) -> vec2f {
    var m = vec2f(0.0);
    let slot = slot_about(n);
    if slot == 0u { return m; }
    for (var c = 0u; c < CLASSES; c++) {
        let key = key_at(slot - 1u, c);
        if c > 0u && key == 0u { break; }
        let side = side_between(key, between);
        if side == 0 { continue; }
        let mass = bitcast<f32>(cuts[masses_place(slot - 1u, c, local_index(n))]);
        m += vec2f(select(0.0, mass, side > 0), select(0.0, mass, side < 0));
    }
    return m;
}

// Place of a node of the block, or of one of the `ring` nodes about it, among all of them.
fn place_about(n: vec3i, ring: i32) -> u32 {
    let at = vec3u(n + ring);
    let edge = u32(4 + 2 * ring);
    return (at.x * edge + at.y) * edge + at.z;
}

fn node_about(i: u32, ring: i32) -> vec3i {
    let edge = u32(4 + 2 * ring);
    return vec3i(vec3u(i / (edge * edge), (i / edge) % edge, i % edge)) - ring;
}

fn total_at(n: vec3i) -> f32 {
    let m = masses[place_about(n, 2)];
    return m.x + m.y;
}

// How far along an axis the middle of a node's clay is off it (`facing::displacement`).
fn displacement(before: f32, here: f32, after: f32) -> f32 {
    let sum = before + 2.0 * here + after;
    if sum <= 0.0 { return 0.0; }
    let c = (after - before) / sum;
    let a = abs(c);
    return c * a * (((DISPLACEMENT_0 * a + DISPLACEMENT_1) * a + DISPLACEMENT_2) * a + DISPLACEMENT_3);
}

fn middle_of(n: vec3i) -> vec3f {
    let here = total_at(n);
    if here == 0.0 { return vec3f(0.0); }
    let x = vec3i(1, 0, 0);
    let y = vec3i(0, 1, 0);
    let z = vec3i(0, 0, 1);
    return vec3f(
        displacement(total_at(n - x), here, total_at(n + x)),
        displacement(total_at(n - y), here, total_at(n + y)),
        displacement(total_at(n - z), here, total_at(n + z)),
    );
}

// Distance of the face of clay whose weighted centre stands that far before a node (`facing::face_distance`).
fn face_distance(centre: f32) -> f32 {
    let c = clamp(centre, 0.0, 1.0);
    let high = (FACE_DISTANCE_0 * c + FACE_DISTANCE_1) * c + FACE_DISTANCE_2;
    return ((high * c + FACE_DISTANCE_3) * c + FACE_DISTANCE_4) * c + FACE_DISTANCE_5;
}

// What a node of the block finds: the slope of ln(front / back), fitted to the nodes about it, or the way
// from the back's centre to the front's (`facing::facing`).
fn facing_at(n: vec3i) -> Facing {
    var weight = 0.0;
    var share_sum = 0.0;
    var place_sum = vec3f(0.0);
    var slope_sum = vec3f(0.0);
    var moment = mat3x3f();
    var front = vec4f(0.0);
    var back = vec4f(0.0);
    for (var i = 0u; i < 27u; i++) {
        let o = vec3i(vec3u(i / 9u, (i / 3u) % 3u, i % 3u)) - 1;
        let m = masses[place_about(n + o, 2)];
        let off = abs(o);
        let near = 1.0 / f32(1u << u32(off.x + off.y + off.z));
        front += near * m.x * vec4f(vec3f(o), 1.0);
        back += near * m.y * vec4f(vec3f(o), 1.0);
        if min(m.x, m.y) <= 0.0 { continue; }
        let share = log(m.x / m.y);
        let w = near * m.x * m.y / (m.x + m.y);
        let place = vec3f(o) + middles[place_about(n + o, 1)];
        weight += w;
        share_sum += w * share;
        place_sum += w * place;
        slope_sum += w * share * place;
        moment += mat3x3f(w * place.x * place, w * place.y * place, w * place.z * place);
    }
    let mean = place_sum / weight;
    moment -= weight * mat3x3f(mean.x * mean, mean.y * mean, mean.z * mean);
    let more = NORMAL_REGULARISATION * (moment[0].x + moment[1].y + moment[2].z);
    moment += mat3x3f(vec3f(more, 0.0, 0.0), vec3f(0.0, more, 0.0), vec3f(0.0, 0.0, more));
    // The matrix is symmetric: its inverse is that of its cofactors, over its determinant.
    let sum = slope_sum - mean * share_sum;
    let cofactors = array(cross(moment[1], moment[2]), cross(moment[2], moment[0]), cross(moment[0], moment[1]));
    let slope = vec3f(dot(cofactors[0], sum), dot(cofactors[1], sum), dot(cofactors[2], sum));
    let determinant = dot(moment[0], cofactors[0]);
    let is_fit = determinant > 0.0 && length(slope) >= SLOPE_MIN * determinant;
    let centres = array(front.xyz / front.w, back.xyz / back.w);
    let along = select(centres[0] - centres[1], slope, is_fit);
    let size = length(along);
    if size == 0.0 { return Facing(vec3f(0.0), 0.0); }
    let normal = along / size;
    let faces_ = face_distance(dot(centres[0], normal)) + face_distance(-dot(centres[1], normal));
    return Facing(normal, faces_ + OBLIQUE_GAP * (1.0 - dot(normal * normal, normal * normal)));
}

// What a node finds of two sides, as it counts in a mean: normal and gap times the mass that both share
// there, and that mass.
fn find(slot: u32, i: u32, k: u32) {
    let m = masses[place_about(local_node(k), 2)];
    var found = vec4f(0.0);
    var mass = 0.0;
    if min(m.x, m.y) > 0.0 {
        let facing = facing_at(local_node(k));
        if any(facing.normal != vec3f(0.0)) {
            mass = m.x * m.y / (m.x + m.y);
            found = mass * vec4f(facing.normal, facing.gap);
        }
    }
    let place = found_place(slot, i, k);
    let words = bitcast<vec4u>(found);
    cuts[place] = words.x;
    cuts[place + 1u] = words.y;
    cuts[place + 2u] = words.z;
    cuts[place + 3u] = words.w;
    cuts[place + 4u] = bitcast<u32>(mass);
}

@compute @workgroup_size(WORKGROUP)
fn faces(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = group.y * groups.x + group.x;
    if k == 0u {
        let is_over = is_halted() || slot >= atomicLoad(&status.slot_count);
        head = vec2u(u32(is_over), blocks[min(slot, params.slot_capacity - 1u)]);
    }
    let h = workgroupUniformLoad(&head);
    if h.x != 0u { return; }
    let low = unpack_cell(h.y) * 4;
    var between = 0u;
    var count = 0u;
    while count < BETWEEN_MAX {
        if k == 0u {
            next = next_between(slot, between);
            atomicStore(&shared_count, 0u);
        }
        between = workgroupUniformLoad(&next);
        if between == 0u { break; }
        if all(masses_at(low + local_node(k), between) > vec2f(0.0)) { atomicAdd(&shared_count, 1u); }
        workgroupBarrier();
        if k == 0u { is_shared = atomicLoad(&shared_count); }
        if workgroupUniformLoad(&is_shared) == 0u { continue; }
        for (var i = k; i < 512u; i += WORKGROUP) {
            masses[i] = masses_at(low + node_about(i, 2), between);
        }
        workgroupBarrier();
        for (var i = k; i < 216u; i += WORKGROUP) {
            middles[i] = middle_of(node_about(i, 1));
        }
        workgroupBarrier();
        find(slot, count, k);
        if k == 0u { cuts[between_place(slot, count)] = between; }
        count += 1u;
        workgroupBarrier();
    }
    if k == 0u && count < BETWEEN_MAX { cuts[between_place(slot, count)] = 0u; }
}
