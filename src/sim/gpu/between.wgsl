// What stands on two sides of something: those of a cut, by its sheet, or two bodies; and how the two face
// each other at a node, in the mean over what the nodes about it find (`facing`).

// Bodies are numbered in 14 bits.
const BODIES: u32 = 1u << 28u;

fn between_bodies(back: u32, front: u32) -> u32 {
    return BODIES | (back << 14u) | front;
}

// On which side of it the clay of a class is: 1 front, -1 back, 0 neither.
fn side_between(key: u32, between: u32) -> i32 {
    if between < BODIES { return side_of(key, between); }
    let body = body_of(key);
    return i32(body == (between & 0x3fffu)) - i32(body == ((between >> 14u) & 0x3fffu));
}

// Slot + 1 of the block that holds node n, which may be out of the room.
fn slot_about(n: vec3i) -> u32 {
    let block = n >> vec3u(2u);
    if any(block < vec3i(0)) || any(block >= params.blocks) { return 0u; }
    return slot_of(n);
}

// How two sides face each other: the unit normal, from back to front, 0 where there is none, and the gap
// along it [cells].
struct Facing { normal: vec3f, gap: f32 }

fn mean_facing(n: vec3i, between: u32) -> Facing {
    var sum = vec4f(0.0);
    var mass = 0.0;
    for (var i = 0; i < 27; i++) {
        let about = n + vec3i(i / 9, (i / 3) % 3, i % 3) - 1;
        let slot = slot_about(about);
        if slot == 0u { continue; }
        for (var b = 0u; b < BETWEEN_MAX; b++) {
            let here = cuts[between_place(slot - 1u, b)];
            if here == 0u { break; }
            if here != between { continue; }
            let place = found_place(slot - 1u, b, local_index(about));
            sum += bitcast<vec4f>(vec4u(cuts[place], cuts[place + 1u], cuts[place + 2u], cuts[place + 3u]));
            mass += bitcast<f32>(cuts[place + 4u]);
        }
    }
    let size = length(sum.xyz);
    if size == 0.0 { return Facing(vec3f(0.0), 0.0); }
    return Facing(sum.xyz / size, sum.w / mass);
}
