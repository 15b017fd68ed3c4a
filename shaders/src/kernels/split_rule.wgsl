// Decision whether a cell is split again, as in the runtime's `cells/split_rule.rs`.

// Returns whether the size of a cell and its tape allow to split it.
fn should_split(low: vec3f, side: vec3f, clauses: u32, min_abs_field: f32) -> bool {
    let longest = max(max(side.x, side.y), side.z);
    let offset = max(max(low - job_queue.params.camera, job_queue.params.camera - (low + side)), vec3f(0.0));
    let squares = offset * offset;
    let distance = max(sqrt(squares.x + squares.y + squares.z), longest * MIN_CAMERA_DISTANCE_SIDES);
    let pixel = job_queue.params.pixel_size + job_queue.params.pixel_growth * distance;
    return clauses > job_queue.params.max_leaf_clauses
        && min_abs_field < MAX_FIELD_SIDES * longest
        && longest > job_queue.params.max_leaf_pixels * pixel;
}

// Returns whether a number of clauses is hardly less than another.
fn is_hardly_shorter(length: u32, other: u32) -> bool {
    return length * 10u > other * STALLED_LENGTH_TENTHS;
}

// Counts the successive levels that shortened no tapes, down to a child with `length` clauses. The job's
// children are `cells` with `clauses` clauses together. A child that kept all clauses counts only if its
// siblings did not lose most of theirs. Where they did, it contains a small solid, and splits pay off.
fn count_stalled_levels(job: CellJob, length: u32, cells: u32, clauses: u32) -> u32 {
    let is_stalled = is_hardly_shorter(clauses, cells * job.length) && is_hardly_shorter(length, job.length);
    return select(0u, job.stalled_levels + 1u, is_stalled);
}

// Returns whether too many levels were stalled.
fn exceeds_stall_limit(job: CellJob) -> bool {
    let is_pruned = job.length * PRUNED_DIVISOR <= job_queue.params.full_tape_length;
    return job.stalled_levels >= select(MAX_STALLED_FULL, MAX_STALLED_PRUNED, is_pruned);
}
