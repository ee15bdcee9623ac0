// Slots for new blocks, in the table's order, so that they are the same in every run; the others keep theirs.

@group(0) @binding(3) var<storage, read_write> table: array<u32>;
@group(0) @binding(4) var<storage, read_write> blocks: array<u32>;
@group(0) @binding(5) var<storage, read> free: array<u32>;
@group(0) @binding(16) var<storage, read> chunks: array<u32>;

var<workgroup> partial: array<u32, 64>;

@compute @workgroup_size(64)
fn scan_write(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let chunk = group_number(group, groups);
    let each = SCAN_CHUNK / 64u;
    let first = chunk * SCAN_CHUNK + k * each;
    let last = min(first + each, arrayLength(&table));
    var sum = 0u;
    for (var j = first; j < last; j++) { sum += u32(table[j] == MARK); }
    partial[k] = sum;
    workgroupBarrier();
    if chunk >= arrayLength(&chunks) { return; }
    var rank = chunks[chunk];
    for (var j = 0u; j < k; j++) { rank += partial[j]; }
    for (var j = first; j < last; j++) {
        if table[j] != MARK {
            table[j] &= ~MARK;
            continue;
        }
        table[j] = 0u;
        if rank < status.free_counts[params.level] {
            table[j] = free[rank] + 1u;
            blocks[free[rank]] = j;
        }
        rank++;
    }
}
