// edges: lines between a pixel and its right or lower neighbour, where depth, direction or material differ.

@group(0) @binding(2) var<storage, read> rays: array<RayState>;
@group(0) @binding(4) var<storage, read> normals: array<vec4f>;
#if materials
@group(0) @binding(5) var<storage, read> surfaces: array<Surface>;
#end
@group(0) @binding(8) var<storage, read_write> colors: array<vec4f>;

struct RayEnd { p: vec3f, normal: vec3f, id: f32, shown: bool }

fn ray_end(pixel: vec2u) -> RayEnd {
    let index = pixel.y * frame.tile.z + pixel.x;
    let ray = rays[index];
    let camera = camera_ray(pixel);
    let p = point_along(camera.origin, camera.direction, ray.t);
#if materials
    let id = surfaces[index].id;
#else
    let id = frame.id;
#end
    return RayEnd(p, normals[index].xyz, id, (ray.status & SHOWN) != 0u);
}

fn edge(first: RayEnd, second: RayEnd, half: f32) -> f32 {
    if !first.shown && !second.shown { return 0.0; }
    let same_coverage = select(0.0, 1.0, first.shown == second.shown);
    return edge_between(
        first.p, first.normal, first.id, second.p, second.normal, second.id, half, same_coverage
    );
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let item = block_item(line_index(id, groups));
    if !item.exists { return; }
    let ray = rays[item.index];
    let half = half_pixel(ray.t, frame.half_pixel_size, frame.half_pixel_growth);
    let centre = ray_end(item.pixel);
    let right = ray_end(min(item.pixel + vec2u(1u, 0u), frame.tile.zw - 1u));
    let below = ray_end(min(item.pixel + vec2u(0u, 1u), frame.tile.zw - 1u));
    let line = max(edge(centre, right, half), edge(centre, below, half));
    let shown = select(0.0, 1.0, centre.shown);
    var color = vec4f(edge_color(line, paper_color(centre.normal, camera_ray(item.pixel).direction)), shown);
    color += select(vec4f(0.0), colors[item.index], frame.sample > 0u);
    colors[item.index] = color;
}
