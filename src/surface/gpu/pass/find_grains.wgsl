// Particles that the surface does not show: how far f is below GRAIN_FIELD thresholds at each, of that. How
// many there are in each workgroup.

@group(0) @binding(8) var<storage, read> fields: array<f32>;
@group(0) @binding(19) var<storage, read_write> grains: array<f32>; // densities, which become shares, 0 within the surface
@group(0) @binding(20) var<storage, read> kept_grains: array<vec4f>;
@group(0) @binding(21) var<storage, read_write> grain_counts: array<u32>;

var<workgroup> found: atomic<u32>;

fn value_at(node: vec3i) -> f32 {
    let slot = slot_of(node >> vec3u(3u));
    if slot == 0u { return 0.0; }
    return fields[(slot - 1u) * planes_stored() * 512u + local_index(node)];
}

// f between nodes, linear along each axis.
fn value_between(at: vec3f) -> f32 {
    let low = floor(at);
    let t = at - low;
    var sum = 0.0;
    for (var i = 0; i < 8; i++) {
        let d = vec3i(i & 1, (i >> 1u) & 1, i >> 2u);
        let share = select(1.0 - t, t, d == vec3i(1));
        sum += share.x * share.y * share.z * value_at(vec3i(low) + d);
    }
    return sum;
}

fn share_of(i: u32) -> f32 {
    let rho = grains[i];
    if rho <= 0.0 || rho >= BULK_DENSITY { return 0.0; }
    return max(1.0 - value_between(place_of(i) * params.scale) / (GRAIN_FIELD * params.iso), 0.0);
}

// Whether a grain that shows has changed, or one that does not is large enough to be seen.
fn is_other(i: u32, share: f32) -> bool {
    let kept = kept_grains[i];
    if abs(share - kept.w) * GRAIN_FIELD * params.iso > HYSTERESIS { return true; }
    return share > 0.0 && kept.w > 0.0 && any(abs(place_of(i) - kept.xyz) > vec3f(HYSTERESIS));
}

@compute @workgroup_size(64)
fn find_grains(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let chunk = group_number(group, groups);
    let i = chunk * 64u + k;
    if i < params.particle_count {
        let share = share_of(i);
        grains[i] = share;
        if share > 0.0 { atomicAdd(&found, 1u); }
        if (share > 0.0 || status.grain_count > 0u) && is_other(i, share) { atomicStore(&status.is_changed, 1u); }
    }
    workgroupBarrier();
    if k == 0u && chunk < arrayLength(&grain_counts) { grain_counts[chunk] = atomicLoad(&found); }
}
