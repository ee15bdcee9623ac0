// Mass of the clay that touches a separating tool to the nodes: what tells contact from a gap.

@group(0) @binding(8) var<storage, read_write> sums: array<atomic<i32>>;

@compute @workgroup_size(WORKGROUP)
fn touching(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if i >= params.particle_count || is_halted() { return; }
    let position = state[at(POSITION, i)];
    let cell = unpack_cell(bitcast<u32>(position.w));
    let mass = state[at(AFFINE, i)].w;
    let radius = 0.5 * pow(mass * params.density_unit, 1.0 / 3.0);
    var touch = 0.0;
    for (var t = 0u; t < params.tool_count; t++) {
        let tool = tool_now(t);
        if !separates(tool) { continue; }
        let distance_ = distance_to(tool, local_end(tool, cell, position.xyz));
        touch = max(touch, clamp(TOUCH_SHARE + (radius - distance_) / TOUCH_FADE, 0.0, 1.0));
    }
    if touch == 0.0 { return; }
    let part = mass * touch * params.mass_scale;
    let s = stencil(position);
    for (var xy = 0; xy < 9; xy++) {
        let o = vec2i(xy / 3, xy % 3);
        let first = s.base + vec3i(o, 0);
        let slots = slots_along_z(first);
        if slots.x == 0u || slots.y == 0u { halt(MARGIN); return; }
        let w = part * (weight(s.f.x, o.x) * weight(s.f.y, o.y));
        for (var z = 0; z < 3; z++) {
            let n = first + vec3i(0, 0, z);
            atomicAdd(&sums[touching_place(at_z(slots, first, z) - 1u, local_index(n))], i32(round(w * weight(s.f.z, z))));
        }
    }
}
