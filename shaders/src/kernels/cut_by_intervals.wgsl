// Choices by intervals, for fields whose slopes are not known: what is rounded outwards all the way
// (`outward.rs`) holds for every point of a box.

// Which of two operands alone matters: 1 or 2; 0 where both may. Beyond ends that are not told apart
// anything may lie.
fn decided(fact: vec4u, a: vec2f, b: vec2f) -> u32 {
    let first = select(a, -a.yx, (fact.w & FIRST_NEGATIVE) != 0u);
    let second = select(b, -b.yx, (fact.w & SECOND_NEGATIVE) != 0u);
    // A little more, for the rounding of the differences.
    let reach = bitcast<f32>(fact.z) * (1.0 + 1e-6);
    let only_first = first.y <= KNOWN && second.x - first.y > reach;
    let only_second = second.y <= KNOWN && first.x - second.y > reach;
    return select(select(0u, 2u, only_second), 1u, only_first);
}

// What the field lies between in a box, by the tape of a cell that holds it; keeps the choices.
fn bounded(job: Job, choices: u32, middle: vec3f, half: vec3f) -> vec2f {
    let low = middle - half;
    let high = middle + half;
    let origin = BoxPoint(vec2f(low.x, high.x), vec2f(low.y, high.y), vec2f(low.z, high.z));
    return run(job.tape, job.length, choices, origin);
}
