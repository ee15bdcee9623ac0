// Marked blocks before each chunk; how many there are in all.

@group(0) @binding(16) var<storage, read_write> chunks: array<u32>;

var<workgroup> partial: array<u32, 64>;

@compute @workgroup_size(64)
fn scan_chunks(@builtin(local_invocation_index) k: u32) {
    let count = arrayLength(&chunks);
    let each = (count + 63u) / 64u;
    let first = min(k * each, count);
    let last = min(first + each, count);
    var sum = 0u;
    for (var j = first; j < last; j++) { sum += chunks[j]; }
    partial[k] = sum;
    workgroupBarrier();
    var before = 0u;
    for (var j = 0u; j < k; j++) { before += partial[j]; }
    for (var j = first; j < last; j++) {
        let own = chunks[j];
        chunks[j] = before;
        before += own;
    }
    if k == 63u {
        if before > params.slot_capacity { atomicOr(&status.flags, BLOCKS_FULL); }
        status.slot_counts[params.level] = before;
    }
}
