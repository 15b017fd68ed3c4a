//! Each pass keeps the value of every scene: with all passes, with none, and with each left out.

use crate::corpus::{compiled, on_large_stack, scenes};
use sdfc_compiler::passes::{PASSES, PassOptions};
use sdfc_vm::lanes::{Column, LANES};
use sdfc_vm::program::Program;
use sdfc_vm::tape::Tape;
use sdfc_vm::tape::machine::Machine;

/// 4,096 points in and around the cube of three units.
fn points(block: u64) -> [Column; 3] {
    let mut state = block.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    std::array::from_fn(|_| {
        Column(std::array::from_fn(|_| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            ((state >> 40) as f32 / (1 << 23) as f32 - 1.0) * 3.0
        }))
    })
}

fn values(program: &Program) -> Vec<f32> {
    let tape = Tape::of(program);
    let mut machine = Machine::<f32>::new(tape.values, tape.points);
    (0..64)
        .flat_map(|block| {
            *machine.seed() = points(block);
            machine.run(program, &tape.clauses, LANES).0
        })
        .collect()
}

#[test]
fn passes_keep_every_bit() {
    let mut variants = vec![PassOptions {
        none: true,
        without: vec![],
    }];
    for pass in PASSES {
        variants.push(PassOptions {
            none: false,
            without: vec![pass.name.to_owned()],
        });
    }
    for path in scenes("tests/scenes").iter().chain(&scenes("examples")) {
        on_large_stack(|| {
            let all = values(&compiled(path, PassOptions::default()).module.distance);
            assert_eq!(all.len(), 64 * LANES);
            for options in &variants {
                let other = values(&compiled(path, options.clone()).module.distance);
                let differs = all
                    .iter()
                    .zip(&other)
                    .position(|(a, b)| a != b && !(a.is_nan() && b.is_nan()));
                if let Some(at) = differs {
                    panic!(
                        "{}, {options:?}: point {at} is {} with all passes, {} with these",
                        path.display(),
                        all[at],
                        other[at]
                    );
                }
            }
        });
    }
}
