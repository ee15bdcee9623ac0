// Whether clay touches a separating tool (`tool::closed_share`). Touching masses stand behind the sums of
// mass and momentum, a word a node.

// Index of a node's touching mass among the words of the sums.
fn touching_place(slot: u32, k: u32) -> u32 {
    return params.slot_capacity * CLASSES * 256u + slot * 64u + k;
}

fn separates(t: Tool) -> bool {
    return !divides(t) && can_part(t);
}

fn contact_offset(t: Tool) -> f32 {
    return select(CONTACT_OFFSET, TOUCH_OFFSET, separates(t));
}

// How closed the gap is at distance s from a tool, where so much of a full cell's mass touches.
fn closed_share(touching: f32, s: f32) -> f32 {
    let r = abs(LAYER_DEPTH - s);
    let rest = max(1.5 - r, 0.0);
    let layer = TOUCH_SHARE * 0.5 * select(0.5 * rest * rest, 0.75 - r * r, r < 0.5);
    if touching >= layer { return 1.0; }
    return touching / layer;
}
