// normal: the direction each surface faces.

@group(0) @binding(2) var<storage, read> rays: array<Ray>;
@group(0) @binding(4) var<storage, read_write> normals: array<vec4f>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let item = block_item(line_index(id, groups));
    if !item.exists { return; }
    let ray = rays[item.index];
    if (ray.status & SHOWN) == 0u {
        normals[item.index] = vec4f(0.0);
        return;
    }
    let camera = camera_ray(item.pixel);
    let p = along(camera.origin, camera.direction, ray.t);
    let half = half_pixel(ray.t, frame.footprint, frame.footprint_growth);
#if exact
    // Just outside, where of two faces that meet the visible one counts. Where that is in doubt, just inside;
    // and where the field jumps, differences.
    let rounding = rounding_at(ray.t, frame.rounding);
    let apart = tap_distance(p, half, SPREAD);
    var gradient = vec3f(0.0);
    var slope = 0.0;
    var seen = vec4f(0.0);
    for (var n = 0u; n < 2u + JUMP_TAPS; n++) {
        let beside = outside(rounding) * select(1.0, -1.0, n == 1u);
        var at = along(camera.origin, camera.direction, ray.t - beside);
        let tap = FIRST_JUMP_TAP + max(n, 2u) - 2u;
        if n > 1u { at = along(p, TAP_OFFSETS[tap], apart); }
        let found = scene_gradient(at);
        if n > 1u {
            gradient += TAP_WEIGHTS[tap] * found.w;
            continue;
        }
        let steep = length3(found.xyz);
        let doubt = is_doubtful(found.w, steep, rounding) > 0.0;
        if n == 0u { seen = found; }
        if n == 0u || !doubt {
            gradient = found.xyz;
            slope = steep;
        }
        if !doubt { break; }
        if n == 1u {
            if jumps(seen.w, slope, apart) == 0.0 { break; }
            gradient = vec3f(0.0);
        }
    }
#else
    let slope = 1.0;
#if general
    let apart = tap_distance(p, half, frame.normal_spread);
    let first = frame.normal_taps;
#else
    let apart = tap_distance(p, half, SPREAD);
    let first = 0u;
#end
    var gradient = vec3f(0.0);
    for (var n = 0u; n < NORMAL_TAPS; n++) {
        let weight = TAP_WEIGHTS[first + n];
#if general
        if all(weight == vec3f(0.0)) { continue; }
#end
        gradient += weight * scene_distance(along(p, TAP_OFFSETS[first + n], apart));
    }
#end
    let side = select(1.0, -1.0, (ray.status & FROM_INSIDE) != 0u);
    normals[item.index] = vec4f(facing(gradient, camera.direction, side), slope);
}
