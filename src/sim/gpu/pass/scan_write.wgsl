// Exclusive prefix sum, third part: within the chunks.

@group(0) @binding(11) var<storage, read_write> source: array<u32>;
@group(0) @binding(12) var<storage, read_write> prefix: array<u32>;
@group(0) @binding(13) var<storage, read_write> chunk_sums: array<u32>;

var<workgroup> partial: array<u32, WORKGROUP>;

@compute @workgroup_size(WORKGROUP)
fn scan_write(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let chunk = group.y * groups.x + group.x;
    let each = SCAN_CHUNK / WORKGROUP;
    let first = chunk * SCAN_CHUNK + k * each;
    let last = min(first + each, arrayLength(&source));
    var sum = 0u;
    for (var j = first; j < last; j++) {
        sum += source[j];
    }
    partial[k] = sum;
    workgroupBarrier();
    var before = chunk_sums[min(chunk, arrayLength(&chunk_sums) - 1u)];
    for (var j = 0u; j < k; j++) {
        before += partial[j];
    }
    for (var j = first; j < last; j++) {
        prefix[j] = before;
        before += source[j];
    }
}
