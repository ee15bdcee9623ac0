// Weights of the particles: volume times what those that stand free weigh more.

@group(0) @binding(6) var<storage, read_write> weights: array<f32>;

@compute @workgroup_size(64)
fn weigh(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = group_number(group, groups) * 64u + k;
    if i >= params.particle_count { return; }
    if !is_usable(i) { weights[i] = 0.0; return; }
    let s = stencil_of(i);
    var rho = 0.0;
    for (var n = 0; n < 27; n++) {
        let d = vec3i(n % 3, (n / 3) % 3, n / 9);
        let node = s.base + d;
        let slot = slot_of(node >> vec3u(3u));
        if slot != 0u {
            let f = f32(atomicLoad(&sums[(slot - 1u) * 512u + local_index(node)])) / FIXED_POINT;
            rho += weight(s.f.z, d.z) * weight(s.f.y, d.y) * weight(s.f.x, d.x) * f;
        }
    }
    let excess = SURFACE_DENSITY / max(rho, DENSITY_MIN);
    weights[i] = volume_of(i) * select(1.0, pow(excess, params.density_exponent), excess > 1.0 && params.density_exponent != 0.0);
}
