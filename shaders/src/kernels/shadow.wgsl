// shadow: takes each ray towards a light a bounded number of evaluations further; all lights at once.

@group(0) @binding(1) var<uniform> lights: array<Light, LIGHTS>;
@group(0) @binding(2) var<storage, read> rays: array<Ray>;
@group(0) @binding(3) var<storage, read_write> queue: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read> normals: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> shadows: array<ShadowRay>;

// What is seen of a light by a point of the ray at `t`, if a surface is at a distance `h` there: no more than
// `visibility`. The ball before it had the radius `before`, and was a `stride` behind.
fn visible(light: Light, visibility: f32, h: f32, before: f32, stride: f32, t: f32, depth: f32) -> f32 {
#if hard
    if light.shadow == SHADOW_HARD { return shadow_hard(visibility, h, depth); }
#end
#if plain
    if light.shadow == SHADOW_PLAIN { return shadow_plain(visibility, h, t, light.size); }
#end
#if improved
    if light.shadow == SHADOW_IMPROVED {
        return shadow_improved(visibility, h, before, stride, t, light.size);
    }
#end
#if sized
    if light.shadow == SHADOW_SIZED { return shadow_sized(visibility, h, t, light.size); }
#end
    return visibility;
}

fn stride_of(light: Light, h: f32, t: f32, least: f32) -> f32 {
#if short
    if light.shadow == SHADOW_PLAIN || light.shadow == SHADOW_SIZED {
        return shadow_short_stride(h, t, least, light.size);
    }
#end
    return shadow_stride(h, t, least, light.size);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let k = line_index(id, groups);
    let blocks = ((frame.tile.z + 7u) / 8u) * ((frame.tile.w + 7u) / 8u);
    var item = block_item(k % (blocks * 64u));
    var which = k / (blocks * 64u);
    let listed = entries_listed();
    if listed > 0u {
        if k >= listed { return; }
        let entry = resumed(k);
        item = stored_item(entry % tile_pixels());
        which = entry / tile_pixels();
    }
    if !item.exists || which >= frame.lights { return; }
    let light = lights[which];
    let slot = which * tile_pixels() + item.index;
    let seen = rays[item.index];
    let camera = camera_ray(item.pixel);
    let p = along(camera.origin, camera.direction, seen.t);
    let normal = normals[item.index].xyz;
    let to_place = light.place - p * light.near;
    let direction = unit(to_place);
    let half = half_pixel(seen.t, frame.footprint, frame.footprint_growth);
    let rounding = rounding_at(seen.t, frame.rounding);
    let above = lift(p, half, rounding);
    let start = along(p, normal, above);
    let reach = select(frame.far, min(frame.far, length3(to_place)), light.near > 0.0);
    let bounds = crossing(start, direction, frame.bounds_min, frame.bounds_max, reach);
    let least = above * 0.25;
    let side = select(1.0, -1.0, (seen.status & FROM_INSIDE) != 0u);
    var ray: ShadowRay;
    ray.t = least;
    ray.visibility = 1.0;
    ray.last = 1.0;
    ray.claimed = NO_CLAIM;
    if listed > 0u {
        ray = shadows[slot];
    } else if (seen.status & SHOWN) == 0u || light.shadow == SHADOW_NONE {
        ray.steps = DONE;
    } else if cosine_between(normal, direction) <= 0.0 {
        ray.visibility = -1.0;
        ray.steps = DONE;
    }
    let budget = evaluations_left();
    for (var n = 0u; n < budget; n++) {
        if ray.steps >= DONE { break; }
#if checked
        let checking = ray.phase > 0.0;
        let at = along(start, direction, select(ray.t, ray.claim_t, checking)) + ray.offset;
        let sideways = claim_apart(ray.value, at);
        let place = claim_place(at, ray.offset, ray.phase, ray.value, ray.gradient, sideways);
#else
        let place = along(start, direction, ray.t);
#end
        let field = scene_distance(place) * side;
        ray.steps += 1u;
        if is_nan(field) {
            ray.steps |= DONE;
            break;
        }
        let depth = march_noise(rounding, 1.0, frame.raw);
        let out_of_steps = ray.steps >= frame.shadow_steps;
#if checked
        if checking {
            if ray.phase < 3.5 {
                ray.gradient = claim_gradient(ray.gradient, ray.phase, field - ray.value, sideways);
                ray.phase += 1.0;
            } else if claim_decided(
                ray.phase, ray.round, ray.value, field, ray.beyond, frame.raw
            ) == 0.0 {
                let again = claim_looks_again(ray.phase, frame.raw) > 0.0;
                let there = select(field, ray.beyond, ray.phase > 4.5);
                let offset = claim_offset(ray.offset, ray.value, ray.gradient);
                ray.offset = select(offset, ray.offset, again);
                ray.round += select(1.0, 0.0, again);
                ray.phase = select(1.0, 5.0, again);
                ray.value = select(there, ray.value, again);
                ray.gradient = select(vec3f(0.0), ray.gradient, again);
                ray.beyond = field;
            } else {
                let found = claim_distance(
                    ray.value, ray.gradient, ray.offset, ray.phase, field, ray.beyond, frame.raw
                );
                if found < NOTHING {
                    let before = claim_before(ray.claim_before, found, ray.round);
                    ray.visibility =
                        visible(light, ray.visibility, found, before, ray.claim_stride, ray.claim_t, depth);
                }
                ray.phase = 0.0;
                ray.offset = vec3f(0.0);
                ray.claimed = NO_CLAIM;
                if ray.stride < 0.0 { ray.steps |= DONE; }
            }
            if out_of_steps { ray.steps |= DONE; }
            continue;
        }
        let is_checked = (frame.choices & CHECKED) != 0u && light.shadow != SHADOW_HARD;
        let start_from = select(ray.visibility, 1.0, is_checked);
#else
        let start_from = ray.visibility;
#end
        let t = ray.t;
        let before = ray.radius_before;
        let stride = ray.stride;
        let new_visibility = visible(light, start_from, field, before, stride, t, depth);
        // The last point is the end of the ray itself, wherever the steps before it were.
        let at_end = t >= bounds.y || out_of_steps;
        let shortest = least * shadow_hurry(f32(ray.steps));
        ray.radius_before = field;
        ray.stride = min(stride_of(light, field, t, shortest), max(bounds.y - t, 0.0));
        ray.t += ray.stride;
        let dark = select(0.0, -1.0, light.shadow == SHADOW_SIZED);
#if checked
        if is_checked {
            if select(field < -depth, new_visibility <= dark, light.shadow == SHADOW_SIZED) {
                ray.visibility = dark;
                ray.steps |= DONE;
                break;
            }
            // A claim is checked once the ray has passed the point where it is greatest.
            let claims = shadow_claims(new_visibility, ray.last, ray.visibility, field, depth) > 0.0;
            ray.last = new_visibility;
            if claims {
                ray.claimed = new_visibility;
                ray.claim_t = t;
                ray.value = field;
                ray.claim_before = before / field;
                ray.claim_stride = stride;
            }
            if (!claims || at_end) && ray.claimed < NO_CLAIM && !out_of_steps {
                ray.phase = 1.0;
                ray.round = 0.0;
                ray.gradient = vec3f(0.0);
                if at_end { ray.stride = -1.0; }
            } else if at_end {
                ray.steps |= DONE;
            }
            continue;
        }
#end
        ray.visibility = new_visibility;
        if at_end || ray.visibility <= dark { ray.steps |= DONE; }
    }
    shadows[slot] = ray;
    if ray.steps < DONE { enqueue(slot); }
}
