// Moves the particles into the order of block, cell and record: it depends on nothing else, so runs repeat.

@group(0) @binding(3) var<storage, read_write> sorted: array<vec4f>;
@group(0) @binding(11) var<storage, read_write> counts: array<u32>;
@group(0) @binding(12) var<storage, read_write> prefix: array<u32>;
@group(0) @binding(14) var<storage, read_write> keys: array<vec2u>;
@group(0) @binding(15) var<storage, read_write> list: array<u32>;

fn record_of(i: u32) -> u32 {
    return bitcast<u32>(state[at(STRAIN + 1u, i)].w);
}

@compute @workgroup_size(WORKGROUP)
fn order(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if i >= params.particle_count || is_halted() { return; }
    let cell = keys[i].x;
    let first = prefix[cell];
    let here = record_of(i);
    var to = first;
    for (var j = first; j < first + counts[cell]; j++) {
        to += u32(record_of(list[j]) < here);
    }
    let fields = select(ANCHORS, FIELDS, params.pressing != 0u);
    for (var f = 0u; f < fields; f++) {
        sorted[at(f, to)] = state[at(f, i)];
    }
}
