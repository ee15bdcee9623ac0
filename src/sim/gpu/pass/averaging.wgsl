// Anti-locking: particles of a cell and class that have flowed share their ln J by how far they have. Runs
// where the particles have just been sorted by cell: the first of each cell does the work of all.

fn cell_of(i: u32) -> u32 {
    return bitcast<u32>(state[at(POSITION, i)].w);
}

fn strain_of(i: u32) -> Sym {
    let a = state[at(STRAIN, i)];
    return Sym(a.xyz, vec3f(a.w, state[at(STRAIN + 1u, i)].xy));
}

fn key_at(i: u32) -> u32 {
    return key_of(body_at(i), bitcast<u32>(state[at(VELOCITY, i)].w));
}

// Of the difference to its cell's mean, that a particle takes.
fn share_of(i: u32) -> f32 {
    return -expm1(-min(state[at(AFFINE + 2u, i)].w / params.averaging, 80.0));
}

// ln J changes, the deviator stays: b *= exp(2 change / 3), and the pressure follows.
fn dilate(i: u32, change: f32) {
    let grown = expm1(2.0 / 3.0 * change);
    let e = strain_of(i);
    let d = e.d + (1.0 + e.d) * grown;
    let o = e.o + e.o * grown;
    state[at(STRAIN, i)] = vec4f(d, o.x);
    let rest = state[at(STRAIN + 1u, i)];
    state[at(STRAIN + 1u, i)] = vec4f(o.yz, rest.zw);
    let pressure = (params.mu2 / 3.0 + params.lambda) * change;
    let tau = state[at(STRESS, i)];
    state[at(STRESS, i)] = vec4f(tau.xyz + pressure, tau.w);
}

@compute @workgroup_size(WORKGROUP)
fn averaging(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let first = invocation(group, groups, k);
    if first >= params.particle_count || is_halted() { return; }
    let packed = cell_of(first);
    if first > 0u && cell_of(first - 1u) == packed { return; }
    var end = first;
    for (; end < params.particle_count && cell_of(end) == packed; end++) {}
    for (var a = first; a < end; a++) {
        // The first of its class in the cell does the work of all.
        let key = key_at(a);
        var is_first = true;
        for (var i = first; i < a; i++) { is_first = is_first && key_at(i) != key; }
        if !is_first { continue; }
        var weight_ = 0.0;
        var sum = 0.0;
        for (var i = a; i < end; i++) {
            let share = share_of(i);
            if share == 0.0 || key_at(i) != key { continue; }
            weight_ += state[at(AFFINE, i)].w * share;
            sum += state[at(AFFINE, i)].w * share * trace(hencky(strain_of(i)));
        }
        for (var i = a; i < end; i++) {
            let share = share_of(i);
            if share == 0.0 || key_at(i) != key { continue; }
            dilate(i, share * (sum / weight_ - trace(hencky(strain_of(i)))));
        }
    }
    for (var i = first; i < end; i++) {
        let a2 = state[at(AFFINE + 2u, i)];
        state[at(AFFINE + 2u, i)] = vec4f(a2.xyz, 0.0);
    }
}
