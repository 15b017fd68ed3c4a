// occlusion: samples the field around each surface for the fraction of the sky that is hidden, with a bounded
// number of evaluations per dispatch.

@group(0) @binding(2) var<storage, read> rays: array<RayState>;
@group(0) @binding(3) var<storage, read_write> queue: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read> normals: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> occlusion: array<OcclusionState>;

fn next_probe_offset(state: OcclusionState, point: vec3f, limit: f32) -> vec3f {
    return candidate_next_offset(point, state.offset, state.face, state.phase, state.value, state.gradient, limit);
}

fn probe_outcome(state: OcclusionState, point: vec3f, field: f32, next: vec3f, limit: f32) -> f32 {
    return candidate_outcome(
        point, state.gradient, state.round, state.phase, state.value, field, state.offset, state.face, next, limit
    );
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let k = line_index(id, groups);
    var item = block_item(k);
    let listed = listed_count();
    if listed > 0u {
        if k >= listed { return; }
        item = stored_item(listed_entry(k));
    }
    if !item.exists { return; }
    let ray = rays[item.index];
    if (ray.status & SHOWN) == 0u { return; }
    let camera = camera_ray(item.pixel);
    let p = point_along(camera.origin, camera.direction, ray.t);
    let normal = normals[item.index].xyz;
    let slope = normals[item.index].w;
    let side = select(1.0, -1.0, (ray.status & FROM_INSIDE) != 0u);
    let open_margin = occlusion_open_margin(ray.t, frame.rounding);
    var state = OcclusionState();
    if listed > 0u { state = occlusion[item.index]; }
#if generic
    let taps = frame.occlusion_taps;
    let hemisphere = (frame.flags & HEMISPHERE_FLAG) != 0u;
    let seed = vec3f(vec2f(frame.tile.xy + item.pixel), f32(frame.sample));
#else
    let taps = OCCLUSION_TAPS;
#end
#if hemisphere
    let seed = vec3f(vec2f(frame.tile.xy + item.pixel), f32(frame.sample));
#end
    let budget = evaluation_budget();
    for (var n = 0u; n < budget; n++) {
        if state.tap_index >= taps { break; }
#if generic
        // Both variants, since a branch on a uniform would be compiled for each of its values.
        let hemisphere_range = hemisphere_distance(state.tap_index, seed, frame.occlusion_reach);
        let hemisphere_side = hemisphere_direction(normal, state.tap_index, taps, seed);
        let five_tap_range = five_tap_distance(state.tap_index, frame.occlusion_reach);
        let distance = select(five_tap_range, hemisphere_range, hemisphere);
        let direction = select(normal, hemisphere_side, hemisphere);
        let height = select(five_tap_range, hemisphere_range * hemisphere_cosine(state.tap_index, taps), hemisphere);
        let weight = select(five_tap_weight(state.tap_index), 1.0, hemisphere);
#else
#if hemisphere
        let distance = hemisphere_distance(state.tap_index, seed, frame.occlusion_reach);
        let direction = hemisphere_direction(normal, state.tap_index, taps, seed);
        let height = distance * hemisphere_cosine(state.tap_index, taps);
        let weight = 1.0;
#else
        let distance = five_tap_distance(state.tap_index, frame.occlusion_reach);
        let direction = normal;
        let height = distance;
        let weight = five_tap_weight(state.tap_index);
#end
#end
        let point = point_along(p, direction, distance) + state.offset;
        let limit = occlusion_candidate_limit(height);
        let sample = candidate_sample_point(point, state.offset, state.face, state.phase, state.value, state.gradient, limit);
        let field = scene_distance(sample) * side;
        state.steps += 1.0;
        var clearance = field;
        if !is_nan(field) {
            let next = next_probe_offset(state, point, limit);
            let outcome = probe_outcome(state, point, field, next, limit);
            if state.phase == 0.0 {
                if occlusion_is_candidate(field, height, slope) > 0.0 {
                    state.value = field;
                    state.gradient = vec3f(0.0);
                    state.phase = 1.0;
                    continue;
                }
                if field > 0.0 { clearance = height; }
            } else if state.phase < 3.5 {
                let tap_length = candidate_tap_distance(state.value, point, limit);
                state.gradient = candidate_add_tap(state.gradient, state.phase, field - state.value, tap_length);
                state.phase += 1.0;
                continue;
            } else if outcome > MIN_PHASE_OUTCOME {
                state.phase = outcome;
                continue;
            } else if outcome == 0.0 {
                state.offset = next;
                state.face = state.gradient;
                state.round += 1.0;
                state.phase = 1.0;
                state.value = candidate_restart_value(field);
                state.gradient = vec3f(0.0);
                continue;
            } else {
                let to_surface = candidate_surface_offset(state.offset, next, state.value, field);
                clearance = select(NO_SURFACE, length3(to_surface), outcome > 0.0);
            }
        }
        let hidden = occlusion_hidden_weight(clearance + open_margin, height, distance, weight);
        if !is_nan(field) { state.hidden += hidden; }
        state.phase = 0.0;
        state.round = 0.0;
        state.offset = vec3f(0.0);
        state.face = vec3f(0.0);
        state.tap_index += 1.0;
    }
    occlusion[item.index] = state;
    if state.tap_index < taps { enqueue(item.index); }
}
