// resolve: from the sum of all samples to the bytes of a picture.

@group(0) @binding(8) var<storage, read> colors: array<vec4f>;
@group(0) @binding(9) var<storage, read_write> pixels: array<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let item = block_item(line_index(id, groups));
    if !item.exists { return; }
    var color = colors[item.index].xyz / f32(frame.samples);
#if exposed
    color = color * frame.exposure;
#end
#if reinhard
    color = tone_reinhard(color);
#end
#if filmic
    color = tone_filmic(color);
#end
#if encoded
    color = srgb_encode(color);
#end
    pixels[item.index] = u32(to_byte(color.x)) | u32(to_byte(color.y)) << 8u
        | u32(to_byte(color.z)) << 16u | 0xff000000u;
}
