// Where the two sides of a cut, pressed on each other, grow together: at a frame's end, by the node masses of
// its last substep.

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
        let n = normal_of(sides_about(s, tag & 255u));
        if all(n == vec3f(0.0)) { continue; }
        let traction = vec3f(dot(vec3f(tau.d.x, tau.o.x, tau.o.y), n), dot(vec3f(tau.o.x, tau.d.y, tau.o.z), n), dot(vec3f(tau.o.y, tau.o.z, tau.d.z), n));
        // The count of a tag is the magnitude of its side, a signed byte.
        let is_front = side < 128u;
        var count = select(256u - side, side, is_front) + params.weld_step;
        if dot(n, traction) >= -params.weld_stress * ratio { count = 1u; }
        var new_tag = (tag & 255u) | (select(256u - count, count, is_front) << 8u);
        if count > WELD_PARTS {
            new_tag = tag & 255u;
            atomicAdd(&status.welded, 1u);
        }
        tags = (tags & ~(0xffffu << shift)) | (new_tag << shift);
    }
    state[at(VELOCITY, i)].w = bitcast<f32>(tags);
}
