// Mass and momentum of each class to the nodes, and apart from it the impulses of stress, solid tools and
// separating walls, in fixed point: sums do not depend on their order, and what nodes gain is not the
// difference of two that were rounded by themselves.

@group(0) @binding(8) var<storage, read_write> sums: array<atomic<i32>>; // of a node and class: impulse, mass, momentum, what is lost of the strength

struct Motion { velocity: vec3f, affine: mat3x3f }

fn reach_of(m: Motion) -> vec3f {
    return abs(m.velocity) + 1.5 * (abs(m.affine[0]) + abs(m.affine[1]) + abs(m.affine[2]));
}

fn add(place: u32, q: vec3f) {
    atomicAdd(&sums[place], i32(round(q.x)));
    atomicAdd(&sums[place + 1u], i32(round(q.y)));
    atomicAdd(&sums[place + 2u], i32(round(q.z)));
}

@compute @workgroup_size(WORKGROUP)
fn p2g(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if i >= params.particle_count || is_halted() { return; }
    let velocity = state[at(VELOCITY, i)];
    let a0 = state[at(AFFINE, i)];
    let mass = a0.w;
    let own = Motion(velocity.xyz, mat3x3f(a0.xyz, state[at(AFFINE + 1u, i)].xyz, state[at(AFFINE + 2u, i)].xyz));
    let d = state[at(STRESS, i)];
    let o = vec3f(d.w, state[at(STRESS + 1u, i)].xy);
    var given = Motion(vec3f(0.0), -1.0 * mat3x3f(vec3f(d.x, o.xy), vec3f(o.x, d.y, o.z), vec3f(o.yz, d.z)));
    let push = state[at(WAY, i)];
    if push.w != 0.0 { given.velocity = push.xyz; }
    var lost = 0.0;
    if params.remembers != 0u && push.w != 0.0 { lost = (push.w - FRESH) / LOST_MAX; }
    let s = stencil(state[at(POSITION, i)]);
    // The stencil reaches 1.5 cells: no node gets more momentum than mass * reach.
    let reach = max(reach_of(own), reach_of(given));
    let most = max(reach.x, max(reach.y, reach.z));
    if !is_finite(most) { halt(NON_FINITE); return; }
    if most > params.reach_limit {
        atomicStore(&status.reach_met, 1u);
        halt(OVERFLOW);
        return;
    }
    let key = key_of(body_at(i), bitcast<u32>(velocity.w));
    for (var xy = 0; xy < 9; xy++) {
        let o = vec2i(xy / 3, xy % 3);
        let first = s.base + vec3i(o, 0);
        let slots = slots_along_z(first);
        if slots.x == 0u || slots.y == 0u { halt(MARGIN); return; }
        let classes = vec2u(class_in(slots.x, key), class_in(slots.y, key));
        let w = mass * (weight(s.f.x, o.x) * weight(s.f.y, o.y));
        for (var z = 0; z < 3; z++) {
            let place = 8u * node_place(at_z(slots, first, z), at_z(classes, first, z), first + vec3i(0, 0, z));
            let m = w * weight(s.f.z, z);
            let arm = vec3f(vec3i(o, z)) - s.f;
            add(place, (m * params.momentum_scale) * (given.velocity + given.affine * arm));
            atomicAdd(&sums[place + 3u], i32(round(m * params.mass_scale)));
            if lost != 0.0 { atomicAdd(&sums[place + 7u], i32(round(m * params.mass_scale * lost))); }
            add(place + 4u, (m * params.momentum_scale) * (own.velocity + own.affine * arm));
        }
    }
}
