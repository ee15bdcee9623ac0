// Folded masses of the tagged classes at every node: what the normals of kept cuts are made of.

var<workgroup> is_over: u32;

@compute @workgroup_size(WORKGROUP)
fn sides(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = group.y * groups.x + group.x;
    if k == 0u { is_over = u32(is_halted() || slot >= atomicLoad(&status.slot_count) || cuts[keys_place(slot)] == 0u); }
    if workgroupUniformLoad(&is_over) != 0u { return; }
    let here = fold(own_sums(slot, k), slot, unpack_cell(blocks[slot]), k);
    for (var c = 1u; c < CLASSES; c++) {
        cuts[masses_place(slot, c, k)] = bitcast<u32>(here.sums.c[c].w);
    }
}
