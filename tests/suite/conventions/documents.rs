//! Paths and lengths of documents.

use super::all_sources;
use std::fs;
use std::path::Path;

/// Documents whose paths are checked, with their maximum number of lines.
const DOCUMENTS: [(&str, usize); 6] = [
    ("README.md", 150),
    ("ARCHITECTURE.md", 300),
    ("CONTRIBUTING.md", 150),
    ("docs/known-defects.md", 150),
    ("docs/limits.md", 150),
    ("tests/README.md", 250),
];

/// Keywords before the name of an item.
const KEYWORDS: [&str; 7] = ["fn", "struct", "enum", "trait", "const", "mod", "type"];

/// Returns the item that a quoted path such as `marching::march_step` names, if it is one of the project's.
fn named_item(quoted: &str) -> Option<&str> {
    let is_path = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let (module, item) = quoted.rsplit_once("::")?;
    let is_ours = module.starts_with(|c: char| c.is_ascii_lowercase()) && !item.is_empty();
    (is_ours && quoted.chars().all(is_path)).then_some(item)
}

#[test]
fn documents_name_items_that_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let sources = all_sources();
    let mut wrong = Vec::new();
    for (name, _) in DOCUMENTS {
        let text = fs::read_to_string(root.join(name)).expect("a document");
        for item in text.split('`').skip(1).step_by(2).filter_map(named_item) {
            let is_defined = |keyword: &str| {
                let definition = format!("{keyword} {item}");
                sources
                    .iter()
                    .any(|source| source.text.contains(&definition))
            };
            if !KEYWORDS.into_iter().any(is_defined) {
                wrong.push(format!("{name}: `{item}` is not defined"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn documents_name_files_that_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let paths: Vec<String> = all_sources()
        .iter()
        .map(|source| source.path.display().to_string())
        .collect();
    let mut wrong = Vec::new();
    for (name, max_lines) in DOCUMENTS {
        let text = fs::read_to_string(root.join(name)).expect("a document");
        let lines = text.lines().count();
        if lines > max_lines {
            wrong.push(format!("{name}: {lines} lines, at most {max_lines}"));
        }
        for quoted in text.split('`').skip(1).step_by(2) {
            let is_path = quoted.ends_with(".rs") && !quoted.contains(['*', '…', ' ']);
            let suffix = format!("/{quoted}");
            let exists = || {
                paths
                    .iter()
                    .any(|path| path == quoted || path.ends_with(&suffix))
            };
            if is_path && !exists() {
                wrong.push(format!("{name}: `{quoted}` is no file"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
