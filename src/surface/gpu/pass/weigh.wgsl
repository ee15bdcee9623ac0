// Weights of the particles: volume times what those that stand free weigh more; nothing for small clusters,
// where grains are drawn.

@group(0) @binding(6) var<storage, read_write> weights: array<f32>;
@group(0) @binding(19) var<storage, read_write> grains: array<f32>; // density at each particle, 0 for those left out
@group(0) @binding(22) var<storage, read> occupancy: array<u32>; // particles by slot and cell

fn particles_in(cell: vec3i) -> u32 {
    let slot = slot_of(cell >> vec3u(3u));
    if slot == 0u { return 0u; }
    return occupancy[(slot - 1u) * 512u + local_index(cell)];
}

// Whether the cells joined to this one have fewer than CLUSTER_MIN particles.
fn is_small_cluster(cell: vec3i) -> bool {
    var seen: array<vec3i, CLUSTER_MIN>; // each with a particle: never full
    seen[0] = cell;
    var count = 1u;
    var size = particles_in(cell);
    for (var next = 0u; next < count; next++) {
        for (var n = 0; n < 27; n++) {
            let near = seen[next] + vec3i(n % 3, (n / 3) % 3, n / 9) - 1;
            let more = particles_in(near);
            var is_new = more > 0u;
            for (var j = 0u; j < count; j++) { is_new = is_new && any(seen[j] != near); }
            if !is_new { continue; }
            size += more;
            if size >= CLUSTER_MIN { return false; }
            seen[count] = near;
            count++;
        }
    }
    return size < CLUSTER_MIN;
}

@compute @workgroup_size(64)
fn weigh(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = group_number(group, groups) * 64u + k;
    if i >= params.particle_count { return; }
    if !is_usable(i) {
        weights[i] = 0.0;
        if params.has_grains != 0u { grains[i] = 0.0; }
        return;
    }
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
    if params.has_grains != 0u {
        grains[i] = rho;
        if rho > 0.0 && rho < GRAIN_DENSITY && is_small_cluster(vec3i(floor(place_of(i)))) {
            weights[i] = 0.0;
            return;
        }
    }
    let excess = SURFACE_DENSITY / max(rho, DENSITY_MIN);
    weights[i] = volume_of(i) * select(1.0, pow(excess, params.density_exponent), excess > 1.0 && params.density_exponent != 0.0);
}
