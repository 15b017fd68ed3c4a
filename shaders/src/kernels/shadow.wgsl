// shadow: advances each ray towards a light by a bounded number of evaluations; all lights at once.

@group(0) @binding(1) var<uniform> lights: array<LightRecord, LIGHT_COUNT>;
@group(0) @binding(2) var<storage, read> rays: array<RayState>;
@group(0) @binding(3) var<storage, read_write> queue: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read> normals: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> shadows: array<ShadowRayState>;

fn next_stride(light: LightRecord, field: f32, t: f32, min_step: f32, size: f32) -> f32 {
#if short_stride
    if size > 0.0 && (light.shadow_form == SHADOW_PLAIN || light.shadow_form == SHADOW_SIZED) {
        return shadow_short_stride(field, t, min_step, size);
    }
#end
    return shadow_stride(field, t, min_step, size);
}

// Reports whether a surface beside a candidate hides more at the end of the ray, which is checked, too.
fn is_left_to_end(ray: ShadowRayState, to_surface: vec3f, direction: vec3f, t_end: f32) -> bool {
    let hides_most = shadow_hides_most_at_end(to_surface, ray.gradient, direction, t_end - ray.candidate_t);
    return ray.next_check_t < NO_NEXT_CHECK && hides_most > 0.0;
}

// Returns the visibility after a probe of a ray to the centre of a light, which found a surface.
fn probed_visibility(
    ray: ShadowRayState, to_surface: vec3f, direction: vec3f, t_end: f32, shadow_form: u32
) -> f32 {
    return shadow_visibility_beside(
        ray.visibility, to_surface, ray.gradient, direction, ray.candidate_t, ray.size, ray.value, ray.round, t_end,
        select(HALF_VISIBILITY, 0.0, shadow_form == SHADOW_SIZED)
    );
}

// Forgets the rounds of a probe.
fn forget_rounds(ray: ptr<function, ShadowRayState>) {
    (*ray).round = 0.0;
    (*ray).offset = vec3f(0.0);
    (*ray).face = vec3f(0.0);
    (*ray).gradient = vec3f(0.0);
}

// Returns the state of a ray to the centre of a light.
fn new_ray(light: LightRecord, start_t: f32) -> ShadowRayState {
    var ray: ShadowRayState;
    ray.t = start_t;
    ray.visibility = 1.0;
    ray.last_visibility = 1.0;
    ray.candidate_t = NO_CANDIDATE;
    ray.size = light.size;
    ray.best_visibility = -1.0;
    ray.clear_t = start_t;
    return ray;
}

#if proved_steps
fn proves_steps() -> bool { return 0.0 < frame.step_factor && frame.step_factor < 1.0; }

// Returns the distance of the next sample on a step. Between probes, `value` is the distance up to which the step is proved.
fn next_sample_t(ray: ShadowRayState, min_step: f32) -> f32 {
    if !proves_steps() || ray.phase > 0.0 { return ray.t; }
    let from_t = ray.t - ray.step;
    let min_sample_step = shadow_stride(0.0, from_t, min_step, ray.size);
    return first_sample_t(from_t, ray.field_before, frame.step_factor, min_sample_step, ray.t, ray.value);
}

// Takes a sample on a step, and reports whether it proves a part of it. Otherwise the step ends there.
fn proves_part_of_step(
    ray: ptr<function, ShadowRayState>, sample_t: f32, field: f32, rounding: f32, min_step: f32
) -> bool {
    let step = (*ray).step - ((*ray).t - sample_t);
    let slope = shadow_slope(field, (*ray).field_before, step);
    if field >= -sign_margin(rounding, slope, frame.is_raw) {
        let min_sample_step = shadow_stride(0.0, sample_t, min_step, (*ray).size);
        (*ray).value = later_sample_t(sample_t, field, frame.step_factor, min_sample_step, (*ray).t);
        return true;
    }
    (*ray).t = sample_t;
    (*ray).step = step;
    return false;
}

#end
#if sized
// Prepares the state of a ray for one to the rim of the light.
fn restart_ray(ray: ptr<function, ShadowRayState>) {
    (*ray).visibility = 0.0;
    (*ray).last_visibility = NO_LAST_VISIBILITY;
    (*ray).next_check_t = 0.0;
    (*ray).value = 0.0;
    (*ray).field_before = 0.0;
    (*ray).step = 0.0;
    (*ray).slope_before = 0.0;
    (*ray).steps_before = f32((*ray).steps & ~DONE_FLAG);
}

#end
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let k = line_index(id, groups);
    let blocks = ((frame.tile.z + 7u) / 8u) * ((frame.tile.w + 7u) / 8u);
    var item = block_item(k % (blocks * 64u));
    var light_index = k / (blocks * 64u);
    let listed = listed_count();
    if listed > 0u {
        if k >= listed { return; }
        let entry = listed_entry(k);
        item = stored_item(entry % tile_pixels());
        light_index = entry / tile_pixels();
    }
    if !item.exists || light_index >= frame.light_count { return; }
    let light = lights[light_index];
    let slot = light_index * tile_pixels() + item.index;
    let primary = rays[item.index];
    let camera = camera_ray(item.pixel);
    let p = point_along(camera.origin, camera.direction, primary.t);
    let normal = normals[item.index].xyz;
    let half = half_pixel(primary.t, frame.half_pixel_size, frame.half_pixel_growth);
    let rounding = rounding_at(primary.t, frame.rounding);
    let is_sharp = select(0.0, 1.0, light.shadow_form == SHADOW_HARD);
    let height = lift(p, half, rounding, is_sharp);
    let start = point_along(p, normal, height);
    // From the start of the ray, so that it ends at the light and not beside it.
    let to_light = light.position - start * light.is_positional;
    let axis = unit(to_light);
    let light_t = select(frame.light_far, min(frame.light_far, length3(to_light)), light.is_positional > 0.0);
    let min_step = shadow_min_step(half, height);
    let start_t = shadow_start(min_step, is_sharp);
    let side = select(1.0, -1.0, (primary.status & FROM_INSIDE) != 0u);
    var ray = new_ray(light, start_t);
    if listed > 0u {
        ray = shadows[slot];
    } else if (primary.status & SHOWN) == 0u || light.shadow_form == SHADOW_NONE {
        ray.steps = DONE_FLAG;
    } else if cosine_between(normal, unit(light.position - p * light.is_positional)) <= 0.0 {
        ray.visibility = -1.0;
        ray.steps = DONE_FLAG;
    }
    var origin = start;
    var direction = axis;
    var exit_t = shadow_end(start, axis, light_t, ray.size);
#if sized
    var rim = shadow_rim_direction(axis, ray.ray_number);
    if ray.ray_number >= 1.0 {
        direction = shadow_rim_ray_direction(axis, rim, ray.size);
        let plane_t = shadow_light_plane(direction, axis, light_t);
        exit_t = shadow_end(start, direction, plane_t, ray.size);
        if ray.size == 0.0 {
            origin = point_along(start, axis, light_t);
            direction = rim;
            exit_t = shadow_required_room(light_t, light.size);
        }
    }
#end
    let budget = evaluation_budget();
    for (var n = 0u; n < budget; n++) {
        if ray.steps >= DONE_FLAG { break; }
        let is_probing = ray.phase > 0.0;
#if proved_steps
        let sample_t = next_sample_t(ray, min_step);
#else
        let sample_t = ray.t;
#end
        let point = point_along(origin, direction, select(sample_t, ray.candidate_t, is_probing)) + ray.offset;
        let limit = shadow_candidate_limit(ray.candidate_t, ray.size);
        let sample = candidate_sample_point(point, ray.offset, ray.face, ray.phase, ray.value, ray.gradient, limit);
        let field = scene_distance(sample) * side;
        let checks_all = light.checks > 0.5;
#if proved_steps
        if !is_probing && sample_t < ray.t {
            let value_rounding = rounding_near(point, rounding, frame.least_rounding);
            if proves_part_of_step(&ray, sample_t, field, value_rounding, min_step) { continue; }
        }
#end
        ray.steps += select(1u, 0u, is_probing && checks_all);
        if is_nan(field) {
            ray.steps |= DONE_FLAG;
            break;
        }
        let out_of_steps = f32(ray.steps) - ray.steps_before >= f32(frame.max_shadow_steps);
        // For lights with a size, other rays may follow.
        var ray_ends = false;
#if sized
        let is_sized = light.shadow_form == SHADOW_SIZED;
        let is_rim = ray.ray_number >= 1.0;
        let dark_visibility = select(0.0, select(MAX_HIDDEN_VISIBILITY, -1.0, is_rim), is_sized);
#else
        let dark_visibility = 0.0;
#end
        if is_probing {
            let next = candidate_next_offset(
                point, ray.offset, ray.face, ray.phase, ray.value, ray.gradient, limit
            );
            let outcome = candidate_outcome(
                point, ray.gradient, ray.round, ray.phase, ray.value, field, ray.offset, ray.face, next, limit
            );
            var probe_ends = false;
            if checks_all && ray.phase > 3.5 && ray.round + ray.moves < 0.5 && ray.next_check_t < NO_NEXT_CHECK {
                ray.next_check_t = shadow_next_check(ray.candidate_t, ray.value, ray.gradient, ray.size, exit_t);
            }
            if ray.phase < 0.75 {
                let is_offset = any(ray.offset != vec3f(0.0));
                ray.value = field;
                ray.phase = 1.0;
                let bound = shadow_candidate_bound(ray.visibility, ray.ray_number);
                probe_ends = !is_offset && shadow_cannot_darken(field, ray.candidate_t, ray.size, bound) > 0.0;
            } else if ray.phase < 3.5 {
                let tap_length = candidate_tap_distance(ray.value, point, limit);
                ray.gradient = candidate_add_tap(ray.gradient, ray.phase, field - ray.value, tap_length);
                ray.phase += 1.0;
            } else if outcome > MIN_PHASE_OUTCOME {
                ray.phase = outcome;
            } else if outcome == 0.0 {
                ray.offset = next;
                ray.face = ray.gradient;
                ray.round += 1.0;
                ray.phase = 1.0;
                ray.value = candidate_restart_value(field);
                ray.gradient = vec3f(0.0);
            } else if outcome > 0.0 {
                let to_surface = candidate_surface_offset(ray.offset, next, ray.value, field);
                let visibility = ray.visibility;
                // At the light, not where the ray leaves the bounds: light does not depend on these.
                var t_end = light_t;
                ray.visibility = probed_visibility(ray, to_surface, direction, t_end, light.shadow_form);
#if sized
                if is_rim {
                    t_end = shadow_light_plane(direction, axis, light_t);
                    ray.visibility = shadow_rim_visibility_beside(
                        visibility, to_surface, direction, axis, ray.candidate_t, ray.size, t_end
                    );
                }
#end
                if checks_all && is_left_to_end(ray, to_surface, direction, t_end) { ray.visibility = visibility; }
                let target_t = shadow_moved_candidate(
                    to_surface, ray.gradient, direction, ray.candidate_t, t_end, ray.size, ray.value, ray.round, ray.moves,
                    visibility - ray.visibility
                );
                if target_t > 0.0 && ray.visibility > dark_visibility {
                    // After several rounds the next probe counts as a later round, too.
                    let has_bent = ray.round > 0.0;
                    let plane_offset = shadow_plane_offset(to_surface, ray.gradient, direction);
                    ray.candidate_t = target_t;
                    ray.moves += 1.0;
                    ray.phase = MOVED_PHASE;
                    ray.round = select(0.0, 1.0, has_bent);
                    ray.offset = select(vec3f(0.0), plane_offset, has_bent);
                    ray.face = select(vec3f(0.0), ray.gradient, has_bent);
                    ray.gradient = vec3f(0.0);
                } else {
                    probe_ends = true;
                    // After several rounds the next sample may be a candidate for a farther surface.
                    ray.last_visibility = select(ray.last_visibility, NO_LAST_VISIBILITY, ray.round > 0.0);
                }
            } else {
                let ahead = next.x * direction.x + next.y * direction.y + next.z * direction.z;
                let target_t = shadow_earlier_candidate(ray.candidate_t, ray.size, ray.moves, ahead);
                probe_ends = target_t <= 0.0 || checks_all;
                ray.candidate_t = target_t;
                ray.moves += 1.0;
                ray.phase = MOVED_PHASE;
                forget_rounds(&ray);
                ray.last_visibility = NO_LAST_VISIBILITY;
            }
            if probe_ends {
                ray.candidate_t = NO_CANDIDATE;
                ray.moves = 0.0;
                ray.phase = 0.0;
                ray.value = 0.0;
                forget_rounds(&ray);
                ray_ends = ray.next_check_t >= NO_NEXT_CHECK || ray.visibility <= dark_visibility;
            }
            if out_of_steps { ray.steps |= DONE_FLAG; }
            if !ray_ends { continue; }
        } else {
            let t = ray.t;
            let slope = shadow_slope(field, ray.field_before, ray.step);
            let margin = sign_margin(rounding_near(point, rounding, frame.least_rounding), slope, frame.is_raw);
            // The last sample is the end of the ray itself, wherever the earlier steps were.
            let at_end = t >= exit_t || out_of_steps;
            let current_min_step = min_step * shadow_late_speedup(f32(ray.steps) - ray.steps_before);
            let step_back = shadow_step_to_passed_sheet(field, ray.field_before, ray.step, ray.slope_before, margin);
            let is_inside = field < -margin;
#if sized
            let measures_room = ray.size == 0.0;
            if measures_room && (is_inside || at_end) && !out_of_steps {
                let room = select(t, t - ray.step, is_inside);
                ray.size = min(shadow_size_in_room(room, light_t), light.size);
                if ray.size <= 0.0 {
                    ray.steps |= DONE_FLAG;
                    break;
                }
                origin = start;
                direction = shadow_rim_ray_direction(axis, rim, ray.size);
                let plane_t = shadow_light_plane(direction, axis, light_t);
                exit_t = shadow_end(start, direction, plane_t, ray.size);
                restart_ray(&ray);
                ray.t = abs(ray.clear_t);
                continue;
            }
            let steps_back = step_back > 0.0 && ray.ray_number != INSIDE_RAY_NUMBER;
#else
            let steps_back = step_back > 0.0;
#end
            if steps_back && !out_of_steps {
                ray.t += step_back - ray.step;
                ray.step = step_back;
                ray.slope_before = 0.0;
                continue;
            }
            var step = next_stride(light, field, t, current_min_step, ray.size);
#if sized
            if is_sized && is_inside { step = shadow_inner_stride(t, current_min_step, ray.size); }
#end
            step = min(shadow_step_to_check(step, t, ray.next_check_t, light.checks), max(exit_t - t, 0.0));
            ray.t += step;
            ray.field_before = field;
            ray.step = step;
            ray.slope_before = slope;
            if light.shadow_form == SHADOW_HARD {
                ray.visibility = shadow_hard_visibility(ray.visibility, field, margin);
                if at_end || ray.visibility <= 0.0 { ray.steps |= DONE_FLAG; }
                continue;
            }
            let sample_visibility = shadow_sample_visibility(field, t, ray.size);
            var bound = ray.visibility;
#if sized
            if is_sized {
                if out_of_steps && ray.ray_number > 0.0 {
                    ray.steps |= DONE_FLAG;
                    break;
                }
                if measures_room { continue; }
                if is_inside && !is_rim {
                    ray.ray_number = INSIDE_RAY_NUMBER;
                    ray.candidate_t = NO_CANDIDATE;
                    if sample_visibility <= -1.0 {
                        ray.steps |= DONE_FLAG;
                        break;
                    }
                    if !at_end { continue; }
                }
                ray_ends = is_inside || ray.ray_number == INSIDE_RAY_NUMBER;
                if ray_ends { ray.visibility = -1.0; }
                if ray.ray_number == 0.0 {
                    ray.clear_t = shadow_clear_until(ray.clear_t, field, t, ray.size, light.checks);
                }
                bound = shadow_candidate_bound(ray.visibility, ray.ray_number);
            } else if is_inside {
                ray.visibility = 0.0;
                ray.steps |= DONE_FLAG;
                break;
            }
#else
            if is_inside {
                ray.visibility = 0.0;
                ray.steps |= DONE_FLAG;
                break;
            }
#end
            if !ray_ends {
                // A candidate is probed once the ray has passed the lowest visibility.
                let is_lower = shadow_is_candidate(sample_visibility, ray.last_visibility, bound);
                let is_candidate = shadow_is_checked(is_lower, t, ray.next_check_t, light.checks) > 0.0;
                ray.last_visibility = shadow_last_visibility(sample_visibility, light.checks);
                if is_candidate {
                    ray.candidate_t = t;
                    ray.value = candidate_restart_value(field);
                }
                if (!is_candidate || at_end || checks_all) && ray.candidate_t > 0.0 && !out_of_steps {
                    ray.phase = 1.0;
                    forget_rounds(&ray);
                    if at_end { ray.next_check_t = NO_NEXT_CHECK; }
                    continue;
                }
                if !at_end { continue; }
            }
        }
        // The present ray has ended.
#if sized
        if is_sized && (ray.ray_number > 0.0 || ray.visibility <= MAX_HIDDEN_VISIBILITY) {
            if is_rim { ray.best_visibility = max(ray.best_visibility, ray.visibility); }
            ray.ray_number = floor(ray.ray_number) + 1.0;
            ray.candidate_t = NO_CANDIDATE;
            restart_ray(&ray);
            let is_hidden = ray.ray_number > FIRST_RIM_RAYS && ray.best_visibility <= -1.0;
            if is_hidden || ray.best_visibility >= 0.0 || ray.ray_number > RIM_RAYS {
                ray.steps |= DONE_FLAG;
                break;
            }
            rim = shadow_rim_direction(axis, ray.ray_number);
            if light.is_positional > 0.0 {
                ray.size = 0.0;
                ray.t = 0.0;
                origin = point_along(start, axis, light_t);
                direction = rim;
                exit_t = shadow_required_room(light_t, light.size);
            } else {
                ray.t = abs(ray.clear_t);
                direction = shadow_rim_ray_direction(axis, rim, light.size);
                let plane_t = shadow_light_plane(direction, axis, light_t);
                exit_t = shadow_end(start, direction, plane_t, ray.size);
            }
            continue;
        }
#end
        ray.steps |= DONE_FLAG;
    }
#if sized
    if ray.steps >= DONE_FLAG && ray.ray_number > 0.0 { ray.visibility = ray.best_visibility; }
#end
    shadows[slot] = ray;
    if ray.steps < DONE_FLAG { enqueue(slot); }
}
