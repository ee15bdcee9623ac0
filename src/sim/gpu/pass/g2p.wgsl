// Velocity and affine from the particle's own class's field and a share of what nodes do not see of its own,
// advection, elastic strain, return map; the stress of the next p2g.

@group(0) @binding(9) var<storage, read_write> velocities: array<vec4f>; // after and before: two of each node and class

// What nodes have at a particle.
struct Seen { velocity: vec3f, affine: mat3x3f }

fn add_row(seen: ptr<function, Seen>, row: vec3f, arm: vec2f) {
    (*seen).velocity += row;
    (*seen).affine[0] += row * arm.x;
    (*seen).affine[1] += row * arm.y;
}

@compute @workgroup_size(WORKGROUP)
fn g2p(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if i >= params.particle_count || is_halted() { return; }
    let position = state[at(POSITION, i)];
    let tags = state[at(VELOCITY, i)].w;
    let s = stencil(position);
    let key = key_of(body_at(i), bitcast<u32>(tags));
    var after: Seen;
    var before: Seen;
    for (var xy = 0; xy < 9; xy++) {
        let o = vec2i(xy / 3, xy % 3);
        let first = s.base + vec3i(o, 0);
        let slots = slots_along_z(first);
        let classes = vec2u(class_in(slots.x, key), class_in(slots.y, key));
        let w = weight(s.f.x, o.x) * weight(s.f.y, o.y);
        var rows = mat2x3f();
        for (var z = 0; z < 3; z++) {
            let place = 2u * node_place(at_z(slots, first, z), at_z(classes, first, z), first + vec3i(0, 0, z));
            let q = (w * weight(s.f.z, z)) * mat2x3f(velocities[place].xyz, velocities[place + 1u].xyz);
            rows += q;
            after.affine[2] += q[0] * (f32(z) - s.f.z);
            before.affine[2] += q[1] * (f32(z) - s.f.z);
        }
        add_row(&after, rows[0], vec2f(o) - s.f.xy);
        add_row(&before, rows[1], vec2f(o) - s.f.xy);
    }
    let v = after.velocity;
    let c = 4.0 * after.affine;
    let cell = unpack_cell(bitcast<u32>(position.w));
    let x = clamp(position.xyz + v, vec3f(params.wall_low - cell), vec3f(params.wall_high - cell));
    let a = state[at(STRAIN, i)];
    let b = state[at(STRAIN + 1u, i)];
    let worked = state[at(AFFINE + 1u, i)].w;
    let u = update(c, Sym(a.xyz, vec3f(a.w, b.xy)), yield_norm_at(cell, x, b.z, worked));
    if u.clamped { atomicAdd(&status.clamped, 1u); }
    if !is_finite(norm2(u.strain) + dot(v, v)) { halt(NON_FINITE); return; }
    let whole = floor(x);
    let tau = u.stress;
    state[at(POSITION, i)] = vec4f(x - whole, bitcast<f32>(pack_cell(cell + vec3i(whole))));
    // What nodes did not see stays in part; its way with them takes its spin from the particle.
    let unseen = params.velocity_kept * (state[at(VELOCITY, i)].xyz - before.velocity);
    let spin = -2.0 * cross(v, unseen);
    let a0 = state[at(AFFINE, i)];
    let a1 = state[at(AFFINE + 1u, i)];
    let a2 = state[at(AFFINE + 2u, i)];
    let kept = params.velocity_kept * (mat3x3f(a0.xyz, a1.xyz, a2.xyz) - 4.0 * before.affine);
    state[at(VELOCITY, i)] = vec4f(v + unseen, tags);
    state[at(AFFINE, i)] = vec4f(c[0] + kept[0] + vec3f(0.0, spin.z, -spin.y), a0.w);
    state[at(AFFINE + 1u, i)] = vec4f(c[1] + kept[1] + vec3f(-spin.z, 0.0, spin.x), structure_after(worked, u.plastic));
    state[at(AFFINE + 2u, i)] = vec4f(c[2] + kept[2] + vec3f(spin.y, -spin.x, 0.0), a2.w + u.plastic);
    state[at(WAY, i)] = vec4f(v, 0.0);
    state[at(STRESS, i)] = vec4f(tau.d, tau.o.x);
    state[at(STRESS + 1u, i)] = vec4f(tau.o.yz, state[at(STRESS + 1u, i)].zw);
    state[at(STRAIN, i)] = vec4f(u.strain.d, u.strain.o.x);
    state[at(STRAIN + 1u, i)] = vec4f(u.strain.o.yz, b.z + u.plastic, b.w);
}
