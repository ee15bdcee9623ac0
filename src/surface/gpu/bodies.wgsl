// Where values stand, by the lists.

fn page_count(slot: u32) -> u32 {
    if status.has_bodies == 0u { return 0u; }
    let count = cells[list_first(slot) + 1u];
    return select(0u, count, count > 1u);
}

// First value of a slot's planes, then of its pages.
fn values_first(slot: u32, number: u32) -> u32 {
    if number < plane_count() { return plane_first(slot, number); }
    return page_first(cells[list_first(slot)] + number - plane_count());
}

// First value of a body's clay at a slot; NONE where it is not near.
fn body_first(slot: u32, body: u32) -> u32 {
    if status.has_bodies == 0u { return plane_first(slot, 0u); }
    let list = list_first(slot);
    let count = cells[list + 1u];
    for (var i = 0u; i < count; i++) {
        if cells[list + 2u + i] != body { continue; }
        if count == 1u { return plane_first(slot, 0u); }
        return page_first(cells[list] + i);
    }
    return NONE;
}

// Whether a cut with fields is a body's, of this sheet.
fn is_cut_of(number: u32, body: u32, sheet: u32) -> bool {
    return is_cut_in(number, body) && (status.sheets[number] & 255u) == sheet;
}

fn is_cut_in(number: u32, body: u32) -> bool {
    return status.has_bodies == 0u || (status.sheets[number] >> 8u) == body;
}
