// The clay on either side of a sheet about a particle, or of its body and all others, by the node masses of
// the last substep.

@group(0) @binding(8) var<storage, read> sums: array<vec4i>;

// The front first: masses, and those times the way to them.
struct SidesAbout { masses: vec2f, front: vec3f, back: vec3f }

// In place of a sheet: clay of the particle's body is the front, of all others the back.
const OTHERS: u32 = 256u;

// On which side of it the clay of a class is for clay of a body: 1 front, -1 back, 0 neither. Sides of a
// sheet are those of the body's own clay.
fn side_for(key: u32, body: u32, sheet: u32) -> i32 {
    let is_own = body_of(key) == body;
    if sheet == OTHERS { return select(-1, 1, is_own); }
    return select(0, side_of(key, sheet), is_own);
}

fn sides_about(s: Stencil, body: u32, sheet: u32) -> SidesAbout {
    var about: SidesAbout;
    for (var i = 0; i < 27; i++) {
        let o = vec3i(i / 9, (i / 3) % 3, i % 3);
        let n = s.base + o;
        let slot = slot_of(n);
        if slot == 0u { continue; }
        let arm = vec3f(o) - s.f;
        let w = weight(s.f.x, o.x) * weight(s.f.y, o.y) * weight(s.f.z, o.z);
        for (var c = 0u; c < CLASSES; c++) {
            let key = key_at(slot - 1u, c);
            if c > 0u && key == 0u { break; }
            let side = side_for(key, body, sheet);
            if side == 0 { continue; }
            let mass = w * f32(sums[2u * node_place(slot, c, n)].w);
            if side > 0 {
                about.masses.x += mass;
                about.front += mass * arm;
            } else {
                about.masses.y += mass;
                about.back += mass * arm;
            }
        }
    }
    return about;
}

// The unit normal between them there, from back to front; 0 where the two sides do not meet.
fn normal_of(about: SidesAbout) -> vec3f {
    let share = about.masses / (about.masses.x + about.masses.y);
    let g = share.y * about.front - share.x * about.back;
    let size = length(g);
    if !(min(share.x, share.y) > MEETING_SHARE) || size == 0.0 { return vec3f(0.0); }
    return g / size;
}

// Whether a blade of the plan has that sheet.
fn is_spared(sheet: u32) -> bool {
    for (var t = 0u; t < params.tool_count; t++) {
        if tool_now(t).sheet == sheet { return true; }
    }
    return false;
}
