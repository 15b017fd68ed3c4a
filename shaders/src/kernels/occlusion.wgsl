// occlusion: asks the field around each surface how much of the sky is hidden; a bounded number
// of taps at a time.

@group(0) @binding(2) var<storage, read> rays: array<Ray>;
@group(0) @binding(3) var<storage, read_write> queue: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read> normals: array<vec4f>;
// What is hidden so far, and how many taps were taken.
@group(0) @binding(7) var<storage, read_write> occlusion: array<vec2f>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let k = line_index(id, groups);
    var item = block_item(k);
    let listed = entries_listed();
    if listed > 0u {
        if k >= listed { return; }
        item = stored_item(resumed(k));
    }
    if !item.exists { return; }
    let ray = rays[item.index];
    if (ray.status & SHOWN) == 0u { return; }
    let camera = camera_ray(item.pixel);
    let p = along(camera.origin, camera.direction, ray.t);
    let normal = normals[item.index].xyz;
    let side = select(1.0, -1.0, (ray.status & FROM_INSIDE) != 0u);
    // What rounding may take from the field counts as open.
    let unsure = rounding_at(ray.t, frame.rounding);
    var state = vec2f(0.0);
    if listed > 0u { state = occlusion[item.index]; }
#if general
    let taps = frame.occlusion_taps;
    let hemisphere = (frame.choices & HEMISPHERE) != 0u;
    let place = vec3f(vec2f(frame.tile.xy + item.pixel), f32(frame.sample));
#else
    let taps = TAPS;
#end
#if many
    let place = vec3f(vec2f(frame.tile.xy + item.pixel), f32(frame.sample));
#end
    let budget = evaluations_left();
    for (var n = 0u; n < budget; n++) {
        if state.y >= taps { break; }
#if general
        // Both, since a branch by a uniform would be compiled for each of its values.
        let far = many_distance(state.y, place, frame.occlusion_reach);
        let aside = many_direction(normal, state.y, taps, place);
        let near = five_distance(state.y, frame.occlusion_reach);
        let distance = select(near, far, hemisphere);
        let direction = select(normal, aside, hemisphere);
        let height = select(near, far * many_cosine(state.y, taps), hemisphere);
        let weight = select(five_weight(state.y), 1.0, hemisphere);
#else
#if many
        let distance = many_distance(state.y, place, frame.occlusion_reach);
        let direction = many_direction(normal, state.y, taps, place);
        let height = distance * many_cosine(state.y, taps);
        let weight = 1.0;
#else
        let distance = five_distance(state.y, frame.occlusion_reach);
        let direction = normal;
        let height = distance;
        let weight = five_weight(state.y);
#end
#end
        let field = scene_distance(along(p, direction, distance)) * side;
        let hidden = occlusion_hidden(field + unsure, height, distance, weight);
        if !is_nan(field) { state.x += hidden; }
        state.y += 1.0;
    }
    occlusion[item.index] = state;
    if state.y < taps { enqueue(item.index); }
}
