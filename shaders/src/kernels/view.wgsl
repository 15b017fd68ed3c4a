// view: a debug view of the end of each ray.

@group(0) @binding(2) var<storage, read> rays: array<RayState>;
#if normal
@group(0) @binding(4) var<storage, read> normals: array<vec4f>;
#end
#if materials
@group(0) @binding(5) var<storage, read> surfaces: array<Surface>;
#end
@group(0) @binding(8) var<storage, read_write> colors: array<vec4f>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let item = block_item(line_index(id, groups));
    if !item.exists { return; }
    let ray = rays[item.index];
    var color = vec4f(0.0);
#if steps
    color = vec4f(heat(f32(ray.steps) / f32(frame.max_steps)), 1.0);
#else
    if (ray.status & SHOWN) != 0u {
#if albedo
#if materials
        color = vec4f(surfaces[item.index].albedo, 1.0);
#else
        color = vec4f(frame.albedo, 1.0);
#end
#end
#if normal
        color = vec4f(direction_color(normals[item.index].xyz), 1.0);
#end
#if depth
        color = vec4f(depth_color(ray.t + camera_ray(item.pixel).start_excess, frame.depth_range), 1.0);
#end
#if id
#if materials
        color = vec4f(id_color(surfaces[item.index].id), 1.0);
#else
        color = vec4f(id_color(frame.id), 1.0);
#end
#end
#if mask
        color = vec4f(1.0);
#end
    }
#end
    color += select(vec4f(0.0), colors[item.index], frame.sample > 0u);
    colors[item.index] = color;
}
