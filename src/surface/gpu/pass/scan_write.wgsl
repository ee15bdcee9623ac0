// Slots, in the table's order, so that they are the same in every run.

@group(0) @binding(3) var<storage, read_write> table: array<u32>;
@group(0) @binding(4) var<storage, read_write> blocks: array<u32>;
@group(0) @binding(16) var<storage, read> chunks: array<u32>;

var<workgroup> partial: array<u32, 64>;

@compute @workgroup_size(64)
fn scan_write(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let chunk = group_number(group, groups);
    let each = SCAN_CHUNK / 64u;
    let first = chunk * SCAN_CHUNK + k * each;
    let last = min(first + each, arrayLength(&table));
    var sum = 0u;
    for (var j = first; j < last; j++) { sum += table[j]; }
    partial[k] = sum;
    workgroupBarrier();
    if chunk >= arrayLength(&chunks) { return; }
    var slot = chunks[chunk];
    for (var j = 0u; j < k; j++) { slot += partial[j]; }
    for (var j = first; j < last; j++) {
        if table[j] == 0u { continue; }
        let has_room = slot < params.slot_capacity;
        table[j] = select(0u, slot + 1u, has_room);
        if has_room { blocks[slot] = j; }
        slot++;
    }
}
