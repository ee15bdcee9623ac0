// Enters the keys of particles that are tagged or of another body than the first into the lists of the blocks
// that their stencils reach: the greatest first, so that nothing depends on who entered first, not even which
// find no room.

@group(0) @binding(16) var<storage, read_write> cuts: array<atomic<u32>>;

const KEYS: u32 = CLASSES - 1u;

fn enter(slot: u32, key: u32) {
    let first = slot * CUT_WORDS;
    // Most particles find theirs entered.
    for (var c = 0u; c < KEYS; c++) {
        let here = atomicLoad(&cuts[first + c]);
        if here == key { return; }
        if here < key { break; }
    }
    // Each place keeps the greater key, the other goes on to the next.
    var carried = key;
    for (var c = 0u; c < KEYS; c++) {
        let here = atomicMax(&cuts[first + c], carried);
        if here == carried || here == 0u { return; }
        carried = min(carried, here);
    }
    // The host takes the passes for more classes, if there are any.
    if CLASSES < CLASSES_MAX { halt(CROWDED); } else { atomicStore(&status.crowded, 1u); }
}

@compute @workgroup_size(WORKGROUP)
fn classes(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = invocation(group, groups, k);
    if i >= params.particle_count || is_halted() { return; }
    let key = key_of(body_at(i), bitcast<u32>(state[at(VELOCITY, i)].w));
    if key == 0u { return; }
    let base = stencil(state[at(POSITION, i)]).base;
    let low = base >> vec3u(2u);
    let high = (base + 2) >> vec3u(2u);
    for (var c = 0u; c < 8u; c++) {
        let is_high = (vec3u(c, c >> 1u, c >> 2u) & vec3u(1u)) == vec3u(1u);
        // A block that the stencil reaches by both ends of an axis is entered once.
        if any(is_high & (low == high)) { continue; }
        let slot = table[block_index(select(low, high, is_high))];
        if slot == 0u { halt(MARGIN); return; }
        enter(slot - 1u, key);
    }
}
