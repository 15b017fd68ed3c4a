//! Fuzz target: sections of `.sdfb` files from libFuzzer.
//!
//! The header is made valid, since its checksum would reject nearly all inputs.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sdfc_trials::checks;
use sdfc_vm::file::with_header;

fuzz_target!(|bytes: &[u8]| {
    let words = bytes.as_chunks::<4>().0.iter();
    let words: Vec<u32> = words.map(|&word| u32::from_le_bytes(word)).collect();
    checks::file(&with_header(&words));
    checks::file(bytes);
});
