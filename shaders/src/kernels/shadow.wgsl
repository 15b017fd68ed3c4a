// shadow: takes each ray towards a light a bounded number of evaluations further; all lights at once.

@group(0) @binding(1) var<uniform> lights: array<Light, LIGHTS>;
@group(0) @binding(2) var<storage, read> rays: array<Ray>;
@group(0) @binding(3) var<storage, read_write> queue: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read> normals: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> shadows: array<ShadowRay>;

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
    ray.claim_t = NO_CLAIM;
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
        let checking = ray.phase > 0.0;
        let at = along(start, direction, select(ray.t, ray.claim_t, checking)) + ray.offset;
        let limit = shadow_limit(ray.claim_t, light.size);
        let place = claim_place(at, ray.offset, ray.phase, ray.value, ray.gradient, limit);
        let field = scene_distance(place) * side;
        ray.steps += 1u;
        if is_nan(field) {
            ray.steps |= DONE;
            break;
        }
        let depth = march_noise(rounding, 1.0, 0.0);
        let out_of_steps = ray.steps >= frame.shadow_steps;
        let dark = select(0.0, -1.0, light.shadow == SHADOW_SIZED);
        if checking {
            let next = claim_offset(at, ray.offset, ray.value, ray.gradient, limit);
            let outcome = claim_outcome(at, ray.gradient, ray.round, ray.value, field, next, limit);
            if ray.phase < 0.75 {
                ray.value = field;
                ray.phase = 1.0;
            } else if ray.phase < 3.5 {
                let sideways = claim_apart(ray.value, at, limit);
                ray.gradient = claim_gradient(ray.gradient, ray.phase, field - ray.value, sideways);
                ray.phase += 1.0;
            } else if outcome == 0.0 {
                ray.offset = next;
                ray.round += 1.0;
                ray.phase = 1.0;
                ray.value = field;
                ray.gradient = vec3f(0.0);
            } else {
                var to = NO_CLAIM;
                if outcome > 0.0 {
                    let way = claim_surface(ray.offset, next, ray.value, field);
                    ray.visibility = shadow_beside(
                        ray.visibility, way, direction, ray.claim_t, light.size, ray.value, bounds.y
                    );
                    to = shadow_moved(way, direction, ray.claim_t, bounds.y, ray.value);
                }
                let moves = to > 0.0 && ray.again == 0.0 && ray.visibility > dark;
                ray.again = select(0.0, 1.0, moves);
                ray.claim_t = select(NO_CLAIM, to, moves);
                ray.phase = select(0.0, MOVED, moves);
                ray.round = 0.0;
                ray.offset = vec3f(0.0);
                ray.gradient = vec3f(0.0);
                if !moves && (ray.ends > 0.0 || ray.visibility <= dark) { ray.steps |= DONE; }
            }
            if out_of_steps { ray.steps |= DONE; }
            continue;
        }
        let t = ray.t;
        // The last point is the end of the ray itself, wherever the steps before it were.
        let at_end = t >= bounds.y || out_of_steps;
        let shortest = least * shadow_hurry(f32(ray.steps));
        ray.t += min(stride_of(light, field, t, shortest), max(bounds.y - t, 0.0));
        if light.shadow == SHADOW_HARD {
            ray.visibility = shadow_hard(ray.visibility, field, depth);
            if at_end || ray.visibility <= dark { ray.steps |= DONE; }
            continue;
        }
        let seen_here = shadow_seen(field, t, light.size);
        if select(field < -depth, seen_here <= dark, light.shadow == SHADOW_SIZED) {
            ray.visibility = dark;
            ray.steps |= DONE;
            break;
        }
        // A claim is checked once the ray has passed the point where it is greatest.
        let claims = shadow_claims(seen_here, ray.last, ray.visibility) > 0.0;
        ray.last = seen_here;
        if claims {
            ray.claim_t = t;
            ray.value = field;
        }
        if (!claims || at_end) && ray.claim_t > 0.0 && !out_of_steps {
            ray.phase = 1.0;
            ray.round = 0.0;
            ray.gradient = vec3f(0.0);
            if at_end { ray.ends = 1.0; }
        } else if at_end {
            ray.steps |= DONE;
        }
    }
    shadows[slot] = ray;
    if ray.steps < DONE { enqueue(slot); }
}
