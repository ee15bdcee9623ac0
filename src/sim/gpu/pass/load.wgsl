// Records (SI, as in a snapshot) -> state (cells and substeps).

@group(0) @binding(4) var<storage, read> records: array<u32>;

fn number(at: u32) -> f32 {
    return bitcast<f32>(records[at]);
}

fn numbers(at: u32) -> vec3f {
    return vec3f(number(at), number(at + 1u), number(at + 2u));
}

// The tags without those of plates that are not in the plan.
fn tags_of(record: u32) -> u32 {
    var tags = records[record + RECORD_TAGS];
    if is_left(tags >> 16u) { tags &= 0xffffu; }
    if is_left(tags) { tags >>= 16u; }
    return tags;
}

fn is_left(tag: u32) -> bool {
    let sheet = tag & 255u;
    return sheet >= PLATE_SHEET && ((params.plates >> (sheet - PLATE_SHEET)) & 1u) == 0u;
}

@compute @workgroup_size(WORKGROUP)
fn load(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if i >= params.particle_count || is_halted() { return; }
    let r = i * RECORD_WORDS;
    let cell = vec3i(vec3u(records[r + RECORD_CELL], records[r + RECORD_CELL + 1u], records[r + RECORD_CELL + 2u]));
    let affine = r + RECORD_AFFINE;
    let e = Sym(numbers(r + RECORD_STRAIN), numbers(r + RECORD_STRAIN + 3u));
    let tau = stress(e);
    let v = numbers(r + RECORD_VELOCITY) / params.velocity_unit;
    state[at(POSITION, i)] = vec4f(numbers(r + RECORD_OFFSET), bitcast<f32>(pack_cell(cell)));
    state[at(VELOCITY, i)] = vec4f(v, bitcast<f32>(tags_of(r)));
    state[at(AFFINE, i)] = vec4f(numbers(affine) / params.rate_unit, number(r + RECORD_REST_VOLUME) / params.mass_unit);
    state[at(AFFINE + 1u, i)] = vec4f(numbers(affine + 3u) / params.rate_unit, number(r + RECORD_STRUCTURE));
    state[at(AFFINE + 2u, i)] = vec4f(numbers(affine + 6u) / params.rate_unit, 0.0);
    state[at(STRAIN, i)] = vec4f(e.d, e.o.x);
    state[at(STRAIN + 1u, i)] = vec4f(e.o.yz, number(r + RECORD_HARDENING), bitcast<f32>(i));
    state[at(STRESS, i)] = vec4f(tau.d, tau.o.x);
    state[at(STRESS + 1u, i)] = vec4f(tau.o.yz, number(r + RECORD_WALLS), number(r + RECORD_BODY));
    state[at(WAY, i)] = vec4f(v * min(1.0, params.travel_limit / max(length(v), 1e-30)), 0.0);
    if params.pressing == 0u { return; }
    for (var a = 0u; a < ANCHORS_MAX; a++) {
        let from_ = r + RECORD_ANCHORS + 4u * a;
        state[at(ANCHORS + a, i)] = vec4f(numbers(from_), number(from_ + 3u));
    }
}
