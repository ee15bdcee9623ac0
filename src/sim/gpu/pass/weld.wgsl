// Where the two sides of a cut, or two bodies, pressed on each other grow together: at a frame's end, by the
// node masses of its last substep.

// Whether clay of another body may be at the nodes of a stencil.
fn meets_others(base: vec3i, body: u32) -> bool {
    // The first body's clay has no key that would tell.
    if body != 0u { return true; }
    let low = base >> vec3u(2u);
    let high = (base + 2) >> vec3u(2u);
    for (var b = 0u; b < 8u; b++) {
        let is_high = (vec3u(b, b >> 1u, b >> 2u) & vec3u(1u)) == vec3u(1u);
        let slot = table[block_index(select(low, high, is_high))];
        // The greatest key comes first.
        if slot != 0u && body_of(key_at(slot - 1u, 1u)) != 0u { return true; }
    }
    return false;
}

// Whether a blade left the tag pressed.
fn is_left(tag: u32) -> bool {
    let side = tag >> 8u;
    return side == LEFT_PRESSED || side == 256u - LEFT_PRESSED;
}

// Whether the blade of the tag's cut is there.
fn is_at_blade(tag: u32) -> bool {
    return (tag >> 8u) != 0u && (tag & 255u) < JOINT_SHEET && is_spared(tag & 255u);
}

// See `WeldRule::joint_stress_at`.
fn has_left_joint(tag: u32) -> bool {
    return ((tag & 255u) == JOINT_SHEET && is_left(tag)) || is_at_blade(tag);
}

// Whether the clay presses across the normal there; none where the two sides do not meet.
fn is_pressed(tau: Sym, ratio: f32, n: vec3f, share: f32) -> bool {
    let traction = vec3f(dot(vec3f(tau.d.x, tau.o.x, tau.o.y), n), dot(vec3f(tau.o.x, tau.d.y, tau.o.z), n), dot(vec3f(tau.o.y, tau.o.z, tau.d.z), n));
    return any(n != vec3f(0.0)) && dot(n, traction) < -share * params.weld_stress * ratio;
}

// The tag with this count, the magnitude of its side, a signed byte.
fn with_count(tag: u32, count: u32) -> u32 {
    let is_front = (tag >> 8u) < 128u;
    return (tag & 255u) | (select(256u - count, count, is_front) << 8u);
}

// A tag whose blade is there, by whether it is pressed.
fn marked(tag: u32, pressed: bool) -> u32 {
    return with_count(tag, select(1u, LEFT_PRESSED, pressed));
}

// A tag after a frame in which it was pressed, or was not.
fn counted(tag: u32, pressed: bool) -> u32 {
    let side = tag >> 8u;
    let before = select(256u - side, side, side < 128u);
    if pressed && before == LEFT_PRESSED { return tag; }
    let count = select(1u, before + params.weld_step, pressed);
    if count > WELD_PARTS {
        atomicAdd(&status.welded, 1u);
        if (tag & 255u) == JOINT_SHEET { atomicAdd(&status.joined, 1u); }
        return tag & 255u;
    }
    return with_count(tag, count);
}

// The tags of a particle that meets another body, or none: see `WeldRule::count_joint`.
fn with_joint(tags: u32, pressed: bool) -> u32 {
    for (var shift = 0u; shift < 32u; shift += 16u) {
        let tag = (tags >> shift) & 0xffffu;
        if (tag >> 8u) == 0u || (tag & 255u) >= JOINT_SHEET || !is_spared(tag & 255u) { continue; }
        let cut = select(tag, marked(tag, true), pressed);
        let other = (tags >> (16u - shift)) & 0xffffu;
        if (other & 255u) == JOINT_SHEET && (other >> 8u) != 0u { return cut; }
        return (cut << shift) | (other << (16u - shift));
    }
    var shift = 0u;
    if (tags & 255u) != JOINT_SHEET { shift = 16u; }
    let joint = (tags >> shift) & 0xffffu;
    if (joint & 255u) == JOINT_SHEET {
        if (joint >> 8u) == 0u { return tags; }
        if pressed { return (tags & ~(0xffffu << shift)) | (counted(joint, true) << shift); }
        return select(tags & 0xffffu, tags >> 16u, shift == 0u);
    }
    let is_full = (tags & 0xff00u) != 0u && (tags & 0xff000000u) != 0u;
    if !pressed || is_full { return tags; }
    shift = select(0u, 16u, (tags & 0xff00u) != 0u);
    return (tags & ~(0xffffu << shift)) | (counted(JOINT_SHEET | (1u << 8u), true) << shift);
}

@compute @workgroup_size(WORKGROUP)
fn weld(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if i >= params.particle_count || is_halted() { return; }
    var tags = bitcast<u32>(state[at(VELOCITY, i)].w);
    let s = stencil(state[at(POSITION, i)]);
    let body = body_at(i);
    let meets = meets_others(s.base, body);
    if !meets && (tags & 0xff00ff00u) == 0u { return; }
    let a = state[at(STRAIN, i)];
    let e = Sym(a.xyz, vec3f(a.w, state[at(STRAIN + 1u, i)].xy));
    let tau = stress(e);
    let ratio = 1.0 + expm1(trace(hencky(e)));
    for (var shift = 0u; shift < 32u; shift += 16u) {
        let tag = (tags >> shift) & 0xffffu;
        let sheet = tag & 255u;
        if (tag >> 8u) == 0u || sheet == JOINT_SHEET { continue; }
        let n = normal_of(sides_about(s, body, sheet));
        if all(n == vec3f(0.0)) { continue; }
        let pressed = is_pressed(tau, ratio, n, select(1.0, LEFT_SHARE, is_left(tag) || is_at_blade(tag)));
        var now: u32;
        if is_spared(sheet) { now = marked(tag, pressed); } else { now = counted(tag, pressed); }
        tags = (tags & ~(0xffffu << shift)) | (now << shift);
    }
    var n = vec3f(0.0);
    if meets { n = normal_of(sides_about(s, body, OTHERS)); }
    let is_left_joint = has_left_joint(tags & 0xffffu) || has_left_joint(tags >> 16u);
    tags = with_joint(tags, is_pressed(tau, ratio, n, select(1.0, LEFT_SHARE, is_left_joint)));
    state[at(VELOCITY, i)].w = bitcast<f32>(tags);
}
