// polish: closes in on the change of sign where each ray ended, by a few secant steps within it.

@group(0) @binding(2) var<storage, read_write> rays: array<Ray>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let item = block_item(line_index(id, groups));
    if !item.exists { return; }
    var ray = rays[item.index];
    // What ran out of steps has no change of sign to close in on.
    if (ray.status & ENDING) != HIT { return; }
    let camera = camera_ray(item.pixel);
    let side = select(1.0, -1.0, (ray.status & FROM_INSIDE) != 0u);
    var best = Bracket(ray.t, ray.radius, ray.t_before, ray.radius_before);
    for (var n = 0u; n < SECANT_STEPS; n++) {
        let rounding = rounding_at(best.t, frame.rounding);
        let raw = frame.raw;
        if settled(best.t, best.field, best.t_other, best.field_other, rounding, raw) > 0.0 { break; }
        let guess = next_guess(best.t, best.field, best.t_other, best.field_other, rounding, raw);
        let distance = scene_distance(along(camera.origin, camera.direction, guess));
        ray.steps += 1u;
        if is_nan(distance) { break; }
        best = secant_step(
            best.t, best.field, best.t_other, best.field_other, guess, distance * side
        );
    }
    ray.t = secant_guess(best.t, best.field, best.t_other, best.field_other);
    rays[item.index] = ray;
}
