// Which cubes of two cells hold clay, and in which of them a wall bears it: 8 bits a block each
// (`sim::support`).

@group(0) @binding(7) var<storage, read_write> blocks: array<atomic<u32>>;

@compute @workgroup_size(WORKGROUP)
fn support(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if i >= params.particle_count || is_halted() { return; }
    let cell = unpack_cell(bitcast<u32>(state[at(POSITION, i)].w));
    let walls = bitcast<u32>(state[at(STRESS + 1u, i)].z);
    let slot = slot_of(cell);
    if slot == 0u { halt(MARGIN); return; }
    let c = vec3u(cell >> vec3u(1u)) & vec3u(1u);
    let cube = 1u << (4u * c.x + 2u * c.y + c.z);
    atomicOr(&blocks[3u * params.slot_capacity + slot - 1u], select(cube, cube | (cube << 8u), (walls & (params.wall_kinds >> 16u)) != 0u));
}
