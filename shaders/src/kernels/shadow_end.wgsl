// Returns the end of a ray to a light of the `size` at `light_t`. Beyond it, no solid is as near as the light is wide.
fn shadow_end(origin: vec3f, direction: vec3f, light_t: f32, size: f32) -> f32 {
    let end = shadow_exit(origin, direction, frame.bounds_min, frame.bounds_max, light_t, size);
#if half_spaces
    if frame.half_space_count > 0u {
        var last = shadow_exit(origin, direction, frame.box_min, frame.box_max, light_t, size);
        for (var i = 0u; i < frame.half_space_count; i++) {
            let plane = frame.half_spaces[i];
            last = max(last, shadow_half_space_exit(origin, direction, plane.xyz, plane.w, light_t, size));
        }
        return min(end, last);
    }
#end
    return end;
}
