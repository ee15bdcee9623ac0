// Which cuts of which bodies there are, and on which sides of them there is clay; whether there are several
// bodies.

@group(0) @binding(18) var<storage, read_write> pairs: array<atomic<u32>>; // body << 8 | sheet, or 0; bits: front, back

fn note_side(pair: u32, side: u32) {
    let first = (pair * 2654435761u) >> 16u;
    for (var i = 0u; i < PAIRS_MAX; i++) {
        let at = 2u * ((first + i) % PAIRS_MAX);
        // Not weakly: a place that is free must be taken.
        loop {
            let there = atomicLoad(&pairs[at]);
            if there == pair {
                if (atomicLoad(&pairs[at + 1u]) & side) == 0u { atomicOr(&pairs[at + 1u], side); }
                return;
            }
            if there != 0u { break; }
            atomicCompareExchangeWeak(&pairs[at], 0u, pair);
        }
    }
    atomicOr(&status.flags, SHEETS_FULL);
}

@compute @workgroup_size(64)
fn survey(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) k: u32) {
    let i = group_number(group, groups) * 64u + k;
    if i >= params.particle_count { return; }
    if body_of(i) != body_of(0u) { atomicStore(&status.has_others, 1u); }
    if particles[SURFACE_PARTICLE_WORDS * i + SURFACE_PARTICLE_TAGS] == 0u || !is_usable(i) { return; }
    for (var slot = 0u; slot < 2u; slot++) {
        let tag = tag_of(i, slot);
        if tag.sheet != 0u { note_side((body_of(i) << 8u) | tag.sheet, select(2u, 1u, tag.side > 0)); }
    }
}
