// canvas: draws the picture over its whole area of the window, plain or dimmed.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var picture_sampler: sampler;

struct VertexOutput {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
}

// A triangle that covers the area; uv (0, 0) is the upper left corner of the picture.
@vertex
fn corner(@builtin(vertex_index) index: u32) -> VertexOutput {
    let uv = vec2f(f32(index & 1u), f32(index >> 1u)) * 2.0;
    return VertexOutput(vec4f(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0, 0.0, 1.0), uv);
}

@fragment
fn plain(corner: VertexOutput) -> @location(0) vec4f {
    return vec4f(textureSample(picture, picture_sampler, corner.uv).rgb, 1.0);
}

@fragment
fn dimmed(corner: VertexOutput) -> @location(0) vec4f {
    return vec4f(textureSample(picture, picture_sampler, corner.uv).rgb * 0.41, 1.0);
}
