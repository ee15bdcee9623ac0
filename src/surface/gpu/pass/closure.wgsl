// All clay at the faces of parts, by cells of 2^3 nodes: see closure.rs.

@group(0) @binding(9) var<storage, read_write> cells: array<u32>;
@group(0) @binding(10) var<storage, read> kept: array<f32>;
@group(0) @binding(23) var<storage, read> work: array<Work>;

// All clay at a node if two parts stand there face to face, SEVERAL if more do, else 0.
fn clay_at_faces(slot: u32, j: u32) -> f32 {
    let first = plane_first(slot, 0u) + j;
    let total = kept[first];
    if total < CLAY_OPEN { return 0.0; }
    var body = 0u;
    var whole = total;
    var faces = 0;
    if status.has_bodies != 0u {
        let list = list_first(slot);
        whole = 0.0;
        faces = -1;
        for (var i = 0u; i < cells[list + 1u]; i++) {
            let number = cells[list + 2u + i];
            let value = kept[body_first(slot, number) + j];
            faces += i32(value > PART_SHARE * total);
            if value > whole {
                whole = value;
                body = number;
            }
        }
    }
    var share = whole / total;
    for (var s = 0u; s < min(status.sheet_count, params.sheet_capacity); s++) {
        if !is_cut_in(s, body) { continue; }
        let front = kept[first + (2u * s + 1u) * 512u];
        let back = kept[first + (2u * s + 2u) * 512u];
        if owner_of(whole, front, back) == 0u || min(front, back) <= PART_SHARE * (front + back) { continue; }
        // Clay beyond the cut's end is one more.
        faces += select(1, 2, front + back < FACE_SHARE * whole);
        share *= max(front, back) / (front + back);
    }
    if faces > 1 { return SEVERAL; }
    return select(0.0, total, faces == 1 && share <= FACE_SHARE);
}

@compute @workgroup_size(64)
fn closure(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) k: u32) {
    let slot = work[group.x].slot;
    if work[group.x].values == 0u || work[group.x].entry == NONE || !has_parts() { return; }
    let low = 2u * vec3u(k & 3u, (k >> 2u) & 3u, k >> 4u);
    var most = 0.0;
    for (var i = 0u; i < 8u; i++) {
        let node = low + vec3u(i & 1u, (i >> 1u) & 1u, i >> 2u);
        most = max(most, clay_at_faces(slot, node.x + 8u * (node.y + 8u * node.z)));
    }
    cells[cells_first(slot) + CLOSURE_FIRST + k] = bitcast<u32>(most);
}
