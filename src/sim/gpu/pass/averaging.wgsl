// Anti-locking: flowing particles of a cell and class share part of their ln J. Runs where the particles have
// just been sorted by cell: the first of each cell does the work of all.

fn cell_of(i: u32) -> u32 {
    return bitcast<u32>(state[at(POSITION, i)].w);
}

fn strain_of(i: u32) -> Sym {
    let a = state[at(STRAIN, i)];
    return Sym(a.xyz, vec3f(a.w, state[at(STRAIN + 1u, i)].xy));
}

fn key_at(i: u32) -> u32 {
    return key_of(bitcast<u32>(state[at(VELOCITY, i)].w));
}

struct Volume { log: f32, flows: bool }

fn volume_of(i: u32, cell: vec3i) -> Volume {
    let h = hencky(strain_of(i));
    let log = trace(h);
    let size = sqrt(max(norm2(h) - log * log / 3.0, 0.0));
    let worked = state[at(AFFINE + 1u, i)].w;
    let most = yield_norm_at(cell, state[at(POSITION, i)].xyz, true, state[at(STRAIN + 1u, i)].z, worked);
    return Volume(log, size >= FLOWING * most);
}

// ln J changes, the deviator stays: b *= exp(2 change / 3), and the pressure in the affine momentum follows.
fn dilate(i: u32, change: f32) {
    let grown = expm1(2.0 / 3.0 * change);
    let e = strain_of(i);
    let d = e.d + (1.0 + e.d) * grown;
    let o = e.o + e.o * grown;
    state[at(STRAIN, i)] = vec4f(d, o.x);
    let rest = state[at(STRAIN + 1u, i)];
    state[at(STRAIN + 1u, i)] = vec4f(o.yz, rest.zw);
    let pressure = (params.mu2 / 3.0 + params.lambda) * change;
    state[at(AFFINE, i)].x -= pressure;
    state[at(AFFINE + 1u, i)].y -= pressure;
    state[at(AFFINE + 2u, i)].z -= pressure;
}

@compute @workgroup_size(WORKGROUP)
fn averaging(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let first = invocation(group, groups, k);
    if first >= params.particle_count || is_halted() { return; }
    let packed = cell_of(first);
    if first > 0u && cell_of(first - 1u) == packed { return; }
    let is_last = atomicLoad(&status.substep) == params.averaging_last_at;
    let share = select(params.averaging, params.averaging_last, is_last);
    let cell = unpack_cell(packed);
    var end = first;
    for (; end < params.particle_count && cell_of(end) == packed; end++) {}
    for (var a = first; a < end; a++) {
        // The first of its class in the cell does the work of all.
        let key = key_at(a);
        var is_first = true;
        for (var i = first; i < a; i++) { is_first = is_first && key_at(i) != key; }
        if !is_first { continue; }
        var mass = 0.0;
        var sum = 0.0;
        for (var i = a; i < end; i++) {
            let v = volume_of(i, cell);
            if !v.flows || key_at(i) != key { continue; }
            mass += state[at(AFFINE, i)].w;
            sum += state[at(AFFINE, i)].w * v.log;
        }
        for (var i = a; i < end; i++) {
            if key_at(i) != key { continue; }
            let v = volume_of(i, cell);
            if v.flows { dilate(i, share * (sum / mass - v.log)); }
        }
    }
}
