// Where the ray of a pixel goes.

struct CameraRay { origin: vec3f, direction: vec3f }

fn camera_ray(pixel: vec2u) -> CameraRay {
    let place = place_in_view(vec2f(frame.tile.xy + pixel), frame.offset, frame.size);
    let origin = across(place, frame.origin, frame.origin_right, frame.origin_up);
    let direction = unit(across(place, frame.forward, frame.forward_right, frame.forward_up));
    return CameraRay(origin, direction);
}
