//! Fuzz target: scene texts from libFuzzer.
#![no_main]

use libfuzzer_sys::fuzz_target;
use sdfc_trials::checks;

fuzz_target!(|text: &str| {
    checks::text(text);
});
