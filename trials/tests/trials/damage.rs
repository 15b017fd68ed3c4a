//! Damaged input is refused with a message, or is valid.

use sdfc_trials::campaign::{input_count, run_timed};
use sdfc_trials::{checks, damage};
use sdfc_vm::file::decode_file;
use std::time::Duration;

/// Returns the time an input may take beyond the common limit.
///
/// It is 1 µs per byte of the text and 2 µs per byte of the compiled file: a short text may request many
/// shapes. Texts with functions of the point get 100 ms for the search for slopes. Refused texts with
/// loops or functions get 4 s, since they may have used up all evaluation steps.
fn allowed_time(text: &str, file: Option<Vec<u8>>) -> Duration {
    let is_refused = file.is_none();
    let bytes = text.len() + 2 * file.map_or(0, |file| file.len());
    let search_time = Duration::from_millis(if text.contains("fn") { 100 } else { 0 });
    let step_time = is_refused && (text.contains("for") || text.contains("fn"));
    let step_time = Duration::from_secs(if step_time { 4 } else { 0 });
    Duration::from_micros(bytes as u64) + search_time + step_time
}

#[test]
fn texts() {
    let tally = run_timed(
        "texts",
        input_count(500, 1),
        damage::text,
        |text| checks::text(text),
        |text| allowed_time(text, checks::compile_text(text)),
    );
    assert!(tally.is_balanced(), "{tally:?}");
}

#[test]
fn files() {
    let tally = run_timed(
        "files",
        input_count(10_000, 1),
        damage::file,
        |bytes| checks::file(bytes),
        |bytes| {
            drop(decode_file(bytes));
            Duration::ZERO
        },
    );
    assert!(tally.is_balanced(), "{tally:?}");
}

#[test]
fn clauses() {
    let tally = run_timed(
        "clauses",
        input_count(1000, 100),
        damage::clauses,
        |text| checks::clauses(text),
        |text| {
            let search_time = Duration::from_millis(100);
            search_time + allowed_time(text, checks::compile_clauses(text))
        },
    );
    assert!(tally.is_balanced(), "{tally:?}");
}
