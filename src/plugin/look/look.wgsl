// Worked clay over a standard material: a fine grain in the clay's own frame, and a second, damp tone in
// hollows. Needs positions and normals alone. It imports, as `software/plain.wgsl` does and no other shader
// of the project: Bevy's lighting has no other way in.

#import bevy_pbr::{
    forward_io::{FragmentOutput, VertexOutput},
    mesh_functions::get_world_from_local,
    pbr_fragment::pbr_input_from_standard_material,
    pbr_functions::{alpha_discard, apply_pbr_lighting, main_pass_post_lighting_processing},
}

struct Look {
    damp: vec4<f32>,
    // Size of the grain [m], its height over its size, radius of a hollow that is wholly damp [m], strength
    // of the tones.
    grain_size: f32,
    grain: f32,
    crevice: f32,
    tone: f32,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(100) var<uniform> look: Look;

// Octaves of the grain, each about twice as fine as the one before: their number is most of what the look
// costs.
const OCTAVES: i32 = 3;

// A number in 0..1 that belongs to a cell.
fn chance(cell: vec3<i32>) -> f32 {
    var h = bitcast<u32>(cell.x) * 0x8da6b343u ^ bitcast<u32>(cell.y) * 0xd8163841u ^ bitcast<u32>(cell.z) * 0xcb1ab31fu;
    h = (h ^ (h >> 15u)) * 0x2c1b3c6du;
    h = h ^ (h >> 12u);
    return f32(h & 0xffffu) / 65535.0;
}

// Smooth noise in -1..1 and its gradient [1 / cell], as (gradient, value).
fn noise(at: vec3<f32>) -> vec4<f32> {
    let cell = vec3<i32>(floor(at));
    let f = at - floor(at);
    let u = f * f * (3.0 - 2.0 * f);
    let du = 6.0 * f * (1.0 - f);
    let a = chance(cell);
    let b = chance(cell + vec3<i32>(1, 0, 0));
    let c = chance(cell + vec3<i32>(0, 1, 0));
    let d = chance(cell + vec3<i32>(1, 1, 0));
    let e = chance(cell + vec3<i32>(0, 0, 1));
    let g = chance(cell + vec3<i32>(1, 0, 1));
    let h = chance(cell + vec3<i32>(0, 1, 1));
    let k = chance(cell + vec3<i32>(1, 1, 1));
    let low = mix(mix(a, b, u.x), mix(c, d, u.x), u.y);
    let high = mix(mix(e, g, u.x), mix(h, k, u.x), u.y);
    let dx = mix(mix(b - a, d - c, u.y), mix(g - e, k - h, u.y), u.z);
    let dy = mix(mix(c - a, d - b, u.x), mix(h - e, k - g, u.x), u.z);
    return vec4<f32>(2.0 * vec3<f32>(dx, dy, high - low) * du, 2.0 * mix(low, high, u.z) - 1.0);
}

// Octaves of the grain, each flatter than the one before: (gradient, value). What is finer than `footprint`,
// in cells of the coarsest, fades.
fn grain(at: vec3<f32>, footprint: f32) -> vec4<f32> {
    var sum = vec4<f32>(0.0);
    var scale = 1.0;
    var height = 1.0;
    for (var octave = 0; octave < OCTAVES; octave++) {
        let seen = 1.0 - smoothstep(0.25, 0.75, footprint * scale);
        if (seen <= 0.0) {
            break;
        }
        let n = noise(at * scale + vec3<f32>(17.3 * scale));
        sum += seen * height * vec4<f32>(n.xyz, n.w / scale);
        height *= 0.6;
        scale *= 2.17;
    }
    return sum;
}

@fragment
fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) -> FragmentOutput {
    var pbr = pbr_input_from_standard_material(in, is_front);
    let world_from_local = get_world_from_local(in.instance_index);
    let turn = mat3x3<f32>(world_from_local[0].xyz, world_from_local[1].xyz, world_from_local[2].xyz);
    // The clay's own frame is scaled uniformly.
    let scale = length(turn[0]);
    let local = (transpose(turn) * (in.world_position.xyz - world_from_local[3].xyz)) / (scale * scale);

    // How the normal turns from pixel to pixel, over the way [1/m]: positive in hollows.
    let right = dpdx(in.world_position.xyz);
    let down = dpdy(in.world_position.xyz);
    let normal = normalize(in.world_normal);
    let bend = -(dot(dpdx(normal), right) / max(dot(right, right), 1e-12) + dot(dpdy(normal), down) / max(dot(down, down), 1e-12));
    let hollow = clamp(0.7 * bend * scale * look.crevice, -1.0, 1.0);

    let cell = max(look.grain_size, 1e-6);
    let footprint = max(length(right), length(down)) / (scale * cell);
    let fine = grain(local / cell, footprint);
    let slope = turn * fine.xyz / scale;
    let along = slope - normal * dot(slope, normal);
    pbr.N = normalize(pbr.N - look.grain * along * select(-1.0, 1.0, is_front));

    // Ridges are dry and light, hollows and the grain's pits damp, dark and smoother.
    let damp = clamp(look.tone * (hollow - 0.15 * fine.w), -0.6, 1.0);
    let base = pbr.material.base_color.rgb;
    let wet = mix(base, look.damp.rgb, max(damp, 0.0));
    pbr.material.base_color = vec4<f32>(wet * (1.0 + 0.35 * max(-damp, 0.0)), pbr.material.base_color.a);
    pbr.material.perceptual_roughness = clamp(pbr.material.perceptual_roughness - 0.3 * max(damp, 0.0) - 0.12 * damp, 0.2, 1.0);
    pbr.material.base_color = alpha_discard(pbr.material, pbr.material.base_color);

    var out: FragmentOutput;
    out.color = main_pass_post_lighting_processing(pbr, apply_pbr_lighting(pbr));
    return out;
}
