// Cutting cells: a workgroup takes a cell, and each of its invocations finds what of the cell's tape
// matters in one of its 64 children. One run decides minima and maxima (`bounded`, in
// `cut_by_slopes.wgsl` or `cut_by_intervals.wgsl`), a walk from the back counts what is still read, a
// second one writes it with registers named anew. What finds no room stays as it is, so the cells are
// whole and right at any time.
//
// Words are drawn in `interpreter/tape.rs`, facts and memory in `interpreter/cut.rs`.

struct Given {
    job: Job,
    node: u32,
    choices: u32,
    taken: u32,
    // The entry of its first child before an edit.
    before: u32,
}

// What became of a child: whether it has a tape, how many clauses of its own, and whether it has more
// of them than it needs.
struct Made {
    cells: u32,
    clauses: u32,
    short: u32,
    // Whether its size lets it be cut further.
    wanted: u32,
    // What it is cut as, if it is.
    next: Job,
}

var<workgroup> given: Given;
// The cells, the clauses of their own, those that are short, and the clauses of all their tapes.
var<workgroup> sums: array<atomic<u32>, 4>;

// The end of the tape that a child had before an edit, how long it was, and whether what is kept now is
// the same.
var<private> old_last: u32;
var<private> old_length: u32;
var<private> is_same: bool;

// New names of the registers that are read later, a byte for each old one: one more than the name.
var<private> value_names: array<u32, VALUE_WORDS>;
var<private> point_names: array<u32, POINT_WORDS>;
// Names in use, a bit for each.
var<private> values_taken: vec4u;
var<private> points_taken: u32;

fn value_name(old: u32) -> u32 {
    return (value_names[old >> 2u] >> ((old & 3u) * 8u)) & 255u;
}

fn name_value(old: u32, name: u32) {
    let shift = (old & 3u) * 8u;
    value_names[old >> 2u] = (value_names[old >> 2u] & ~(255u << shift)) | (name << shift);
}

fn free_value(name: u32) {
    let bit = name - 1u;
    values_taken[bit >> 5u] &= ~(1u << (bit & 31u));
}

// The name of a register that is read.
fn read_value(old: u32) -> u32 {
    let name = value_name(old);
    if name != 0u { return name; }
    let free = ~values_taken;
    var word = 3u;
    if free.z != 0u { word = 2u; }
    if free.y != 0u { word = 1u; }
    if free.x != 0u { word = 0u; }
    let bit = firstTrailingBit(free[word]) & 31u;
    values_taken[word] |= 1u << bit;
    let fresh = word * 32u + bit + 1u;
    name_value(old, fresh);
    return fresh;
}

fn point_name(old: u32) -> u32 {
    return (point_names[old >> 2u] >> ((old & 3u) * 8u)) & 255u;
}

fn name_point(old: u32, name: u32) {
    let shift = (old & 3u) * 8u;
    point_names[old >> 2u] = (point_names[old >> 2u] & ~(255u << shift)) | (name << shift);
}

fn read_point(old: u32) -> u32 {
    let name = point_name(old);
    if name != 0u { return name; }
    let bit = firstTrailingBit(~points_taken) & 31u;
    points_taken |= 1u << bit;
    name_point(old, bit + 1u);
    return bit + 1u;
}

// Walks through a tape from its end; gives how many clauses are kept. With `last` they are written,
// the last one there; else they are compared with what was there before. `choices` are those of this
// invocation.
fn walk(tape: u32, length: u32, choices: u32, last: u32) -> u32 {
    // The result is in register 0, and the point that is looked at is point 0.
    value_names = array<u32, VALUE_WORDS>();
    point_names = array<u32, POINT_WORDS>();
    name_value(0u, 1u);
    name_point(0u, 1u);
    values_taken = vec4u(1u, 0u, 0u, 0u);
    points_taken = 1u;
    // Whether clauses that set channels belong to a kept one that paints.
    var painting = false;
    var kept = 0u;
    for (var left = length; left > 0u; left -= 1u) {
        let clause = tapes[tape + left];
        var form = clause.x & 7u;
        let moves = form > 3u;
        var reads = select(facts[clause.x >> INSTRUCTION_SHIFT].w, FIRST_OPERAND, moves);
        var first = (clause.y >> (2u * REGISTER_BITS)) & REGISTER_MASK;
        let old_out = clause.y & REGISTER_MASK;

        var out = 0u;
        if (reads & GIVES_POINT) != 0u {
            out = point_name(old_out & 31u);
            if out != 0u {
                name_point(old_out & 31u, 0u);
                points_taken &= ~(1u << (out - 1u));
            }
        } else if (reads & CHANNEL) == 0u {
            out = value_name(old_out);
            if out != 0u { name_value(old_out, 0u); }
            if (reads & PAINT) != 0u { painting = out != 0u; }
        }
        var keeps = out != 0u || ((reads & CHANNEL) != 0u && painting);

        // The winner of a decided choice is handed on, or its clause does without the blend.
        let open = form == 0u || form == 3u;
        if !open { reads &= ~(BLENDS | CHOICE); }
        if keeps && (reads & CHOICE) != 0u {
            let place = left - 1u;
            let choice = (space.choices[choices + (place >> 4u) * 64u] >> (2u * (place & 15u))) & 3u;
            let blends = (reads & BLENDS) != 0u;
            let negates = choice == 2u && (reads & NEGATES) != 0u;
            if choice == 2u && blends && form == 0u {
                form = select(1u, 2u, negates);
                reads &= ~BLENDS;
            } else if choice != 0u {
                if choice == 1u && blends {
                    first = (clause.y >> REGISTER_BITS) & REGISTER_MASK;
                } else if choice == 2u && !blends {
                    first = (clause.y >> (3u * REGISTER_BITS)) & REGISTER_MASK;
                }
                form = select(4u, 5u, negates);
                reads = FIRST_OPERAND;
                if !negates && value_name(first) == 0u {
                    name_value(first, out);
                    keeps = false;
                }
            }
        }
        if !keeps { continue; }

        if (reads & (GIVES_POINT | CHANNEL)) == 0u { free_value(out); }
        var words = vec2u(
            form | (clause.x & INSTRUCTION_MASK) | NO_POINT_AND_THIRD,
            ((out - 1u) & REGISTER_MASK) | NO_OPERANDS,
        );
        if (reads & BLENDS) != 0u {
            let old = (clause.y >> REGISTER_BITS) & REGISTER_MASK;
            words.y = put(words.y, REGISTER_BITS, read_value(old) - 1u);
        }
        if (reads & FIRST_OPERAND) != 0u {
            words.y = put(words.y, 2u * REGISTER_BITS, read_value(first) - 1u);
        }
        if (reads & SECOND_OPERAND) != 0u {
            let old = (clause.y >> (3u * REGISTER_BITS)) & REGISTER_MASK;
            words.y = put(words.y, 3u * REGISTER_BITS, read_value(old) - 1u);
        }
        if (reads & THIRD_OPERAND) != 0u {
            let old = (clause.x >> 8u) & REGISTER_MASK;
            words.x = put(words.x, 8u, read_value(old) - 1u);
        }
        if (reads & READS_POINT) != 0u {
            let name = read_point((clause.x >> 3u) & 31u) - 1u;
            words.x = (words.x & ~(31u << 3u)) | (name << 3u);
        }
        if last != 0u {
            tapes[last - kept] = words;
        } else if is_same {
            is_same = kept < old_length
                && all(tapes[old_last - kept] == words)
                && (facts[clause.x >> INSTRUCTION_SHIFT].w & CHANGED) == 0u;
        }
        kept += 1u;
    }
    return kept;
}

// A word with a register's name in it.
fn put(word: u32, shift: u32, name: u32) -> u32 {
    return (word & ~(REGISTER_MASK << shift)) | (name << shift);
}

// Adds a cell to those that are to be cut, if there is room.
fn list(job: Job) -> bool {
    if atomicLoad(&work.state[LISTED]) >= work.cut.queue { return false; }
    let number = atomicAdd(&work.state[LISTED], 1u);
    if number >= work.cut.queue { return false; }
    work.jobs[number] = job;
    atomicAdd(&work.state[LOAD], choice_words(job.length) / 4u);
    return true;
}

// How much room the choices of all children take.
fn choice_words(length: u32) -> u32 {
    return (length + 15u) / 16u * 64u;
}

// A cell of the list, with room for its choices and its children.
fn give(number: u32) -> Given {
    var nothing: Given;
    if number >= atomicLoad(&work.state[NEXT]) { return nothing; }
    let job = work.jobs[number];
    if job.length == 0u {
        nodes[job.entry] = nodes[job.before];
        return nothing;
    }
    let need = choice_words(job.length);
    if need > work.cut.choices {
        atomicAdd(&space.state[SHORT], 1u);
        return nothing;
    }
    let choices = atomicAdd(&space.state[USED], need);
    if choices + need > work.cut.choices {
        // Another dispatch has room for it.
        if !list(job) { atomicAdd(&space.state[SHORT], 1u); }
        return nothing;
    }
    let node = atomicAdd(&space.state[NODES], 1u);
    if node >= work.cut.nodes {
        atomicAdd(&space.state[SHORT], 1u);
        return nothing;
    }
    nodes[owner_entry(node)] = job.tape;
    var before = NONE_BEFORE;
    if job.before != NONE_BEFORE {
        let word = nodes[job.before];
        if word >= NODE { before = (word - NODE) * 64u; }
    }
    return Given(job, node, choices, 1u, before);
}

// Where the tape of the cell stands that a node is of.
fn owner_entry(node: u32) -> u32 {
    return work.cut.nodes * 64u + node;
}

// Lets what is kept of a child be compared with what the child was, by the entry that was its.
fn compare_with(entry: u32) {
    is_same = false;
    if entry == NONE_BEFORE { return; }
    var tape = nodes[entry];
    if tape >= NODE { tape = nodes[owner_entry(tape - NODE)]; }
    if tape >= CONSTANT { return; }
    old_length = tapes[tape].x;
    old_last = tape + old_length;
    is_same = true;
}

// Where a tape of so many clauses goes; 0 where there is no room.
fn reserve(length: u32) -> u32 {
    let need = length + 1u;
    if atomicLoad(&space.state[TAPES]) + need > work.cut.tapes { return 0u; }
    let start = atomicAdd(&space.state[TAPES], need);
    return select(0u, start, start + need <= work.cut.tapes);
}

// Whether a cell is cut further: see `engine/cut.rs`.
fn is_wanted(low: vec3f, side: vec3f, clauses: u32, away: f32) -> bool {
    let longest = max(max(side.x, side.y), side.z);
    let outside = max(max(low - work.cut.eye, work.cut.eye - (low + side)), vec3f(0.0));
    let squares = outside * outside;
    let distance = max(sqrt(squares.x + squares.y + squares.z), longest * 0.25);
    let pixel = work.cut.footprint + work.cut.growth * distance;
    return clauses > work.cut.few
        && away < 2.0 * longest
        && longest > work.cut.leaf * pixel;
}

// Makes one child.
fn make(here: Given, lane: u32) -> Made {
    let job = here.job;
    let digit = work.cut.digit;
    let mask = (1u << digit) - 1u;
    let inner = vec3u(lane & mask, (lane >> digit) & mask, lane >> (2u * digit));
    let place = (vec3u(job.x, job.y, job.z) << vec3u(digit)) | inner;
    let level = job.level + 1u;
    // A power of two, exactly; squares are as thick as the whole.
    var side = work.cut.size * bitcast<f32>((127u - digit * level) << 23u);
    let flat = digit == FLAT_DIGIT;
    if flat { side.z = work.cut.size.z; }
    let low = work.cut.low + vec3f(place) * side;
    // A little larger, for what rounding puts on the wrong side of a face.
    let margin = max(max(side.x, side.y), side.z) * 0.015625 + work.cut.rounding;
    var half = side * 0.5 + margin;
    if flat { half.z = side.z * 0.5; }
    let middle = low + side * 0.5;

    let entry = here.node * 64u + lane;
    let choices = here.choices + lane;
    let field = bounded(job, choices, middle, half);
    if field.x > 0.0 && field.x >= work.cut.band {
        nodes[entry] = work.cut.empty;
        return Made();
    }
    if field.y < 0.0 && field.y <= -work.cut.band {
        nodes[entry] = work.cut.full;
        return Made();
    }

    var before = NONE_BEFORE;
    if here.before != NONE_BEFORE { before = here.before + lane; }
    compare_with(before);
    var made = Made();
    made.cells = 1u;
    var tape = job.tape;
    var length = job.length;
    var last = 0u;
    for (var turn = 0u; turn < 2u; turn += 1u) {
        let kept = walk(job.tape, job.length, choices, last);
        if is_same && last == 0u && kept == old_length {
            nodes[entry] = nodes[before];
            return Made();
        }
        if kept == job.length || last != 0u { break; }
        let start = reserve(kept);
        if start == 0u {
            made.short = 1u;
            break;
        }
        tapes[start] = vec2u(kept, 0u);
        tape = start;
        length = kept;
        last = start + kept;
        made.clauses = kept;
    }
    nodes[entry] = tape;

    let away = max(max(field.x, -field.y), 0.0);
    made.next = Job(entry, tape, length, level, place.x, place.y, place.z, 0u, before);
    made.wanted = u32(
        made.short == 0u && level < work.cut.levels && is_wanted(low, side, length, away)
    );
    return made;
}

// Whether a list of clauses is next to nothing shorter than another.
fn is_as_long(length: u32, other: u32) -> bool {
    return length * 10u > other * 9u;
}

// Lists a child that is to be cut, unless it is stale; gives 1 where there was no room. A child that kept
// all is no reason to stop where the others are rid of most: it is large still, and what is in it is small.
fn pass_on(job: Job, made: Made, cells: u32, clauses: u32) -> u32 {
    var next = made.next;
    if is_as_long(clauses, cells * job.length) && is_as_long(next.length, job.length) {
        next.stale = job.stale + 1u;
    }
    let most_stale = select(STALE_WHOLE, STALE_PART, next.length * 2u <= work.cut.whole);
    if made.wanted == 0u || next.stale >= most_stale { return 0u; }
    return select(1u, 0u, list(next));
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    if lane == 0u {
        given = give(atomicLoad(&work.state[FIRST]) + group.y * groups.x + group.x);
    }
    let here = workgroupUniformLoad(&given);
    if here.taken == 0u { return; }
    let made = make(here, lane);
    atomicAdd(&sums[0], made.cells);
    atomicAdd(&sums[1], made.clauses);
    atomicAdd(&sums[3], made.next.length);
    workgroupBarrier();
    let without_room = pass_on(here.job, made, atomicLoad(&sums[0]), atomicLoad(&sums[3]));
    atomicAdd(&sums[2], made.short + without_room);
    workgroupBarrier();
    if lane == 0u {
        atomicAdd(&space.state[MADE], atomicLoad(&sums[0]));
        atomicAdd(&space.state[CLAUSES], atomicLoad(&sums[1]));
        atomicAdd(&space.state[SHORT], atomicLoad(&sums[2]));
        nodes[here.job.entry] = NODE | here.node;
    }
}
