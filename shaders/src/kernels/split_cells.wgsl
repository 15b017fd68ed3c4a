// Splitting cells: a workgroup takes a cell, and each of its invocations prunes the cell's tape for one of
// its 64 children. One evaluation decides minima and maxima (`field_range`, in `prune_by_slopes.wgsl` or
// `prune_by_intervals.wgsl`). A backward liveness pass counts the clauses that are still live, and a second
// one writes them with renamed registers. A child without memory for its tape keeps its parent's, so the
// cells are complete and correct at any time.
//
// The words are described in `interpreter/tape.rs`, instruction info and buffers in
// `interpreter/split_cells.rs`.

// A claimed job with its node and its memory for choices; invalid where `is_valid` is 0.
struct ClaimedJob {
    job: CellJob,
    node: u32,
    choices: u32,
    is_valid: u32,
    // The entry of its first child before an edit.
    old_children: u32,
}

// Results of a child: 1 for a cell with a tape, the number of its own clauses, and 1 without memory for them.
struct ChildStats {
    cells: u32,
    clauses: u32,
    out_of_memory: u32,
    // 1 where its size allows to split it.
    should_split: u32,
    // The job that would split it.
    next: CellJob,
}

var<workgroup> claimed: ClaimedJob;
// Sums of cells, of their own clauses, of children without memory, and of the clauses of all their tapes.
var<workgroup> sums: array<atomic<u32>, 4>;

// The end and the length of the tape that a child had before an edit, and whether the pruned tape equals it.
var<private> old_end: u32;
var<private> old_length: u32;
var<private> matches_old: bool;

// New names of the live registers, a byte for each old one: the name plus one.
var<private> value_names: array<u32, VALUE_WORDS>;
var<private> point_names: array<u32, POINT_WORDS>;
// Names in use, a bit for each.
var<private> values_taken: vec4u;
var<private> points_taken: u32;

fn value_name(old_register: u32) -> u32 {
    return (value_names[old_register >> 2u] >> ((old_register & 3u) * 8u)) & 255u;
}

fn rename_value(old_register: u32, name: u32) {
    let shift = (old_register & 3u) * 8u;
    value_names[old_register >> 2u] = (value_names[old_register >> 2u] & ~(255u << shift)) | (name << shift);
}

fn free_value(name: u32) {
    let bit = name - 1u;
    values_taken[bit >> 5u] &= ~(1u << (bit & 31u));
}

// Returns the name of a register that is read.
fn use_value(old_register: u32) -> u32 {
    let name = value_name(old_register);
    if name != 0u { return name; }
    let free = ~values_taken;
    var word = 3u;
    if free.z != 0u { word = 2u; }
    if free.y != 0u { word = 1u; }
    if free.x != 0u { word = 0u; }
    let bit = firstTrailingBit(free[word]) & 31u;
    values_taken[word] |= 1u << bit;
    let new_name = word * 32u + bit + 1u;
    rename_value(old_register, new_name);
    return new_name;
}

fn point_name(old_register: u32) -> u32 {
    return (point_names[old_register >> 2u] >> ((old_register & 3u) * 8u)) & 255u;
}

fn rename_point(old_register: u32, name: u32) {
    let shift = (old_register & 3u) * 8u;
    point_names[old_register >> 2u] = (point_names[old_register >> 2u] & ~(255u << shift)) | (name << shift);
}

fn use_point(old_register: u32) -> u32 {
    let name = point_name(old_register);
    if name != 0u { return name; }
    let bit = firstTrailingBit(~points_taken) & 31u;
    points_taken |= 1u << bit;
    rename_point(old_register, bit + 1u);
    return bit + 1u;
}

// Prunes a tape from its end, and returns the number of live clauses. With an `end` they are written, the
// last one there; else they are compared with the old tape. `choices` are those of this invocation.
fn prune_tape(tape: u32, length: u32, choices: u32, end: u32) -> u32 {
    // The result is in register 0, and the evaluated point is point 0.
    value_names = array<u32, VALUE_WORDS>();
    point_names = array<u32, POINT_WORDS>();
    rename_value(0u, 1u);
    rename_point(0u, 1u);
    values_taken = vec4u(1u, 0u, 0u, 0u);
    points_taken = 1u;
    // Clauses that set channels are live if they belong to a live one that sets a material.
    var sets_material = false;
    var kept_count = 0u;
    for (var remaining = length; remaining > 0u; remaining -= 1u) {
        let clause = tapes[tape + remaining];
        var kind = clause.x & 7u;
        let is_move = kind > 3u;
        var reads = select(instruction_info[clause.x >> INSTRUCTION_SHIFT].w, FIRST_OPERAND, is_move);
        var first = (clause.y >> (2u * REGISTER_BITS)) & REGISTER_MASK;
        let old_result = clause.y & REGISTER_MASK;

        var result = 0u;
        if (reads & RETURNS_POINT) != 0u {
            result = point_name(old_result & 31u);
            if result != 0u {
                rename_point(old_result & 31u, 0u);
                points_taken &= ~(1u << (result - 1u));
            }
        } else if (reads & CHANNEL) == 0u {
            result = value_name(old_result);
            if result != 0u { rename_value(old_result, 0u); }
            if (reads & PAINT) != 0u { sets_material = result != 0u; }
        }
        var is_kept = result != 0u || ((reads & CHANNEL) != 0u && sets_material);

        // The surviving operand of a decided choice is forwarded, or its clause loses the blend.
        let is_undecided = kind == 0u || kind == 3u;
        if !is_undecided { reads &= ~(BLENDS | CHOICE); }
        if is_kept && (reads & CHOICE) != 0u {
            let clause_index = remaining - 1u;
            let choice = (scratch.choices[choices + (clause_index >> 4u) * 64u] >> (2u * (clause_index & 15u))) & 3u;
            let blends = (reads & BLENDS) != 0u;
            let negates = choice == 2u && (reads & NEGATES) != 0u;
            if choice == 2u && blends && kind == 0u {
                kind = select(1u, 2u, negates);
                reads &= ~BLENDS;
            } else if choice != 0u {
                if choice == 1u && blends {
                    first = (clause.y >> REGISTER_BITS) & REGISTER_MASK;
                } else if choice == 2u && !blends {
                    first = (clause.y >> (3u * REGISTER_BITS)) & REGISTER_MASK;
                }
                kind = select(4u, 5u, negates);
                reads = FIRST_OPERAND;
                if !negates && value_name(first) == 0u {
                    rename_value(first, result);
                    is_kept = false;
                }
            }
        }
        if !is_kept { continue; }

        if (reads & (RETURNS_POINT | CHANNEL)) == 0u { free_value(result); }
        var words = vec2u(
            kind | (clause.x & INSTRUCTION_MASK) | NO_POINT_AND_THIRD,
            ((result - 1u) & REGISTER_MASK) | NO_OPERANDS,
        );
        if (reads & BLENDS) != 0u {
            let old_register = (clause.y >> REGISTER_BITS) & REGISTER_MASK;
            words.y = set_register(words.y, REGISTER_BITS, use_value(old_register) - 1u);
        }
        if (reads & FIRST_OPERAND) != 0u {
            words.y = set_register(words.y, 2u * REGISTER_BITS, use_value(first) - 1u);
        }
        if (reads & SECOND_OPERAND) != 0u {
            let old_register = (clause.y >> (3u * REGISTER_BITS)) & REGISTER_MASK;
            words.y = set_register(words.y, 3u * REGISTER_BITS, use_value(old_register) - 1u);
        }
        if (reads & THIRD_OPERAND) != 0u {
            let old_register = (clause.x >> 8u) & REGISTER_MASK;
            words.x = set_register(words.x, 8u, use_value(old_register) - 1u);
        }
        if (reads & READS_POINT) != 0u {
            let name = use_point((clause.x >> 3u) & 31u) - 1u;
            words.x = (words.x & ~(31u << 3u)) | (name << 3u);
        }
        if end != 0u {
            tapes[end - kept_count] = words;
        } else if matches_old {
            matches_old = kept_count < old_length
                && all(tapes[old_end - kept_count] == words)
                && (instruction_info[clause.x >> INSTRUCTION_SHIFT].w & CHANGED) == 0u;
        }
        kept_count += 1u;
    }
    return kept_count;
}

// Inserts the name of a register into a word.
fn set_register(word: u32, shift: u32, name: u32) -> u32 {
    return (word & ~(REGISTER_MASK << shift)) | (name << shift);
}

// Lists a cell to be split, and returns whether there was memory for it.
fn enqueue_job(job: CellJob) -> bool {
    if atomicLoad(&job_queue.state[LISTED]) >= job_queue.params.queue_capacity { return false; }
    let index = atomicAdd(&job_queue.state[LISTED], 1u);
    if index >= job_queue.params.queue_capacity { return false; }
    job_queue.jobs[index] = job;
    atomicAdd(&job_queue.state[WAITING_CLAUSES], choice_words(job.length) / 4u);
    return true;
}

// Returns the number of words for the choices of all children.
fn choice_words(length: u32) -> u32 {
    return (length + 15u) / 16u * 64u;
}

// Claims a cell of the list, with memory for its choices and its children.
fn claim_job(index: u32) -> ClaimedJob {
    var none: ClaimedJob;
    if index >= atomicLoad(&job_queue.state[NEXT]) { return none; }
    let job = job_queue.jobs[index];
    if job.length == 0u {
        nodes[job.node_entry] = nodes[job.old_entry];
        return none;
    }
    let choice_word_count = choice_words(job.length);
    if choice_word_count > job_queue.params.choice_capacity {
        atomicAdd(&scratch.state[OUT_OF_MEMORY], 1u);
        return none;
    }
    let choices = atomicAdd(&scratch.state[CHOICE_WORDS], choice_word_count);
    if choices + choice_word_count > job_queue.params.choice_capacity {
        // Another dispatch has memory for it.
        if !enqueue_job(job) { atomicAdd(&scratch.state[OUT_OF_MEMORY], 1u); }
        return none;
    }
    let node = atomicAdd(&scratch.state[NODES], 1u);
    if node >= job_queue.params.node_capacity {
        atomicAdd(&scratch.state[OUT_OF_MEMORY], 1u);
        return none;
    }
    nodes[parent_tape_slot(node)] = job.tape;
    var old_children = NO_OLD_ENTRY;
    if job.old_entry != NO_OLD_ENTRY {
        let old_word = nodes[job.old_entry];
        if old_word >= NODE { old_children = (old_word - NODE) * 64u; }
    }
    return ClaimedJob(job, node, choices, 1u, old_children);
}

// Returns the entry for the tape of the cell of a node.
fn parent_tape_slot(node: u32) -> u32 {
    return job_queue.params.node_capacity * 64u + node;
}

// Prepares the comparison of a child's pruned tape with its old one, by its old entry.
fn compare_with_old(entry: u32) {
    matches_old = false;
    if entry == NO_OLD_ENTRY { return; }
    var tape = nodes[entry];
    if tape >= NODE { tape = nodes[parent_tape_slot(tape - NODE)]; }
    if tape >= SIGN_ONLY { return; }
    old_length = tapes[tape].x;
    old_end = tape + old_length;
    matches_old = true;
}

// Returns the start of memory for a tape of `length` clauses; 0 where there is none.
fn reserve_tape(length: u32) -> u32 {
    let word_count = length + 1u;
    if atomicLoad(&scratch.state[TAPES]) + word_count > job_queue.params.tape_capacity { return 0u; }
    let start = atomicAdd(&scratch.state[TAPES], word_count);
    return select(0u, start, start + word_count <= job_queue.params.tape_capacity);
}

// Builds a child.
fn build_child(claim: ClaimedJob, lane: u32) -> ChildStats {
    let job = claim.job;
    let digit = job_queue.params.digit_bits;
    let mask = (1u << digit) - 1u;
    let child_position = vec3u(lane & mask, (lane >> digit) & mask, lane >> (2u * digit));
    let position = (vec3u(job.x, job.y, job.z) << vec3u(digit)) | child_position;
    let level = job.level + 1u;
    // An exact power of two. Flat cells are as thick as the whole box.
    var side = job_queue.params.size * bitcast<f32>((127u - digit * level) << 23u);
    let is_flat = digit == FLAT_DIGIT;
    if is_flat { side.z = job_queue.params.size.z; }
    let low = job_queue.params.low + vec3f(position) * side;
    // A margin for the rounding of points near a face.
    let margin = max(max(side.x, side.y), side.z) * 0.015625 + job_queue.params.rounding;
    var half = side * 0.5 + margin;
    if is_flat { half.z = side.z * 0.5; }
    let centre = low + side * 0.5;

    let entry = claim.node * 64u + lane;
    let choices = claim.choices + lane;
    var range = field_range(job, choices, centre, half);
    if job_queue.params.margin > 0.0 && (range.x >= job_queue.params.band || range.y <= -job_queue.params.band) {
        var wide = half + job_queue.params.margin;
        if is_flat { wide.z = half.z; }
        range = field_range(job, choices, centre, wide);
    }
    if range.x >= job_queue.params.band {
        nodes[entry] = job_queue.params.empty_word;
        return ChildStats();
    }
    if range.y < 0.0 && range.y <= -job_queue.params.band {
        nodes[entry] = job_queue.params.full_word;
        return ChildStats();
    }

    var old_entry = NO_OLD_ENTRY;
    if claim.old_children != NO_OLD_ENTRY { old_entry = claim.old_children + lane; }
    compare_with_old(old_entry);
    var stats = ChildStats();
    stats.cells = 1u;
    var tape = job.tape;
    var length = job.length;
    var end = 0u;
    for (var pass_index = 0u; pass_index < 2u; pass_index += 1u) {
        let kept_count = prune_tape(job.tape, job.length, choices, end);
        if matches_old && end == 0u && kept_count == old_length {
            nodes[entry] = nodes[old_entry];
            return ChildStats();
        }
        if kept_count == job.length || end != 0u { break; }
        let start = reserve_tape(kept_count);
        if start == 0u {
            stats.out_of_memory = 1u;
            break;
        }
        tapes[start] = vec2u(kept_count, 0u);
        tape = start;
        length = kept_count;
        end = start + kept_count;
        stats.clauses = kept_count;
    }
    nodes[entry] = tape;

    let min_abs_field = max(max(range.x, -range.y), 0.0);
    stats.next = CellJob(entry, tape, length, level, position.x, position.y, position.z, 0u, old_entry);
    stats.should_split = u32(
        stats.out_of_memory == 0u && level < job_queue.params.max_levels && should_split(low, side, length, min_abs_field)
    );
    return stats;
}

// Lists a child to be split, unless it is stalled; returns 1 without memory for it.
fn enqueue_child(job: CellJob, child: ChildStats, cells: u32, clauses: u32) -> u32 {
    var next = child.next;
    next.stalled_levels = count_stalled_levels(job, next.length, cells, clauses);
    if child.should_split == 0u || exceeds_stall_limit(next) { return 0u; }
    return select(1u, 0u, enqueue_job(next));
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    if lane == 0u {
        claimed = claim_job(atomicLoad(&job_queue.state[FIRST]) + group.y * groups.x + group.x);
    }
    let claim = workgroupUniformLoad(&claimed);
    if claim.is_valid == 0u { return; }
    let child = build_child(claim, lane);
    atomicAdd(&sums[0], child.cells);
    atomicAdd(&sums[1], child.clauses);
    atomicAdd(&sums[3], child.next.length);
    workgroupBarrier();
    let not_enqueued = enqueue_child(claim.job, child, atomicLoad(&sums[0]), atomicLoad(&sums[3]));
    atomicAdd(&sums[2], child.out_of_memory + not_enqueued);
    workgroupBarrier();
    if lane == 0u {
        atomicAdd(&scratch.state[CELLS], atomicLoad(&sums[0]));
        atomicAdd(&scratch.state[CLAUSES], atomicLoad(&sums[1]));
        atomicAdd(&scratch.state[OUT_OF_MEMORY], atomicLoad(&sums[2]));
        nodes[claim.job.node_entry] = NODE | claim.node;
    }
}
