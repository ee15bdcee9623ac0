// Solid tools, edges of blades and separating walls press on particles: what they give them goes to the nodes
// beside their own momentum. Walls that hold clay learn where it has arrived. One workgroup a block, as the
// particles were sorted last.

@group(0) @binding(7) var<storage, read_write> blocks: array<atomic<u32>>;
@group(0) @binding(12) var<storage, read> firsts: array<u32>; // the first particle of each cell

var<workgroup> near_tools: atomic<u32>;
var<workgroup> head: vec4u; // near tools, first particle, the one after the last, near walls
var<workgroup> touching: atomic<u32>;
var<workgroup> touched: u32;

// A particle under the tools.
struct Pressed {
    cell: vec3i,
    offset: vec3f,
    velocity: vec3f,
    tags: u32,
    key: u32, // of its class
    mass: f32,
    given: vec3f, // velocity that the tools give it
    before: array<vec4f, ANCHORS_MAX>,
    after: array<vec4f, ANCHORS_MAX>,
    count: u32, // of anchors after
    walls: u32, // that it touches or has arrived at
}

fn pressed_at(i: u32) -> Pressed {
    var p: Pressed;
    let position = state[at(POSITION, i)];
    p.cell = unpack_cell(bitcast<u32>(position.w));
    p.offset = position.xyz;
    let velocity = state[at(VELOCITY, i)];
    p.velocity = velocity.xyz;
    p.tags = bitcast<u32>(velocity.w);
    p.key = key_of(body_at(i), p.tags);
    p.mass = state[at(AFFINE, i)].w;
    p.walls = bitcast<u32>(state[at(STRESS + 1u, i)].z);
    if params.pressing == 0u { return p; }
    for (var a = 0u; a < ANCHORS_MAX; a++) {
        p.before[a] = state[at(ANCHORS + a, i)];
    }
    return p;
}

fn anchor_on(p: ptr<function, Pressed>, tool: u32) -> Anchor {
    for (var a = 0u; a < ANCHORS_MAX; a++) {
        if bitcast<u32>((*p).before[a].w) == tool { return Anchor(true, (*p).before[a].xyz); }
    }
    return Anchor(false, vec3f(0.0));
}

fn press(p: ptr<function, Pressed>, t: Tool) -> Taken {
    var taken: Taken;
    let q = local_end(t, (*p).cell, (*p).offset);
    let volume = (*p).mass * params.density_unit;
    let gap = distance_to(t, q) - reach_of(volume);
    if gap >= BOND_REACH { return taken; }
    let normal = normal_at(t, q);
    let leaving = dot(t.end_rotation * normal, (*p).velocity + (*p).given - velocity_at(t, q));
    let springs = springs_of(volume);
    let found = touch(t, springs, Surface(gap, normal, leaving), q, anchor_on(p, t.anchor));
    if !found.is_there { return taken; }
    if found.anchor.is_there { cling(p, t, found.anchor.place); }
    return give(p, t, t.end_rotation * found.force / springs.inertia);
}

// Keeps an anchor, if there is a seat for it.
fn cling(p: ptr<function, Pressed>, t: Tool, place: vec3f) {
    if (*p).count == ANCHORS_MAX { return; }
    (*p).after[(*p).count] = vec4f(place, bitcast<f32>(t.anchor));
    (*p).count += 1u;
}

// A tool gives the particle this velocity, and takes the opposite impulse.
fn give(p: ptr<function, Pressed>, t: Tool, given: vec3f) -> Taken {
    (*p).given += given;
    var arm = vec3f((*p).cell - t.end_cell) + ((*p).offset - t.end_offset);
    // A wire's origin is on the wire, its strip's is not.
    if is_wire(t) { arm -= t.end_rotation * vec3f(0.0, t.radius, 0.0); }
    let impulse = (*p).mass * given;
    return Taken(vec4f(-impulse, 1.0), vec4f(-cross(arm, impulse), length(impulse)));
}

// The edge of a blade holds off clay that has no side of it, where it has something to part there.
fn hold_off(p: ptr<function, Pressed>, index: u32, t: Tool) -> Taken {
    var taken: Taken;
    if params.toughness == 0.0 || place_of((*p).tags, t.sheet) != NONE { return taken; }
    let q = local_end(t, (*p).cell, (*p).offset);
    let edge = edge_before(t, q);
    var share = edge_share(edge);
    if !edge.is_there || share <= 0.0 { return taken; }
    share *= wholeness(index, (*p).key);
    var anchor = local_start(t, (*p).cell, (*p).offset);
    let kept = anchor_on(p, t.anchor);
    if kept.is_there { anchor = kept.place; }
    let volume = (*p).mass * params.density_unit;
    let springs = springs_of(volume);
    let found = cut(springs, volume, share, dot(edge.outward, anchor - q));
    cling(p, t, q + found.y * edge.outward);
    if found.x == 0.0 { return taken; }
    return give(p, t, t.end_rotation * edge.outward * (found.x / springs.inertia));
}

// What walls near the block give to a particle, and its length; notes those it touches or has arrived at.
fn against_walls(p: ptr<function, Pressed>, near: u32) -> vec4f {
    let noted = (*p).walls;
    let volume = (*p).mass * params.density_unit;
    var pushed = vec4f(0.0);
    (*p).walls = 0u;
    for (var wall = 0u; wall < 6u; wall++) {
        if ((near >> wall) & 1u) == 0u { continue; }
        let axis = axis_of(wall);
        let distance_ = inward_of(wall) * (f32((*p).cell[axis] - node_of(wall)) + (*p).offset[axis]);
        let was_noted = ((noted >> wall) & 1u) == 1u;
        if kind_of(wall) != WALL_SEPARATE {
            if distance_ >= NODE_REACH || (!was_noted && distance_ > arrival_of(volume)) { continue; }
            (*p).walls |= 1u << wall;
            arrive(p, wall);
            continue;
        }
        let gap = distance_ - reach_of(volume);
        if gap >= 0.0 { continue; }
        let springs = springs_of(volume);
        let leaving = inward_of(wall) * ((*p).velocity[axis] + (*p).given[axis]);
        var push = -springs.normal * gap;
        if is_found(was_noted, gap, leaving) {
            push = ejection(springs, push, leaving);
        } else {
            (*p).walls |= 1u << wall;
        }
        var given = vec3f(0.0);
        given[axis] = inward_of(wall) * push / springs.inertia;
        (*p).given += given;
        pushed += (*p).mass * vec4f(given, length(given));
    }
    return pushed;
}

// Marks the columns of a wall to whose nodes the particle gives mass.
fn arrive(p: ptr<function, Pressed>, wall: u32) {
    let axis = axis_of(wall);
    let base = (*p).cell + vec3i(floor((*p).offset - 0.5));
    for (var i = 0; i < 9; i++) {
        var n = base;
        n[(axis + 1u) % 3u] += i / 3;
        n[(axis + 2u) % 3u] += i % 3;
        n[axis] = node_of(wall);
        let slot = slot_of(n);
        if slot == 0u { halt(MARGIN); return; }
        let bit = column_bit(axis, n);
        atomicOr(&blocks[column_word(slot - 1u, bit)], 1u << (bit % 32u));
    }
}

// Whether any invocation of the workgroup says so. All call it together.
fn any_touches(k: u32, touches: bool) -> bool {
    if k == 0u { atomicStore(&touching, 0u); }
    workgroupBarrier();
    if touches { atomicStore(&touching, 1u); }
    workgroupBarrier();
    if k == 0u { touched = atomicLoad(&touching); }
    return workgroupUniformLoad(&touched) != 0u;
}

@compute @workgroup_size(WORKGROUP)
fn penalty(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = group.y * groups.x + group.x;
    let is_over = is_halted() || slot >= min(atomicLoad(&status.slot_count), params.slot_capacity);
    let presses = k < params.tool_count && ((params.pressing >> k) & 1u) == 1u;
    if !is_over && presses && is_near_block(tool_now(k), unpack_cell(atomicLoad(&blocks[slot]))) {
        atomicOr(&near_tools, 1u << k);
    }
    workgroupBarrier();
    if k == 0u {
        var last = params.particle_count;
        if slot + 1u < params.slot_capacity { last = firsts[(slot + 1u) * 64u]; }
        head = vec4u(0u);
        if !is_over { head = vec4u(atomicLoad(&near_tools), firsts[slot * 64u], last, walls_near(unpack_cell(atomicLoad(&blocks[slot])))); }
    }
    let h = workgroupUniformLoad(&head);
    if h.x == 0u && h.w == 0u {
        // Within a frame nothing that touched is suddenly away from all tools.
        if params.starts_frame == 1u && atomicLoad(&status.substep) == 1u { let_go(h, k); }
        return;
    }
    for (var first = h.y; first < h.z; first += WORKGROUP) {
        press_on(slot, h, first + k, k);
    }
}

// The particles of a block touch nothing.
fn let_go(h: vec4u, k: u32) {
    for (var i = h.y + k; i < h.z; i += WORKGROUP) {
        state[at(STRESS + 1u, i)].z = 0.0;
        if params.pressing == 0u { continue; }
        for (var a = 0u; a < ANCHORS_MAX; a++) {
            state[at(ANCHORS + a, i)] = vec4f(0.0);
        }
    }
}

// What nodes have to know of a particle that tools may press on.
fn noted(i: u32) -> f32 {
    if params.remembers == 0u { return 1.0; }
    let lost = params.work_loss * state[at(AFFINE + 1u, i)].w - params.strength_gain * state[at(STRAIN + 1u, i)].z;
    return FRESH + max(lost, -LOST_MAX);
}

// All invocations of the workgroup call it together: the tools near the block, in order, then its walls, on a
// particle each.
fn press_on(slot: u32, h: vec4u, i: u32, k: u32) {
    let is_there = i < h.z;
    var p: Pressed;
    if is_there { p = pressed_at(i); }
    for (var t = 0u; t < params.tool_count; t++) {
        if (h.x & (1u << t)) == 0u { continue; }
        var taken: Taken;
        if is_there {
            let tool = tool_now(t);
            if is_solid(tool) { taken = press(&p, tool); } else { taken = hold_off(&p, t, tool); }
        }
        if any_touches(k, taken.impulse.w != 0.0) { book(books_of(slot), t, k, taken); }
    }
    var pushed = vec4f(0.0);
    if is_there { pushed = against_walls(&p, h.w); }
    if any_touches(k, pushed.w != 0.0) {
        let sum = workgroup_sum(k, pushed);
        if k == 0u { impulses[books_of(slot)] += sum; }
    }
    if !is_there { return; }
    state[at(WAY, i)] = vec4f(p.given, noted(i));
    state[at(STRESS + 1u, i)].z = bitcast<f32>(p.walls);
    if params.pressing == 0u { return; }
    for (var a = 0u; a < ANCHORS_MAX; a++) {
        state[at(ANCHORS + a, i)] = p.after[a];
    }
}
