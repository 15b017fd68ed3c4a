//! No result exceeds its row's slope bound: pairs of points, near and far.

use crate::fixture::{Case, Random, add, cases, distance, is_math, operands, point, tries};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::row::{Output, SlopeRule};
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;

/// Returns the bound for operands of slope one.
fn bound(case: &Case) -> Option<f64> {
    let a = case.parameters();
    Some(match case.op.row().facts.slope {
        SlopeRule::Constant(s) => s,
        SlopeRule::FromParams(f) => f(&a),
        SlopeRule::MaxOfOperands(factor) => factor,
        SlopeRule::MaxOfOperandsOrOne => 1.0,
        SlopeRule::Sum => case.op.row().arity() as f64,
        SlopeRule::Norm => (case.op.row().arity() as f64).sqrt(),
        SlopeRule::PlusParams(f) => 1.0 + f(&a),
        SlopeRule::ScaledBy(f) => f(&a),
        SlopeRule::Fold | SlopeRule::PointMap(_) | SlopeRule::Step | SlopeRule::Unbounded => {
            return None;
        }
    })
}

#[test]
fn no_value_is_steeper_than_its_row_states() {
    // The ends of a partial turn and the inside of an elongation apply to a transformed point. An edge of a
    // polygon depends on the others.
    let elsewhere = |op| {
        use Op::{ElongateCorrect, PolygonEdge, RevolveClose};
        matches!(op, ElongateCorrect | RevolveClose | PolygonEdge)
    };
    for case in cases(6, 4, |op| {
        op.row().output == Output::Value && !elsewhere(op)
    }) {
        let mut random = Random::for_case(5, &case.name());
        let Some(slope) = bound(&case) else { continue };
        for i in 0..tries(2000, 4) {
            let p = random.point([3.0, 3.0, 3.0, 30.0][i % 4]);
            let reach = [1.0, 0.1, 1e-3][i % 3];
            let q = add(p, random.direction(), reach * random.unit());
            let (a, b) = (
                case.on::<f64>(point::<f64>(p)),
                case.on::<f64>(point::<f64>(q)),
            );
            assert!(
                (a - b).abs() <= slope * distance(p, q) * (1.0 + 1e-5) + 1e-6,
                "{}: {a} at {p:?}, {b} at {q:?}, slope {slope}",
                case.name()
            );
        }
    }
}

#[test]
fn no_map_stretches_more_than_its_row_states() {
    for case in cases(8, 5, |op| op.row().output == Output::Point && !is_math(op)) {
        let mut random = Random::for_case(7, &case.name());
        // Long enough that the errors of elementary functions, about 2e-7, stay below the margin.
        let (reach, step) = (1.5, 1e-3);
        let limit = match case.op.row().facts.slope {
            SlopeRule::Fold => 1.0,
            SlopeRule::PointMap(stretch) => {
                stretch(&case.parameters(), &Bounds::centred([reach + step; 3]))
            }
            _ => panic!("{} has no stretch", case.name()),
        };
        let mut largest: f64 = 0.0;
        for _ in 0..tries(4000, 5) {
            let p = random.point(reach);
            let q = add(p, random.direction(), step);
            let images: [_; 9] = std::array::from_fn(|part| {
                let fraction = part as f64 / 8.0;
                case.map(std::array::from_fn(|i| p[i] + (q[i] - p[i]) * fraction))
            });
            let parts = images.windows(2).map(|ends| distance(ends[0], ends[1]));
            let longest = parts.fold(0.0, f64::max);
            let moved = distance(images[0], images[8]);
            // Between two cells the map is discontinuous, and a single part covers the full distance.
            if longest < moved * 0.2 {
                largest = largest.max(moved / step);
            }
        }
        assert!(
            largest <= limit * (1.0 + 1e-3),
            "{}: {largest}, not {limit}",
            case.name()
        );
        let tight = if case.op == Op::Bend { 0.55 } else { 0.85 };
        assert!(
            largest >= limit * tight,
            "{}: only {largest} of {limit}",
            case.name()
        );
    }
}

/// The slope of arithmetic without a rule follows from intervals; its stated bounds must hold.
#[test]
fn operands_have_slope_one() {
    let mut random = Random::new(9);
    for _ in 0..1000 {
        let (p, q) = (random.point(2.0), random.point(2.0));
        let at = |[x, y, z]: [f64; 3]| operands::<f64>(Op::Add, V3::new(x, y, z));
        for (a, b) in at(p).iter().zip(at(q)) {
            assert!((a - b).abs() <= distance(p, q) * (1.0 + 1e-12));
        }
    }
}
