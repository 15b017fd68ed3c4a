//! Random programs: their encodings and evaluators must agree.

use sdfc_trials::campaign::{CheckOutcome, input_count, run};
use sdfc_trials::checks::{self, equal_or_both_nan, has_nonfinite_intermediate, tape_values};
use sdfc_trials::programs::{points, program};
use sdfc_trials::random::Random;
use sdfc_vm::dual::Dual;
use sdfc_vm::encode::{decode, encode};
use sdfc_vm::evaluate::{evaluate, gradient};
use sdfc_vm::interval::Interval;
use sdfc_vm::lanes::{F32x64, LANES, SimdLevel, with_identity_jacobian};
use sdfc_vm::listing;
use sdfc_vm::program::Program;
use sdfc_vm::rounding::error_bound;
use sdfc_vm::tape::evaluator::TapeEvaluator;
use sdfc_vm::tape::lipschitz::LipschitzBounds;
use sdfc_vm::tape::prune::Pruner;
use sdfc_vm::tape::trace::{Trace, Tracer};
use sdfc_vm::tape::{Clause, ClauseKind, Tape};
use sdfc_vm::vector::V3;
use sdfc_vm::verify::verify;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Runs a check on random programs.
fn check_programs(name: &str, default_count: u64, check: impl Fn(u64, &Program) + Sync) -> u64 {
    let check = |&seed: &u64| {
        check(seed, &program(seed));
        CheckOutcome::Accepted
    };
    run(name, input_count(default_count, 1), |seed| seed, check).accepted
}

#[test]
fn verify_and_survive_every_form() {
    check_programs("forms", 3000, |_, program| {
        verify(program, 0, false).unwrap_or_else(|error| panic!("{error}"));
        checks::check_round_trips(program);
    });
}

/// Reports whether the value at a point is outside the interval of a box that is just that point.
///
/// The program then takes the root of a negative number in between.
fn has_invalid_interval(program: &Program, tape: &Tape, points: &[F32x64; 3], lane: usize) -> bool {
    let mut chooser = Tracer::new(tape);
    let boxes = chooser.boxes();
    boxes[..3].copy_from_slice(points);
    boxes[3..].copy_from_slice(points);
    let [lo, hi] = *chooser.run(program, &tape.clauses, LANES);
    let value = tape_values(program, tape, &tape.clauses, points).0[lane];
    !(lo.0[lane] <= value && value <= hi.0[lane])
}

/// In a box, the tape pruned for it yields the bits of the full tape, and the interval contains them.
///
/// Boxes inside, with tapes pruned from the pruned tape, behave alike.
#[test]
fn pruned_tapes_give_the_same_bits_in_their_box() {
    let (shorter, invalid) = (AtomicU64::new(0), AtomicU64::new(0));
    let programs = check_programs("pruned tapes", 3000, |seed, program| {
        // The parameters of these programs are arbitrary, so the slope bounds of the rows do not hold.
        let unknown = LipschitzBounds {
            result: f32::INFINITY,
            ..LipschitzBounds::default()
        };
        let tape = Tape {
            lipschitz: Arc::new(unknown),
            ..Tape::new(program)
        };
        let (mut chooser, mut pruner) = (Tracer::new(&tape), Pruner::default());
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
                |index| chooser.trace().choice(index, 7),
                &mut pruned,
            );
            if pruned.len() < clauses.len() {
                shorter.fetch_add(1, Ordering::Relaxed);
            }
            let inner = half * 0.3;
            let points: [F32x64; 3] = std::array::from_fn(|axis| {
                F32x64(std::array::from_fn(|_| {
                    (centre[axis] + half * r.number())
                        .clamp(centre[axis] - half, centre[axis] + half)
                }))
            });
            let full_values = tape_values(program, &tape, &tape.clauses, &points);
            let pruned_values = tape_values(program, &tape, &pruned, &points);
            for lane in 0..LANES {
                let (a, b) = (full_values.0[lane], pruned_values.0[lane]);
                let agrees = equal_or_both_nan(a, b) && lo <= a && a <= hi;
                let p = V3::new(points[0].0[lane], points[1].0[lane], points[2].0[lane]);
                if !agrees
                    && (has_invalid_interval(program, &tape, &points, lane)
                        || has_nonfinite_intermediate(program, p))
                {
                    invalid.fetch_add(1, Ordering::Relaxed);
                    continue;
                }
                assert!(
                    agrees,
                    "{a} by all, {b} by what was kept, in [{lo}, {hi}]\n{}",
                    listing::print(program)
                );
            }
            clauses = pruned;
            // The next box is inside this one.
            for axis in &mut centre {
                *axis += (half - inner) * 0.9 * r.number().clamp(-1.0, 1.0);
            }
            half = inner;
        }
    });
    let (shorter, invalid) = (shorter.into_inner(), invalid.into_inner());
    assert!(
        programs < 100 || shorter > programs / 3,
        "{shorter} of {} tapes became shorter",
        3 * programs
    );
    assert!(
        programs < 100 || invalid < programs * 7,
        "{invalid} of {} values are none",
        programs * 3 * LANES as u64
    );
}

/// Pruning for several boxes and then for each equals pruning for each alone.
#[test]
fn boxes_are_pruned_together_as_they_are_alone() {
    let (shorter, reduced) = (AtomicU64::new(0), AtomicU64::new(0));
    let programs = check_programs("boxes together", 1000, |seed, program| {
        let tape = Tape::new(program);
        let (mut chooser, mut pruner) = (Tracer::new(&tape), Pruner::default());
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
        let decided = chooser.trace();
        for lanes in [0x1111_u64, 0xF0F0 << 20, 1 << 63, 0b110] {
            let (mut joint, mut joint_decisions) = (Vec::new(), Trace::default());
            decided.prune_for(
                lanes,
                &tape.clauses,
                &mut pruner,
                &mut joint,
                &mut joint_decisions,
            );
            shorter.fetch_add(
                u64::from(joint.len() < tape.clauses.len()),
                Ordering::Relaxed,
            );
            for lane in (0..LANES).filter(|lane| lanes >> lane & 1 == 1) {
                let mut prune = |tape: &[Clause], decided: &Trace| {
                    let mut clauses = Vec::new();
                    let choice = |index| decided.choice(index, lane);
                    pruner.prune(tape, choice, &mut clauses);
                    clauses
                };
                let alone = prune(&tape.clauses, decided);
                let via_joint = prune(&joint, &joint_decisions);
                reduced.fetch_add(u64::from(via_joint.len() < joint.len()), Ordering::Relaxed);
                let points: [F32x64; 3] =
                    std::array::from_fn(|_| F32x64(std::array::from_fn(|_| r.number())));
                let values = [&alone, &via_joint]
                    .map(|clauses| tape_values(program, &tape, clauses, &points));
                let length = |clauses: &[Clause]| {
                    let moves = |clause: &&Clause| matches!(clause.kind, ClauseKind::Copy);
                    clauses.len() - clauses.iter().filter(moves).count()
                };
                assert_eq!(length(&alone), length(&via_joint), "lane {lane}");
                for lane in 0..LANES {
                    let [a, b] = [values[0].0[lane], values[1].0[lane]];
                    assert!(equal_or_both_nan(a, b), "{a} alone, {b} by way of others");
                }
            }
        }
    });
    let (shorter, reduced) = (shorter.into_inner(), reduced.into_inner());
    assert!(
        programs < 100 || shorter.min(reduced) > programs / 3,
        "{shorter} of {} tapes became shorter, and {reduced} of what was left of them",
        4 * programs
    );
}

/// No program's error exceeds its running error bound, with guards and without.
#[test]
fn programs_are_off_by_no_more_than_their_bound() {
    let (bounded, invalid) = (AtomicU64::new(0), AtomicU64::new(0));
    let programs = check_programs("bounds of rounding", 3000, |seed, program| {
        let mut r = Random::new(seed.wrapping_mul(7) + 3);
        for _ in 0..20 {
            let p: [f32; 3] = std::array::from_fn(|_| r.number() * 1.37);
            let [x, y, z] = p;
            let single = f64::from(evaluate::<f32>(program, V3::new(x, y, z)));
            let [x, y, z] = p.map(f64::from);
            let double = evaluate::<f64>(program, V3::new(x, y, z));
            let rounding = error_bound(program, [x, y, z].map(Interval::point), [0.0; 3]);
            if single.is_nan() || double.is_nan() {
                invalid.fetch_add(1, Ordering::Relaxed);
                continue;
            }
            let max_error = rounding.worst_case_error();
            if max_error == f64::INFINITY {
                continue;
            }
            bounded.fetch_add(1, Ordering::Relaxed);
            let error = (single - double).abs();
            assert!(
                error <= max_error + 1e-12 * (1.0 + double.abs()),
                "at {p:?}: {single} instead of {double}, {error} off, by no more than {max_error}\n{}",
                listing::print(program)
            );
        }
    });
    let (bounded, invalid) = (bounded.into_inner(), invalid.into_inner());
    assert!(
        programs < 100 || bounded > programs * 10,
        "something is known of {bounded} in {} values",
        programs * 20
    );
    assert!(
        programs < 100 || invalid < programs * 2,
        "{invalid} of {} values are none",
        programs * 20
    );
}

#[test]
fn batches_and_single_points_agree_in_every_bit() {
    check_programs("batches", 1500, |seed, program| {
        let points = points(seed.wrapping_mul(7) + 3);
        let tape = Tape::new(program);
        let values = tape_values(program, &tape, &tape.clauses, &points);
        for simd_level in [SimdLevel::Baseline, SimdLevel::Avx2] {
            let machine = TapeEvaluator::<f32>::new(tape.values, tape.points);
            let mut machine: TapeEvaluator<f32> = machine.with_max_simd(simd_level);
            *machine.inputs_mut() = points;
            let limited = machine.run(program, &tape.clauses, LANES);
            let agrees = (0..LANES).all(|lane| equal_or_both_nan(limited.0[lane], values.0[lane]));
            assert!(agrees, "{simd_level:?}\n{}", listing::print(program));
        }
        let mut dual = TapeEvaluator::<Dual<f32>>::new(tape.values, tape.points);
        *dual.inputs_mut() = with_identity_jacobian(&points);
        let duals = *dual.run(program, &tape.clauses, LANES);
        for lane in 0..LANES {
            let p = V3::new(points[0].0[lane], points[1].0[lane], points[2].0[lane]);
            let single = evaluate::<f32>(program, p);
            let listing = || listing::print(program);
            assert!(
                equal_or_both_nan(values.0[lane], single),
                "{} in a batch, {single} alone at {p:?}\n{}",
                values.0[lane],
                listing()
            );
            let exact = gradient::<f32>(program, p);
            let pairs = [
                (duals[3].0[lane], exact.value),
                (duals[0].0[lane], exact.gradient.x),
                (duals[1].0[lane], exact.gradient.y),
                (duals[2].0[lane], exact.gradient.z),
            ];
            // A skipped block may flip the sign of a zero in the gradient.
            assert!(
                pairs
                    .iter()
                    .all(|&(a, b)| equal_or_both_nan(a, b) || a == b),
                "{pairs:?}\n{}",
                listing()
            );
        }
    });
}

#[test]
fn damaged_words_are_refused_or_run() {
    let tally = run(
        "words",
        input_count(20_000, 1),
        |seed| seed,
        |&seed| {
            let mut r = Random::new(seed);
            let program = program(seed % 50);
            let mut words = encode(&program.code);
            for _ in 0..=r.below(3) {
                let index = r.below(words.len());
                words[index] ^= 1 << r.below(32);
            }
            let Ok(code) = decode(&words) else {
                return CheckOutcome::Refused;
            };
            assert_eq!(encode(&code), words, "equal programs have equal words");
            let damaged = Program { code, ..program };
            if verify(&damaged, 0, false).is_err() {
                return CheckOutcome::Refused;
            }
            // Accepted programs run to the end without an access out of range.
            checks::run_all(&damaged);
            CheckOutcome::Accepted
        },
    );
    assert!(tally.is_balanced(), "{tally:?}");
}
