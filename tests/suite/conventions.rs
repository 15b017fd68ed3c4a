//! Conventions of the source text that no compiler checks.

mod additions;
mod circles;
mod comments;
mod crates;
mod documents;
mod lengths;
mod names;
mod tests;

use std::fs;
use std::path::{Path, PathBuf};

/// The folders of the crates' sources, relative to the root of the repository.
const CRATES: [(&str, &str); 9] = [
    ("sdfc-lang", "lang/src"),
    ("sdfc-vm", "vm/src"),
    ("sdfc-compiler", "compiler/src"),
    ("sdfc-shaders", "shaders/src"),
    ("sdfc-trials", "trials/src"),
    ("sdfc-runtime", "runtime/src"),
    ("sdfc-io", "io/src"),
    ("sdfc-playground", "playground/src"),
    ("sdfc", "src"),
];
/// The folders of the tests and benchmarks.
const TESTS: [&str; 10] = [
    "lang/tests",
    "vm/tests",
    "compiler/tests",
    "shaders/tests",
    "trials/tests",
    "runtime/tests",
    "playground/tests",
    "tests/suite",
    "tests/faults/src",
    "benches",
];

/// A file of Rust or WGSL, with its path relative to the root of the repository.
struct Source {
    path: PathBuf,
    text: String,
}

/// All files of Rust below a folder, in the order of their paths.
fn sources(folder: &str) -> Vec<Source> {
    sources_of(folder, "rs")
}

/// All files with an extension below a folder, in the order of their paths.
fn sources_of(folder: &str, extension: &str) -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut open, mut found) = (vec![root.join(folder)], Vec::new());
    while let Some(folder) = open.pop() {
        let Ok(entries) = fs::read_dir(&folder) else {
            continue;
        };
        for entry in entries {
            let path = entry.expect("a readable folder").path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|own| own == extension) {
                let text = fs::read_to_string(&path).expect("a file of text");
                let path = path.strip_prefix(root).expect("below the root").to_owned();
                found.push(Source { path, text });
            }
        }
    }
    found.sort_by(|a, b| a.path.cmp(&b.path));
    found
}

/// All files of Rust of the project.
fn all_sources() -> Vec<Source> {
    let crates = CRATES.iter().map(|(_, folder)| *folder);
    let found: Vec<Source> = crates.chain(TESTS).flat_map(sources).collect();
    assert!(found.len() > 400, "only {} files were found", found.len());
    found
}
