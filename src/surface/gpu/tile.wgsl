// A block and its neighbours: what stands at nodes from -1 to 9 from its first node. One workgroup a block.

@group(0) @binding(23) var<storage, read> work: array<Work>;
@group(0) @binding(9) var<storage, read_write> cells: array<u32>; // by slot, see lists.wgsl

var<workgroup> near: array<u32, 27>; // slots + 1

fn find_neighbours(block: vec3i, k: u32) {
    if k < 27u {
        near[k] = slot_of(block + vec3i(vec3u(k % 3u, (k / 3u) % 3u, k / 9u)) - 1);
    }
    workgroupBarrier();
}

fn slot_near(node: vec3i) -> u32 {
    let b = (node + 8) >> vec3u(3u);
    return near[b.x + 3 * (b.y + 3 * b.z)];
}

fn cell_word(node: vec3i, section: u32) -> u32 {
    let slot = slot_near(node);
    if slot == 0u { return 0u; }
    return cells[cells_first(slot - 1u) + section * 512u + local_index(node)];
}

fn label_at(node: vec3i) -> u32 {
    return cell_word(node, 0u);
}

fn body_at(node: vec3i) -> u32 {
    if slot_near(node) == 0u { return NOBODY; }
    return cell_word(node, 3u);
}

// See closure.rs.
fn closure_at(node: vec3i) -> f32 {
    return bitcast<f32>(cell_word(node, 4u));
}

// 3 bits per corner: the first corner of its body of the cell.
fn bodies_at(cell: vec3i) -> u32 {
    return cell_word(cell, 2u);
}

fn corner_of(i: u32) -> vec3i {
    return vec3i(vec3u(i & 1u, (i >> 1u) & 1u, i >> 2u));
}

fn inside_of(cell: vec3i) -> u32 {
    var mask = 0u;
    for (var i = 0u; i < 8u; i++) {
        mask |= (label_at(cell + corner_of(i)) & 1u) << i;
    }
    return mask;
}
