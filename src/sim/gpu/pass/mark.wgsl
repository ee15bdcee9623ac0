// Marks the blocks whose nodes a particle may reach until the next re-bin: its stencil and one node around
// it.

@group(0) @binding(6) var<storage, read_write> marks: array<u32>;

@compute @workgroup_size(WORKGROUP)
fn mark(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if i >= params.particle_count || is_halted() { return; }
    let base = stencil(state[at(POSITION, i)]).base;
    // Five nodes an axis touch two blocks at most.
    let low = (base - 1) >> vec3u(2u);
    let high = (base + 3) >> vec3u(2u);
    for (var c = 0u; c < 8u; c++) {
        let b = select(low, high, (vec3u(c, c >> 1u, c >> 2u) & vec3u(1u)) == vec3u(1u));
        // All who write here write the same.
        marks[block_index(b)] = 1u;
    }
}
