// Where the two sides of a cut, pressed on each other, grow together: at a frame's end, by the node masses of
// its last substep.

@group(0) @binding(8) var<storage, read> sums: array<vec4i>;

struct CutSides { normal: vec3f, are_met: bool }

// The unit normal of a sheet's cut at a place; whether both sides meet there.
fn sides_at(s: Stencil, sheet: u32) -> CutSides {
    var m = vec2f(0.0);
    var front = vec3f(0.0);
    var back = vec3f(0.0);
    for (var i = 0; i < 27; i++) {
        let o = vec3i(i / 9, (i / 3) % 3, i % 3);
        let n = s.base + o;
        let slot = slot_of(n);
        if slot == 0u { continue; }
        let arm = vec3f(o) - s.f;
        let w = weight(s.f.x, o.x) * weight(s.f.y, o.y) * weight(s.f.z, o.z);
        for (var c = 1u; c < CLASSES; c++) {
            let key = key_at(slot - 1u, c);
            if key == 0u { break; }
            let side = side_of(key, sheet);
            if side == 0 { continue; }
            let mass = w * f32(sums[2u * node_place(slot, c, n)].w);
            if side > 0 {
                m.x += mass;
                front += mass * arm;
            } else {
                m.y += mass;
                back += mass * arm;
            }
        }
    }
    let share = m / (m.x + m.y);
    let g = share.y * front - share.x * back;
    let size = length(g);
    if !(min(share.x, share.y) > MEETING_SHARE) || size == 0.0 { return CutSides(vec3f(0.0), false); }
    return CutSides(g / size, true);
}

fn is_spared(sheet: u32) -> bool {
    for (var t = 0u; t < params.tool_count; t++) {
        let tool = tool_now(t);
        if tool.sheet == sheet { return true; }
    }
    return false;
}

@compute @workgroup_size(WORKGROUP)
fn weld(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if i >= params.particle_count || is_halted() { return; }
    var tags = bitcast<u32>(state[at(VELOCITY, i)].w);
    if (tags & 0xff00ff00u) == 0u { return; }
    let s = stencil(state[at(POSITION, i)]);
    let a = state[at(STRAIN, i)];
    let e = Sym(a.xyz, vec3f(a.w, state[at(STRAIN + 1u, i)].xy));
    let tau = stress(e);
    let ratio = 1.0 + expm1(trace(hencky(e)));
    for (var shift = 0u; shift < 32u; shift += 16u) {
        let tag = (tags >> shift) & 0xffffu;
        let side = tag >> 8u;
        if side == 0u || is_spared(tag & 255u) { continue; }
        let here = sides_at(s, tag & 255u);
        if !here.are_met { continue; }
        let n = here.normal;
        let traction = vec3f(dot(vec3f(tau.d.x, tau.o.x, tau.o.y), n), dot(vec3f(tau.o.x, tau.d.y, tau.o.z), n), dot(vec3f(tau.o.y, tau.o.z, tau.d.z), n));
        // The count of a tag is the magnitude of its side, a signed byte.
        let is_front = side < 128u;
        var count = select(256u - side, side, is_front) + params.weld_step;
        if dot(n, traction) >= -params.weld_stress * ratio { count = 1u; }
        var new_tag = (tag & 255u) | (select(256u - count, count, is_front) << 8u);
        if count > WELD_PARTS {
            new_tag = 0u;
            atomicAdd(&status.welded, 1u);
        }
        tags = (tags & ~(0xffffu << shift)) | (new_tag << shift);
    }
    state[at(VELOCITY, i)].w = bitcast<f32>(tags);
}
