// Raw sums -> field of one block and plane, or page: refinement and blur, one axis after the other, in place
// in workgroup memory.

@group(0) @binding(4) var<storage, read> blocks: array<u32>;
@group(0) @binding(7) var<storage, read> raw: array<i32>;
@group(0) @binding(9) var<storage, read> cells: array<u32>;
@group(0) @binding(8) var<storage, read_write> fields: array<f32>;

var<workgroup> tile: array<f32, 3375>; // 15^3: 8 nodes and up to 7 around
var<workgroup> sources: array<u32, 27>; // first values, or NONE

fn tap(k: u32) -> f32 {
    return params.taps[k >> 2u][k & 3u];
}

// First value of what goes into a plane, or page, from another slot.
fn source_of(to_: u32, number: u32, from_: u32) -> u32 {
    if from_ == 0u { return NONE; }
    if number < plane_count() { return plane_first(from_ - 1u, number); }
    return body_first(from_ - 1u, cells[list_first(to_) + 2u + number - plane_count()]);
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
    let number = group.y;
    if blocks[slot] == NONE || number >= plane_count() + page_count(slot) { return; }
    let block = block_of(blocks[slot]);
    if k < 27u { sources[k] = source_of(slot, number, slot_of(block + vec3i(vec3u(k % 3u, (k / 3u) % 3u, k / 9u)) - 1)); }
    workgroupBarrier();
    let size = 7u + params.tap_count;
    for (var j = k; j < size * size * size; j += 256u) {
        let node = vec3i(vec3u(j % size, (j / size) % size, j / (size * size))) + params.first;
        let b = (node + 8) >> vec3u(3u);
        let from_ = sources[b.x + 3 * (b.y + 3 * b.z)];
        var value = 0.0;
        if from_ != NONE { value = f32(raw[from_ + local_index(node)]) / FIXED_POINT; }
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
        fields[values_first(slot, number) + j] = tile[at];
    }
}
