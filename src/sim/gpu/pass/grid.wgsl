// Momentum -> velocity: fold, sides, gravity, blades and cuts, walls, in the order of the substep's
// definition. One workgroup a block, one invocation a node.

@group(0) @binding(9) var<storage, read_write> velocities: array<vec4f>; // after and before: two of each node and class

var<workgroup> near_dividers: atomic<u32>;
var<workgroup> head: vec4u; // is over, packed block, near blades, stands at a wall
var<workgroup> reflection: array<vec3f, 64>;

// No node's momentum overflows while its mass keeps its limit.
fn check_mass(slot: u32, k: u32) {
    var most = 0u;
    for (var c = 0u; c < CLASSES; c++) {
        most = max(most, u32(sums[2u * ((slot * CLASSES + c) * 64u + k)].w));
    }
    if f32(most) > params.node_mass_limit * params.mass_scale { halt(OVERFLOW); }
    if most > atomicLoad(&status.node_mass) { atomicMax(&status.node_mass, most); }
}

// What a class came with: no wall folds it, no field shares it.
fn velocity_before(place: u32, mass: f32) -> vec3f {
    return select(vec3f(0.0), vec3f(sums[place + 1u].xyz) / (params.momentum_scale * mass), mass > 0.0);
}

@compute @workgroup_size(WORKGROUP)
fn grid(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = group.y * groups.x + group.x;
    let is_divider = k < params.tool_count && ((params.dividers >> k) & 1u) == 1u;
    if is_divider && !is_halted() && slot < params.slot_capacity && is_near_block(tool_now(k), unpack_cell(blocks[slot])) {
        atomicOr(&near_dividers, 1u << k);
    }
    workgroupBarrier();
    if k == 0u {
        let packed = blocks[min(slot, params.slot_capacity - 1u)];
        let is_over = is_halted() || slot >= atomicLoad(&status.slot_count);
        head = vec4u(u32(is_over), packed, atomicLoad(&near_dividers), u32(is_at_wall(unpack_cell(packed))));
    }
    let h = workgroupUniformLoad(&head);
    if h.x != 0u { return; }
    let block = unpack_cell(h.y);
    let n = block * 4 + local_node(k);
    let near = h.z;
    let own = own_sums(slot, k);
    check_mass(slot, k);
    var folding = Folding(own, 0u);
    if h.w != 0u { folding = fold(own, slot, block, k); }
    let sums_ = folding.sums;

    // Sides.
    var node: Node;
    divide(&node, slot, n, near, sums_);

    // Velocity.
    for (var c = 0u; c < CLASSES; c++) {
        let f = node.leader[c];
        node.v[f] += sums_.c[c].xyz;
        node.mass[f] += sums_.c[c].w;
    }
    for (var f = 0u; f < CLASSES; f++) {
        if node.mass[f] > 0.0 { node.v[f] = (node.v[f] / node.mass[f] + params.gravity) * params.damping; }
    }
    var is_outer = false;
    for (var axis = 0u; axis < 3u; axis++) {
        if (folding.folds & (1u << axis)) != 0u && column(axis, block, k).role == 0u { is_outer = true; }
    }

    // Blades in order, then the fields that kept cuts divide.
    let row = books_of(slot);
    if CLASSES > 1u {
        for (var t = 0u; t < params.tool_count; t++) {
            if (near & (1u << t)) == 0u { continue; }
            var taken: Taken;
            if !is_outer { taken = against_blade(&node, t, n, slot, k); }
            book(row, t, k, taken);
        }
        if !is_outer { exchange_all(&node, n); }
    }

    // Walls: from here on each class by itself.
    for (var c = 0u; c < CLASSES; c++) {
        node.v[c] = node.v[node.leader[c]];
        node.mass[c] = node.mass[node.leader[c]];
    }
    if h.w != 0u {
        for (var c = 0u; c < CLASSES; c++) {
            for (var a = 0u; a < 3u; a++) {
                let axis = 2u - a;
                workgroupBarrier();
                reflection[k] = node.v[c];
                workgroupBarrier();
                let w = column(axis, block, k);
                let is_folded = (folding.folds & (1u << axis)) != 0u;
                if is_folded && w.role == 0u { node.v[c] = reflected(w.kind, axis, reflection[w.inner]); }
                if is_folded && w.role == 1u { node.v[c] = 0.5 * (node.v[c] + reflected(w.kind, axis, node.v[c])); }
            }
        }
        var impulse = vec3f(0.0);
        if folding.folds != 0u {
            impulse = -node.pushed;
            for (var c = 0u; c < CLASSES; c++) {
                let q = own.c[c];
                impulse += q.w * node.v[c] - params.damping * (q.xyz + q.w * params.gravity);
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

    // A mass of a few fixed-point units is off by as much, and so is its velocity; and it moves no particle.
    let least = 256.0 / params.mass_scale;
    var greatest = 0.0;
    var all_ = 0.0;
    for (var c = 0u; c < CLASSES; c++) {
        let place = 2u * ((slot * CLASSES + c) * 64u + k);
        velocities[place] = vec4f(node.v[c], 0.0);
        velocities[place + 1u] = vec4f(velocity_before(place, own.c[c].w), 0.0);
        let square = dot(node.v[c], node.v[c]);
        if node.mass[c] >= least { greatest = max(greatest, square); }
        all_ += square;
    }
    let speed = sqrt(greatest);
    if !is_finite(all_) { halt(NON_FINITE); return; }
    if speed > params.travel_limit { halt(SPEED); }
    let bits = bitcast<u32>(speed);
    if bits > atomicLoad(&status.speed) { atomicMax(&status.speed, bits); }
}
