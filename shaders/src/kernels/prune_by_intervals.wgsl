// Choices by intervals, for fields with unknown slopes: bounds that are rounded outwards at each step hold
// for every point of a box.

// Returns the only operand that matters, 1 or 2; 0 where both may. An end beyond `MAX_BOUNDED` is unbounded.
fn decide_choice(info: vec4u, a: vec2f, b: vec2f) -> u32 {
    let first = select(a, -a.yx, (info.w & FIRST_NEGATIVE) != 0u);
    let second = select(b, -b.yx, (info.w & SECOND_NEGATIVE) != 0u);
    // A margin for the rounding of the differences.
    let support = bitcast<f32>(info.z) * (1.0 + 1e-6);
    let is_first = first.y <= MAX_BOUNDED && second.x - first.y > support;
    let is_second = second.y <= MAX_BOUNDED && first.x - second.y > support;
    return select(select(0u, 2u, is_second), 1u, is_first);
}

// Returns bounds of the field in a box, by the tape of a cell that contains it; stores the choices.
fn field_range(job: CellJob, choices: u32, centre: vec3f, half: vec3f) -> vec2f {
    let low = centre - half;
    let high = centre + half;
    let origin = BoxPoint(vec2f(low.x, high.x), vec2f(low.y, high.y), vec2f(low.z, high.z));
    return run_tape(job.tape, job.length, choices, origin);
}
