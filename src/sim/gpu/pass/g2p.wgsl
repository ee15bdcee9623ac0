// Velocity and affine from the particle's own class's field, advection, elastic strain, return map; the
// stress of the next p2g.

@group(0) @binding(9) var<storage, read_write> velocities: array<vec4f>;

@compute @workgroup_size(WORKGROUP)
fn g2p(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if i >= params.particle_count || is_halted() { return; }
    let position = state[at(POSITION, i)];
    let tags = state[at(VELOCITY, i)].w;
    let s = stencil(position);
    let key = key_of(bitcast<u32>(tags));
    var v = vec3f(0.0);
    var c = mat3x3f();
    for (var xy = 0; xy < 9; xy++) {
        let o = vec2i(xy / 3, xy % 3);
        let first = s.base + vec3i(o, 0);
        let slots = slots_along_z(first);
        let classes = vec2u(class_in(slots.x, key), class_in(slots.y, key));
        let w = weight(s.f.x, o.x) * weight(s.f.y, o.y);
        var row = vec3f(0.0);
        for (var z = 0; z < 3; z++) {
            let place = node_place(at_z(slots, first, z), at_z(classes, first, z), first + vec3i(0, 0, z));
            let q = (w * weight(s.f.z, z)) * velocities[place].xyz;
            row += q;
            c[2] += q * (f32(z) - s.f.z);
        }
        v += row;
        c[0] += row * (f32(o.x) - s.f.x);
        c[1] += row * (f32(o.y) - s.f.y);
    }
    c *= 4.0;
    let cell = unpack_cell(bitcast<u32>(position.w));
    let x = clamp(position.xyz + v, vec3f(params.wall_low - cell), vec3f(params.wall_high - cell));
    let a = state[at(STRAIN, i)];
    let b = state[at(STRAIN + 1u, i)];
    let worked = state[at(AFFINE + 1u, i)].w;
    let u = update(c, Sym(a.xyz, vec3f(a.w, b.xy)), yield_norm_at(cell, x, false, b.z, worked));
    if u.clamped { atomicAdd(&status.clamped, 1u); }
    if !is_finite(norm2(u.strain) + dot(v, v)) { halt(NON_FINITE); return; }
    let whole = floor(x);
    let tau = u.stress;
    state[at(POSITION, i)] = vec4f(x - whole, bitcast<f32>(pack_cell(cell + vec3i(whole))));
    state[at(VELOCITY, i)] = vec4f(v, tags);
    state[at(AFFINE, i)] = vec4f(c[0] - vec3f(tau.d.x, tau.o.x, tau.o.y), state[at(AFFINE, i)].w);
    state[at(AFFINE + 1u, i)] = vec4f(c[1] - vec3f(tau.o.x, tau.d.y, tau.o.z), structure_after(worked, u.plastic));
    state[at(AFFINE + 2u, i)] = vec4f(c[2] - vec3f(tau.o.y, tau.o.z, tau.d.z), state[at(AFFINE + 2u, i)].w);
    state[at(STRAIN, i)] = vec4f(u.strain.d, u.strain.o.x);
    state[at(STRAIN + 1u, i)] = vec4f(u.strain.o.yz, b.z + u.plastic, b.w);
}
