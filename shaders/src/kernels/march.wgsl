// march: advances each active ray by a bounded number of steps.

@group(0) @binding(2) var<storage, read_write> rays: array<RayState>;
@group(0) @binding(3) var<storage, read_write> queue: array<atomic<u32>>;
@group(0) @binding(9) var<storage, read> beams: array<Beam>;

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
    let camera = camera_ray(item.pixel);
    let segment = camera_segment(camera);
    var ray = rays[item.index];
    if listed == 0u {
        let start = max(segment.enter, beams[k / 64u].t);
        let status = select(ACTIVE, MISS, segment.exit < start);
        ray = RayState(start, 0.0, 0.0, -1.0, start, 0.0, status, 0u);
    }
#if proved_steps
    var sample_t = ray.t + ray.step * (f32(ray.status >> PROVED_SHIFT) / MAX_PROVED);
    ray.status &= (1u << PROVED_SHIFT) - 1u;
#end
    let budget = evaluation_budget();
    for (var n = 0u; n < budget; n++) {
        if (ray.status & END_MASK) != ACTIVE { break; }
        let is_probe = takes_probe(ray.t, ray.field, ray.step, ray.trend, ray.field_before, frame.rounding);
#if proved_steps
        let end_t = ray.t + ray.step;
        let is_between = is_probe < 0.5 && sample_t < end_t;
        let t = select(end_t, sample_t, is_between);
        let step = select(ray.step, t - ray.t, is_between);
#else
        let step = ray.step;
        let t = ray.t + step;
#end
        let half = half_pixel(t, frame.half_pixel_size, frame.half_pixel_growth);
        let point = sample_point(
            camera.origin, camera.direction, ray.t, step, ray.trend, is_probe,
            frame.bounds_min, frame.bounds_max, half, frame.rounding
        );
        let distance = scene_distance(point);
        ray.steps += 1u;
        if is_nan(distance) {
            ray.status |= NOT_A_NUMBER;
            break;
        }
        // A camera inside a solid sees the solid's surface from behind.
        if ray.steps == 1u && t == 0.0 && distance < 0.0 { ray.status |= FROM_INSIDE; }
        let side = select(1.0, -1.0, (ray.status & FROM_INSIDE) != 0u);
        let next_field = distance * side;
        let march_threshold = threshold(t, half, frame.threshold_fraction, frame.rounding);
        let rounding = rounding_at(t, frame.rounding);
        let value_rounding = rounding_near(point, rounding, frame.least_rounding);
#if proved_steps
        let min_step = min_sample_step(half, march_threshold);
        if is_between {
            let margin = sign_margin(value_rounding, (next_field - ray.field) / step, frame.is_raw);
            if next_field >= -margin {
                ray.steps -= 1u;
                sample_t = later_sample_t(t, next_field, frame.step_factor, min_step, end_t);
                continue;
            }
        }
#end
        let next = march_step(
            ray.t, ray.field, step, ray.trend, ray.t_before, ray.field_before, next_field,
            f32(ray.steps), march_threshold, half, frame.relaxation, rounding, value_rounding, frame.is_raw,
            segment.exit, segment.crowd_enter, segment.crowd_exit, segment.plane_t, is_probe
        );
        ray.t = next.t;
        ray.field = next.field;
        ray.step = next.step;
        ray.trend = next.trend;
        ray.t_before = next.t_before;
        ray.field_before = next.field_before;
#if proved_steps
        sample_t = first_sample_t(ray.t, ray.field, frame.step_factor, min_step, ray.t + ray.step, sample_t);
#end
        if next.t > segment.exit {
            ray.status |= MISS;
        } else if next.arrived > 0.0 {
            ray.status |= HIT | SHOWN;
        } else if ray.steps >= frame.max_steps {
            let accepted = accept_at_step_cap(
                next.t, next.field, next.trend, next.t_before, next.field_before,
                max(half, march_threshold), segment.exit
            );
            ray.status |= STEP_CAP | select(0u, SHOWN, accepted > 0.0);
        }
    }
    if (ray.status & END_MASK) == ACTIVE {
#if proved_steps
        // Rounded down: the samples before are taken again.
        ray.status |= u32(proved_fraction(ray.t, ray.step, sample_t) * MAX_PROVED) << PROVED_SHIFT;
#end
        enqueue(item.index);
    }
    rays[item.index] = ray;
}
