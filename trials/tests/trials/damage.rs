//! What is damaged is refused with a message, or is a scene like any other.

use sdfc_trials::campaign::{count, run_timed};
use sdfc_trials::{checks, damage};
use sdfc_vm::file::decode_file;
use std::time::Duration;

/// What more than others an input may take: a microsecond for each of its bytes and two for each byte
/// of the file that it becomes, since a short text may ask for many shapes; and what searching for
/// slopes may take where there are functions of the point. What is refused may have used up its steps.
fn allowed(text: &str, file: Option<Vec<u8>>) -> Duration {
    let is_refused = file.is_none();
    let bytes = text.len() + 2 * file.map_or(0, |file| file.len());
    let search = Duration::from_millis(if text.contains("fn") { 100 } else { 0 });
    let steps = is_refused && (text.contains("for") || text.contains("fn"));
    let steps = Duration::from_secs(if steps { 4 } else { 0 });
    Duration::from_micros(bytes as u64) + search + steps
}

#[test]
fn texts() {
    let tally = run_timed(
        "texts",
        count(500, 1),
        damage::text,
        |text| checks::text(text),
        |text| allowed(text, checks::compile_text(text)),
    );
    assert!(tally.says_something(), "{tally:?}");
}

#[test]
fn files() {
    let tally = run_timed(
        "files",
        count(10_000, 1),
        damage::file,
        |bytes| checks::file(bytes),
        |bytes| {
            drop(decode_file(bytes));
            Duration::ZERO
        },
    );
    assert!(tally.says_something(), "{tally:?}");
}

#[test]
fn clauses() {
    let tally = run_timed(
        "clauses",
        count(1000, 100),
        damage::clauses,
        |text| checks::clauses(text),
        |text| {
            let search = Duration::from_millis(100);
            search + allowed(text, checks::compile_clauses(text))
        },
    );
    assert!(tally.says_something(), "{tally:?}");
}
