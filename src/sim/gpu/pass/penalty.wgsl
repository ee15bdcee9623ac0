// Solid tools press on particles: what they give them goes into the velocity with which they scatter. One
// workgroup a block, as the particles were sorted last.

@group(0) @binding(7) var<storage, read> blocks: array<u32>;
@group(0) @binding(12) var<storage, read> firsts: array<u32>; // the first particle of each cell

var<workgroup> near_tools: atomic<u32>;
var<workgroup> head: vec3u; // near tools, first particle, the one after the last
var<workgroup> touching: atomic<u32>;
var<workgroup> touched: u32;

// A particle under the tools.
struct Pressed {
    cell: vec3i,
    offset: vec3f,
    velocity: vec3f,
    mass: f32,
    given: vec3f, // velocity that the tools give it
    before: array<vec4f, ANCHORS_MAX>,
    after: array<vec4f, ANCHORS_MAX>,
    count: u32, // of anchors after
}

fn pressed_at(i: u32) -> Pressed {
    var p: Pressed;
    let position = state[at(POSITION, i)];
    p.cell = unpack_cell(bitcast<u32>(position.w));
    p.offset = position.xyz;
    p.velocity = state[at(VELOCITY, i)].xyz;
    p.mass = state[at(AFFINE, i)].w;
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
    if found.anchor.is_there && (*p).count < ANCHORS_MAX {
        (*p).after[(*p).count] = vec4f(found.anchor.place, bitcast<f32>(t.anchor));
        (*p).count += 1u;
    }
    let given = t.end_rotation * found.force / springs.inertia;
    (*p).given += given;
    let arm = vec3f((*p).cell - t.end_cell) + ((*p).offset - t.end_offset);
    let impulse = (*p).mass * given;
    return Taken(vec4f(-impulse, 1.0), vec4f(-cross(arm, impulse), length(impulse)));
}

@compute @workgroup_size(WORKGROUP)
fn penalty(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = group.y * groups.x + group.x;
    let is_over = is_halted() || slot >= min(atomicLoad(&status.slot_count), params.slot_capacity);
    let is_solid = k < params.tool_count && ((params.solids >> k) & 1u) == 1u;
    if !is_over && is_solid && is_near_block(tool_now(k), unpack_cell(blocks[slot])) {
        atomicOr(&near_tools, 1u << k);
    }
    workgroupBarrier();
    if k == 0u {
        var last = params.particle_count;
        if slot + 1u < params.slot_capacity { last = firsts[(slot + 1u) * 64u]; }
        head = vec3u(0u);
        if !is_over { head = vec3u(atomicLoad(&near_tools), firsts[slot * 64u], last); }
    }
    let h = workgroupUniformLoad(&head);
    if h.x == 0u {
        // Within a frame nothing that touched is suddenly away from all tools.
        if params.starts_frame == 1u && atomicLoad(&status.substep) == 1u { let_go(h, k); }
        return;
    }
    for (var first = h.y; first < h.z; first += WORKGROUP) {
        press_on(slot, h.x, first + k, h.z, k);
    }
}

// The particles of a block cling to nothing.
fn let_go(h: vec3u, k: u32) {
    for (var i = h.y + k; i < h.z; i += WORKGROUP) {
        for (var a = 0u; a < ANCHORS_MAX; a++) {
            state[at(ANCHORS + a, i)] = vec4f(0.0);
        }
    }
}

// All invocations of the workgroup call it together: the tools near the block, in order, on a particle each.
fn press_on(slot: u32, near: u32, i: u32, last: u32, k: u32) {
    let is_there = i < last;
    var p: Pressed;
    if is_there { p = pressed_at(i); }
    for (var t = 0u; t < params.tool_count; t++) {
        if (near & (1u << t)) == 0u { continue; }
        var taken: Taken;
        if is_there { taken = press(&p, tool_now(t)); }
        if k == 0u { atomicStore(&touching, 0u); }
        workgroupBarrier();
        if taken.impulse.w != 0.0 { atomicStore(&touching, 1u); }
        workgroupBarrier();
        if k == 0u { touched = atomicLoad(&touching); }
        if workgroupUniformLoad(&touched) != 0u { book(books_of(slot), t, k, taken); }
    }
    if !is_there { return; }
    let velocity = state[at(VELOCITY, i)];
    state[at(VELOCITY, i)] = vec4f(velocity.xyz + p.given, velocity.w);
    for (var a = 0u; a < ANCHORS_MAX; a++) {
        state[at(ANCHORS + a, i)] = p.after[a];
    }
}
