// Blocks that a particle's stencil, and what is read around it, reach.

@group(0) @binding(3) var<storage, read_write> marks: array<atomic<u32>>;

@compute @workgroup_size(64)
fn mark(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = group_number(group, groups) * 64u + k;
    if i >= params.particle_count || !is_usable(i) { return; }
    let base = stencil_of(i).base;
    let low = (base - params.reach_low) >> vec3u(3u);
    let high = (base + params.reach_high) >> vec3u(3u);
    for (var z = low.z; z <= high.z; z++) {
        for (var y = low.y; y <= high.y; y++) {
            for (var x = low.x; x <= high.x; x++) {
                let block = vec3i(x, y, z);
                if has_entry(block) { atomicOr(&marks[entry_of(block)], MARK); }
            }
        }
    }
}
