// Indices of the extraction before, behind those of this one, and of whatever stood there before where that
// is not known: triangles of no size.

@group(0) @binding(14) var<storage, read_write> indices: array<u32>;

@compute @workgroup_size(256)
fn tail(@builtin(local_invocation_index) k: u32) {
    if atomicLoad(&status.flags) != 0u { return; }
    let end = select(min(status.index_count_before, params.index_capacity), params.index_capacity, status.is_all == ANEW);
    for (var i = status.index_count + k; i < end; i += 256u) {
        indices[params.index_start + i] = 0u;
    }
}
