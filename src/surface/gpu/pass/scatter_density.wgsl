// Volumes to the cell grid; particles of each cell, for grains.

@group(0) @binding(22) var<storage, read_write> occupancy: array<atomic<u32>>; // by slot and cell, as nodes

@compute @workgroup_size(64)
fn scatter_density(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = group_number(group, groups) * 64u + k;
    if i >= params.particle_count || !is_usable(i) { return; }
    let s = stencil_of(i);
    if params.has_grains != 0u {
        let cell = vec3i(floor(place_of(i)));
        let slot = slot_of(cell >> vec3u(3u));
        if slot != 0u { atomicAdd(&occupancy[(slot - 1u) * 512u + local_index(cell)], 1u); }
    }
    for (var n = 0; n < 27; n++) {
        let d = vec3i(n % 3, (n / 3) % 3, n / 9);
        let node = s.base + d;
        let slot = slot_of(node >> vec3u(3u));
        if slot != 0u {
            add((slot - 1u) * 512u + local_index(node), volume_of(i) * weight(s.f.z, d.z) * weight(s.f.y, d.y) * weight(s.f.x, d.x));
        }
    }
}
