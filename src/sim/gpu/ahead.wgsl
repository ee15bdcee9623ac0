// The clay ahead of the edges of blades, and what of it is still to be parted (`sim::ahead`): sums by class
// in fixed point, in a table of each tool that is open at a class's own place. Of more classes than it has
// places those that come last are whole, and which they are depends on who comes first.

// Of a cell^3: fine enough for the first substep in which an edge comes to clay, coarse enough for edges of
// 4,000 cells.
const AHEAD_UNIT: f32 = 4194304.0;

// The i-th place to look for a class at.
fn ahead_place(key: u32, i: u32) -> u32 {
    return ((((key ^ (key >> 18u)) * 2654435769u) >> 27u) + i) % AHEAD_PLACES;
}

// Enters a class at a place, if that is free or its own.
fn enter_ahead(tool: u32, place: u32, key: u32) -> bool {
    loop {
        let here = atomicLoad(&status.tools[tool].ahead[place]);
        if here == key + 1u { return true; }
        if here != 0u { return false; }
        if atomicCompareExchangeWeak(&status.tools[tool].ahead[place], 0u, key + 1u).exchanged { return true; }
    }
    return false;
}

// Takes in a particle of a class, which has no side of the tool's cut.
fn see_ahead(tool: u32, t: Tool, key: u32, volume: f32, q: vec3f) {
    let edge = edge_before(t, q);
    let share = edge_share(edge);
    if !edge.is_there || share <= 0.0 { return; }
    let sum = u32(round(volume * share * edge.beside * AHEAD_UNIT));
    for (var i = 0u; i < AHEAD_PLACES; i++) {
        let place = ahead_place(key, i);
        if !enter_ahead(tool, place, key) { continue; }
        if foot_on(t, q).distance > 0.0 {
            atomicAdd(&status.tools[tool].before[place], sum);
        } else {
            atomicAdd(&status.tools[tool].behind[place], sum);
        }
        return;
    }
}

// How much of a class that was seen ahead of it the edge of a tool has to part.
fn wholeness(tool: u32, key: u32) -> f32 {
    for (var i = 0u; i < AHEAD_PLACES; i++) {
        let place = ahead_place(key, i);
        if atomicLoad(&status.tools[tool].ahead[place]) != key + 1u { continue; }
        let before = f32(atomicLoad(&status.tools[tool].before[place]));
        let behind = f32(atomicLoad(&status.tools[tool].behind[place]));
        let lesser = min(before, behind) / max(before + behind, 1.0);
        return clamp((lesser - PARTED_MAX) / (WHOLE_MIN - PARTED_MAX), 0.0, 1.0);
    }
    return 1.0;
}
