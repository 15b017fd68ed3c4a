//! Constants: the numbers in generated source equal those in the program's words, bit for bit.

use crate::corpus::{compiled, name, on_large_stack, scenes};
use sdfc_compiler::passes::PassOptions;
use sdfc_trials::random::Random;
use sdfc_vm::record::scalar_literal;
use std::collections::BTreeSet;

/// Reports whether a number belongs to the structure of the text (rows of matrices, seeds of gradients) or is
/// the sign of a blend. The text omits the latter.
fn is_structure(bits: u32) -> bool {
    [0.0_f32, 1.0].contains(&f32::from_bits(bits).abs())
}

/// Returns the bits of the literals in a function of a text. They are read as in a WGSL compiler: as
/// `f64`, then rounded to `f32`.
fn literals(text: &str, function: &str) -> BTreeSet<u32> {
    let start = text.find(&format!("fn {function}(")).expect("it is there");
    let body = &text[start..];
    let body = &body[body.find('{').expect("it has a body")..];
    let body = &body[..body.find("\n}").expect("which ends")];
    // A sign belongs to a literal if no operand precedes it.
    let words = body.split(|c: char| !(c.is_ascii_alphanumeric() || "_.+-".contains(c)));
    words
        .filter(|word| word.contains(['.', 'e']))
        .filter_map(|word| word.parse::<f64>().ok())
        .map(|number| (number as f32).to_bits())
        .filter(|&bits| !is_structure(bits))
        .collect()
}

#[test]
fn source_and_words_hold_the_same_constants() {
    let mut checked = 0;
    for path in scenes("tests/scenes").iter().chain(&scenes("examples")) {
        let compiled = on_large_stack(|| compiled(path, PassOptions::default()));
        let source = compiled.generated();
        let written = literals(&source.text, "scene_distance");
        let program = &compiled.module.distance;
        let patched: BTreeSet<u32> = program.patches.iter().map(|patch| patch.index).collect();
        let pool = program.pool.as_flattened().iter().enumerate();
        let words: BTreeSet<u32> = pool
            .filter(|(at, _)| !patched.contains(&(*at as u32)))
            .map(|(_, number)| number.to_bits())
            .filter(|&bits| !is_structure(bits))
            .collect();
        let show = |bits: &BTreeSet<u32>, others: &BTreeSet<u32>| -> Vec<f32> {
            bits.difference(others)
                .map(|&b| f32::from_bits(b))
                .collect()
        };
        let (only_written, only_words) = (show(&written, &words), show(&words, &written));
        assert!(
            only_written.is_empty() && only_words.is_empty(),
            "{}: only in the source {only_written:?}, only in the words {only_words:?}",
            name(path)
        );
        checked += written.len();
    }
    assert!(checked > 1000, "{checked}");
}

/// Every float survives writing and reading, although it is read as `f64` first.
#[test]
fn literals_read_back_as_they_were() {
    let mut random = Random::for_case("literals");
    for _ in 0..1 << 20 {
        let bits = random.bits() as u32;
        let value = f32::from_bits(bits);
        if value.is_finite() {
            let text = scalar_literal(value);
            let read = text.parse::<f64>().map(|number| number as f32);
            assert_eq!(read.map(f32::to_bits), Ok(bits), "{text}");
        }
    }
}
