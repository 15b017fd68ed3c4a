//! Loops over lanes against single points: distances, gradients and bounds of shapes have the same bits in
//! both, for every SIMD level.

use crate::fixture::{Random, cases, is_shape};
use sdfc_vm::dual::Dual;
use sdfc_vm::evaluate::evaluate;
use sdfc_vm::interval::FloatInterval;
use sdfc_vm::lanes::{LANES, LaneNumber, Points, SimdLevel, with_identity_jacobian};
use sdfc_vm::listing;
use sdfc_vm::tape::Tape;
use sdfc_vm::tape::evaluator::TapeEvaluator;
use sdfc_vm::vector::V3;

#[test]
fn lanes_have_the_bits_of_single_points() {
    for case in cases(12, 20, is_shape) {
        let mut random = Random::for_case(12, &case.name());
        let text = format!("0000  {} {:?}\n", case.op.row().name, case.parameters());
        let program = listing::parse(&text).unwrap_or_else(|error| panic!("{error:?}\n{text}"));
        let tape = Tape::new(&program);
        let mut points = Points::default();
        for column in &mut points {
            column.0.fill_with(|| random.range(-3.0, 3.0) as f32);
        }
        let mut boxes = <FloatInterval as LaneNumber>::PointBlock::default();
        for axis in 0..3 {
            for lane in 0..LANES {
                let low = points[axis].0[lane];
                boxes[axis].0[lane] = low;
                boxes[axis + 3].0[lane] = low + random.range(0.0, 0.5) as f32;
            }
        }
        for widest in [SimdLevel::Baseline, SimdLevel::Avx2, SimdLevel::Avx512] {
            let mut evaluator =
                TapeEvaluator::<f32>::new(tape.values, tape.points).with_max_simd(widest);
            *evaluator.inputs_mut() = points;
            let values = *evaluator.run(&program, &tape.clauses, LANES);
            let mut evaluator =
                TapeEvaluator::<Dual<f32>>::new(tape.values, tape.points).with_max_simd(widest);
            *evaluator.inputs_mut() = with_identity_jacobian(&points);
            let gradients = *evaluator.run(&program, &tape.clauses, LANES);
            let mut evaluator =
                TapeEvaluator::<FloatInterval>::new(tape.values, tape.points).with_max_simd(widest);
            *evaluator.inputs_mut() = boxes;
            let bounds = *evaluator.run(&program, &tape.clauses, LANES);
            for lane in 0..LANES {
                let [x, y, z] = [0, 1, 2].map(|axis| points[axis].0[lane]);
                let p = V3::new(x, y, z);
                let single = evaluate::<f32>(&program, p);
                let dual = evaluate::<Dual<f32>>(
                    &program,
                    Dual::load_point(&with_identity_jacobian(&points), lane),
                );
                let interval =
                    evaluate::<FloatInterval>(&program, FloatInterval::load_point(&boxes, lane));
                let actual = [
                    &values,
                    &gradients[0],
                    &gradients[1],
                    &gradients[2],
                    &gradients[3],
                ];
                let actual = actual
                    .into_iter()
                    .chain(&bounds)
                    .map(|column| column.0[lane]);
                let V3 {
                    x: dx,
                    y: dy,
                    z: dz,
                } = dual.gradient;
                let singly = [single, dx, dy, dz, dual.value, interval.lo, interval.hi];
                for (actual, single) in actual.zip(singly) {
                    assert_eq!(
                        actual.to_bits(),
                        single.to_bits(),
                        "{widest:?}: {actual} in a lane and {single} at {p:?}\n{text}"
                    );
                }
            }
        }
    }
}
