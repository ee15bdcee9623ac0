// State -> records (SI) and surface particles. What the substeps do not change comes from the
// particle's record before.

@group(0) @binding(4) var<storage, read> records: array<u32>;
@group(0) @binding(5) var<storage, read_write> stored: array<u32>;
@group(0) @binding(20) var<storage, read_write> surface: array<u32>;

fn put(at: u32, v: vec3f) {
    stored[at] = bitcast<u32>(v.x);
    stored[at + 1u] = bitcast<u32>(v.y);
    stored[at + 2u] = bitcast<u32>(v.z);
}

@compute @workgroup_size(WORKGROUP)
fn store(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if i >= params.particle_count || is_halted() { return; }
    let position = state[at(POSITION, i)];
    let velocity = state[at(VELOCITY, i)];
    let a = state[at(STRAIN, i)];
    let b = state[at(STRAIN + 1u, i)];
    let e = Sym(a.xyz, vec3f(a.w, b.xy));
    let a0 = state[at(AFFINE, i)];
    let cell = unpack_cell(bitcast<u32>(position.w));
    let r = i * RECORD_WORDS;
    let from_ = bitcast<u32>(b.w) * RECORD_WORDS;
    let affine = r + RECORD_AFFINE;
    stored[r + RECORD_CELL] = u32(cell.x);
    stored[r + RECORD_CELL + 1u] = u32(cell.y);
    stored[r + RECORD_CELL + 2u] = u32(cell.z);
    put(r + RECORD_OFFSET, position.xyz);
    put(r + RECORD_VELOCITY, velocity.xyz * params.velocity_unit);
    put(affine, a0.xyz * params.rate_unit);
    put(affine + 3u, state[at(AFFINE + 1u, i)].xyz * params.rate_unit);
    put(affine + 6u, state[at(AFFINE + 2u, i)].xyz * params.rate_unit);
    put(r + RECORD_STRAIN, e.d);
    put(r + RECORD_STRAIN + 3u, e.o);
    stored[r + RECORD_HARDENING] = bitcast<u32>(b.z);
    stored[r + RECORD_STRUCTURE] = bitcast<u32>(state[at(AFFINE + 1u, i)].w);
    stored[r + RECORD_REST_VOLUME] = records[from_ + RECORD_REST_VOLUME];
    stored[r + RECORD_ID] = records[from_ + RECORD_ID];
    stored[r + RECORD_TAGS] = bitcast<u32>(velocity.w);
    stored[r + RECORD_WALLS] = bitcast<u32>(state[at(STRESS + 1u, i)].z);
    stored[r + RECORD_BODY] = body_at(i);
    for (var anchor = 0u; anchor < ANCHORS_MAX; anchor++) {
        var words = vec4u(0u);
        // Without solid tools there is nothing to cling to.
        if params.pressing != 0u { words = bitcast<vec4u>(state[at(ANCHORS + anchor, i)]); }
        for (var word = 0u; word < 4u; word++) { stored[r + RECORD_ANCHORS + 4u * anchor + word] = words[word]; }
    }

    atomicMax(&status.body_max, body_at(i));
    let tags = bitcast<u32>(velocity.w);
    if (tags & 0xff00u) != 0u { atomicOr(&status.sheets[(tags & 255u) / 32u], 1u << (tags & 31u)); }
    if (tags & 0xff000000u) != 0u { atomicOr(&status.sheets[((tags >> 16u) & 255u) / 32u], 1u << ((tags >> 16u) & 31u)); }

    let x = vec3f(cell) + position.xyz;
    let f = 1.0 + e.d;
    let det = f.x * (f.y * f.z - e.o.z * e.o.z) - e.o.x * (e.o.x * f.z - e.o.z * e.o.y) + e.o.y * (e.o.x * e.o.z - f.y * e.o.y);
    let q = i * SURFACE_PARTICLE_WORDS;
    surface[q + SURFACE_PARTICLE_POSITION] = bitcast<u32>(x.x);
    surface[q + SURFACE_PARTICLE_POSITION + 1u] = bitcast<u32>(x.y);
    surface[q + SURFACE_PARTICLE_POSITION + 2u] = bitcast<u32>(x.z);
    surface[q + SURFACE_PARTICLE_VOLUME_RATIO] = bitcast<u32>(sqrt(max(det, 0.0)));
    surface[q + SURFACE_PARTICLE_DENSITY_WEIGHT] = bitcast<u32>(a0.w * params.density_unit);
    surface[q + SURFACE_PARTICLE_TAGS] = bitcast<u32>(velocity.w);
    surface[q + SURFACE_PARTICLE_BODY] = body_at(i);
}
