// edges: lines where a ray's end and that of its right or lower neighbour do not belong together.

@group(0) @binding(2) var<storage, read> rays: array<Ray>;
@group(0) @binding(4) var<storage, read> normals: array<vec4f>;
#if materials
@group(0) @binding(5) var<storage, read> surfaces: array<Surface>;
#end
@group(0) @binding(8) var<storage, read_write> colors: array<vec4f>;

struct End { p: vec3f, normal: vec3f, id: f32, shown: bool }

fn end_of(pixel: vec2u) -> End {
    let index = pixel.y * frame.tile.z + pixel.x;
    let ray = rays[index];
    let camera = camera_ray(pixel);
    let p = along(camera.origin, camera.direction, ray.t);
#if materials
    let id = surfaces[index].id;
#else
    let id = frame.id;
#end
    return End(p, normals[index].xyz, id, (ray.status & SHOWN) != 0u);
}

fn edge(here: End, there: End, half: f32) -> f32 {
    if !here.shown && !there.shown { return 0.0; }
    let both = select(0.0, 1.0, here.shown == there.shown);
    return edge_between(
        here.p, here.normal, here.id, there.p, there.normal, there.id, half, both
    );
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let item = block_item(line_index(id, groups));
    if !item.exists { return; }
    let ray = rays[item.index];
    let half = half_pixel(ray.t, frame.footprint, frame.footprint_growth);
    let here = end_of(item.pixel);
    let right = end_of(min(item.pixel + vec2u(1u, 0u), frame.tile.zw - 1u));
    let below = end_of(min(item.pixel + vec2u(0u, 1u), frame.tile.zw - 1u));
    let line = max(edge(here, right, half), edge(here, below, half));
    let shown = select(0.0, 1.0, here.shown);
    var color = vec4f(edge_color(line, paper(here.normal, camera_ray(item.pixel).direction)), shown);
    color += select(vec4f(0.0), colors[item.index], frame.sample > 0u);
    colors[item.index] = color;
}
