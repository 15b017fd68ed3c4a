//! Regressions found by campaigns, each reduced as far as possible.

use sdfc_trials::campaign::CheckOutcome;
use sdfc_trials::checks;
use sdfc_trials::seeds::FILES;
use sdfc_vm::file::{FileError, decode_file, with_header};

/// Files with unused words were once accepted, and were encoded differently.
#[test]
fn a_file_has_no_unused_words() {
    let words: Vec<u32> = FILES[0].as_chunks::<4>().0[5..]
        .iter()
        .map(|&bytes| u32::from_le_bytes(bytes))
        .collect();
    assert!(decode_file(&with_header(&words)).is_ok());
    // The settings are the last section. Its length follows its kind.
    let mut longer = words.clone();
    let index = longer
        .windows(2)
        .rposition(|pair| pair[0] == 9)
        .expect("there are settings");
    longer[index + 1] += 1;
    longer.push(7);
    let refused = decode_file(&with_header(&longer)).map(drop);
    assert!(
        matches!(refused, Err(FileError::Form | FileError::Section(9))),
        "{refused:?}"
    );
}

/// Slope searches of many fields once shared no budget: each was searched as if it were the only one.
#[test]
fn many_fields_share_what_searching_for_slopes_may_take() {
    let field = |i: usize| {
        format!("field(fn(p) => sin(p.x * p.y + {i}) * exp(p.z / (2 + p.x * p.x)), within: 3)")
    };
    let fields: Vec<String> = (0..300).map(field).collect();
    let verdict = checks::text(&format!("union([{}])", fields.join(", ")));
    assert_eq!(verdict, CheckOutcome::Accepted);
}

/// Bounds of roots were once computed again for every path to a shared minimum.
#[test]
fn shared_minima_of_squares_are_bounded_once() {
    let step = "fn(s, i) => min(max(s, dot(p - k * i, p - k * i)), max(s, dot(p + i, p + i)))";
    let verdict = checks::text(&format!(
        "param k = 0.5 in 0.1..=1;\nfield(fn(p) => sqrt(fold(0..40, dot(p, p), {step})) - k - (if p.x < 0 {{ 0.1 }} else {{ 0 }}))"
    ));
    assert_eq!(verdict, CheckOutcome::Accepted);
}
