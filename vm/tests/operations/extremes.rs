//! No input produces a NaN: every operation at special points, with degenerate parameters, for values and
//! gradients in `f32`.

use crate::fixture::{Case, Random, is_math, tries};
use sdfc_vm::apply::{OpResult, apply};
use sdfc_vm::dual::{Dual, DualVec3};
use sdfc_vm::row::ArgumentKind;
use sdfc_vm::table::{Op, ROWS};
use sdfc_vm::vector::V3;

fn is_nan(v: f32) -> bool {
    v.to_bits() & 0x7fff_ffff > 0x7f80_0000
}

fn check(case: &Case, p: [f32; 3], values: [f32; 3]) {
    let [x, y, z] = p;
    let seed = DualVec3::seed(V3::new(x, y, z));
    let duals = [0, 1, 2].map(|i| Dual {
        value: values[i],
        gradient: V3::new([1.0, 0.0, 0.5][i], 0.0, 1.0),
    });
    let mut numbers = Vec::new();
    let mut gradient = |d: Dual<f32>| {
        numbers.extend([d.value, d.gradient.x, d.gradient.y, d.gradient.z]);
    };
    match apply::<Dual<f32>>(case.op, seed, duals, &case.constants) {
        OpResult::Value(d) => gradient(d),
        OpResult::Point(q) => {
            for (value, i) in q.value.to_array().into_iter().zip(0..) {
                gradient(Dual {
                    value,
                    gradient: q.gradients[i],
                });
            }
        }
    }
    match apply::<f32>(case.op, V3::new(x, y, z), values, &case.constants) {
        OpResult::Value(v) => numbers.push(v),
        OpResult::Point(q) => numbers.extend(q.to_array()),
    }
    assert!(
        !numbers.iter().any(|&v| is_nan(v)),
        "{} at {p:?} of {values:?}: {numbers:?}",
        case.name()
    );
}

/// Arguments that no scene should give, but that a live parameter may have.
fn degenerate(op: Op, random: &mut Random) -> Vec<Vec<f64>> {
    let usual = random.arguments(op);
    let n = usual.len();
    let mut all = vec![
        usual.clone(),
        vec![0.0; n],
        vec![1.0; n],
        vec![1e-20; n],
        vec![1e6; n],
    ];
    for i in 0..n {
        for v in [0.0, 1e-12, 100.0] {
            let mut a = usual.clone();
            a[i] = v;
            all.push(a);
        }
    }
    // A direction is a unit vector, which the compiler guarantees.
    if let Some(language) = op.row().facts.language {
        let mut at = 0;
        for argument in language.arguments {
            if argument.kind == ArgumentKind::Direction {
                for a in &mut all {
                    a[at..at + 3].copy_from_slice(&usual[at..at + 3]);
                }
            }
            at += argument.kind.width();
        }
    }
    all
}

#[test]
fn no_operation_returns_nan() {
    // Zeros, tiny and huge numbers. The long form adds denormal numbers, the largest one whose square is
    // finite, and neighbours of integers.
    let denormal = f32::from_bits(1);
    let special = [
        0.0_f32,
        -0.0,
        1.0,
        -0.5,
        1e-18,
        -1e-18,
        1e18,
        -1e18,
        denormal,
        -1e-40,
        f32::MIN_POSITIVE,
        -1.0 - f32::EPSILON,
        8_388_609.0,
        9e18,
    ];
    let special = &special[..tries(10, 1).min(special.len())];
    for row in ROWS {
        let mut random = Random::for_case(70, row.name);
        for arguments in degenerate(row.op, &mut random) {
            let case = Case::new(row.op, &arguments);
            assert!(
                case.constants.iter().all(|&v| v.is_finite()),
                "{}: {:?}",
                case.name(),
                case.constants
            );
            for i in 0..special.len().pow(3) {
                let n = special.len();
                let p = [special[i % n], special[i / n % n], special[i / n / n]];
                // Arithmetic gets the special numbers as operands, operations on shapes get distances.
                let values = if is_math(row.op) {
                    p
                } else {
                    [0.0, p[0].abs(), -p[1].abs()]
                };
                check(&case, p, values);
                if !is_math(row.op) {
                    check(&case, p, [p[2], p[2], p[2]]);
                }
            }
        }
    }
}

/// On a face, the gradient is the face's normal: renderers evaluate normals exactly there.
#[test]
fn on_a_surface_the_gradient_is_the_normal() {
    let up = [0.0, 1.0, 0.0];
    let all: [(Op, &[f64], [f64; 3]); 11] = [
        (Op::Cuboid, &[1.0, 2.0, 3.0], [0.25, 1.0, 0.5]),
        (Op::RoundedCuboid, &[1.0, 2.0, 3.0, 0.25], [0.125, 1.0, 0.5]),
        (Op::BoxFrame, &[1.0, 2.0, 3.0, 0.25], [0.4375, 1.0, 0.5]),
        (Op::Capsule, &[1.0, 0.5], [0.0, 1.0, 0.0]),
        (Op::Cylinder, &[1.0, 2.0], [0.25, 1.0, 0.5]),
        (
            Op::CylinderBetween,
            &[0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 1.0],
            [0.25, 1.0, 0.5],
        ),
        (Op::Cone, &[1.0, 0.5, 2.0], [0.25, 1.0, 0.125]),
        (Op::Prism, &[6.0, 1.0, 2.0], [0.25, 1.0, 0.125]),
        (Op::Plane, &[0.0, 1.0, 0.0, 1.0], [3.0, 1.0, 4.0]),
        (Op::Slab, &[0.0, 1.0, 0.0, 2.0], [3.0, 1.0, 4.0]),
        (Op::Rect, &[1.0, 2.0], [0.25, 1.0, 0.0]),
    ];
    for (op, arguments, p) in all {
        let case = Case::new(op, arguments);
        let d = case.dual(V3::new(p[0], p[1], p[2]), [Dual::fixed(0.0); 3]);
        assert_eq!(d.value, 0.0, "{}", case.name());
        let normal = [d.gradient.x, d.gradient.y, d.gradient.z];
        assert_eq!(normal, up, "{}", case.name());
    }
}
