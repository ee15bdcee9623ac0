// Walls before particles: what separating ones give, and where clay has arrived at the others. Walls by
// number: low x y z, high x y z; the bits of a word name them.

// How near clay gives mass to the nodes of a wall.
const NODE_REACH: f32 = 1.5;

// Distance from a wall that holds clay at which a particle of this rest volume [cells^3] has arrived.
fn arrival_of(volume: f32) -> f32 {
    return reach_of(max(volume, 0.125)) + ARRIVAL_GAP;
}

fn kind_of(wall: u32) -> u32 {
    return (params.wall_kinds >> (2u * wall)) & 3u;
}

// The inward normal along the wall's axis.
fn inward_of(wall: u32) -> f32 {
    return select(1.0, -1.0, wall >= 3u);
}

// The axis of a wall's normal.
fn axis_of(wall: u32) -> u32 {
    return wall % 3u;
}

fn node_of(wall: u32) -> i32 {
    return select(params.wall_low[axis_of(wall)], params.wall_high[axis_of(wall)], wall >= 3u);
}

// The walls that particles of a block, which may have strayed by a cell, may touch.
fn walls_near(block: vec3i) -> u32 {
    var near = 0u;
    for (var wall = 0u; wall < 6u; wall++) {
        let from_middle = abs(f32(4 * block[axis_of(wall)] + 2 - node_of(wall)));
        if from_middle < 3.0 + NODE_REACH { near |= 1u << wall; }
    }
    return near;
}

// The bit of a wall node among the columns of its block that walls hold: two words a block, the columns along
// x and y in the first.
fn column_bit(axis: u32, n: vec3i) -> u32 {
    let c = vec3u(n & vec3i(3));
    let u = c[(axis + 1u) % 3u];
    let v = c[(axis + 2u) % 3u];
    return 16u * axis + 4u * u + v;
}

// Where the word of that bit stands in `blocks`.
fn column_word(slot: u32, bit: u32) -> u32 {
    return params.slot_capacity + 2u * slot + bit / 32u;
}
