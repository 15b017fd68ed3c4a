// surface: the material of each surface.

@group(0) @binding(2) var<storage, read> rays: array<RayState>;
@group(0) @binding(4) var<storage, read> normals: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> surfaces: array<Surface>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let item = block_item(line_index(id, groups));
    if !item.exists { return; }
    let ray = rays[item.index];
    if (ray.status & SHOWN) == 0u { return; }
    let camera = camera_ray(item.pixel);
    let p = point_along(camera.origin, camera.direction, ray.t);
    let normal = normals[item.index].xyz;
    let side = select(1.0, -1.0, (ray.status & FROM_INSIDE) != 0u);
    let rounding = rounding_near(p, rounding_at(ray.t, frame.rounding), frame.least_rounding);
    let depth = inside_depth(rounding) * side;
    surfaces[item.index] = scene_surface(point_along(p, normal, -depth), normal);
}
