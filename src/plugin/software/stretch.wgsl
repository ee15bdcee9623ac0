// A picture over a whole window, smooth between its pixels, and over it what is drawn in the window's own.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var picture_sampler: sampler;
// Colours times how much they cover.
@group(0) @binding(2) var overlay: texture_2d<f32>;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

// One triangle that covers the view.
@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Corner {
    let uv = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u));
    return Corner(vec4<f32>(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0, 0.0, 1.0), uv);
}

@fragment
fn fragment(corner: Corner) -> @location(0) vec4<f32> {
    let over = textureLoad(overlay, vec2<i32>(corner.position.xy), 0);
    let under = textureSample(picture, picture_sampler, corner.uv).rgb;
    return vec4<f32>(over.rgb + (1.0 - over.a) * under, 1.0);
}
