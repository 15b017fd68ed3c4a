// How many of the cells listed the next dispatch of `cut` takes: all, or as many as its budget of
// clauses allows if those that wait are of the mean length.

@compute @workgroup_size(1)
fn main() {
    let listed = min(atomicLoad(&work.state[LISTED]), work.cut.queue);
    let first = atomicLoad(&work.state[NEXT]);
    let waiting = listed - min(first, listed);
    let load = atomicLoad(&work.state[LOAD]);
    var count = waiting;
    var left = 0u;
    if load > work.cut.budget {
        let share = f32(work.cut.budget) / f32(load);
        count = min(max(u32(f32(waiting) * share), 1u), waiting);
        left = u32(f32(load) * (1.0 - f32(count) / f32(max(waiting, 1u))));
    }
    atomicStore(&work.state[FIRST], first);
    atomicStore(&work.state[NEXT], first + count);
    atomicStore(&work.state[LOAD], left);
    atomicStore(&space.state[USED], 0u);
    let columns = min(count, work.cut.per_axis);
    arguments[0] = columns;
    arguments[1] = (count + max(columns, 1u) - 1u) / max(columns, 1u);
    arguments[2] = 1u;
}
