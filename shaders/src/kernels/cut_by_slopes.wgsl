// Choices by slopes: no value leaves the one in the middle of a box by more than its slope times the
// box's half diagonal.

fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

// Which of two operands alone matters: 1 or 2; 0 where both may.
fn decided(fact: vec4u, a: f32, b: f32, radius: f32, slack: f32) -> u32 {
    let first = select(a, -a, (fact.w & FIRST_NEGATIVE) != 0u);
    let second = select(b, -b, (fact.w & SECOND_NEGATIVE) != 0u);
    let slopes = bitcast<f32>(fact.x) + bitcast<f32>(fact.y);
    let reach = bitcast<f32>(fact.z) + radius * slopes + 2.0 * slack + (abs(a) + abs(b)) * SHARE;
    let ahead = second - first;
    if !is_finite(ahead) || !is_finite(reach) { return 0u; }
    return select(select(0u, 2u, -ahead > reach), 1u, ahead > reach);
}

// What the field lies between in a box, by the tape of a cell that holds it; keeps the choices.
fn bounded(job: Job, choices: u32, middle: vec3f, half: vec3f) -> vec2f {
    let radius = sqrt(half.x * half.x + half.y * half.y + half.z * half.z) * (1.0 + 1e-5);
    let corner = abs(middle) + half;
    let slack = (corner.x + corner.y + corner.z) * SLACK;
    let value = run(job.tape, job.length, choices, middle, radius, slack);
    let most = radius * work.cut.slope + slack + abs(value) * SHARE;
    if !is_finite(value) || !is_finite(most) { return vec2f(-1e30, 1e30); }
    return vec2f(value - most, value + most);
}
