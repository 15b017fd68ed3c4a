// The ray of a pixel. Its start is farther from the camera by `start_excess` than that of the middle ray.

struct CameraRay { origin: vec3f, direction: vec3f, start_excess: f32 }

fn camera_ray(pixel: vec2u) -> CameraRay {
    return camera_ray_at(vec2f(frame.tile.xy + pixel));
}

// Returns the ray of a position in the picture, in pixels.
fn camera_ray_at(pixel: vec2f) -> CameraRay {
    let position = view_position(pixel, frame.offset, frame.size);
    let origin = interpolate_view(position, frame.origin, frame.origin_right, frame.origin_up);
    let offset = interpolate_view(position, vec3f(0.0), frame.forward_right, frame.forward_up);
    let direction = interpolate_view(position, frame.forward, frame.forward_right, frame.forward_up);
    return CameraRay(origin, unit(direction), start_excess(offset, frame.approach));
}

// Returns the distances at which a ray enters and leaves the space in which it may meet a surface.
fn camera_segment(camera: CameraRay) -> vec2f {
    let origin = camera.origin;
    let direction = camera.direction;
    if frame.half_space_count == 0u {
        return intersect_box(origin, direction, frame.bounds_min, frame.bounds_max, frame.far);
    }
    let bounds = intersect_box(origin, direction, frame.bounds_min, frame.bounds_max, frame.extended_far);
    let finite = intersect_box(origin, direction, frame.finite_min, frame.finite_max, frame.far);
    var end = select(0.0, finite.y, finite.x <= finite.y);
    for (var i = 0u; i < frame.half_space_count; i++) {
        let plane = frame.half_spaces[i];
        let solid_depth = select(1e30, frame.solid_depth, i < frame.solid_half_space_count);
        let exit = half_space_exit(
            origin, direction, plane.xyz, plane.w, solid_depth, frame.far, frame.extended_far
        );
        if exit < 0.0 { return vec2f(bounds.x, exit); }
        end = max(end, exit);
    }
    return vec2f(bounds.x, min(bounds.y, end));
}
