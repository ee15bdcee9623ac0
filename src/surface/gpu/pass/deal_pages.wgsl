// Lists of the bodies that were found, in order; pages for those of blocks that several are near. Where a
// block that stays has another list, or other pages, all blocks are extracted anew.

@group(0) @binding(9) var<storage, read_write> cells: array<u32>;

var<workgroup> sums: array<u32, 256>;
var<workgroup> most: atomic<u32>;
var<workgroup> is_other: atomic<u32>;

// How many were found; sorts them.
fn sort_found(found: u32) -> u32 {
    var count = 0u;
    while count < params.body_capacity && cells[found + count] != 0u {
        let body = cells[found + count];
        var at = count;
        while at > 0u && cells[found + at - 1u] > body {
            cells[found + at] = cells[found + at - 1u];
            at--;
        }
        cells[found + at] = body;
        count++;
    }
    return count;
}

// Makes what was found the list; empties the room for it.
fn list_found(list: u32, page: u32) -> u32 {
    let found = list + 2u + params.body_capacity;
    let count_before = cells[list + 1u];
    var count = 0u;
    var differs = false;
    while count < params.body_capacity && cells[found + count] != 0u {
        let body = cells[found + count] - 1u;
        differs = differs || count >= count_before || cells[list + 2u + count] != body;
        cells[list + 2u + count] = body;
        cells[found + count] = 0u;
        count++;
    }
    differs = differs || count != count_before;
    // Blocks that come and go with one body alone are seen as any.
    let is_alone = count + count_before <= 1u;
    if (differs && !is_alone) || (count > 1u && cells[list] != page) { atomicStore(&is_other, 1u); }
    cells[list] = page;
    cells[list + 1u] = count;
    return count;
}

@compute @workgroup_size(256)
fn deal_pages(@builtin(local_invocation_index) k: u32) {
    status.has_bodies = atomicLoad(&status.has_others);
    if status.has_bodies == 0u { return; }
    let each = (params.slot_capacity + 255u) / 256u;
    let first = min(k * each, params.slot_capacity);
    let last = min(first + each, params.slot_capacity);
    var sum = 0u;
    for (var slot = first; slot < last; slot++) {
        let count = sort_found(list_first(slot) + 2u + params.body_capacity);
        sum += select(0u, count, count > 1u);
    }
    sums[k] = sum;
    workgroupBarrier();
    var page = 0u;
    var all_pages = 0u;
    for (var j = 0u; j < 256u; j++) {
        if j == k { page = all_pages; }
        all_pages += sums[j];
    }
    for (var slot = first; slot < last; slot++) {
        let count = list_found(list_first(slot), page);
        if count > 1u {
            page += count;
            atomicMax(&most, count);
        }
    }
    workgroupBarrier();
    if k != 0u { return; }
    status.page_count = all_pages;
    status.body_most = atomicLoad(&most);
    status.is_relisted = atomicLoad(&is_other);
    if all_pages > params.page_capacity || atomicLoad(&status.bodies_wanted) != 0u {
        atomicOr(&status.flags, BODIES_FULL);
        // Nothing may go by lists that there is no room for.
        status.has_bodies = 0u;
        status.body_most = 0u;
    }
}
