// Whether clay touches a separating tool (`tool::closed_share`). Moments of the gap stand behind the sums of mass and momentum, a word a node.

// Index of a node's moment among the words of the sums.
fn gap_place(slot: u32, k: u32) -> u32 {
    return params.slot_capacity * CLASSES * 256u + slot * 64u + k;
}

// Fixed point of the moments: distances are less than 4 cells, and no node's mass overflows.
fn gap_scale() -> f32 {
    return 0.25 * params.mass_scale;
}

fn separates(t: Tool) -> bool {
    return t.shape != BLADE && t.contact != STICK && t.contact != SLIP;
}

fn contact_offset(t: Tool) -> f32 {
    return select(CONTACT_OFFSET, TOUCH_OFFSET, separates(t));
}

// 1 where clay of this mean distance touches a tool at distance s from the node, 0 where it does not.
fn closed_share(mean: f32, s: f32) -> f32 {
    let reach = 1.5 + s;
    let rest = max(1.5 - s, 0.0);
    var m0 = 0.5 + s * (0.75 - s * s / 3.0);
    var m1 = 0.203125 + s * (0.5 + s * (0.375 - s * s / 12.0));
    var weight = 0.75 - s * s;
    var slope = 2.0 * s;
    if s <= -0.5 {
        m0 = reach * reach * reach / 6.0;
        m1 = 0.25 * reach * m0;
        weight = 0.5 * reach * reach;
        slope = -reach;
    } else if s > 0.5 {
        m0 = 1.0 - rest * rest * rest / 6.0;
        m1 = s + rest * rest * rest * rest / 24.0;
        weight = 0.5 * rest * rest;
        slope = rest;
    }
    let layers = m0 + TOUCH_LAYERS * slope;
    if reach <= 0.0 || layers <= 0.0 { return 1.0; }
    return clamp(1.0 + ((m1 + TOUCH_LAYERS * weight) / layers - mean) / TOUCH_FADE, 0.0, 1.0);
}
