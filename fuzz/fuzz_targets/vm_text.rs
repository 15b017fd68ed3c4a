//! Fuzz target: clauses of `.vm` files from libFuzzer.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sdfc_trials::checks;

fuzz_target!(|text: &str| {
    checks::clauses(text);
});
