//! The names of tests, and the tests that deliberate faults name.

use super::{Source, all_sources};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// The list of deliberate faults.
const FAULTS: &str = "tests/faults/faults.txt";

/// Words of the project's former dialect. The glossary of ARCHITECTURE.md has others for them.
const FORMER_WORDS: [&str; 25] = [
    "anew", "ask", "asked", "asks", "ball", "balls", "eye", "eyes", "figure", "figures", "know",
    "known", "knows", "lamp", "lamps", "said", "say", "says", "tell", "tells", "told", "torn",
    "want", "wants", "whole",
];
/// Words with which no name begins: the subject of the sentence is missing.
const OPENERS: [&str; 8] = [
    "how", "it", "of", "they", "what", "whatever", "where", "which",
];

/// A test: its path within its binary, without the crate, and its name.
struct Test {
    path: String,
    name: String,
}

/// The tests of a file.
fn tests(source: &Source) -> Vec<Test> {
    let (_, module) = binary(&source.path).unwrap_or_default();
    let mut found = Vec::new();
    let mut is_attributed = false;
    let mut is_within = false;
    for line in source.text.lines() {
        let line = line.trim();
        is_within |= line == "mod tests {";
        let name = line.strip_prefix("fn ").filter(|_| is_attributed);
        if let Some((name, _)) = name.and_then(|name| name.split_once('(')) {
            let inner = if is_within { "::tests" } else { "" };
            found.push(Test {
                path: format!("{module}{inner}::{name}"),
                name: name.to_owned(),
            });
        }
        is_attributed = line == "#[test]" || (is_attributed && line.starts_with("#["));
    }
    found
}

/// The binary that contains a file's tests, and the path of the file's module in it.
fn binary(path: &Path) -> Option<(String, String)> {
    let path = path.with_extension("");
    let mut parts: Vec<String> = path
        .iter()
        .map(|part| part.to_string_lossy().into_owned())
        .collect();
    if parts[0] == "tests" || parts[0] == "src" {
        parts.insert(0, String::new());
    }
    if !matches!(parts.get(1).map(String::as_str), Some("src" | "tests")) {
        return None;
    }
    let owner = parts.remove(0);
    let name = match parts.remove(0).as_str() {
        "src" if owner.is_empty() => "sdfc".to_owned(),
        "src" => format!("sdfc_{owner}"),
        _ => parts.remove(0),
    };
    Some((name, parts.join("::")))
}

/// All tests of each binary.
fn all_tests() -> BTreeMap<String, Vec<Test>> {
    let mut found: BTreeMap<String, Vec<Test>> = BTreeMap::new();
    for source in all_sources() {
        let name = binary(&source.path).map_or_else(String::new, |(name, _)| name);
        found.entry(name).or_default().extend(tests(&source));
    }
    let count: usize = found.values().map(Vec::len).sum();
    assert!(count > 700, "only {count} tests were found");
    found
}

/// The former words in a name, and the opener with which it begins.
fn former_words(name: &str) -> Vec<&str> {
    let words: Vec<&str> = name.split('_').collect();
    let opener = words.first().filter(|word| OPENERS.contains(word));
    let former = words.iter().filter(|word| FORMER_WORDS.contains(word));
    opener.into_iter().chain(former).copied().collect()
}

#[test]
fn names_of_tests_keep_to_the_glossary() {
    let all = all_tests();
    let wrong: Vec<String> = all
        .values()
        .flatten()
        .filter(|test| !former_words(&test.name).is_empty())
        .map(|test| format!("{}: {}", test.path, former_words(&test.name).join(", ")))
        .collect();
    assert!(wrong.is_empty(), "{}\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn former_words_are_found_in_names() {
    assert_eq!(
        former_words("what_is_said_of_a_ball"),
        ["what", "said", "ball"]
    );
    assert!(former_words("spheres_are_wholly_visible_of_course").is_empty());
}

#[test]
fn faults_name_tests_that_exist() {
    let all = all_tests();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(FAULTS);
    let text = fs::read_to_string(path).expect("the list of faults");
    let mut wrong = Vec::new();
    let mut count = 0;
    for line in text.lines() {
        let Some(selection) = line.strip_prefix("  by ") else {
            continue;
        };
        let mut words = selection.split_whitespace();
        let binary = words.next().unwrap_or_default();
        let Some(tests) = all.get(binary) else {
            wrong.push(format!("there is no test binary `{binary}`"));
            continue;
        };
        // Words with `=` are variables.
        for filter in words.filter(|word| !word.contains('=')) {
            count += 1;
            if !tests.iter().any(|test| test.path.contains(filter)) {
                wrong.push(format!("`{filter}` selects no test of `{binary}`"));
            }
        }
    }
    assert!(count > 150, "only {count} filters were found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
