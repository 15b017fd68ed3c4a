// occlusion: samples the field around each surface for how much of the sky is hidden; a bounded number
// of evaluations at a time.

@group(0) @binding(2) var<storage, read> rays: array<Ray>;
@group(0) @binding(3) var<storage, read_write> queue: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read> normals: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> occlusion: array<OcclusionRay>;

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
    let slope = normals[item.index].w;
    let side = select(1.0, -1.0, (ray.status & FROM_INSIDE) != 0u);
    // What rounding may take from the field counts as open.
    let unsure = rounding_at(ray.t, frame.rounding);
    var around = OcclusionRay(vec3f(0.0), 0.0, vec3f(0.0), 0.0, 0.0, 0.0, 0.0, 0.0);
    if listed > 0u { around = occlusion[item.index]; }
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
        if around.tap >= taps { break; }
#if general
        // Both, since a branch by a uniform would be compiled for each of its values.
        let far = many_distance(around.tap, place, frame.occlusion_reach);
        let aside = many_direction(normal, around.tap, taps, place);
        let near = five_distance(around.tap, frame.occlusion_reach);
        let distance = select(near, far, hemisphere);
        let direction = select(normal, aside, hemisphere);
        let height = select(near, far * many_cosine(around.tap, taps), hemisphere);
        let weight = select(five_weight(around.tap), 1.0, hemisphere);
#else
#if many
        let distance = many_distance(around.tap, place, frame.occlusion_reach);
        let direction = many_direction(normal, around.tap, taps, place);
        let height = distance * many_cosine(around.tap, taps);
        let weight = 1.0;
#else
        let distance = five_distance(around.tap, frame.occlusion_reach);
        let direction = normal;
        let height = distance;
        let weight = five_weight(around.tap);
#end
#end
        let at = along(p, direction, distance) + around.offset;
        let limit = occlusion_limit(height);
        let sampled = claim_place(at, around.offset, around.phase, around.value, around.gradient, limit);
        let field = scene_distance(sampled) * side;
        around.steps += 1.0;
        var clear = field;
        if !is_nan(field) {
            let next = claim_offset(at, around.offset, around.phase, around.value, around.gradient, limit);
            let outcome = claim_outcome(
                at, around.gradient, around.round, around.phase, around.value, field, around.offset, next, limit
            );
            if around.phase == 0.0 {
                if occlusion_claims(field, height, slope) > 0.0 {
                    around.value = field;
                    around.gradient = vec3f(0.0);
                    around.phase = 1.0;
                    continue;
                }
                if field > 0.0 { clear = height; }
            } else if around.phase < 3.5 {
                let sideways = claim_apart(around.value, at, limit);
                around.gradient = claim_gradient(around.gradient, around.phase, field - around.value, sideways);
                around.phase += 1.0;
                continue;
            } else if outcome == TOO_FAR {
                around.phase += 1.0;
                continue;
            } else if outcome == 0.0 {
                around.offset = next;
                around.round += 1.0;
                around.phase = 1.0;
                around.value = claim_repeated(field);
                around.gradient = vec3f(0.0);
                continue;
            } else {
                let way = claim_surface(around.offset, next, around.value, field);
                clear = select(NOTHING, length3(way), outcome > 0.0);
            }
        }
        let hidden = occlusion_hidden(clear + unsure, height, distance, weight);
        if !is_nan(field) { around.hidden += hidden; }
        around.phase = 0.0;
        around.round = 0.0;
        around.offset = vec3f(0.0);
        around.tap += 1.0;
    }
    occlusion[item.index] = around;
    if around.tap < taps { enqueue(item.index); }
}
