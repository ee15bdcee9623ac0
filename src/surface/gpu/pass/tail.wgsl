// Indices of the extraction before, behind those of this one: triangles of no size.

@group(0) @binding(14) var<storage, read_write> indices: array<u32>;

@compute @workgroup_size(256)
fn tail(@builtin(local_invocation_index) k: u32) {
    if atomicLoad(&status.flags) != 0u { return; }
    for (var i = status.index_count + k; i < min(status.index_count_before, params.index_capacity); i += 256u) {
        indices[params.index_first + i] = 0u;
    }
}
