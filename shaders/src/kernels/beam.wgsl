// beam: advances the rays of each block of pixels together, as far as none of them can hit anything.

@group(0) @binding(3) var<storage, read_write> queue: array<atomic<u32>>;
@group(0) @binding(9) var<storage, read_write> beams: array<Beam>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let k = line_index(id, groups);
    var block = k;
    let listed = listed_count();
    if listed > 0u {
        if k >= listed { return; }
        block = listed_entry(k);
    }
    let first = block_pixel(block);
    if first.y >= frame.tile.w { return; }
    let middle_ray = camera_ray(first + BLOCK_SIDE / 2u);
    var spread = 0.0;
    var widening = 0.0;
    for (var corner = 0u; corner < 4u; corner++) {
        let corner_ray = camera_ray(first + vec2u(corner & 1u, corner >> 1u) * (BLOCK_SIDE - 1u));
        spread = max(spread, distance_between(corner_ray.origin, middle_ray.origin));
        widening = max(widening, distance_between(corner_ray.direction, middle_ray.direction));
    }
    var beam = Beam(beam_start(middle_ray.origin, frame.bounds_min, frame.bounds_max, spread), 0u);
    if listed > 0u { beam = beams[block]; }
    let budget = evaluation_budget();
    var done = false;
    for (var n = 0u; n < budget; n++) {
        let p = point_along(middle_ray.origin, middle_ray.direction, beam.t);
        let is_distance = (frame.flags & ESTIMATE_FLAG) == 0u;
        let distance = select(
            0.0, scene_distance(beam_clamp_to_box(p, frame.bounds_min, frame.bounds_max)), is_distance
        );
        beam.steps += 1u;
        let half = half_pixel(beam.t, frame.half_pixel_size, frame.half_pixel_growth);
        let march_threshold = threshold(beam.t, half, frame.threshold_fraction, frame.rounding);
        let advance = beam_advance(beam.t, distance, spread, widening, march_threshold);
        let continues = beam_continues(advance, half) > 0.0;
        beam.t += select(0.0, advance, continues);
        done = !continues || beam.t > frame.far || beam.steps >= MAX_BEAM_STEPS;
        if done { break; }
    }
    beams[block] = beam;
    if !done { enqueue(block); }
}
