//! The number types agree: gradients with differences, intervals with the values in their boxes, `f32` with
//! `f64`.

use crate::fixture::{Point, Random, cases, constants, gradient, is_math, length, operands, point};
use sdfc_vm::apply::{OpResult, apply, record_value};
use sdfc_vm::dual::{Dual, DualVec3};
use sdfc_vm::interval::{FloatInterval, Interval};
use sdfc_vm::real::Real;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

#[test]
fn gradients_are_the_limit_of_differences() {
    for case in cases(61, 3, |_| true) {
        let mut random = Random::for_case(60, &case.name());
        let (mut tried, mut agreed) = (0, 0);
        for _ in 0..120 {
            let p = random.point(1.5);
            let differences = |h: f64| -> Point {
                std::array::from_fn(|i| {
                    let (mut a, mut b) = (p, p);
                    a[i] -= h;
                    b[i] += h;
                    (case.on::<f64>(point::<f64>(b)) - case.on::<f64>(point::<f64>(a))) / (2.0 * h)
                })
            };
            let (fine, coarse) = (differences(1e-6), differences(1e-5));
            let scale = 1.0 + length(fine);
            // Across a kink, the two differences disagree, and there is nothing to compare with.
            if (0..3).any(|i| (fine[i] - coarse[i]).abs() > 1e-4 * scale) {
                continue;
            }
            tried += 1;
            let (_, slope) = gradient(&case, p);
            agreed += usize::from((0..3).all(|i| (fine[i] - slope[i]).abs() < 1e-3 * scale));
        }
        assert!(tried >= 60, "{}: only {tried} points", case.name());
        assert!(agreed + 1 >= tried, "{}: {agreed} of {tried}", case.name());
    }
}

fn random_box(random: &mut Random) -> [Interval; 3] {
    let size = [0.0, 1e-3, 0.1, 1.0][(random.unit() * 4.0) as usize];
    random.point(2.0).map(|v| Interval {
        lo: v,
        hi: v + size * random.unit(),
    })
}

fn within(random: &mut Random, i: Interval) -> f64 {
    if random.unit() < 0.2 {
        i.lo
    } else {
        random.range(i.lo, i.hi).clamp(i.lo, i.hi)
    }
}

#[test]
fn intervals_hold_every_value_of_their_box() {
    for case in cases(63, 4, |_| true) {
        let mut random = Random::for_case(62, &case.name());
        for _ in 0..150 {
            let [x, y, z] = random_box(&mut random);
            let hull = case.on::<Interval>(V3::new(x, y, z));
            assert!(hull.lo <= hull.hi, "{}: {hull:?}", case.name());
            for _ in 0..6 {
                let p = [x, y, z].map(|i| within(&mut random, i));
                let v = case.on::<f64>(point::<f64>(p));
                // The elementary functions of the intervals are the standard library's.
                let slack = 1e-9 * (1.0 + v.abs());
                assert!(
                    hull.lo - slack <= v && v <= hull.hi + slack,
                    "{} at {p:?}: {v} outside {hull:?} of {x:?}, {y:?}, {z:?}",
                    case.name()
                );
            }
        }
    }
}

/// Boxes across the negative x axis contain angles on both sides of the discontinuity there.
#[test]
fn intervals_of_angles_hold_every_value_around_the_cut() {
    let mut random = Random::new(71);
    for _ in 0..2000 {
        let [y, x, _] = random_box(&mut random);
        let hull = Real::atan2(y, x);
        for _ in 0..6 {
            let (b, a) = (within(&mut random, y), within(&mut random, x));
            let v = b.atan2(a);
            assert!(
                hull.lo - 1e-12 <= v && v <= hull.hi + 1e-12,
                "{v} at {b}, {a} outside {hull:?} of {y:?}, {x:?}"
            );
        }
    }
}

/// The intervals of `f32` contain the `f32` values, to the last bit where only arithmetic is used.
#[test]
fn float_intervals_hold_what_f32_gives() {
    for case in cases(69, 4, |_| true) {
        let mut random = Random::for_case(68, &case.name());
        for _ in 0..150 {
            let [x, y, z] = random_box(&mut random).map(|i| FloatInterval {
                lo: i.lo as f32,
                hi: (i.hi as f32).max(i.lo as f32),
            });
            let hull = case.on::<FloatInterval>(V3::new(x, y, z));
            for _ in 0..6 {
                let [a, b, c] = [x, y, z].map(|i| {
                    let at = within(&mut random, Interval::between(i.lo.into(), i.hi.into()));
                    (at as f32).clamp(i.lo, i.hi)
                });
                let v = case.on::<f32>(V3::new(a, b, c));
                assert!(
                    hull.lo <= v && v <= hull.hi,
                    "{} at {a}, {b}, {c}: {v} outside {hull:?} of {x:?}, {y:?}, {z:?}",
                    case.name()
                );
            }
        }
    }
}

/// The slopes of intervals bound discontinuous and continuous functions alike. The difference between any two
/// points of a box is at most the slope times their distance. (Bodies of shapes fold space by discontinuities
/// that cancel; their rows state their slope.)
#[test]
fn slopes_of_intervals_bound_all_differences() {
    for case in cases(65, 3, |op| is_math(op) && op != Op::Constant) {
        let mut random = Random::for_case(64, &case.name());
        for _ in 0..200 {
            let corner = random.point(1.5);
            let size = 0.5 * random.unit();
            let [x, y, z] = corner.map(|v| Interval {
                lo: v,
                hi: v + size,
            });
            let d = case
                .on::<Dual<Interval>>(DualVec3::seed(V3::new(x, y, z)))
                .gradient;
            let [p, q] = [0; 2].map(|_| [x, y, z].map(|i| within(&mut random, i)));
            let change = case.on::<f64>(point::<f64>(q)) - case.on::<f64>(point::<f64>(p));
            let bound: f64 = [d.x, d.y, d.z]
                .iter()
                .zip(0..3)
                .map(|(slope, i)| {
                    let step = (q[i] - p[i]).abs();
                    if step == 0.0 {
                        0.0
                    } else {
                        slope.magnitude() * step
                    }
                })
                .sum();
            assert!(
                change.abs() <= bound * (1.0 + 1e-9) + 1e-9,
                "{}: {change} from {p:?} to {q:?}, bound {bound}",
                case.name()
            );
        }
    }
}

/// Reports whether the body calls sines or arctangents.
fn uses_angles(op: Op) -> bool {
    let calls = record_value(op).calls;
    calls
        .iter()
        .any(|name| matches!(*name, "sine" | "cosine" | "arctangent"))
}

/// The default tier's tolerance: 16 · 2⁻²⁴ of the largest coordinate, more where a sine or an angle
/// contributes to a length.
#[test]
fn single_precision_is_close_to_double() {
    let ulp = 1.0 / f64::from(1 << 24);
    for case in cases(67, 5, |op| !is_math(op)) {
        let mut random = Random::for_case(66, &case.name());
        let folds = uses_angles(case.op);
        let mut outside = 0;
        for _ in 0..500 {
            let p = random.point(4.0);
            let [single, double] = [
                f64::from(case.on::<f32>(V3::new(p[0] as f32, p[1] as f32, p[2] as f32))),
                case.on::<f64>(point::<f64>(p)),
            ];
            let tolerance = if folds { 64.0 } else { 16.0 } * ulp * 4.0;
            outside += usize::from((single - double).abs() > tolerance);
        }
        // Where space is divided into cells, a point may be on either side of a cell boundary.
        let seams = if case.op.row().output == sdfc_vm::row::Output::Point {
            2
        } else {
            0
        };
        assert!(outside <= seams, "{}: {outside} of 500", case.name());
    }
}

/// Arithmetic in `f32` is as accurate as its operands allow.
#[test]
fn single_precision_arithmetic_is_close_to_double() {
    for case in cases(69, 2, |op| {
        is_math(op) && op.row().output == sdfc_vm::row::Output::Value
    }) {
        let mut random = Random::for_case(68, &case.name());
        // Functions with discontinuities or unbounded slopes are compared elsewhere.
        if matches!(case.op, Op::Noise | Op::NoiseOctave | Op::RidgeOctave) {
            continue;
        }
        let mut outside = 0;
        for _ in 0..500 {
            let p = random.point(2.0);
            let q = V3::new(p[0], p[1], p[2]);
            let values = operands::<f64>(case.op, q).map(|v| f64::from(v as f32));
            // Logarithms of other numbers are those of the smallest normal number of the type.
            if matches!(case.op, Op::Ln | Op::Log2) && values[0] <= 0.0 {
                continue;
            }
            let narrow = values.map(|v| v as f32);
            let constants = constants(case.op, &case.arguments);
            let single = V3::new(p[0] as f32, p[1] as f32, p[2] as f32);
            let [a, b] = [
                match apply::<f32>(case.op, single, narrow, &constants) {
                    OpResult::Value(v) => f64::from(v),
                    OpResult::Point(_) => panic!("a point"),
                },
                match apply::<f64>(case.op, q, values, &constants) {
                    OpResult::Value(v) => v,
                    OpResult::Point(_) => panic!("a point"),
                },
            ];
            outside += usize::from((a - b).abs() > 2e-6 * (1.0 + b.abs()));
        }
        assert!(outside <= 3, "{}: {outside} of 500", case.name());
    }
}
