// The classes of clay in each block: the keys of its particles, and of those whose stencils reach it, the
// greatest first. Class 0 is the first body's untagged clay, whose key is not listed. Behind the keys of a
// block stand the folded masses of its classes at its 64 nodes, then what stands on two sides of something in
// the block, 0 where the list ends, and what its nodes find of each.

const KEYS: u32 = CLASSES - 1u;

fn keys_place(slot: u32) -> u32 {
    return slot * CUT_WORDS;
}

fn masses_place(slot: u32, class_: u32, k: u32) -> u32 {
    return keys_place(slot) + KEYS + class_ * 64u + k;
}

fn between_place(slot: u32, i: u32) -> u32 {
    return keys_place(slot) + KEYS + CLASSES * 64u + i;
}

fn found_place(slot: u32, i: u32, k: u32) -> u32 {
    return between_place(slot, BETWEEN_MAX) + (i * 64u + k) * FOUND;
}

fn key_at(slot: u32, class_: u32) -> u32 {
    if class_ == 0u { return 0u; }
    return cuts[keys_place(slot) + class_ - 1u];
}

// The class of a key in a block, given its slot + 1. Class 0 for a key that found no room.
fn class_in(slot: u32, key: u32) -> u32 {
    if CLASSES == 1u || key == 0u { return 0u; }
    for (var c = 1u; c < CLASSES; c++) {
        if key_at(slot - 1u, c) == key { return c; }
    }
    return 0u;
}

fn body_of(key: u32) -> u32 {
    return key >> 18u;
}

// The sheets of both sides, 0 for none.
fn sheets_of(key: u32) -> vec2u {
    return vec2u(key >> 10u, key >> 1u) & vec2u(255u);
}

// Side (1 front, -1 back) of a sheet; 0 near it not.
fn side_of(key: u32, sheet: u32) -> i32 {
    let sheets = sheets_of(key);
    if sheets.x == sheet { return i32((key >> 9u) & 1u) * 2 - 1; }
    if sheets.y == sheet { return i32(key & 1u) * 2 - 1; }
    return 0;
}
