// plane: the field where each ray meets the plane through the view's centre.

@group(0) @binding(2) var<storage, read_write> rays: array<RayState>;
#if material_colors
#if materials
@group(0) @binding(5) var<storage, read_write> surfaces: array<Surface>;
#end
#end
@group(0) @binding(8) var<storage, read_write> colors: array<vec4f>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let item = block_item(line_index(id, groups));
    if !item.exists { return; }
    let camera = camera_ray(item.pixel);
    let t = intersect_plane(camera.origin, camera.direction, frame.centre, frame.forward);
    let p = point_along(camera.origin, camera.direction, t);
    let distance = scene_distance(p);
    var ray = RayState(t, distance, 0.0, 0.0, t, distance, MISS, 1u);
    if is_nan(distance) {
        ray.status = NOT_A_NUMBER;
    } else if distance < 0.0 {
        ray.status = HIT | SHOWN;
    }
    rays[item.index] = ray;
    let pixel = 2.0 * half_pixel(t, frame.half_pixel_size, frame.half_pixel_growth);
#if distance
    var color = vec4f(distance_color(distance, frame.spacing, pixel), 1.0);
#else
    let covered = coverage(distance, pixel);
#if material_colors
#if materials
    let surface = scene_surface(p, -frame.forward);
    surfaces[item.index] = surface;
    let material_color = surface.albedo;
#else
    let material_color = frame.albedo;
#end
    var color = vec4f(frame.sky_horizon + (material_color - frame.sky_horizon) * covered, covered);
#else
    var color = vec4f(vec3f(covered), covered);
#end
#end
    if ray.status == NOT_A_NUMBER { color = vec4f(0.0); }
    color += select(vec4f(0.0), colors[item.index], frame.sample > 0u);
    colors[item.index] = color;
}
