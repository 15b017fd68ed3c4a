// shadow: takes each ray towards a light a bounded number of evaluations further; all lights at once.

@group(0) @binding(1) var<uniform> lights: array<Light, LIGHTS>;
@group(0) @binding(2) var<storage, read> rays: array<Ray>;
@group(0) @binding(3) var<storage, read_write> queue: array<atomic<u32>>;
@group(0) @binding(4) var<storage, read> normals: array<vec4f>;
@group(0) @binding(6) var<storage, read_write> shadows: array<ShadowRay>;

fn stride_of(light: Light, h: f32, t: f32, least: f32, size: f32) -> f32 {
#if short
    if size > 0.0 && (light.shadow == SHADOW_PLAIN || light.shadow == SHADOW_SIZED) {
        return shadow_short_stride(h, t, least, size);
    }
#end
    return shadow_stride(h, t, least, size);
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
    let half = half_pixel(seen.t, frame.footprint, frame.footprint_growth);
    let rounding = rounding_at(seen.t, frame.rounding);
    let sharp = select(0.0, 1.0, light.shadow == SHADOW_HARD);
    let above = lift(p, half, rounding, sharp);
    let start = along(p, normal, above);
    // From where the ray starts, so that it ends at the lamp and not beside it.
    let to_place = light.place - start * light.near;
    let axis = unit(to_place);
    let reach = select(frame.far, min(frame.far, length3(to_place)), light.near > 0.0);
    let least = shadow_shortest(half, above);
    let begin = shadow_begin(least, sharp);
    let side = select(1.0, -1.0, (seen.status & FROM_INSIDE) != 0u);
    var ray: ShadowRay;
    ray.t = begin;
    ray.visibility = 1.0;
    ray.last = 1.0;
    ray.claim_t = NO_CLAIM;
    ray.size = light.size;
    ray.best = -1.0;
    ray.cleared = begin;
    if listed > 0u {
        ray = shadows[slot];
    } else if (seen.status & SHOWN) == 0u || light.shadow == SHADOW_NONE {
        ray.steps = DONE;
    } else if cosine_between(normal, unit(light.place - p * light.near)) <= 0.0 {
        ray.visibility = -1.0;
        ray.steps = DONE;
    }
    var origin = start;
    var direction = axis;
    var leave = shadow_leave(start, axis, frame.bounds_min, frame.bounds_max, reach, ray.size);
#if sized
    var rim = shadow_rim(axis, ray.number);
    if ray.number >= 1.0 {
        direction = shadow_aim(axis, rim, ray.size);
        let far = shadow_rim_reach(direction, axis, reach);
        leave = shadow_leave(start, direction, frame.bounds_min, frame.bounds_max, far, ray.size);
        if ray.size == 0.0 {
            origin = along(start, axis, reach);
            direction = rim;
            leave = shadow_room(reach, light.size);
        }
    }
#end
    let budget = evaluations_left();
    for (var n = 0u; n < budget; n++) {
        if ray.steps >= DONE { break; }
        let checking = ray.phase > 0.0;
        let at = along(origin, direction, select(ray.t, ray.claim_t, checking)) + ray.offset;
        let limit = shadow_limit(ray.claim_t, ray.size);
        let place = claim_place(at, ray.offset, ray.phase, ray.value, ray.gradient, limit);
        let field = scene_distance(place) * side;
        ray.steps += 1u;
        if is_nan(field) {
            ray.steps |= DONE;
            break;
        }
        let out_of_steps = ray.steps >= frame.shadow_steps;
        // Whether the present ray has ended: for lights with a size others may follow.
        var ends = false;
#if sized
        let is_sized = light.shadow == SHADOW_SIZED;
        let is_rim = ray.number >= 1.0;
        let dark = select(0.0, select(HIDDEN, -1.0, is_rim), is_sized);
#else
        let dark = 0.0;
#end
        if checking {
            let next = claim_offset(at, ray.offset, ray.phase, ray.value, ray.gradient, limit);
            let outcome = claim_outcome(
                at, ray.gradient, ray.round, ray.phase, ray.value, field, ray.offset, next, limit
            );
            // Whether the check has ended.
            var finishes = false;
            if ray.phase < 0.75 {
                let is_aside = any(ray.offset != vec3f(0.0));
                ray.value = select(field, claim_repeated(field), is_aside);
                ray.phase = 1.0;
                let most = shadow_claimed(ray.visibility, ray.number);
                finishes = !is_aside && shadow_is_vain(field, ray.claim_t, ray.size, most) > 0.0;
            } else if ray.phase < 3.5 {
                let sideways = claim_apart(ray.value, at, limit);
                ray.gradient = claim_gradient(ray.gradient, ray.phase, field - ray.value, sideways);
                ray.phase += 1.0;
            } else if outcome == TOO_FAR {
                ray.phase += 1.0;
            } else if outcome == 0.0 {
                ray.offset = next;
                ray.round += 1.0;
                ray.phase = 1.0;
                ray.value = claim_repeated(field);
                ray.gradient = vec3f(0.0);
            } else if outcome > 0.0 {
                let way = claim_surface(ray.offset, next, ray.value, field);
                let before = ray.visibility;
                // At the light, not where the ray leaves the bounds: light does not depend on these.
                var end = reach;
                ray.visibility = shadow_beside(
                    before, way, direction, ray.claim_t, ray.size, ray.value, end
                );
#if sized
                if is_rim {
                    end = shadow_rim_reach(direction, axis, reach);
                    ray.visibility = shadow_beside_rim(
                        before, way, direction, axis, ray.claim_t, ray.size, end
                    );
                }
#end
                let to = shadow_moved(
                    way, ray.gradient, direction, ray.claim_t, end, ray.value, ray.round, ray.moves
                );
                if to > 0.0 && ray.visibility > dark {
                    // After a roundabout way the next one counts as one, too.
                    let bends = ray.round > 0.0;
                    let aside = shadow_aside(way, ray.gradient, direction);
                    ray.claim_t = to;
                    ray.moves += 1.0;
                    ray.phase = MOVED;
                    ray.round = select(0.0, 1.0, bends);
                    ray.offset = select(vec3f(0.0), aside, bends);
                    ray.gradient = vec3f(0.0);
                } else {
                    finishes = true;
                    // After a roundabout way the next point may claim what is farther.
                    ray.last = select(ray.last, NO_LAST, ray.round > 0.0);
                }
            } else {
                let to = shadow_earlier(ray.claim_t, ray.size, ray.moves);
                finishes = to <= 0.0;
                ray.claim_t = to;
                ray.moves += 1.0;
                ray.round = 0.0;
                ray.phase = MOVED;
                ray.offset = vec3f(0.0);
                ray.gradient = vec3f(0.0);
                ray.last = NO_LAST;
            }
            if finishes {
                ray.claim_t = NO_CLAIM;
                ray.moves = 0.0;
                ray.phase = 0.0;
                ray.round = 0.0;
                ray.offset = vec3f(0.0);
                ray.gradient = vec3f(0.0);
                ends = ray.ends > 0.0 || ray.visibility <= dark;
            }
            if out_of_steps { ray.steps |= DONE; }
            if !ends { continue; }
        } else {
            let t = ray.t;
            let slope = shadow_slope(field, ray.before, ray.step);
            let depth = march_noise(rounding, slope, frame.raw);
            // The last point is the end of the ray itself, wherever the steps before it were.
            let at_end = t >= leave || out_of_steps;
            let shortest = least * shadow_hurry(f32(ray.steps) - ray.begun);
            let back = shadow_passed(field, ray.before, ray.step, ray.fall, depth);
            let is_inside = field < -depth;
#if sized
            let measures = ray.size == 0.0;
            if measures && (is_inside || at_end) && !out_of_steps {
                let room = select(t, t - ray.step, is_inside);
                ray.size = min(shadow_fitting(room, reach), light.size);
                if ray.size <= 0.0 {
                    ray.steps |= DONE;
                    break;
                }
                origin = start;
                direction = shadow_aim(axis, rim, ray.size);
                let far = shadow_rim_reach(direction, axis, reach);
                leave = shadow_leave(start, direction, frame.bounds_min, frame.bounds_max, far, ray.size);
                ray.begun = f32(ray.steps);
                ray.t = abs(ray.cleared);
                ray.before = 0.0;
                ray.step = 0.0;
                ray.fall = 0.0;
                ray.visibility = 0.0;
                ray.last = NO_LAST;
                ray.ends = 0.0;
                continue;
            }
            let goes_back = back > 0.0 && ray.number != INSIDE;
#else
            let goes_back = back > 0.0;
#end
            if goes_back && !out_of_steps {
                ray.t += back - ray.step;
                ray.step = back;
                ray.fall = 0.0;
                continue;
            }
            var step = stride_of(light, field, t, shortest, ray.size);
#if sized
            if is_sized && is_inside { step = shadow_inner_stride(t, shortest, ray.size); }
#end
            step = min(step, max(leave - t, 0.0));
            ray.t += step;
            ray.before = field;
            ray.step = step;
            ray.fall = slope;
            if light.shadow == SHADOW_HARD {
                ray.visibility = shadow_hard(ray.visibility, field, depth);
                if at_end || ray.visibility <= 0.0 { ray.steps |= DONE; }
                continue;
            }
            let seen_here = shadow_seen(field, t, ray.size);
            var claimed = ray.visibility;
#if sized
            if is_sized {
                if out_of_steps && ray.number > 0.0 {
                    ray.steps |= DONE;
                    break;
                }
                if measures { continue; }
                if is_inside && !is_rim {
                    ray.number = INSIDE;
                    ray.claim_t = NO_CLAIM;
                    if seen_here <= -1.0 {
                        ray.steps |= DONE;
                        break;
                    }
                    if !at_end { continue; }
                }
                ends = is_inside || ray.number == INSIDE;
                if ends { ray.visibility = -1.0; }
                if ray.number == 0.0 { ray.cleared = shadow_cleared(ray.cleared, field, t, ray.size); }
                claimed = shadow_claimed(ray.visibility, ray.number);
            } else if is_inside {
                ray.visibility = 0.0;
                ray.steps |= DONE;
                break;
            }
#else
            if is_inside {
                ray.visibility = 0.0;
                ray.steps |= DONE;
                break;
            }
#end
            if !ends {
                // A claim is checked once the ray has passed the point where it is greatest.
                let claims = shadow_claims(seen_here, ray.last, claimed) > 0.0;
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
                    continue;
                }
                if !at_end { continue; }
            }
        }
        // The present ray has ended.
#if sized
        if is_sized && (ray.number > 0.0 || ray.visibility <= HIDDEN) {
            if is_rim { ray.best = max(ray.best, ray.visibility); }
            ray.number = floor(ray.number) + 1.0;
            ray.claim_t = NO_CLAIM;
            ray.ends = 0.0;
            ray.last = NO_LAST;
            ray.before = 0.0;
            ray.step = 0.0;
            ray.fall = 0.0;
            ray.begun = f32(ray.steps & ~DONE);
            ray.visibility = 0.0;
            let is_hidden = ray.number > FIRST_RIM_RAYS && ray.best <= -1.0;
            if is_hidden || ray.best >= 0.0 || ray.number > RIM_RAYS {
                ray.steps |= DONE;
                break;
            }
            rim = shadow_rim(axis, ray.number);
            if light.near > 0.0 {
                ray.size = 0.0;
                ray.t = 0.0;
                origin = along(start, axis, reach);
                direction = rim;
                leave = shadow_room(reach, light.size);
            } else {
                ray.t = abs(ray.cleared);
                direction = shadow_aim(axis, rim, light.size);
                let far = shadow_rim_reach(direction, axis, reach);
                leave = shadow_leave(start, direction, frame.bounds_min, frame.bounds_max, far, ray.size);
            }
            continue;
        }
#end
        ray.steps |= DONE;
    }
#if sized
    if ray.steps >= DONE && ray.number > 0.0 { ray.visibility = ray.best; }
#end
    shadows[slot] = ray;
    if ray.steps < DONE { enqueue(slot); }
}
