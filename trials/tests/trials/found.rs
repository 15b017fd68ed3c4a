//! What campaigns have found, each as small as it could be made.

use sdfc_trials::campaign::Verdict;
use sdfc_trials::checks;
use sdfc_trials::seeds::FILES;
use sdfc_vm::file::{FileError, decode_file, sealed};

/// Bytes that hold a scene, with words that nothing reads: they read as the scene did, and were
/// written otherwise.
#[test]
fn a_file_says_nothing_twice() {
    let words: Vec<u32> = FILES[0].as_chunks::<4>().0[5..]
        .iter()
        .map(|&bytes| u32::from_le_bytes(bytes))
        .collect();
    assert!(decode_file(&sealed(&words)).is_ok());
    // The settings are the last section; its length stands behind its kind.
    let mut longer = words.clone();
    let at = longer
        .windows(2)
        .rposition(|pair| pair[0] == 9)
        .expect("there are settings");
    longer[at + 1] += 1;
    longer.push(7);
    let refused = decode_file(&sealed(&longer)).map(drop);
    assert!(
        matches!(refused, Err(FileError::Form | FileError::Section(9))),
        "{refused:?}"
    );
}

/// Slopes of many fields shared no budget: each was searched for as if it were the only one.
#[test]
fn many_fields_share_what_searching_for_slopes_may_take() {
    let field = |i: usize| {
        format!("field(fn(p) => sin(p.x * p.y + {i}) * exp(p.z / (2 + p.x * p.x)), within: 3)")
    };
    let fields: Vec<String> = (0..300).map(field).collect();
    let verdict = checks::text(&format!("union([{}])", fields.join(", ")));
    assert_eq!(verdict, Verdict::Accepted);
}
