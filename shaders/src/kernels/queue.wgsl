// The queue of a resumable stage: the items that are unfinished after a dispatch are listed for the next.
//
// Its header has four words: the number of entries written, the maximum number of evaluations per invocation,
// the number of entries to read, and their half. The first dispatch reads none. The other half is written.
//
// The header is in storage and not in uniforms. If the end of a loop depended on a uniform, software
// Vulkan would compile the kernel again for each new value.

fn evaluation_budget() -> u32 {
    return atomicLoad(&queue[1]);
}

fn listed_count() -> u32 {
    return atomicLoad(&queue[2]);
}

fn listed_entry(k: u32) -> u32 {
    return atomicLoad(&queue[4u + atomicLoad(&queue[3]) * frame.queue_capacity + k]);
}

fn enqueue(entry: u32) {
    let index = atomicAdd(&queue[0], 1u);
    atomicStore(&queue[4u + (1u - atomicLoad(&queue[3])) * frame.queue_capacity + index], entry);
}
