//! What is damaged is refused with a message, or is a scene like any other.

use sdfc_trials::campaign::{count, run};
use sdfc_trials::{checks, damage};

#[test]
fn texts() {
    let tally = run("texts", count(1500, 1), damage::text, |text| {
        checks::text(text)
    });
    // Where nearly all are refused nothing is said of the compiler, and of messages otherwise.
    assert!(tally.accepted > tally.refused / 30, "{tally:?}");
    assert!(tally.refused > tally.accepted / 8, "{tally:?}");
}

#[test]
fn files() {
    let tally = run("files", count(20_000, 1), damage::file, |bytes| {
        checks::file(bytes)
    });
    assert!(tally.accepted > tally.refused / 30, "{tally:?}");
    assert!(tally.refused > tally.accepted / 8, "{tally:?}");
}

#[test]
fn clauses() {
    let tally = run("clauses", count(2000, 1), damage::clauses, |text| {
        checks::clauses(text)
    });
    assert!(tally.accepted > tally.refused / 30, "{tally:?}");
    assert!(tally.refused > tally.accepted / 8, "{tally:?}");
}
