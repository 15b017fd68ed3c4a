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
