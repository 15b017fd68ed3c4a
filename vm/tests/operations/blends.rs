//! The blends: every row equals its kernel's formula, bit for bit, and the kernels have their documented
//! properties.

use crate::fixture::{Case, Random, cases, constants};
use sdfc_vm::apply::{OpResult, apply};
use sdfc_vm::blend::BlendKernel;
use sdfc_vm::dual::{Dual, DualVec3};
use sdfc_vm::row::Category;
use sdfc_vm::table::{Op, ROWS};
use sdfc_vm::vector::V3;

const ORIGIN: V3<f32> = V3::new(0.0, 0.0, 0.0);

fn run(op: Op, a: f32, b: f32, constants: &[f32]) -> f32 {
    match apply::<f32>(op, ORIGIN, [a, b, 0.0], constants) {
        OpResult::Value(v) => v,
        OpResult::Point(_) => panic!("a point"),
    }
}

#[test]
fn rows_are_their_kernels_formula_bit_for_bit() {
    let mut seen = 0;
    for row in ROWS {
        let Some(blend) = row.facts.blend else {
            continue;
        };
        seen += 1;
        let mut random = Random::for_case(20, row.name);
        for i in 0..4000 {
            let k = if i % 10 == 0 {
                0.0
            } else {
                random.range(0.0, 0.5)
            };
            let k = if row.parameters.is_empty() {
                vec![]
            } else {
                constants(row.op, &[k])
            };
            let [a, mut b] = [0; 2].map(|_| random.range(-1.0, 1.0) as f32);
            if i % 7 == 0 {
                b = a;
            }
            if i % 11 == 0 {
                b = -a;
            }
            let negated = if blend.negate_second { -1.0 } else { 1.0 };
            let width = k.first().copied().unwrap_or(0.0);
            let coefficient = k.get(1).copied().unwrap_or(0.0);
            let fused = blend
                .kernel
                .blend(a, b, blend.sign, negated, width, coefficient);
            let own = run(row.op, a, b, &k);
            assert_eq!(
                own.to_bits(),
                fused.to_bits(),
                "{} of {a}, {b}, {k:?}",
                row.name
            );
            // Gradients too, also where both operands are equal.
            let [a, b] = [a, b].map(|value| {
                let gradient = [0; 3].map(|_| random.range(-1.0, 1.0) as f32);
                let gradient = V3::new(gradient[0], gradient[1], gradient[2]);
                Dual { value, gradient }
            });
            let [s, sb, width, coefficient] =
                [blend.sign, negated, width, coefficient].map(Dual::fixed);
            let fused = blend.kernel.blend(a, b, s, sb, width, coefficient);
            let nowhere = DualVec3::fixed(V3::new(0.0, 0.0, 0.0));
            let OpResult::Value(own) = apply(row.op, nowhere, [a, b, b], &k) else {
                panic!("{} gives a value", row.name);
            };
            let name = row.name;
            assert_eq!(
                own.gradient, fused.gradient,
                "{name} of {a:?}, {b:?}, {k:?}"
            );
        }
    }
    assert_eq!(seen, 3 * BlendKernel::ALL.len());
}

/// The union of each kernel that has a thickness.
const UNIONS: [(Op, BlendKernel); 4] = [
    (Op::SmoothUnion, BlendKernel::Quadratic),
    (Op::CubicUnion, BlendKernel::Cubic),
    (Op::CircularUnion, BlendKernel::Circular),
    (Op::ExponentialUnion, BlendKernel::Exponential),
];

#[test]
fn the_thickness_is_what_a_blend_adds_where_both_are_equal() {
    for (op, kernel) in UNIONS {
        for k in [0.5, 0.25, 1e-3] {
            let case = Case::new(op, &[k]);
            let added = 0.125 - case.with([0.0; 3], [0.125, 0.125, 0.0]);
            assert!((added - k).abs() < 1e-6 * k, "{}: {added}", op.row().name);
            let width = case.parameters()[0];
            assert!((kernel.max_offset(width) - k).abs() < 1e-12);
            // At the end of its support, the offset is exactly zero, without a rounding error.
            let end = kernel.support(width);
            if end.is_finite() {
                let width = width as f32;
                let coefficient = case.constants[1];
                assert_eq!(kernel.offset_at(width, width, coefficient), 0.0);
                assert!(kernel.offset_at(width * 0.999, width, coefficient) > 0.0);
            }
        }
    }
}

#[test]
fn without_thickness_a_blend_is_hard() {
    for (op, _) in UNIONS {
        let mut random = Random::for_case(21, op.row().name);
        for k in [0.0, 1e-30, 1e-16] {
            let constants = constants(op, &[k]);
            for _ in 0..500 {
                let [a, b] = [0; 2].map(|_| random.range(-1.0, 1.0) as f32);
                assert_eq!(
                    run(op, a, b, &constants),
                    a.min(b),
                    "{}, {k}",
                    op.row().name
                );
                let equal = run(op, a, a, &constants);
                assert!(
                    (equal - a).abs() <= k as f32,
                    "{}, {k}: {equal}",
                    op.row().name
                );
            }
        }
    }
}

/// Returns the weight of the farther operand where the operands differ by `x ≥ 0`: the derivative of the result with
/// respect to it, derived by hand.
fn mix_weight(kernel: BlendKernel, x: f64, width: f64) -> f64 {
    let t = (1.0 - x / width).max(0.0);
    match kernel {
        BlendKernel::Hard => 0.0,
        BlendKernel::Quadratic => t / 2.0,
        BlendKernel::Cubic => t * t / 2.0,
        BlendKernel::Circular => (1.0 - (1.0 - t) / (1.0 + t * (2.0 - t)).sqrt()) / 2.0,
        BlendKernel::Exponential => 1.0 / (1.0 + (x / width).exp2()),
    }
}

/// The mix weight of the farther operand is the slope of the blend with respect to it.
#[test]
fn the_weight_of_an_operand_is_its_slope() {
    for (op, kernel) in UNIONS {
        let mut random = Random::for_case(22, op.row().name);
        let case = Case::new(op, &[0.25]);
        let width = f64::from(case.constants[0]);
        for _ in 0..500 {
            let (a, b) = (random.range(-1.0, 1.0), random.range(-1.0, 1.0));
            let (o, i) = (V3::new(0.0, 0.0, 0.0), V3::new(1.0, 0.0, 0.0));
            let (near, far) = (a.min(b), a.max(b));
            let [near, far] = [
                Dual {
                    value: near,
                    gradient: o,
                },
                Dual {
                    value: far,
                    gradient: i,
                },
            ];
            let slope = case.dual(o, [near, far, near]).gradient.x;
            let share = mix_weight(kernel, far.value - near.value, width);
            assert!(
                (share - slope).abs() < 1e-6,
                "{}: {share}, {slope}",
                op.row().name
            );
            assert!((0.0..=0.5 + 1e-9).contains(&share));
        }
    }
}

/// Unions never exceed the hard one, intersections and subtractions are never below it.
#[test]
fn blends_stay_on_their_side() {
    for case in cases(24, 4, |op| op.row().facts.category == Category::Combine) {
        let mut random = Random::for_case(23, &case.name());
        let name = case.op.row().name;
        for _ in 0..500 {
            let [a, b] = [0; 2].map(|_| random.range(-1.0, 1.0));
            let d = case.with([0.0; 3], [a, b, 0.0]);
            if name.ends_with("union") {
                assert!(d <= a.min(b) + 1e-9, "{}", case.name());
            } else if name.ends_with("intersection") {
                assert!(d >= a.max(b) - 1e-9, "{}", case.name());
            } else if name.ends_with("subtraction") {
                assert!(d >= a.max(-b) - 1e-9, "{}", case.name());
            }
        }
    }
}
