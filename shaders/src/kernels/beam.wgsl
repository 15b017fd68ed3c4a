// beam: how far the rays of each block of pixels can go together before any can meet something.

@group(0) @binding(3) var<storage, read_write> queue: array<atomic<u32>>;
@group(0) @binding(9) var<storage, read_write> beams: array<Beam>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let k = line_index(id, groups);
    var block = k;
    let listed = entries_listed();
    if listed > 0u {
        if k >= listed { return; }
        block = resumed(k);
    }
    let first = block_pixel(block);
    if first.y >= frame.tile.w { return; }
    let middle = camera_ray(first + BLOCK / 2u);
    var spread = 0.0;
    var widening = 0.0;
    for (var corner = 0u; corner < 4u; corner++) {
        let other = camera_ray(first + vec2u(corner & 1u, corner >> 1u) * (BLOCK - 1u));
        spread = max(spread, apart(other.origin, middle.origin));
        widening = max(widening, apart(other.direction, middle.direction));
    }
    var beam = Beam(beam_begin(middle.origin, frame.bounds_min, frame.bounds_max, spread), 0u);
    if listed > 0u { beam = beams[block]; }
    let budget = evaluations_left();
    var done = false;
    for (var n = 0u; n < budget; n++) {
        let p = along(middle.origin, middle.direction, beam.t);
        let distance = scene_distance(beam_within(p, frame.bounds_min, frame.bounds_max));
        beam.steps += 1u;
        let half = half_pixel(beam.t, frame.footprint, frame.footprint_growth);
        let enough = threshold(beam.t, half, frame.cone, frame.rounding);
        let way = beam_advance(beam.t, distance, spread, widening, enough);
        let goes_on = beam_goes_on(way, half) > 0.0;
        beam.t += select(0.0, way, goes_on);
        done = !goes_on || beam.t > frame.far || beam.steps >= BEAM_STEPS;
        if done { break; }
    }
    beams[block] = beam;
    if !done { enqueue(block); }
}
