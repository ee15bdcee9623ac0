// Folded masses of the classes at every node: what the normals of kept cuts and between bodies are made of.
// Of a block without keys, where a neighbour may see another body, class 0's alone.

var<workgroup> head: vec3u; // is over, packed block, stands at a wall

@compute @workgroup_size(WORKGROUP)
fn sides(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = group.y * groups.x + group.x;
    if k == 0u {
        let packed = blocks[min(slot, params.slot_capacity - 1u)];
        let is_over = is_halted() || slot >= atomicLoad(&status.slot_count);
        head = vec3u(u32(is_over), packed, u32(is_at_wall(unpack_cell(packed))));
    }
    let h = workgroupUniformLoad(&head);
    if h.x != 0u { return; }
    var sums_ = own_sums(slot, k);
    if h.z != 0u { sums_ = fold(sums_, slot, unpack_cell(h.y), k).sums; }
    for (var c = 0u; c < CLASSES; c++) {
        if c > 0u && key_at(slot, c) == 0u { break; }
        cuts[masses_place(slot, c, k)] = bitcast<u32>(sums_.c[c].w);
    }
}
