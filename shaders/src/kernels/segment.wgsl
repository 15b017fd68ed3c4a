// The part of a ray on which it may meet a surface. Parts other than exact half spaces lie from `crowd_enter` to
// `crowd_exit`, and the first exact half space at `plane_t`.
struct CameraSegment { enter: f32, exit: f32, crowd_enter: f32, crowd_exit: f32, plane_t: f32 }

fn camera_segment(camera: CameraRay) -> CameraSegment {
    let origin = camera.origin;
    let direction = camera.direction;
#if half_spaces
    if frame.half_space_count > 0u { return enclosed_segment(origin, direction); }
#end
    let bounds = intersect_box(origin, direction, frame.bounds_min, frame.bounds_max, frame.far);
    return CameraSegment(bounds.x, bounds.y, 0.0, NEVER, NEVER);
}

#if half_spaces
// Returns that part of a ray through an endless scene.
fn enclosed_segment(origin: vec3f, direction: vec3f) -> CameraSegment {
    let bounds = intersect_box(origin, direction, frame.bounds_min, frame.bounds_max, frame.extended_far);
    let finite = intersect_box(origin, direction, frame.box_min, frame.box_max, frame.far);
    let meets_finite = finite.x <= finite.y;
    var end = select(0.0, finite.y, meets_finite);
    var crowd = vec2f(select(NEVER, finite.x, meets_finite), end);
    var plane_t = NEVER;
    var is_buried = false;
    for (var i = 0u; i < frame.half_space_count; i++) {
        let plane = frame.half_spaces[i];
        let solid_depth = select(NEVER, frame.solid_depth, i < frame.solid_half_space_count);
        let exit = half_space_exit(
            origin, direction, plane.xyz, plane.w, solid_depth, frame.far, frame.extended_far
        );
        is_buried = is_buried || exit < 0.0;
        end = max(end, exit);
        let entry = half_space_entry(origin, direction, plane.xyz, plane.w);
        if i < frame.exact_half_space_count {
            plane_t = min(plane_t, entry);
        } else {
            crowd = vec2f(min(crowd.x, entry), max(crowd.y, exit));
        }
    }
    end = select(min(bounds.y, end), -1.0, is_buried);
    return CameraSegment(max(bounds.x, free_start(crowd.x, plane_t)), end, crowd.x, crowd.y, plane_t);
}
#end
