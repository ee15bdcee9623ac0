// New blocks of each chunk of the table; those that no clay reaches any more give their slots back.

@group(0) @binding(3) var<storage, read_write> table: array<u32>;
@group(0) @binding(4) var<storage, read_write> blocks: array<u32>;
@group(0) @binding(16) var<storage, read_write> chunks: array<u32>;

var<workgroup> partial: array<u32, 64>;

@compute @workgroup_size(64)
fn scan_sums(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let chunk = group_number(group, groups);
    let each = SCAN_CHUNK / 64u;
    let first = chunk * SCAN_CHUNK + k * each;
    var sum = 0u;
    for (var j = first; j < min(first + each, arrayLength(&table)); j++) {
        let slot = table[j];
        if slot == MARK {
            sum++;
        } else if slot != 0u && slot < MARK {
            blocks[slot - 1u] = NONE;
            table[j] = 0u;
        }
    }
    partial[k] = sum;
    workgroupBarrier();
    if k == 0u && chunk < arrayLength(&chunks) {
        var all = 0u;
        for (var j = 0u; j < 64u; j++) { all += partial[j]; }
        chunks[chunk] = all;
    }
}
