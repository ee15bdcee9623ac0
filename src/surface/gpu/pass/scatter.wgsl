// Weights to the visual grid's raw lattice: all clay, and that in front of and behind each cut.

@group(0) @binding(6) var<storage, read> weights: array<f32>;
@group(0) @binding(18) var<storage, read> planes: array<u32>;

@compute @workgroup_size(64)
fn scatter(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = group_number(group, groups) * 64u + k;
    if i >= params.particle_count || weights[i] == 0.0 { return; }
    var plane = vec2u(0u);
    for (var slot = 0u; slot < 2u; slot++) {
        let tag = tag_of(i, slot);
        let number = planes[tag.sheet];
        if tag.sheet != 0u && number != 0u { plane[slot] = 2u * number - select(0u, 1u, tag.side > 0); }
    }
    let s = stencil_of(i);
    for (var n = 0; n < 27; n++) {
        let d = vec3i(n % 3, (n / 3) % 3, n / 9);
        let node = s.base + d;
        let slot = slot_of(node >> vec3u(3u));
        if slot == 0u { continue; }
        let value = weights[i] * weight(s.f.z, d.z) * weight(s.f.y, d.y) * weight(s.f.x, d.x);
        let at = (slot - 1u) * planes_stored() * 512u + local_index(node);
        add(at, value);
        if plane.x != 0u { add(at + plane.x * 512u, value); }
        if plane.y != 0u { add(at + plane.y * 512u, value); }
    }
}
