// Starts a substep: node sums to zero, no keys, nothing held by walls or ahead of edges.

@group(0) @binding(7) var<storage, read_write> blocks: array<u32>;
@group(0) @binding(8) var<storage, read_write> sums: array<vec4i>;
@group(0) @binding(16) var<storage, read_write> cuts: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn clear(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if is_halted() { return; }
    if i == 0u { atomicAdd(&status.substep, 1u); }
    if i < params.tool_count {
        for (var c = 0u; c < AHEAD_PLACES; c++) {
            atomicStore(&status.tools[i].ahead[c], 0u);
            atomicStore(&status.tools[i].behind[c], 0u);
            atomicStore(&status.tools[i].before[c], 0u);
        }
    }
    let slots = atomicLoad(&status.slot_count);
    if i < slots * (CLASSES - 1u) { cuts[i / (CLASSES - 1u) * CUT_WORDS + i % (CLASSES - 1u)] = 0u; }
    if i < 2u * slots { blocks[params.slot_capacity + i] = 0u; }
    if i < slots { blocks[3u * params.slot_capacity + i] = 0u; }
    if i >= slots * CLASSES * 64u { return; }
    sums[2u * i] = vec4i(0);
    sums[2u * i + 1u] = vec4i(0);
}
