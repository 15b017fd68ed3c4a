// refine_roots: refines the change of sign where each ray ended, by a few secant steps within its bracket.

@group(0) @binding(2) var<storage, read_write> rays: array<RayState>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let item = block_item(line_index(id, groups));
    if !item.exists { return; }
    var ray = rays[item.index];
    // A ray that ran out of steps has no change of sign to refine.
    if (ray.status & END_MASK) != HIT { return; }
    let camera = camera_ray(item.pixel);
    let side = select(1.0, -1.0, (ray.status & FROM_INSIDE) != 0u);
    var bracket = Bracket(ray.t, ray.field, ray.t_before, ray.field_before);
    for (var n = 0u; n < MAX_SECANT_STEPS; n++) {
        let rounding = rounding_at(bracket.t, frame.rounding);
        let is_raw = frame.is_raw;
        if is_settled(bracket.t, bracket.field, bracket.t_other, bracket.field_other, rounding, is_raw) > 0.0 { break; }
        let estimate = next_estimate(
            bracket.t, bracket.field, bracket.t_other, bracket.field_other, rounding, is_raw, f32(n)
        );
        let distance = scene_distance(point_along(camera.origin, camera.direction, estimate));
        ray.steps += 1u;
        if is_nan(distance) { break; }
        bracket = secant_step(
            bracket.t, bracket.field, bracket.t_other, bracket.field_other, estimate, distance * side
        );
    }
    ray.t = secant_estimate(bracket.t, bracket.field, bracket.t_other, bracket.field_other);
    rays[item.index] = ray;
}
