// Counts the particles of each cell; a particle's rank here is any, `order` makes it one that repeats.

@group(0) @binding(11) var<storage, read_write> counts: array<atomic<u32>>;
@group(0) @binding(14) var<storage, read_write> keys: array<vec2u>;

@compute @workgroup_size(WORKGROUP)
fn count(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if i >= params.particle_count || is_halted() { return; }
    let cell = unpack_cell(bitcast<u32>(state[at(POSITION, i)].w));
    let place = (slot_of(cell) - 1u) * 64u + local_index(cell);
    let rank = atomicAdd(&counts[place], 1u);
    keys[i] = vec2u(place, rank);
    if rank + 1u > params.cell_count_limit { halt(OVERFLOW); }
    if rank >= atomicLoad(&status.cell_count) { atomicMax(&status.cell_count, rank + 1u); }
}
