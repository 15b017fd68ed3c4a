// canvas: the picture, over all of its place in the window, as it is or dimmed.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var between: sampler;

struct Corner {
    @builtin(position) position: vec4f,
    @location(0) place: vec2f,
}

// A triangle that covers the place, with the picture's upper left corner at (0, 0).
@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let place = vec2f(f32(index & 1u), f32(index >> 1u)) * 2.0;
    return Corner(vec4f(place.x * 2.0 - 1.0, 1.0 - place.y * 2.0, 0.0, 1.0), place);
}

@fragment
fn plain(corner: Corner) -> @location(0) vec4f {
    return vec4f(textureSample(picture, between, corner.place).rgb, 1.0);
}

@fragment
fn dimmed(corner: Corner) -> @location(0) vec4f {
    return vec4f(textureSample(picture, between, corner.place).rgb * 0.41, 1.0);
}
