//! Loops over lanes against single points: shapes have the same bits in both, whatever the instruction set.

use crate::fixture::{Random, cases, is_shape};
use sdfc_vm::evaluate::evaluate;
use sdfc_vm::lanes::{Instructions, LANES, Points};
use sdfc_vm::listing;
use sdfc_vm::tape::Tape;
use sdfc_vm::tape::machine::Machine;
use sdfc_vm::vector::V3;

#[test]
fn lanes_have_the_bits_of_single_points() {
    let mut random = Random::new(12);
    for case in cases(12, 20, is_shape) {
        let text = format!("0000  {} {:?}\n", case.op.row().name, case.parameters());
        let program = listing::parse(&text).unwrap_or_else(|error| panic!("{error:?}\n{text}"));
        let tape = Tape::of(&program);
        let mut points = Points::default();
        for column in &mut points {
            column.0.fill_with(|| random.range(-3.0, 3.0) as f32);
        }
        for widest in [
            Instructions::Baseline,
            Instructions::Avx2,
            Instructions::Avx512,
        ] {
            let mut machine = Machine::<f32>::new(tape.values, tape.points).limited(widest);
            *machine.seed() = points;
            let found = *machine.run(&program, &tape.clauses, LANES);
            for lane in 0..LANES {
                let [x, y, z] = [0, 1, 2].map(|axis| points[axis].0[lane]);
                let single = evaluate::<f32>(&program, V3::of(x, y, z));
                assert_eq!(
                    found.0[lane].to_bits(),
                    single.to_bits(),
                    "{widest:?}: {} in a lane and {single} at {x}, {y}, {z}\n{text}",
                    found.0[lane]
                );
            }
        }
    }
}
