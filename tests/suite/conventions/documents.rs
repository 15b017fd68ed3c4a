//! Documents: their lengths, and the paths, items and links in them.

use super::{CRATES, all_sources};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Maximum number of lines of a document.
const MAX_LINES: usize = 150;
/// Longer documents, with their maximum number of lines.
const LONGER: [(&str, usize); 5] = [
    ("ACCURACY-REPORT.md", 2000),
    ("ARCHITECTURE.md", 300),
    ("BENCHMARKS.md", 400),
    ("CHANGELOG.md", 400),
    ("tests/README.md", 250),
];
/// Folders with documents, besides the root and the crates.
const FOLDERS: [&str; 4] = ["benches", "docs", "fuzz", "tests"];

/// Keywords before the name of an item.
const KEYWORDS: [&str; 7] = ["fn", "struct", "enum", "trait", "const", "mod", "type"];

/// A document, with its path relative to the root of the repository.
struct Document {
    path: PathBuf,
    text: String,
}

impl Document {
    /// The texts in backticks.
    fn quoted(&self) -> impl Iterator<Item = &str> {
        self.text.split('`').skip(1).step_by(2)
    }

    /// The paths of the files that it links to, relative to the root of the repository.
    fn linked_files(&self) -> impl Iterator<Item = PathBuf> {
        let targets = self.text.split("](").skip(1);
        let targets = targets.filter_map(|rest| rest.split([')', '#']).next());
        let folder = self.path.parent().unwrap_or(Path::new(""));
        targets
            .filter(|target| !target.is_empty() && !target.contains(':'))
            .map(move |target| normalized(&folder.join(target)))
    }
}

/// A path without `..`.
fn normalized(path: &Path) -> PathBuf {
    let mut parts = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                parts.pop();
            }
            part => parts.push(part),
        }
    }
    parts
}

/// All documents of the project.
fn documents() -> Vec<Document> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let crates = CRATES
        .iter()
        .filter_map(|(_, sources)| sources.strip_suffix("/src"));
    let mut open: Vec<PathBuf> = crates
        .chain(FOLDERS)
        .map(|folder| root.join(folder))
        .collect();
    let mut found = Vec::new();
    let mut entries: Vec<PathBuf> = files_and_folders(root)
        .into_iter()
        .filter(|path| path.is_file())
        .collect();
    loop {
        for path in entries {
            if path.is_dir() && !path.ends_with("target") {
                open.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                let text = fs::read_to_string(&path).expect("a file of text");
                let path = path.strip_prefix(root).expect("below the root").to_owned();
                found.push(Document { path, text });
            }
        }
        let Some(folder) = open.pop() else { break };
        entries = files_and_folders(&folder);
    }
    assert!(
        found.len() > 40,
        "only {} documents were found",
        found.len()
    );
    found
}

/// The entries of a folder.
fn files_and_folders(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a readable folder");
    entries
        .map(|entry| entry.expect("a readable entry").path())
        .collect()
}

/// Returns the item that a quoted path such as `marching::march_step` names, if it is one of the project's.
fn named_item(quoted: &str) -> Option<&str> {
    let is_path = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    let (module, item) = quoted.rsplit_once("::")?;
    let is_ours = module.starts_with(|c: char| c.is_ascii_lowercase()) && !item.is_empty();
    (is_ours && quoted.chars().all(is_path)).then_some(item)
}

#[test]
fn documents_name_items_that_exist() {
    let sources = all_sources();
    let mut wrong = Vec::new();
    for document in documents() {
        for item in document.quoted().filter_map(named_item) {
            let is_defined = |keyword: &str| {
                let definition = format!("{keyword} {item}");
                sources
                    .iter()
                    .any(|source| source.text.contains(&definition))
            };
            if !KEYWORDS.into_iter().any(is_defined) {
                let name = document.path.display();
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
    for document in documents() {
        let name = document.path.display();
        for quoted in document.quoted() {
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
        for target in document.linked_files() {
            if !root.join(&target).exists() {
                wrong.push(format!("{name}: {} does not exist", target.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn documents_are_short() {
    let mut wrong = Vec::new();
    for document in documents() {
        let longer = LONGER
            .into_iter()
            .find(|(name, _)| document.path == Path::new(name));
        let max_lines = longer.map_or(MAX_LINES, |(_, lines)| lines);
        let lines = document.text.lines().count();
        if lines > max_lines {
            let name = document.path.display();
            wrong.push(format!("{name}: {lines} lines, at most {max_lines}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn links_lead_from_the_readme_to_every_document() {
    let mut unreached = documents();
    let mut open = vec![PathBuf::from("README.md")];
    while let Some(path) = open.pop() {
        let Some(index) = unreached.iter().position(|document| document.path == path) else {
            continue;
        };
        open.extend(unreached.swap_remove(index).linked_files());
    }
    let unreached: BTreeSet<_> = unreached.iter().map(|document| &document.path).collect();
    assert!(unreached.is_empty(), "{unreached:?}");
}
