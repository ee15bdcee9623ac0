// Where the sides of a cut are carried on: at a frame's end, by the node masses of its last substep. Clay
// takes the side of the tagged clay that lies between it and a cut whose other side it sees (`carry`).

// The lowest sheet of a cut above `last` in the clay that the stencil reaches; 0 if there is none.
fn next_sheet_about(base: vec3i, last: u32) -> u32 {
    var next = JOINT_SHEET;
    let low = base >> vec3u(2u);
    let high = (base + 2) >> vec3u(2u);
    for (var b = 0u; b < 8u; b++) {
        let is_high = (vec3u(b, b >> 1u, b >> 2u) & vec3u(1u)) == vec3u(1u);
        if any(is_high & (low == high)) { continue; }
        let slot = table[block_index(select(low, high, is_high))];
        if slot == 0u { continue; }
        for (var c = 1u; c < CLASSES; c++) {
            let key = key_at(slot - 1u, c);
            if key == 0u { break; }
            let sheets = sheets_of(key);
            if sheets.x > last { next = min(next, sheets.x); }
            if sheets.y > last { next = min(next, sheets.y); }
        }
    }
    return select(next, 0u, next == JOINT_SHEET);
}

// Whether tags have room for a side of the sheet, have none, and have not grown together there.
fn is_open(tags: u32, sheet: u32) -> bool {
    let is_known = (tags & 255u) == sheet || ((tags >> 16u) & 255u) == sheet;
    return !is_known && ((tags & 0xff00u) == 0u || (tags & 0xff000000u) == 0u);
}

// The side that is carried on to a place: 1, -1, or 0 for none.
fn carried(about: SidesAbout) -> i32 {
    let n = normal_of(about);
    if all(n == vec3f(0.0)) { return 0; }
    let share = about.masses.x / (about.masses.x + about.masses.y);
    let is_front = share > 0.5;
    let moment = select(about.back, about.front, is_front);
    let side = select(-1.0, 1.0, is_front);
    let size = length(moment);
    let is_behind = -side * dot(n, moment) > CARRY_COSINE * size;
    return select(0, i32(side), max(share, 1.0 - share) > CARRY_SHARE && is_behind && size > 0.0);
}

@compute @workgroup_size(WORKGROUP)
fn carry(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if i >= params.particle_count || is_halted() { return; }
    var tags = bitcast<u32>(state[at(VELOCITY, i)].w);
    if (tags & 0xff00u) != 0u && (tags & 0xff000000u) != 0u { return; }
    let s = stencil(state[at(POSITION, i)]);
    let body = body_at(i);
    let before = tags;
    var sheet = next_sheet_about(s.base, 0u);
    while sheet != 0u {
        if is_open(tags, sheet) && !is_spared(sheet) {
            let side = carried(sides_about(s, body, sheet));
            if side != 0 {
                // The newest sheet comes first.
                tags = select(tags & 0xffff0000u, tags << 16u, (tags & 0xff00u) != 0u);
                tags |= sheet | (select(255u, 1u, side > 0) << 8u);
                atomicAdd(&status.carried, 1u);
            }
        }
        sheet = next_sheet_about(s.base, sheet);
    }
    if tags != before { state[at(VELOCITY, i)].w = bitcast<f32>(tags); }
}
