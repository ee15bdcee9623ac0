// Exclusive prefix sum, second part: the chunks' sums, by one workgroup.

@group(0) @binding(13) var<storage, read_write> chunk_sums: array<u32>;

var<workgroup> partial: array<u32, WORKGROUP>;

@compute @workgroup_size(WORKGROUP)
fn scan_chunks(@builtin(local_invocation_index) k: u32) {
    let count = arrayLength(&chunk_sums);
    let each = (count + WORKGROUP - 1u) / WORKGROUP;
    let first = k * each;
    var sum = 0u;
    for (var j = first; j < min(first + each, count); j++) {
        sum += chunk_sums[j];
    }
    partial[k] = sum;
    workgroupBarrier();
    var before = 0u;
    for (var j = 0u; j < k; j++) {
        before += partial[j];
    }
    for (var j = first; j < min(first + each, count); j++) {
        let here = chunk_sums[j];
        chunk_sums[j] = before;
        before += here;
    }
}
