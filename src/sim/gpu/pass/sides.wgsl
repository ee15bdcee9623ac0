// Folded masses of front and back at every node: what the normal of a kept cut is made of.

@group(0) @binding(16) var<storage, read_write> side_masses: array<vec2f>;

var<workgroup> is_over: u32;

@compute @workgroup_size(WORKGROUP)
fn sides(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = group.y * groups.x + group.x;
    if k == 0u { is_over = u32(is_halted() || slot >= atomicLoad(&status.slot_count)); }
    if workgroupUniformLoad(&is_over) != 0u { return; }
    let here = fold(own_sums(slot, k), unpack_cell(blocks[slot]), k);
    side_masses[slot * 64u + k] = vec2f(here.sums.c[1].w, here.sums.c[2].w);
}
