//! Programs: random ones, always valid, whose forms and runs must agree.
//!
//! The generator draws every opcode of the table and every way to use it (frames, kept points,
//! slots, constant operands, blends), so a new row is covered without a new test.

use sdfc_vm::dual::Dual;
use sdfc_vm::encode::{decode, encode};
use sdfc_vm::evaluate::{evaluate, gradient};
use sdfc_vm::interval::Interval;
use sdfc_vm::kernel::Kernel;
use sdfc_vm::lanes::{Column, LANES, seeded};
use sdfc_vm::listing;
use sdfc_vm::pool::{PoolBuilder, PoolNumber};
use sdfc_vm::program::{Code, Frame, Instruction, MAX_POINTS, Operands, Place, Program};
use sdfc_vm::rounding::bound;
use sdfc_vm::row::Output;
use sdfc_vm::table::{Op, ROWS};
use sdfc_vm::tape::choose::{Chooser, Decided};
use sdfc_vm::tape::machine::Machine;
use sdfc_vm::tape::prune::Pruner;
use sdfc_vm::tape::steep::Slopes;
use sdfc_vm::tape::{Clause, Form, Tape};
use sdfc_vm::vector::V3;
use sdfc_vm::verify::{VerifyError, verify};
use std::sync::Arc;

/// xorshift64*: small, seeded, the same everywhere.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }
    fn below(&mut self, n: usize) -> usize {
        (self.next() >> 33) as usize % n
    }
    fn number(&mut self) -> f32 {
        // A few digits only, so that listings stay short.
        (self.below(4001) as f32 - 2000.0) / 1000.0
    }
    fn chance(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }
}

fn random_program(seed: u64) -> Program {
    let mut r = Random(seed.wrapping_mul(2).wrapping_add(1));
    let mut pool = PoolBuilder::default();
    let mut code = Vec::new();
    let (mut depth, mut points, mut slots) = (0_usize, 0_usize, 0_u32);
    let length = 3 + r.below(40);
    while code.len() < length || depth != 1 {
        let closing = code.len() >= length && depth > 1;
        if depth > 0 && r.chance(8) {
            guarded_balls(&mut r, &mut pool, &mut code, points, 0);
            continue;
        }
        let numbers = |r: &mut Random, n: usize| -> Vec<PoolNumber> {
            (0..n).map(|_| r.number().into()).collect()
        };
        let code_of = |r: &mut Random| match r.below(12) {
            0 if slots > 0 => Code::Load,
            1 if depth > 0 => Code::Store,
            2 if depth > 1 => Code::Take,
            _ => Code::Op(ROWS[r.below(ROWS.len())].op),
        };
        let picked = if closing { Code::Take } else { code_of(&mut r) };
        let mut i = Instruction::new(picked);
        if let Code::Op(op) = picked {
            let row = op.row();
            if row.arity() == 2 && r.chance(30) {
                let index = pool.add(&numbers(&mut r, 1));
                i.operands = if r.chance(50) {
                    Operands::Left(index)
                } else {
                    Operands::Right(index)
                };
            }
            if row.parameter_width() > 0 {
                i.parameters = pool.add(&numbers(&mut r, row.parameter_width()));
            }
            if row.reads_point() {
                i.frame = match r.below(3) {
                    0 => Frame::Same,
                    1 => Frame::Moved(pool.add(&numbers(&mut r, 3))),
                    _ => Frame::Mapped(pool.add(&numbers(&mut r, 12))),
                };
            }
            if points > 0 && r.chance(30) {
                i.pops = (1 + r.below(points)) as u8;
            }
            if row.output == Output::Point && points - (i.pops as usize) < MAX_POINTS {
                i.push = r.chance(70);
            }
        }
        if i.taken() > depth {
            continue;
        }
        match picked {
            Code::Load => i.slot = r.below(slots as usize) as u8,
            Code::Store => {
                i.slot = r.below(slots as usize + 1).min(7) as u8;
                slots = slots.max(u32::from(i.slot) + 1);
            }
            _ => {}
        }
        let left = depth - i.taken();
        let blends = closing || r.chance(40);
        if blends && left > 0 && !i.gives_none() && i.operands == Operands::Stack {
            let kernel = Kernel::ALL[r.below(5)];
            let signs = [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]][r.below(3)];
            let width = 0.1 + r.below(10) as f32 / 10.0;
            let list = [signs[0], signs[1], width, 1.0 / (4.0 * width)].map(PoolNumber::from);
            i.place = Place::Blend {
                kernel,
                index: pool.add(&list),
            };
        }
        let pushes = i.place == Place::Push && !i.gives_none();
        if left + usize::from(pushes) > 8 {
            continue;
        }
        points = points - i.pops as usize + usize::from(i.push);
        depth = left + usize::from(pushes);
        code.push(i);
        if code.len() > 400 {
            // Never seen; a guard against a generator that cannot close.
            panic!("the program does not end");
        }
    }
    let (pool, patches) = pool.finish();
    Program {
        code,
        pool,
        patches,
        slots,
    }
}

/// A guard in front of balls that are blended into the value on top, some of them behind guards of
/// their own, some at a point that is kept for a while. It tells the truth: what it skips does not
/// matter.
fn guarded_balls(
    r: &mut Random,
    pool: &mut PoolBuilder,
    code: &mut Vec<Instruction>,
    points: usize,
    level: usize,
) -> [[f32; 2]; 3] {
    let at = code.len();
    code.push(Instruction::new(Code::Guard));
    let smooth = r.chance(50);
    let mut hull = [[f32::INFINITY, f32::NEG_INFINITY]; 3];
    for _ in 0..1 + r.below(3) {
        if level < 3 && r.chance(25) {
            let inner = guarded_balls(r, pool, code, points, level + 1);
            for (side, [low, high]) in hull.iter_mut().zip(inner) {
                *side = [side[0].min(low), side[1].max(high)];
            }
            continue;
        }
        let mut ball = Instruction::new(Code::Op(Op::Sphere));
        let radius = 0.1 + r.below(900) as f32 / 1000.0;
        let by: [f32; 3] = std::array::from_fn(|_| r.number());
        ball.parameters = pool.add(&[radius.into()]);
        ball.frame = Frame::Moved(pool.add(&by.map(PoolNumber::from)));
        let kernel = if smooth {
            Kernel::Quadratic
        } else {
            Kernel::Hard
        };
        let list = [1.0, 1.0, 0.5, 0.5].map(PoolNumber::from);
        ball.place = Place::Blend {
            kernel,
            index: pool.add(&list),
        };
        // The mirrored point is kept for this ball only: the shape is there on both sides.
        let mirrors = points + level < MAX_POINTS && r.chance(25);
        if mirrors {
            code.push(Instruction {
                push: true,
                parameters: pool.add(&[1.0.into(), 1.0.into(), 1.0.into()]),
                ..Instruction::new(Code::Op(Op::Mirror))
            });
        }
        code.push(ball);
        if mirrors {
            code.push(Instruction {
                pops: 1,
                ..Instruction::new(Code::Take)
            });
        }
        for (side, by) in hull.iter_mut().zip(by) {
            let reach = if mirrors {
                [-by.abs() - radius, by.abs() + radius]
            } else {
                [-by - radius, -by + radius]
            };
            *side = [side[0].min(reach[0]), side[1].max(reach[1])];
        }
    }
    let middle = hull.map(|[low, high]| (low + high) / 2.0);
    let half = hull.map(|[low, high]| (high - low) / 2.0 + 0.01);
    // The blends within may be smooth, or those of the guards within.
    let volume = [
        middle[0], middle[1], middle[2], 0.5, half[0], half[1], half[2], 1.0,
    ];
    let parameters = pool.add(&volume.map(PoolNumber::from));
    code[at].parameters = parameters;
    code[at].skips = (code.len() - at - 1) as u32;
    hull
}

fn random_points(seed: u64) -> [Column; 3] {
    let mut r = Random(seed | 1);
    std::array::from_fn(|_| Column(std::array::from_fn(|_| r.number())))
}

/// Equal bits, or both not a number: raw arithmetic on random numbers may well have none.
fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

#[test]
fn random_programs_verify_and_survive_every_form() {
    for seed in 0..3000 {
        let program = random_program(seed);
        verify(&program, 0, false).unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        let words = encode(&program.code);
        assert_eq!(decode(&words).as_ref(), Ok(&program.code), "seed {seed}");
        let text = listing::print(&program);
        let parsed = listing::parse(&text).unwrap_or_else(|error| panic!("{error}\n{text}"));
        assert_eq!(parsed.code.len(), program.code.len());
        // Pool indices may differ where constants happen to be shared otherwise; text does not.
        assert_eq!(listing::print(&parsed), text, "seed {seed}");
    }
}

fn values_at(program: &Program, tape: &[Clause], points: &[Column; 3]) -> Column {
    let whole = Tape::of(program);
    let mut machine = Machine::<f32>::new(whole.values, whole.points);
    *machine.seed() = *points;
    *machine.run(program, tape, LANES)
}

/// No program is off by more than its running error bound, with guards and without.
#[test]
fn programs_are_off_by_no_more_than_their_bound() {
    let (mut told, mut senseless) = (0, 0);
    for seed in 0..3000 {
        let program = random_program(seed);
        let mut r = Random(seed * 7 + 3);
        for _ in 0..20 {
            let p: [f32; 3] = std::array::from_fn(|_| r.number() * 1.37);
            let [x, y, z] = p;
            let single = f64::from(evaluate::<f32>(&program, V3::of(x, y, z)));
            let [x, y, z] = p.map(f64::from);
            let double = evaluate::<f64>(&program, V3::of(x, y, z));
            let found = bound(&program, [x, y, z].map(Interval::point), [0.0; 3]);
            if single.is_nan() || double.is_nan() {
                senseless += 1;
                continue;
            }
            let most = found.whatever_is_decided();
            if most == f64::INFINITY {
                continue;
            }
            told += 1;
            let off = (single - double).abs();
            assert!(
                off <= most + 1e-12 * (1.0 + double.abs()),
                "seed {seed} at {p:?}: {single} instead of {double}, {off} off, by no more than {most}\n{}",
                listing::print(&program)
            );
        }
    }
    assert!(
        told > 30_000,
        "something is known of {told} in 60,000 values"
    );
    assert!(senseless < 6_000, "{senseless} of 60,000 values are none");
}

/// Whether the value at a point is not even in the interval of a box that is no more than the point: the
/// program takes the root of a negative number on the way.
fn broken(program: &Program, tape: &Tape, points: &[Column; 3], lane: usize) -> bool {
    let mut chooser = Chooser::new(tape);
    let boxes = chooser.boxes();
    boxes[..3].copy_from_slice(points);
    boxes[3..].copy_from_slice(points);
    let [lo, hi] = *chooser.run(program, &tape.clauses, LANES);
    let value = values_at(program, &tape.clauses, points).0[lane];
    !(lo.0[lane] <= value && value <= hi.0[lane])
}

/// In a box, the tape that was pruned for it gives the bits of the whole one, and the interval holds
/// them; and again for the boxes in that box, pruned from the pruned tape.
#[test]
fn pruned_tapes_give_the_same_bits_in_their_box() {
    let (mut shorter, mut senseless) = (0, 0);
    for seed in 0..3000 {
        let program = random_program(seed);
        // The numbers of these programs are any, so the slopes of the rows say nothing of them.
        let unknown = Slopes {
            whole: f32::INFINITY,
            ..Slopes::default()
        };
        let tape = Tape {
            slopes: Arc::new(unknown),
            ..Tape::of(&program)
        };
        let (mut chooser, mut pruner) = (Chooser::new(&tape), Pruner::default());
        pruner.reserve(tape.values, tape.points);
        let mut r = Random(seed * 5 + 2);
        let mut clauses = tape.clauses.clone();
        let mut centre: [f32; 3] = std::array::from_fn(|_| r.number());
        let mut half = 0.5 * r.number().abs();
        for _ in 0..3 {
            let boxes = chooser.boxes();
            for axis in 0..3 {
                boxes[axis].0 = [centre[axis] - half; LANES];
                boxes[axis + 3].0 = [centre[axis] + half; LANES];
            }
            let [lo, hi] = chooser.run(&program, &clauses, LANES);
            let (lo, hi) = (lo.0[7], hi.0[7]);
            let mut pruned = Vec::new();
            pruner.prune(
                &clauses,
                |place| chooser.decided().choice(place, 7),
                &mut pruned,
            );
            shorter += usize::from(pruned.len() < clauses.len());
            let inner = half * 0.3;
            let points: [Column; 3] = std::array::from_fn(|axis| {
                Column(std::array::from_fn(|_| {
                    (centre[axis] + half * r.number())
                        .clamp(centre[axis] - half, centre[axis] + half)
                }))
            });
            let all = values_at(&program, &tape.clauses, &points);
            let some = values_at(&program, &pruned, &points);
            for lane in 0..LANES {
                let (a, b) = (all.0[lane], some.0[lane]);
                let agree = same(a, b) && lo <= a && a <= hi;
                // A smaller operand that is not a number is lost in a minimum, but not without it.
                if !agree && (b.is_nan() || broken(&program, &tape, &points, lane)) {
                    senseless += 1;
                    continue;
                }
                assert!(
                    agree,
                    "seed {seed}: {a} by all, {b} by what was kept, in [{lo}, {hi}]\n{}",
                    listing::print(&program)
                );
            }
            clauses = pruned;
            // The next box lies within this one.
            for axis in &mut centre {
                *axis += (half - inner) * 0.9 * r.number().clamp(-1.0, 1.0);
            }
            half = inner;
        }
    }
    assert!(shorter > 1000, "only {shorter} of 9,000 became shorter");
    assert!(senseless < 20_000, "{senseless} of 576,000 values are none");
}

/// A tape pruned for several boxes, and from there for each of them, is what pruning for each alone
/// gives.
#[test]
fn boxes_are_pruned_together_as_they_are_alone() {
    let (mut shorter, mut between) = (0, 0);
    for seed in 0..1000 {
        let program = random_program(seed);
        let tape = Tape::of(&program);
        let (mut chooser, mut pruner) = (Chooser::new(&tape), Pruner::default());
        pruner.reserve(tape.values, tape.points);
        let mut r = Random(seed * 7 + 3);
        let boxes = chooser.boxes();
        for lane in 0..LANES {
            let half = 0.2 * r.number().abs();
            for axis in 0..3 {
                let middle = r.number();
                boxes[axis].0[lane] = middle - half;
                boxes[axis + 3].0[lane] = middle + half;
            }
        }
        chooser.run(&program, &tape.clauses, LANES);
        let decided = chooser.decided();
        for lanes in [0x1111_u64, 0xF0F0 << 20, 1 << 63, 0b110] {
            let (mut together, mut common) = (Vec::new(), Decided::default());
            decided.prune_for(
                lanes,
                &tape.clauses,
                &mut pruner,
                &mut together,
                &mut common,
            );
            shorter += usize::from(together.len() < tape.clauses.len());
            for lane in (0..LANES).filter(|lane| lanes >> lane & 1 == 1) {
                let mut prune = |tape: &[Clause], decided: &Decided| {
                    let mut kept = Vec::new();
                    let choice = |place| decided.choice(place, lane);
                    pruner.prune(tape, choice, &mut kept);
                    kept
                };
                let alone = prune(&tape.clauses, decided);
                let by_way = prune(&together, &common);
                between += usize::from(by_way.len() < together.len());
                let points: [Column; 3] =
                    std::array::from_fn(|_| Column(std::array::from_fn(|_| r.number())));
                let values = [&alone, &by_way].map(|kept| values_at(&program, kept, &points));
                let length = |kept: &[Clause]| {
                    let moves = |clause: &&Clause| matches!(clause.form, Form::Copy);
                    kept.len() - kept.iter().filter(moves).count()
                };
                assert_eq!(length(&alone), length(&by_way), "seed {seed}, lane {lane}");
                for lane in 0..LANES {
                    let [a, b] = [values[0].0[lane], values[1].0[lane]];
                    assert!(same(a, b), "seed {seed}: {a} alone, {b} by way of others");
                }
            }
        }
    }
    assert!(shorter > 300, "only {shorter} of 4,000 became shorter");
    assert!(between > 300, "only {between} became shorter still");
}

#[test]
fn batches_and_single_points_agree_in_every_bit() {
    for seed in 0..1500 {
        let program = random_program(seed);
        let points = random_points(seed * 7 + 3);
        let tape = Tape::of(&program);
        let values = values_at(&program, &tape.clauses, &points);
        let mut dual = Machine::<Dual<f32>>::new(tape.values, tape.points);
        *dual.seed() = seeded(&points);
        let duals = *dual.run(&program, &tape.clauses, LANES);
        for lane in 0..LANES {
            let p = V3::of(points[0].0[lane], points[1].0[lane], points[2].0[lane]);
            let single = evaluate::<f32>(&program, p);
            let listing = || listing::print(&program);
            assert!(
                same(values.0[lane], single),
                "seed {seed}: {} in a batch, {single} alone at {p:?}\n{}",
                values.0[lane],
                listing()
            );
            let exact = gradient::<f32>(&program, p);
            let both = [
                (duals[3].0[lane], exact.value),
                (duals[0].0[lane], exact.gradient.x),
                (duals[1].0[lane], exact.gradient.y),
                (duals[2].0[lane], exact.gradient.z),
            ];
            // What a guard skips may turn the sign of a zero in the gradient.
            assert!(
                both.iter().all(|&(a, b)| same(a, b) || a == b),
                "seed {seed}: {both:?}\n{}",
                listing()
            );
        }
    }
}

#[test]
fn damaged_words_are_refused_or_run() {
    let mut refused = 0;
    for seed in 0..20_000 {
        let mut r = Random(seed * 2 + 1);
        let program = random_program(seed % 50);
        let mut words = encode(&program.code);
        for _ in 0..=r.below(3) {
            let at = r.below(words.len());
            words[at] ^= 1 << r.below(32);
        }
        let Ok(code) = decode(&words) else {
            refused += 1;
            continue;
        };
        let damaged = Program { code, ..program };
        match verify(&damaged, 0, false) {
            Err(_) => refused += 1,
            // What is accepted runs to its end without an access out of range.
            Ok(()) => {
                let tape = Tape::of(&damaged);
                values_at(&damaged, &tape.clauses, &random_points(seed));
            }
        }
    }
    assert!(refused > 10_000, "only {refused} of 20,000 were refused");
}

#[test]
fn limits_are_refused_with_both_numbers() {
    let constant = Instruction::new(Code::Op(Op::Constant));
    let program = |code| Program {
        code,
        pool: vec![[0.0; 4]],
        patches: vec![],
        slots: 0,
    };
    let deep = program(vec![constant; 65]);
    let error = verify(&deep, 0, false).unwrap_err();
    assert_eq!(
        error.to_string(),
        "the program needs 65 values on the stack, more than the 64 that the format allows"
    );
    let long = program(vec![constant; 250_001]);
    assert!(matches!(
        verify(&long, 0, false),
        Err(VerifyError::Limit {
            what: "instructions",
            need: 250_001,
            allowed: 250_000
        })
    ));
    let two = program(vec![constant; 2]);
    assert_eq!(
        verify(&two, 0, false),
        Err(VerifyError::Leftover { left: 2 })
    );
    assert_eq!(verify(&program(vec![]), 0, false), Err(VerifyError::Empty));
}

/// A program whose guard stands in front of some instructions; `1` is on the stack in front of it.
fn with_guard(skips: u32, behind: &[Instruction]) -> Program {
    let guard = Instruction {
        skips,
        ..Instruction::new(Code::Guard)
    };
    let constant = Instruction::new(Code::Op(Op::Constant));
    let mut code = vec![constant, guard];
    code.extend(behind);
    Program {
        code,
        pool: vec![[1.0; 4]; 4],
        patches: vec![],
        slots: 1,
    }
}

/// A ball that is blended into the value below it.
fn blended_ball() -> Instruction {
    Instruction {
        place: Place::Blend {
            kernel: Kernel::Hard,
            index: 0,
        },
        ..Instruction::new(Code::Op(Op::Sphere))
    }
}

#[test]
fn guards_of_blends_are_accepted() {
    let ball = blended_ball();
    let inner = Instruction {
        skips: 1,
        ..Instruction::new(Code::Guard)
    };
    assert_eq!(verify(&with_guard(1, &[ball]), 0, false), Ok(()));
    assert_eq!(verify(&with_guard(1, &[ball, ball]), 0, false), Ok(()));
    let nested = with_guard(3, &[ball, inner, ball]);
    assert_eq!(verify(&nested, 0, false), Ok(()));
    let words = encode(&nested.code);
    assert_eq!(decode(&words), Ok(nested.code.clone()));
    let parsed = listing::parse(&listing::print(&nested)).map(|program| program.code[1].skips);
    assert_eq!(parsed, Ok(3));
}

#[test]
fn guards_that_skip_more_than_blends_are_refused() {
    let op = |op| Instruction::new(Code::Op(op));
    let ball = blended_ball();
    let slot = |code| Instruction::new(code);
    let guard = |skips| Instruction {
        skips,
        ..Instruction::new(Code::Guard)
    };
    let take = |pops| Instruction {
        pops,
        ..Instruction::new(Code::Take)
    };
    let mirror = |push| Instruction {
        push,
        ..op(Op::Mirror)
    };
    let deep: Vec<Instruction> = (0..40).map(|at| guard(40 - at)).chain([ball]).collect();
    let cases = [
        (with_guard(0, &[ball]), "skips nothing"),
        (with_guard(2, &[ball]), "skips more than there is behind it"),
        (
            with_guard(2, &[guard(2), ball, ball]),
            "skips more than there is behind it",
        ),
        (
            with_guard(1, &[op(Op::Sphere), ball]),
            "leave more values or fewer",
        ),
        (
            with_guard(1, &[op(Op::Union), ball]),
            "takes 2 values but the stack holds 1",
        ),
        (
            with_guard(
                1,
                &[Instruction {
                    place: ball.place,
                    ..take(0)
                }],
            ),
            "reaches below the value",
        ),
        (
            with_guard(1, &[mirror(false), ball]),
            "replaces the point that its guard looks at",
        ),
        (with_guard(2, &[mirror(true), ball]), "keep points"),
        (
            with_guard(2, &[slot(Code::Store), ball, slot(Code::Load), ball]),
            "reads slot 0, which holds nothing yet",
        ),
        (with_guard(41, &deep), "guards within each other"),
    ];
    for (program, expected) in cases {
        let error = verify(&program, 0, false).expect_err(expected).to_string();
        assert!(error.contains(expected), "{error}, not: {expected}");
    }
    let mut nothing = with_guard(1, &[ball]);
    nothing.code.remove(0);
    let error = verify(&nothing, 0, false).unwrap_err().to_string();
    assert!(error.contains("no value to compare with"), "{error}");
    let mut skipping = with_guard(1, &[ball]);
    skipping.code[2].skips = 1;
    let error = verify(&skipping, 0, false).unwrap_err().to_string();
    assert!(error.contains("is no guard"), "{error}");
    // A point that was kept in front of the guard stays where it is.
    let mut back = with_guard(1, &[Instruction { pops: 1, ..ball }]);
    back.code.insert(1, mirror(true));
    let error = verify(&back, 0, false).unwrap_err().to_string();
    assert!(error.contains("from before its guard"), "{error}");
}

#[test]
fn guards_stay_between_channels_and_materials_of_their_own() {
    let ball = blended_ball();
    let constant = Instruction::new(Code::Op(Op::Constant));
    let channel = Instruction::new(Code::Channel);
    let mut left = with_guard(3, &[constant, channel, ball]);
    let error = verify(&left, 0, true).unwrap_err().to_string();
    assert!(error.contains("without its material"), "{error}");
    left.code.swap(1, 3);
    left.code.swap(1, 2);
    left.code[3].skips = 1;
    let error = verify(&left, 0, true).unwrap_err().to_string();
    assert!(
        error.contains("between a channel and its material"),
        "{error}"
    );
}
