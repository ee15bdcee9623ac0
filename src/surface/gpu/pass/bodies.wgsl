// Rule 4: the bodies of each cell.

fn bodies_of(cell: vec3i) -> u32 {
    var corners: array<u32, 8>;
    var bodies: array<u32, 8>;
    var first: array<u32, 8>;
    var is_whole = true;
    for (var i = 0u; i < 8u; i++) {
        corners[i] = label_at(cell + corner_of(i));
        bodies[i] = body_at(cell + corner_of(i));
        first[i] = i;
        is_whole = is_whole && (corners[i] >> 1u) == (corners[0] >> 1u) && bodies[i] == bodies[0];
    }
    if is_whole { return 0u; }
    var is_grown = true;
    while is_grown {
        is_grown = false;
        for (var i = 0u; i < 8u; i++) {
            for (var j = 0u; j < i; j++) {
                let are_in = (corners[i] & corners[j] & 1u) == 1u;
                if are_in && first[i] != first[j] && !are_of_two(bodies[i], bodies[j]) && !is_parted(corners[i], corners[j]) {
                    let least = min(first[i], first[j]);
                    first[i] = least;
                    first[j] = least;
                    is_grown = true;
                }
            }
        }
    }
    var bits = 0u;
    for (var i = 0u; i < 8u; i++) { bits |= first[i] << (3u * i); }
    return bits;
}

@compute @workgroup_size(256)
fn bodies(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = work[group.x].slot;
    let entry = work[group.x].entry;
    if entry == NONE { return; }
    find_neighbours(block_of(entry), k);
    for (var j = k; j < 512u; j += 256u) {
        cells[cells_first(slot) + 1024u + j] = bodies_of(local_node(j));
    }
}
