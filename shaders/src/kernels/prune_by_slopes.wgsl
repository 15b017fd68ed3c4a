// Choices by slopes: no value differs from that at the centre of a box by more than its slope bound times the
// box's half diagonal.

fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

// Returns the only operand that matters, 1 or 2; 0 where both may.
fn decide_choice(info: vec4u, a: f32, b: f32, radius: f32, slack: f32) -> u32 {
    let first = select(a, -a, (info.w & FIRST_NEGATIVE) != 0u);
    let second = select(b, -b, (info.w & SECOND_NEGATIVE) != 0u);
    let slopes = bitcast<f32>(info.x) + bitcast<f32>(info.y);
    let max_difference = bitcast<f32>(info.z) + radius * slopes + 2.0 * slack + (abs(a) + abs(b)) * RELATIVE_SLACK;
    let difference = second - first;
    if !is_finite(difference) || !is_finite(max_difference) { return 0u; }
    return select(select(0u, 2u, -difference > max_difference), 1u, difference > max_difference);
}

// Returns bounds of the field in a box, by the tape of a cell that contains it; stores the choices.
fn field_range(job: CellJob, choices: u32, centre: vec3f, half: vec3f) -> vec2f {
    let radius = sqrt(half.x * half.x + half.y * half.y + half.z * half.z) * (1.0 + 1e-5);
    let corner = abs(centre) + half;
    let slack = (corner.x + corner.y + corner.z) * COORDINATE_SLACK;
    let value = run_tape(job.tape, job.length, choices, centre, radius, slack);
    let max_change = radius * job_queue.params.slope + slack + abs(value) * RELATIVE_SLACK;
    if !is_finite(value) || !is_finite(max_change) { return vec2f(-1e30, 1e30); }
    return vec2f(value - max_change, value + max_change);
}
