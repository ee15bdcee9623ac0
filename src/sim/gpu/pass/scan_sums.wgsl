// Exclusive prefix sum, first part: sums of chunks of SCAN_CHUNK numbers.

@group(0) @binding(11) var<storage, read_write> source: array<u32>;
@group(0) @binding(13) var<storage, read_write> chunk_sums: array<u32>;

var<workgroup> partial: array<u32, WORKGROUP>;

@compute @workgroup_size(WORKGROUP)
fn scan_sums(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let chunk = group.y * groups.x + group.x;
    let each = SCAN_CHUNK / WORKGROUP;
    let first = chunk * SCAN_CHUNK + k * each;
    var sum = 0u;
    for (var j = first; j < min(first + each, arrayLength(&source)); j++) {
        sum += source[j];
    }
    partial[k] = sum;
    for (var step = WORKGROUP / 2u; step > 0u; step /= 2u) {
        workgroupBarrier();
        if k < step { partial[k] += partial[k + step]; }
    }
    if k == 0u && chunk < arrayLength(&chunk_sums) { chunk_sums[chunk] = partial[0]; }
}
