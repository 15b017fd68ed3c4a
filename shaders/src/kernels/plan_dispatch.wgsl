// Plans the number of listed cells that the next dispatch of `split_cells` takes: all, or as many as its
// budget of clauses allows. All waiting cells are assumed to have the mean length.

@compute @workgroup_size(1)
fn main() {
    let listed = min(atomicLoad(&job_queue.state[LISTED]), job_queue.params.queue_capacity);
    let first = atomicLoad(&job_queue.state[NEXT]);
    let waiting = listed - min(first, listed);
    let clauses = atomicLoad(&job_queue.state[WAITING_CLAUSES]);
    var count = waiting;
    var remaining_clauses = 0u;
    if clauses > job_queue.params.clause_budget {
        let fraction = f32(job_queue.params.clause_budget) / f32(clauses);
        count = min(max(u32(f32(waiting) * fraction), 1u), waiting);
        remaining_clauses = u32(f32(clauses) * (1.0 - f32(count) / f32(max(waiting, 1u))));
    }
    atomicStore(&job_queue.state[FIRST], first);
    atomicStore(&job_queue.state[NEXT], first + count);
    atomicStore(&job_queue.state[WAITING_CLAUSES], remaining_clauses);
    atomicStore(&scratch.state[CHOICE_WORDS], 0u);
    let columns = min(count, job_queue.params.max_groups_per_axis);
    arguments[0] = columns;
    arguments[1] = (count + max(columns, 1u) - 1u) / max(columns, 1u);
    arguments[2] = 1u;
}
