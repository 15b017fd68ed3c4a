// The queue of a resumable stage: what is still under way after a dispatch is listed for the next.
// One half is read and the other written; the first word counts what is written.

fn resumed(k: u32) -> u32 {
    return atomicLoad(&queue[4u + frame.phase * frame.capacity + k]);
}

fn enqueue(entry: u32) {
    let place = atomicAdd(&queue[0], 1u);
    atomicStore(&queue[4u + (1u - frame.phase) * frame.capacity + place], entry);
}
