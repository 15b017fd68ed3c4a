//! Random programs in the interpreter: with strict arithmetic their values equal those of the CPU in every
//! bit.

use crate::scenes::{loaded, module_of, strict_interp};
use sdfc_trials::campaign::input_count;
use sdfc_trials::checks::{equal_or_both_nan, has_nonfinite_intermediate, tape_values};
use sdfc_trials::programs::{concatenated, points, program};
use sdfc_vm::lanes::LANES;
use sdfc_vm::listing;
use sdfc_vm::tape::Tape;
use sdfc_vm::vector::V3;
use sdfc_vm::verify::verify;

#[test]
fn random_programs_give_the_same_values() {
    let Some(mut interp) = strict_interp() else {
        return;
    };
    // A kernel that supports all of them, as an editor keeps it. It is made for the programs that extend the
    // requirements of the ones before.
    let programs = input_count(300, 100);
    let mut requirements = program(0).requirements();
    let mut extending = vec![program(0)];
    for program in (1..programs).map(program) {
        let needs = program.requirements();
        if !requirements.covers(&needs) {
            requirements = requirements.union(&needs);
            extending.push(program);
        }
    }
    let combined = concatenated(&extending);
    verify(&combined, 0, false).unwrap_or_else(|error| panic!("{error}"));
    let everything = module_of(combined, None);
    interp.load(&loaded(&everything, &[])).expect("it loads");
    interp.query(&[[0.0; 3]]).expect("it runs");
    let pipelines = interp.pipelines_created();

    let (mut differing, mut values) = (Vec::new(), 0);
    for seed in 0..programs {
        let program = program(seed);
        let points = points(seed);
        let tape = Tape::new(&program);
        let expected = tape_values(&program, &tape, &tape.clauses, &points).0;
        let scene = module_of(program, None);
        interp.load(&loaded(&scene, &[])).expect("it loads");
        let places: Vec<[f32; 3]> = (0..LANES)
            .map(|lane| [0, 1, 2].map(|axis| points[axis].0[lane]))
            .collect();
        let samples = interp.query(&places).expect("it answers");
        for (at, (&a, b)) in expected.iter().zip(&samples).enumerate() {
            values += 1;
            let [x, y, z] = places[at];
            // Equality is not promised if an intermediate value is not finite.
            // Samples have positive zeros.
            if !equal_or_both_nan(a + 0.0, b.distance)
                && !has_nonfinite_intermediate(&scene.distance, V3::new(x, y, z))
            {
                differing.push((seed, places[at], a, b.distance));
            }
        }
    }
    let created = interp.pipelines_created() - pipelines;
    assert_eq!(created, 0, "every program runs in the kernel that is there");
    if let Some(&(seed, at, cpu, interp)) = differing.first() {
        let listing = listing::print(&program(seed));
        panic!(
            "{} of {values} values differ, the first of seed {seed} at {at:?}: cpu {cpu}, interp \
             {interp}\n{listing}",
            differing.len()
        );
    }
}
