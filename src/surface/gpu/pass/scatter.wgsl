// Weights to the visual grid's raw lattice: all clay, that in front of and behind each cut, and that
// of each body where several are near.

@group(0) @binding(6) var<storage, read> weights: array<f32>;
@group(0) @binding(9) var<storage, read> cells: array<u32>;

// Of one side of a cut; 0 for none.
fn plane_of(tag: Tag, body: u32) -> u32 {
    if tag.sheet == 0u { return 0u; }
    for (var s = 0u; s < min(status.sheet_count, params.sheet_capacity); s++) {
        if is_cut_of(s, body, tag.sheet) { return 2u * s + select(2u, 1u, tag.side > 0); }
    }
    return 0u;
}

@compute @workgroup_size(64)
fn scatter(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = group_number(group, groups) * 64u + k;
    if i >= params.particle_count || weights[i] == 0.0 { return; }
    let plane = vec2u(plane_of(tag_of(i, 0u), body_of(i)), plane_of(tag_of(i, 1u), body_of(i)));
    let s = stencil_of(i);
    var last = 0u;
    var own = NONE;
    for (var n = 0; n < 27; n++) {
        let d = vec3i(n % 3, (n / 3) % 3, n / 9);
        let node = s.base + d;
        let slot = slot_of(node >> vec3u(3u));
        if slot == 0u { continue; }
        let value = weights[i] * weight(s.f.z, d.z) * weight(s.f.y, d.y) * weight(s.f.x, d.x);
        if slot != last { own = body_first(slot - 1u, body_of(i)); }
        last = slot;
        let at = plane_first(slot - 1u, 0u) + local_index(node);
        add(at, value);
        if own != NONE && own != plane_first(slot - 1u, 0u) { add(own + local_index(node), value); }
        if plane.x != 0u { add(at + plane.x * 512u, value); }
        if plane.y != 0u { add(at + plane.y * 512u, value); }
    }
}
