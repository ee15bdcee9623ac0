// Raw sums -> field of one block and plane: refinement and blur, one axis after the other, in place in
// workgroup memory.

@group(0) @binding(4) var<storage, read> blocks: array<u32>;
@group(0) @binding(7) var<storage, read> raw: array<i32>;
@group(0) @binding(8) var<storage, read_write> fields: array<f32>;

var<workgroup> tile: array<f32, 3375>; // 15^3: 8 nodes and up to 7 around
var<workgroup> slots: array<u32, 27>;

fn tap(k: u32) -> f32 {
    return params.taps[k >> 2u][k & 3u];
}

// Filters the row that begins at `first`, into its first 8 places.
fn filter_row(first: u32, step: u32) {
    var row: array<f32, 15>;
    let size = 7u + params.tap_count;
    for (var j = 0u; j < size; j++) { row[j] = tile[first + j * step]; }
    for (var j = 0u; j < 8u; j++) {
        var sum = 0.0;
        for (var t = 0u; t < params.tap_count; t++) { sum += tap(t) * row[j + t]; }
        tile[first + j * step] = sum;
    }
}

@compute @workgroup_size(256)
fn filter_fields(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = group.x;
    let plane = group.y;
    if blocks[slot] == NONE { return; }
    let block = block_of(blocks[slot]);
    if k < 27u { slots[k] = slot_of(block + vec3i(vec3u(k % 3u, (k / 3u) % 3u, k / 9u)) - 1); }
    workgroupBarrier();
    let size = 7u + params.tap_count;
    for (var j = k; j < size * size * size; j += 256u) {
        let node = vec3i(vec3u(j % size, (j / size) % size, j / (size * size))) + params.first;
        let b = (node + 8) >> vec3u(3u);
        let from_ = slots[b.x + 3 * (b.y + 3 * b.z)];
        var value = 0.0;
        if from_ != 0u { value = f32(raw[((from_ - 1u) * planes_stored() + plane) * 512u + local_index(node)]) / FIXED_POINT; }
        tile[j] = value;
    }
    workgroupBarrier();
    if k < size * size { filter_row(k * size, 1u); }
    workgroupBarrier();
    if k < 8u * size { filter_row(k % 8u + (k / 8u) * size * size, size); }
    workgroupBarrier();
    if k < 64u { filter_row(k % 8u + (k / 8u) * size, size * size); }
    workgroupBarrier();
    for (var j = k; j < 512u; j += 256u) {
        let at = (j & 7u) + size * (((j >> 3u) & 7u) + size * (j >> 6u));
        fields[(slot * planes_stored() + plane) * 512u + j] = tile[at];
    }
}
