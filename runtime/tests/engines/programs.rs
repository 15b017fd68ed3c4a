//! Random programs in the interpreter: the values of the CPU, bit for bit, where arithmetic is strict.

use crate::scenes::{gpu, loaded, module_of};
use sdfc_runtime::engine::{EngineKind, on};
use sdfc_runtime::gpu::{Arithmetic, Gpu, Preference};
use sdfc_trials::campaign::count;
use sdfc_trials::checks::{meets_none, same, values_at};
use sdfc_trials::programs::{joined, points, program};
use sdfc_vm::lanes::LANES;
use sdfc_vm::listing;
use sdfc_vm::tape::Tape;
use sdfc_vm::vector::V3;
use sdfc_vm::verify::verify;

#[test]
fn random_programs_give_the_same_values() {
    if gpu().is_none() {
        return;
    }
    let strict = Gpu::open_with(Preference::Any, Arithmetic::Strict);
    let mut interp = on(
        EngineKind::Interp,
        strict.expect("software Vulkan can be strict"),
    );
    // A kernel that does for all of them, which is what an editor keeps: made for those that need
    // something more than the ones before.
    let programs = count(300, 100);
    let mut together = program(0).needs();
    let mut needing = vec![program(0)];
    for program in (1..programs).map(program) {
        let needs = program.needs();
        if !together.cover(&needs) {
            together = together.join(&needs);
            needing.push(program);
        }
    }
    let all = joined(&needing);
    verify(&all, 0, false).unwrap_or_else(|error| panic!("{error}"));
    let everything = module_of(all, None);
    interp.load(&loaded(&everything, &[])).expect("it loads");
    interp.query(&[[0.0; 3]]).expect("it runs");
    let pipelines = interp.pipelines_created();

    let (mut differing, mut values) = (Vec::new(), 0);
    for seed in 0..programs {
        let program = program(seed);
        let points = points(seed);
        let tape = Tape::of(&program);
        let expected = values_at(&program, &tape, &tape.clauses, &points).0;
        let scene = module_of(program, None);
        interp.load(&loaded(&scene, &[])).expect("it loads");
        let places: Vec<[f32; 3]> = (0..LANES)
            .map(|lane| [0, 1, 2].map(|axis| points[axis].0[lane]))
            .collect();
        let found = interp.query(&places).expect("it answers");
        for (at, (&a, b)) in expected.iter().zip(&found).enumerate() {
            values += 1;
            let [x, y, z] = places[at];
            // Of what is not finite on the way nothing is promised.
            if !same(a, b.distance) && !meets_none(&scene.distance, V3::of(x, y, z)) {
                differing.push((seed, places[at], a, b.distance));
            }
        }
    }
    let of = interp.pipelines_created() - pipelines;
    assert_eq!(of, 0, "every program runs in the kernel that is there");
    if let Some(&(seed, at, cpu, interp)) = differing.first() {
        let listing = listing::print(&program(seed));
        panic!(
            "{} of {values} values differ, the first of seed {seed} at {at:?}: cpu {cpu}, interp \
             {interp}\n{listing}",
            differing.len()
        );
    }
}
