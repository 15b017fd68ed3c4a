// normal: the direction that each surface faces.

@group(0) @binding(2) var<storage, read> rays: array<RayState>;
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
    let p = point_along(camera.origin, camera.direction, ray.t);
    let half = half_pixel(ray.t, frame.half_pixel_size, frame.half_pixel_growth);
#if exact
    // The gradient just outside, where the visible one of two faces that meet counts. If that is doubtful,
    // the one just inside. If the field is discontinuous, differences.
    let rounding = rounding_at(ray.t, frame.rounding);
    let tap_step = tap_distance(p, half, TAP_SPREAD);
    var gradient = vec3f(0.0);
    var slope = 0.0;
    var outside_sample = vec4f(0.0);
    for (var n = 0u; n < 2u + DISCONTINUITY_TAPS; n++) {
        let distance = outside_distance(rounding) * select(1.0, -1.0, n == 1u);
        var point = point_along(camera.origin, camera.direction, ray.t - distance);
        let tap = FIRST_DISCONTINUITY_TAP + max(n, 2u) - 2u;
        if n > 1u { point = point_along(p, TAP_OFFSETS[tap], tap_step); }
        let sample = scene_gradient(point);
        if n > 1u {
            gradient += TAP_WEIGHTS[tap] * sample.w;
            continue;
        }
        let sample_slope = length3(sample.xyz);
        let doubtful = is_doubtful(sample.w, sample_slope, rounding) > 0.0;
        if n == 0u { outside_sample = sample; }
        if n == 0u || !doubtful {
            gradient = sample.xyz;
            slope = sample_slope;
        }
        if !doubtful { break; }
        if n == 1u {
            if is_discontinuous(outside_sample.w, slope, tap_step) == 0.0 { break; }
            gradient = vec3f(0.0);
        }
    }
#else
    let slope = 1.0;
#if generic
    let tap_step = tap_distance(p, half, frame.normal_spread);
    let first = frame.normal_taps;
#else
    let tap_step = tap_distance(p, half, TAP_SPREAD);
    let first = 0u;
#end
    var gradient = vec3f(0.0);
    for (var n = 0u; n < NORMAL_TAPS; n++) {
        let weight = TAP_WEIGHTS[first + n];
#if generic
        if all(weight == vec3f(0.0)) { continue; }
#end
        gradient += weight * scene_distance(point_along(p, TAP_OFFSETS[first + n], tap_step));
    }
#end
    let side = select(1.0, -1.0, (ray.status & FROM_INSIDE) != 0u);
    normals[item.index] = vec4f(facing(gradient, camera.direction, side), slope);
}
