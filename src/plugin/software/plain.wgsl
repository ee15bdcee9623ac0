// Light as a processor can afford it: what a surface scatters of the sun and of what is all around, a soft
// shine, and a second tone in hollows.

#import bevy_pbr::{forward_io::VertexOutput, mesh_view_bindings::{lights, view}}
#ifdef TONEMAP_IN_SHADER
#import bevy_core_pipeline::tonemapping::tone_mapping
#endif

struct Plain {
    colour: vec4<f32>,
    damp: vec4<f32>,
    // Radius of a hollow that is wholly damp [m], strength of the tones, of the shine.
    crevice: f32,
    tone: f32,
    shine: f32,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> plain: Plain;

@fragment
fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) -> @location(0) vec4<f32> {
    let normal = normalize(in.world_normal) * select(-1.0, 1.0, is_front);
    let to_eye = normalize(view.world_position - in.world_position.xyz);

    // How the normal turns from pixel to pixel, over the way [1/m]: positive in hollows.
    let right = dpdx(in.world_position.xyz);
    let down = dpdy(in.world_position.xyz);
    let bend = -(dot(dpdx(normal), right) / max(dot(right, right), 1e-12) + dot(dpdy(normal), down) / max(dot(down, down), 1e-12));
    let damp = clamp(plain.tone * clamp(0.7 * bend * plain.crevice, -1.0, 1.0), -0.6, 1.0);
    let base = mix(plain.colour.rgb, plain.damp.rgb, max(damp, 0.0)) * (1.0 + 0.35 * max(-damp, 0.0));

    var scattered = lights.ambient_color.rgb;
    var shine = vec3<f32>(0.0);
    for (var i = 0u; i < lights.n_directional_lights; i++) {
        let to_light = lights.directional_lights[i].direction_to_light;
        let light = lights.directional_lights[i].color.rgb * max(dot(normal, to_light), 0.0);
        let halfway = max(dot(normal, normalize(to_light + to_eye)), 0.0);
        let square = halfway * halfway;
        scattered += light * 0.31831;
        shine += light * (square * square * square * square);
    }
    var out = vec4<f32>(view.exposure * (base * scattered + plain.shine * shine), plain.colour.a);
#ifdef TONEMAP_IN_SHADER
    out = tone_mapping(out, view.color_grading);
#endif
    return out;
}
