// Contact at a node: tools, and the two sides of a kept cut.

@group(0) @binding(16) var<storage, read> side_masses: array<vec2f>;

// Two fields: untagged clay and the owner's class, and the other class.
struct Node {
    owner: u32, // the class that moves with untagged clay; 0 at a whole node, where all classes move together
    mass: vec2f,
    v: array<vec3f, 2>,
    pushed: vec3f, // impulse of tools on the node
}

// What one tool took from one node: impulse and contacts, angular impulse and |impulse|.
struct Taken { impulse: vec4f, angular: vec4f }

fn field_of(owner: u32, class_: u32) -> u32 {
    return u32(owner != 0u && class_ != 0u && class_ != owner);
}

fn touch(node: ptr<function, Node>, f: u32, t: Tool, q: vec3f, arm: vec3f, normal: vec3f, share: f32, taken: ptr<function, Taken>) {
    let before = (*node).v[f];
    push(node, f, arm, before + share * (contact(t, before, q, normal) - before), taken);
}

// A tool brings one field to the velocity `after`, and feels the opposite impulse.
fn push(node: ptr<function, Node>, f: u32, arm: vec3f, after: vec3f, taken: ptr<function, Taken>) {
    let mass = (*node).mass[f];
    if mass <= 0.0 { return; }
    let before = (*node).v[f];
    let impulse = mass * (after - before);
    (*node).v[f] = after;
    (*node).pushed += impulse;
    (*taken).impulse += vec4f(-impulse, f32(any(after != before)));
    (*taken).angular += vec4f(-cross(arm, impulse), length(impulse));
}

// Touching clay at a node, of a full cell's mass.
fn touching_at(slot: u32, k: u32) -> f32 {
    let place = touching_place(slot, k);
    return f32(sums[place / 4u][place % 4u]) / params.mass_scale * params.density_unit;
}

fn side_mass_at(n: vec3i) -> vec2f {
    let slot = slot_of(n);
    if slot == 0u { return vec2f(0.0); }
    return side_masses[(slot - 1u) * 64u + local_index(n)];
}

// The two sides of a kept cut exchange momentum while they approach.
fn exchange(node: ptr<function, Node>, n: vec3i, front: f32, back: f32) {
    let dx = side_mass_at(n + vec3i(1, 0, 0)) - side_mass_at(n - vec3i(1, 0, 0));
    let dy = side_mass_at(n + vec3i(0, 1, 0)) - side_mass_at(n - vec3i(0, 1, 0));
    let dz = side_mass_at(n + vec3i(0, 0, 1)) - side_mass_at(n - vec3i(0, 0, 1));
    let total = front + back;
    let g = 0.5 * ((back / total) * vec3f(dx.x, dy.x, dz.x) - (front / total) * vec3f(dx.y, dy.y, dz.y));
    let size = length(g);
    let f = field_of((*node).owner, 1u);
    let b = field_of((*node).owner, 2u);
    let m = (*node).mass;
    if size == 0.0 || m[f] <= 0.0 || m[b] <= 0.0 { return; }
    let normal = g / size;
    let relative = (*node).v[f] - (*node).v[b];
    let approach = dot(relative, normal);
    if approach >= 0.0 { return; }
    let slide = relative - approach * normal;
    let speed = length(slide);
    var push = -approach * normal;
    if speed > 0.0 { push -= slide / speed * min(speed, -approach * CUT_FRICTION); }
    let impulse = m[f] * m[b] / (m[f] + m[b]) * push;
    (*node).v[f] += impulse / m[f];
    (*node).v[b] -= impulse / m[b];
}
