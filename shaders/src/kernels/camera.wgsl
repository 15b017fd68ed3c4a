// Where the ray of a pixel goes, and how far from the eye it starts.

struct CameraRay { origin: vec3f, direction: vec3f, beyond: f32 }

fn camera_ray(pixel: vec2u) -> CameraRay {
    let place = place_in_view(vec2f(frame.tile.xy + pixel), frame.offset, frame.size);
    let origin = across(place, frame.origin, frame.origin_right, frame.origin_up);
    let side = across(place, vec3f(0.0), frame.forward_right, frame.forward_up);
    let way = across(place, frame.forward, frame.forward_right, frame.forward_up);
    return CameraRay(origin, unit(way), way_beyond(side, frame.approach));
}
