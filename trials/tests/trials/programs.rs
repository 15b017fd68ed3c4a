//! Random programs, whose forms and runs must agree.

use sdfc_trials::campaign::{Verdict, count, run};
use sdfc_trials::checks::{self, meets_none, same, values_at};
use sdfc_trials::programs::{points, program};
use sdfc_trials::random::Random;
use sdfc_vm::dual::Dual;
use sdfc_vm::encode::{decode, encode};
use sdfc_vm::evaluate::{evaluate, gradient};
use sdfc_vm::interval::Interval;
use sdfc_vm::lanes::{Column, Instructions, LANES, seeded};
use sdfc_vm::listing;
use sdfc_vm::program::Program;
use sdfc_vm::rounding::bound;
use sdfc_vm::tape::choose::{Chooser, Decided};
use sdfc_vm::tape::machine::Machine;
use sdfc_vm::tape::prune::Pruner;
use sdfc_vm::tape::steep::Slopes;
use sdfc_vm::tape::{Clause, Form, Tape};
use sdfc_vm::vector::V3;
use sdfc_vm::verify::verify;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Runs a check on random programs.
fn on_programs(name: &str, few: u64, check: impl Fn(u64, &Program) + Sync) -> u64 {
    let check = |&seed: &u64| {
        check(seed, &program(seed));
        Verdict::Accepted
    };
    run(name, count(few, 1), |seed| seed, check).accepted
}

#[test]
fn verify_and_survive_every_form() {
    on_programs("forms", 3000, |_, program| {
        verify(program, 0, false).unwrap_or_else(|error| panic!("{error}"));
        checks::forms(program);
    });
}

/// Whether the value at a point is not even in the interval of a box that is no more than the point: the
/// program takes the root of a negative number on the way.
fn broken(program: &Program, tape: &Tape, points: &[Column; 3], lane: usize) -> bool {
    let mut chooser = Chooser::new(tape);
    let boxes = chooser.boxes();
    boxes[..3].copy_from_slice(points);
    boxes[3..].copy_from_slice(points);
    let [lo, hi] = *chooser.run(program, &tape.clauses, LANES);
    let value = values_at(program, tape, &tape.clauses, points).0[lane];
    !(lo.0[lane] <= value && value <= hi.0[lane])
}

/// In a box, the tape that was pruned for it gives the bits of the whole one, and the interval holds
/// them; and again for the boxes in that box, pruned from the pruned tape.
#[test]
fn pruned_tapes_give_the_same_bits_in_their_box() {
    let (shorter, senseless) = (AtomicU64::new(0), AtomicU64::new(0));
    let programs = on_programs("pruned tapes", 3000, |seed, program| {
        // The numbers of these programs are any, so the slopes of the rows say nothing of them.
        let unknown = Slopes {
            whole: f32::INFINITY,
            ..Slopes::default()
        };
        let tape = Tape {
            slopes: Arc::new(unknown),
            ..Tape::of(program)
        };
        let (mut chooser, mut pruner) = (Chooser::new(&tape), Pruner::default());
        pruner.reserve(tape.values, tape.points);
        let mut r = Random::new(seed.wrapping_mul(5) + 2);
        let mut clauses = tape.clauses.clone();
        let mut centre: [f32; 3] = std::array::from_fn(|_| r.number());
        let mut half = 0.5 * r.number().abs();
        for _ in 0..3 {
            let boxes = chooser.boxes();
            for axis in 0..3 {
                boxes[axis].0 = [centre[axis] - half; LANES];
                boxes[axis + 3].0 = [centre[axis] + half; LANES];
            }
            let [lo, hi] = chooser.run(program, &clauses, LANES);
            let (lo, hi) = (lo.0[7], hi.0[7]);
            let mut pruned = Vec::new();
            pruner.prune(
                &clauses,
                |place| chooser.decided().choice(place, 7),
                &mut pruned,
            );
            if pruned.len() < clauses.len() {
                shorter.fetch_add(1, Ordering::Relaxed);
            }
            let inner = half * 0.3;
            let points: [Column; 3] = std::array::from_fn(|axis| {
                Column(std::array::from_fn(|_| {
                    (centre[axis] + half * r.number())
                        .clamp(centre[axis] - half, centre[axis] + half)
                }))
            });
            let all = values_at(program, &tape, &tape.clauses, &points);
            let some = values_at(program, &tape, &pruned, &points);
            for lane in 0..LANES {
                let (a, b) = (all.0[lane], some.0[lane]);
                let agree = same(a, b) && lo <= a && a <= hi;
                let p = V3::of(points[0].0[lane], points[1].0[lane], points[2].0[lane]);
                if !agree && (broken(program, &tape, &points, lane) || meets_none(program, p)) {
                    senseless.fetch_add(1, Ordering::Relaxed);
                    continue;
                }
                assert!(
                    agree,
                    "{a} by all, {b} by what was kept, in [{lo}, {hi}]\n{}",
                    listing::print(program)
                );
            }
            clauses = pruned;
            // The next box lies within this one.
            for axis in &mut centre {
                *axis += (half - inner) * 0.9 * r.number().clamp(-1.0, 1.0);
            }
            half = inner;
        }
    });
    let (shorter, senseless) = (shorter.into_inner(), senseless.into_inner());
    assert!(
        programs < 100 || shorter > programs / 3,
        "{shorter} of {} tapes became shorter",
        3 * programs
    );
    assert!(
        programs < 100 || senseless < programs * 7,
        "{senseless} of {} values are none",
        programs * 3 * LANES as u64
    );
}

/// A tape pruned for several boxes, and from there for each of them, is what pruning for each alone
/// gives.
#[test]
fn boxes_are_pruned_together_as_they_are_alone() {
    let (shorter, between) = (AtomicU64::new(0), AtomicU64::new(0));
    let programs = on_programs("boxes together", 1000, |seed, program| {
        let tape = Tape::of(program);
        let (mut chooser, mut pruner) = (Chooser::new(&tape), Pruner::default());
        pruner.reserve(tape.values, tape.points);
        let mut r = Random::new(seed.wrapping_mul(7) + 3);
        let boxes = chooser.boxes();
        for lane in 0..LANES {
            let half = 0.2 * r.number().abs();
            for axis in 0..3 {
                let middle = r.number();
                boxes[axis].0[lane] = middle - half;
                boxes[axis + 3].0[lane] = middle + half;
            }
        }
        chooser.run(program, &tape.clauses, LANES);
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
            shorter.fetch_add(
                u64::from(together.len() < tape.clauses.len()),
                Ordering::Relaxed,
            );
            for lane in (0..LANES).filter(|lane| lanes >> lane & 1 == 1) {
                let mut prune = |tape: &[Clause], decided: &Decided| {
                    let mut kept = Vec::new();
                    let choice = |place| decided.choice(place, lane);
                    pruner.prune(tape, choice, &mut kept);
                    kept
                };
                let alone = prune(&tape.clauses, decided);
                let by_way = prune(&together, &common);
                between.fetch_add(u64::from(by_way.len() < together.len()), Ordering::Relaxed);
                let points: [Column; 3] =
                    std::array::from_fn(|_| Column(std::array::from_fn(|_| r.number())));
                let values = [&alone, &by_way].map(|kept| values_at(program, &tape, kept, &points));
                let length = |kept: &[Clause]| {
                    let moves = |clause: &&Clause| matches!(clause.form, Form::Copy);
                    kept.len() - kept.iter().filter(moves).count()
                };
                assert_eq!(length(&alone), length(&by_way), "lane {lane}");
                for lane in 0..LANES {
                    let [a, b] = [values[0].0[lane], values[1].0[lane]];
                    assert!(same(a, b), "{a} alone, {b} by way of others");
                }
            }
        }
    });
    let (shorter, between) = (shorter.into_inner(), between.into_inner());
    assert!(
        programs < 100 || shorter.min(between) > programs / 3,
        "{shorter} of {} tapes became shorter, and {between} of what was left of them",
        4 * programs
    );
}

/// No program is off by more than its running error bound, with guards and without.
#[test]
fn programs_are_off_by_no_more_than_their_bound() {
    let (told, senseless) = (AtomicU64::new(0), AtomicU64::new(0));
    let programs = on_programs("bounds of rounding", 3000, |seed, program| {
        let mut r = Random::new(seed.wrapping_mul(7) + 3);
        for _ in 0..20 {
            let p: [f32; 3] = std::array::from_fn(|_| r.number() * 1.37);
            let [x, y, z] = p;
            let single = f64::from(evaluate::<f32>(program, V3::of(x, y, z)));
            let [x, y, z] = p.map(f64::from);
            let double = evaluate::<f64>(program, V3::of(x, y, z));
            let found = bound(program, [x, y, z].map(Interval::point), [0.0; 3]);
            if single.is_nan() || double.is_nan() {
                senseless.fetch_add(1, Ordering::Relaxed);
                continue;
            }
            let most = found.whatever_is_decided();
            if most == f64::INFINITY {
                continue;
            }
            told.fetch_add(1, Ordering::Relaxed);
            let off = (single - double).abs();
            assert!(
                off <= most + 1e-12 * (1.0 + double.abs()),
                "at {p:?}: {single} instead of {double}, {off} off, by no more than {most}\n{}",
                listing::print(program)
            );
        }
    });
    let (told, senseless) = (told.into_inner(), senseless.into_inner());
    assert!(
        programs < 100 || told > programs * 10,
        "something is known of {told} in {} values",
        programs * 20
    );
    assert!(
        programs < 100 || senseless < programs * 2,
        "{senseless} of {} values are none",
        programs * 20
    );
}

#[test]
fn batches_and_single_points_agree_in_every_bit() {
    on_programs("batches", 1500, |seed, program| {
        let points = points(seed.wrapping_mul(7) + 3);
        let tape = Tape::of(program);
        let values = values_at(program, &tape, &tape.clauses, &points);
        for widest in [Instructions::Baseline, Instructions::Avx2] {
            let machine = Machine::<f32>::new(tape.values, tape.points);
            let mut machine: Machine<f32> = machine.limited(widest);
            *machine.seed() = points;
            let narrow = machine.run(program, &tape.clauses, LANES);
            let agree = (0..LANES).all(|lane| same(narrow.0[lane], values.0[lane]));
            assert!(agree, "{widest:?}\n{}", listing::print(program));
        }
        let mut dual = Machine::<Dual<f32>>::new(tape.values, tape.points);
        *dual.seed() = seeded(&points);
        let duals = *dual.run(program, &tape.clauses, LANES);
        for lane in 0..LANES {
            let p = V3::of(points[0].0[lane], points[1].0[lane], points[2].0[lane]);
            let single = evaluate::<f32>(program, p);
            let listing = || listing::print(program);
            assert!(
                same(values.0[lane], single),
                "{} in a batch, {single} alone at {p:?}\n{}",
                values.0[lane],
                listing()
            );
            let exact = gradient::<f32>(program, p);
            let both = [
                (duals[3].0[lane], exact.value),
                (duals[0].0[lane], exact.gradient.x),
                (duals[1].0[lane], exact.gradient.y),
                (duals[2].0[lane], exact.gradient.z),
            ];
            // What a guard skips may turn the sign of a zero in the gradient.
            assert!(
                both.iter().all(|&(a, b)| same(a, b) || a == b),
                "{both:?}\n{}",
                listing()
            );
        }
    });
}

#[test]
fn damaged_words_are_refused_or_run() {
    let tally = run(
        "words",
        count(20_000, 1),
        |seed| seed,
        |&seed| {
            let mut r = Random::new(seed);
            let program = program(seed % 50);
            let mut words = encode(&program.code);
            for _ in 0..=r.below(3) {
                let at = r.below(words.len());
                words[at] ^= 1 << r.below(32);
            }
            let Ok(code) = decode(&words) else {
                return Verdict::Refused;
            };
            assert_eq!(encode(&code), words, "equal programs have equal words");
            let damaged = Program { code, ..program };
            if verify(&damaged, 0, false).is_err() {
                return Verdict::Refused;
            }
            // What is accepted runs to its end without an access out of range.
            checks::run(&damaged);
            Verdict::Accepted
        },
    );
    assert!(tally.says_something(), "{tally:?}");
}
