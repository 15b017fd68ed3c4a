// The queue of a resumable stage: what is still under way after a dispatch is listed for the next.
// Four words stand in front: how many entries were written, how often the scene may be evaluated in
// an invocation, how many entries are to be read (none in the first dispatch), and which half they
// are in; the other half is written.
//
// They are read from here and not from uniforms, since software Vulkan compiles a kernel again for
// each new value of a uniform that a loop's end depends on.

fn evaluations_left() -> u32 {
    return atomicLoad(&queue[1]);
}

fn entries_listed() -> u32 {
    return atomicLoad(&queue[2]);
}

fn resumed(k: u32) -> u32 {
    return atomicLoad(&queue[4u + atomicLoad(&queue[3]) * frame.capacity + k]);
}

fn enqueue(entry: u32) {
    let place = atomicAdd(&queue[0], 1u);
    atomicStore(&queue[4u + (1u - atomicLoad(&queue[3])) * frame.capacity + place], entry);
}
