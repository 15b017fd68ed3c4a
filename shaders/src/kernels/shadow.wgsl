// shadow: takes each ray towards a light a bounded number of evaluations further; all lights at once.

@group(0) @binding(1) var<uniform> lights: array<Light, LIGHTS>;
@group(0) @binding(2) var<storage, read> rays: array<Ray>;
@group(0) @binding(3) var<storage, read_write> queue: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read> normals: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> shadows: array<ShadowRay>;

// What is visible of a light after one more point of the ray, at `t` with a ball of radius `h` that is free
// of surfaces; the ball before had the radius `before`.
fn visible(light: Light, ray: ShadowRay, h: f32, before: f32, noise: f32) -> f32 {
#if hard
    if light.shadow == SHADOW_HARD { return shadow_hard(ray.visibility, h, noise); }
#end
#if plain
    if light.shadow == SHADOW_PLAIN { return shadow_plain(ray.visibility, h, ray.t, light.size); }
#end
#if improved
    if light.shadow == SHADOW_IMPROVED {
        return shadow_improved(ray.visibility, h, before, ray.stride, ray.t, light.size);
    }
#end
#if sized
    if light.shadow == SHADOW_SIZED { return shadow_sized(ray.visibility, h, ray.t, light.size); }
#end
    return ray.visibility;
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
    var ray = ShadowRay(vec3f(0.0), 0.0, least, 0.0, 0.0, 1.0, 0.0, 0.0, 0u, 0u);
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
        let at = along(start, direction, ray.t);
#if checked
        let apart = claim_apart(ray.value, rounding);
        let place = claim_place(at, ray.phase, ray.value, ray.gradient, apart);
#else
        let place = at;
#end
        let field = scene_distance(place) * side;
        ray.steps += 1u;
        if is_nan(field) {
            ray.steps |= DONE;
            break;
        }
        var h = field;
        var distance = field;
        let noise = march_noise(rounding, 1.0, frame.raw);
#if checked
        if (frame.choices & CHECKED) != 0u && light.shadow != SHADOW_HARD {
            let claimed = shadow_claims(ray.visibility, field, ray.t, light.size, noise) > 0.0;
            if ray.phase == 0.0 {
                if claimed {
                    ray.value = field;
                    ray.gradient = vec3f(0.0);
                    ray.phase = 1.0;
                    continue;
                }
                // What rounding can make of the field is no surface.
                if field > -noise { distance = NOTHING; }
            } else if ray.phase < 3.5 {
                ray.gradient = claim_gradient(ray.gradient, ray.phase, field - ray.value, apart);
                ray.phase += 1.0;
                continue;
            } else if claim_decided(ray.phase, field) == 0.0 {
                ray.beyond = field;
                ray.phase = 5.0;
                continue;
            } else {
                distance = claim_distance(ray.value, ray.gradient, ray.phase, field, ray.beyond);
                h = ray.value;
                ray.phase = 0.0;
            }
        }
#end
        if distance < NOTHING {
            let scale = select(1.0, distance / h, h > noise);
            ray.visibility = visible(light, ray, distance, ray.radius_before * scale, noise);
        }
        ray.radius_before = h;
        // The last point is the end of the ray itself, wherever the steps before it were.
        let ended = ray.t >= bounds.y;
        let shortest = least * shadow_hurry(f32(ray.steps));
        ray.stride = min(stride_of(light, h, ray.t, shortest), max(bounds.y - ray.t, 0.0));
        ray.t += ray.stride;
        let dark = select(0.0, -1.0, light.shadow == SHADOW_SIZED);
        if ended || ray.visibility <= dark || ray.steps >= frame.shadow_steps {
            ray.steps |= DONE;
        }
    }
    shadows[slot] = ray;
    if ray.steps < DONE { enqueue(slot); }
}
