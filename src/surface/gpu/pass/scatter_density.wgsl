// Volumes to the cell grid.

@compute @workgroup_size(64)
fn scatter_density(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = group_number(group, groups) * 64u + k;
    if i >= params.particle_count || !is_usable(i) { return; }
    let s = stencil_of(i);
    for (var n = 0; n < 27; n++) {
        let d = vec3i(n % 3, (n / 3) % 3, n / 9);
        let node = s.base + d;
        let slot = slot_of(node >> vec3u(3u));
        if slot != 0u {
            add((slot - 1u) * 512u + local_index(node), volume_of(i) * weight(s.f.z, d.z) * weight(s.f.y, d.y) * weight(s.f.x, d.x));
        }
    }
}
