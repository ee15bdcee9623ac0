// Momentum -> velocity: fold, sides, gravity, contact of the two sides, tools, walls, in the order of the substep's definition.
// One workgroup a block, one invocation a node.

@group(0) @binding(9) var<storage, read_write> velocities: array<vec4f>;
@group(0) @binding(17) var<storage, read_write> impulses: array<vec4f>; // sums of a frame, by slot: walls, damping, 2 for each tool

const NO_TOOL: u32 = 0xffffffffu;

var<workgroup> near_tools: atomic<u32>;
var<workgroup> head: vec4u; // is over, packed block, near tools, stands at a wall
var<workgroup> partial: array<vec4f, 64>;
var<workgroup> fields: array<vec4f, 128>;

// Sum over the workgroup, in a fixed order; only invocation 0 has it.
fn workgroup_sum(k: u32, v: vec4f) -> vec4f {
    workgroupBarrier();
    partial[k] = v;
    for (var step = 32u; step > 0u; step /= 2u) {
        workgroupBarrier();
        if k < step { partial[k] += partial[k + step]; }
    }
    return partial[0];
}

// No node's momentum overflows while its mass keeps its limit.
fn check_mass(slot: u32, k: u32) {
    var most = 0u;
    for (var c = 0u; c < CLASSES; c++) {
        most = max(most, u32(sums[(slot * CLASSES + c) * 64u + k].w));
    }
    if f32(most) > params.node_mass_limit * params.mass_scale { halt(OVERFLOW); }
    if most > atomicLoad(&status.node_mass) { atomicMax(&status.node_mass, most); }
}

@compute @workgroup_size(WORKGROUP)
fn grid(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = group.y * groups.x + group.x;
    if !is_halted() && slot < params.slot_capacity && k < params.tool_count && is_near_block(tool_now(k), unpack_cell(blocks[slot])) {
        atomicOr(&near_tools, 1u << k);
    }
    workgroupBarrier();
    if k == 0u {
        let packed = blocks[min(slot, params.slot_capacity - 1u)];
        let is_over = is_halted() || slot >= atomicLoad(&status.slot_count);
        head = vec4u(u32(is_over), packed, atomicLoad(&near_tools), u32(is_at_wall(unpack_cell(packed))));
    }
    let h = workgroupUniformLoad(&head);
    if h.x != 0u { return; }
    let block = unpack_cell(h.y);
    let n = block * 4 + local_node(k);
    let near = h.z;
    let own = own_sums(slot, k);
    check_mass(slot, k);
    var folding = Folding(own, 0u);
    if h.w != 0u { folding = fold(own, block, k); }
    let sums_ = folding.sums;

    // Sides.
    var node: Node;
    var blade = NO_TOOL;
    var distance_ = 0.0;
    var front = 0.0;
    var back = 0.0;
    if CLASSES == 3u {
        front = sums_.c[CLASSES / 2u].w;
        back = sums_.c[CLASSES - 1u].w;
        if front + back > 0.5 * (sums_.c[0].w + front + back) { node.owner = select(2u, 1u, front >= back); }
        for (var t = 0u; t < params.tool_count && blade == NO_TOOL; t++) {
            if (near & (1u << t)) == 0u { continue; }
            let tool = tool_now(t);
            let q = local_end(tool, n, vec3f(0.0));
            if tool.shape == BLADE && all(abs(q.xy) <= tool.size.xy) && abs(q.z) <= BAND {
                blade = t;
                distance_ = q.z;
                node.owner = select(1u, 2u, q.z < 0.0);
            }
        }
    }

    // Velocity.
    var momentum: array<vec3f, 2>;
    for (var c = 0u; c < CLASSES; c++) {
        let f = field_of(node.owner, c);
        momentum[f] += sums_.c[c].xyz;
        node.mass[f] += sums_.c[c].w;
    }
    for (var f = 0u; f < 2u; f++) {
        if node.mass[f] > 0.0 { node.v[f] = (momentum[f] / node.mass[f] + params.gravity) * params.damping; }
    }
    var is_ghost = false;
    for (var axis = 0u; axis < 3u; axis++) {
        if (folding.folds & (1u << axis)) != 0u && column(axis, block, k).role == 0u { is_ghost = true; }
    }

    // Two sides: at the blade, or where it has been.
    var taken_by_blade: Taken;
    if blade != NO_TOOL && !is_ghost {
        let tool = tool_now(blade);
        let q = local_end(tool, n, vec3f(0.0));
        let arm = vec3f(n - tool.end_cell) - tool.end_offset;
        for (var side = 0u; side < 2u; side++) {
            let f = field_of(node.owner, side + 1u);
            let sign_ = 1.0 - 2.0 * f32(side);
            let normal = sign_ * tool.end_rotation[2];
            if tool.contact == STICK {
                push(&node, f, arm, stick(tool, node.v[f], q, normal, sign_ * distance_, params.adhesion), &taken_by_blade);
            } else if sign_ * distance_ <= CONTACT_OFFSET {
                touch(&node, f, tool, q, arm, normal, 1.0, &taken_by_blade);
            }
        }
    } else if node.owner != 0u && !is_ghost {
        exchange(&node, n, front, back);
    }

    // Solid tools in order, and what each tool took.
    let row = slot * (2u + 2u * params.tool_count);
    for (var t = 0u; t < params.tool_count; t++) {
        if (near & (1u << t)) == 0u { continue; }
        let tool = tool_now(t);
        var taken: Taken;
        if t == blade { taken = taken_by_blade; }
        let q = local_end(tool, n, vec3f(0.0));
        let s = distance_to(tool, q);
        if tool.shape != BLADE && !is_ghost && s < contact_offset(tool) {
            let share = select(1.0, closed_share(touching_at(slot, k), s), separates(tool));
            let normal = tool.end_rotation * normal_at(tool, q);
            let arm = vec3f(n - tool.end_cell) - tool.end_offset;
            touch(&node, 0u, tool, q, arm, normal, share, &taken);
            touch(&node, 1u, tool, q, arm, normal, share, &taken);
        }
        let impulse = workgroup_sum(k, taken.impulse);
        let angular = workgroup_sum(k, taken.angular);
        if k == 0u {
            impulses[row + 2u + 2u * t] += impulse;
            impulses[row + 3u + 2u * t] += angular;
        }
    }

    // Walls.
    if h.w != 0u {
        for (var a = 0u; a < 3u; a++) {
            let axis = 2u - a;
            workgroupBarrier();
            fields[k] = vec4f(node.v[0], f32(node.owner));
            fields[64u + k] = vec4f(node.v[1], 0.0);
            workgroupBarrier();
            let w = column(axis, block, k);
            if (folding.folds & (1u << axis)) != 0u {
                if w.role == 0u { node.owner = u32(fields[w.mirror].w); }
                for (var f = 0u; f < 2u; f++) {
                    if w.role == 0u { node.v[f] = reflected(w.kind, axis, fields[64u * f + w.mirror].xyz); }
                    if w.role == 1u { node.v[f] = 0.5 * (node.v[f] + reflected(w.kind, axis, node.v[f])); }
                }
            }
        }
        var impulse = vec3f(0.0);
        if folding.folds != 0u {
            impulse = -node.pushed;
            for (var c = 0u; c < CLASSES; c++) {
                let q = own.c[c];
                impulse += q.w * node.v[field_of(node.owner, c)] - params.damping * (q.xyz + q.w * params.gravity);
            }
        }
        let wall = workgroup_sum(k, vec4f(impulse, length(impulse)));
        if k == 0u { impulses[row] += wall; }
    }
    if params.damping != 1.0 {
        var free = vec3f(0.0);
        for (var c = 0u; c < CLASSES; c++) {
            free += own.c[c].xyz + own.c[c].w * params.gravity;
        }
        let damped = workgroup_sum(k, vec4f(free * (params.damping - 1.0), 0.0));
        if k == 0u { impulses[row + 1u] += damped; }
    }

    for (var c = 0u; c < CLASSES; c++) {
        velocities[(slot * CLASSES + c) * 64u + k] = vec4f(node.v[field_of(node.owner, c)], 0.0);
    }
    // A mass of a few fixed-point units is off by as much, and so is its velocity; and it moves no particle.
    let least = 256.0 / params.mass_scale;
    let speeds = vec2f(dot(node.v[0], node.v[0]), dot(node.v[1], node.v[1]));
    let speed = sqrt(max(select(0.0, speeds.x, node.mass.x >= least), select(0.0, speeds.y, node.mass.y >= least)));
    if !is_finite(speeds.x + speeds.y) { halt(NON_FINITE); return; }
    if speed > params.travel_limit { halt(SPEED); }
    let bits = bitcast<u32>(speed);
    if bits > atomicLoad(&status.speed) { atomicMax(&status.speed, bits); }
}
