// Particles that a blade came near, or swept over, take their side of it (`tool::Blade::near`); those behind
// it are put back. What edges have ahead is summed up.

// The tags without the one at that place.
fn without(tags: u32, place: u32) -> u32 {
    if place == NONE { return tags; }
    return select(tags & 0xffffu, tags >> 16u, place == 0u);
}

@compute @workgroup_size(WORKGROUP)
fn tags(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if i >= params.particle_count || is_halted() { return; }
    var position = state[at(POSITION, i)];
    var velocity = state[at(VELOCITY, i)];
    let cell = unpack_cell(bitcast<u32>(position.w));
    let start = position.xyz;
    let way = state[at(WAY, i)].xyz;
    var x = start;
    var packed = bitcast<u32>(velocity.w);
    for (var index = 0u; index < params.tool_count; index++) {
        let t = tool_now(index);
        if t.sheet == 0u { continue; }
        let before = local_start(t, cell, x - way);
        let after = local_end(t, cell, x);
        let from_ = foot_on(t, before);
        let to = foot_on(t, after);
        let was_near = is_in_band(t, from_);
        let is_near = is_in_band(t, to);
        // A wire holds nothing off, and tags nothing twice.
        let holds = !is_wire(t);
        let at_blade = is_near || (holds && is_crossed(t, before, after));
        let is_new = holds && !was_near && at_blade;
        var is_behind = from_.distance < 0.0;
        if is_new && !from_.is_inside {
            // From beside the rim: did it come through the blade (`Blade::is_crossed_from_beside`)?
            let was = 2.0 * before - local_end(t, cell, x - way);
            let now = local_start(t, cell, x);
            is_behind = (to.distance < 0.0) != (is_crossed(t, was, now) != is_crossed(t, now, after));
        }
        var place = place_of(packed, t.sheet);
        if is_solid(t) {
            // Clay beside a plate is on a side of it for as long as it is there, if it has room for one.
            if !at_blade { packed = without(packed, place); place = NONE; }
            if place == NONE && (packed & 0xff00u) != 0u && (packed & 0xff000000u) != 0u { continue; }
        }
        if is_new || (at_blade && place == NONE) {
            let taken = t.sheet | (select(1u, 255u, is_behind) << 8u);
            if place == NONE {
                // The newest sheet comes first.
                let has_first = (packed & 0xff00u) != 0u;
                if has_first && (packed & 0xff000000u) != 0u { atomicAdd(&status.tools[index].displaced, 1u); }
                packed = select(packed & 0xffff0000u, packed << 16u, has_first);
                place = 0u;
            }
            packed = (packed & ~(0xffffu << place)) | (taken << place);
            atomicAdd(&status.tools[index].tagged, 1u);
        }
        if place == NONE { continue; }
        let s = select(1.0, -1.0, ((packed >> (place + 8u)) & 255u) > 127u);
        if holds && at_blade && to.distance * s < 0.0 {
            x += t.end_rotation * to.normal * (s * SET_BACK - to.distance);
            atomicAdd(&status.tools[index].pushed_back, 1u);
            atomicMax(&status.tools[index].depth, bitcast<u32>(abs(to.distance)));
        }
    }
    if params.toughness > 0.0 {
        let key = key_of(body_at(i), packed);
        let volume = state[at(AFFINE, i)].w * params.density_unit;
        for (var index = 0u; index < params.tool_count; index++) {
            let t = tool_now(index);
            if t.sheet == 0u || is_solid(t) || place_of(packed, t.sheet) != NONE { continue; }
            see_ahead(index, t, key, volume, local_end(t, cell, x));
        }
    }
    if any(x != start) {
        x = clamp(x, vec3f(params.wall_low - cell), vec3f(params.wall_high - cell));
        let whole = floor(x);
        position = vec4f(x - whole, bitcast<f32>(pack_cell(cell + vec3i(whole))));
        state[at(POSITION, i)] = position;
    }
    state[at(VELOCITY, i)].w = bitcast<f32>(packed);
}
