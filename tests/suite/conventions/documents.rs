//! Documents: their lengths, the form of decisions, and the paths, items and links in them.

use super::{CRATES, all_sources};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// Maximum number of lines of a document.
const MAX_LINES: usize = 150;
/// Longer documents, with their maximum number of lines.
const LONGER: [(&str, usize); 6] = [
    ("ACCURACY-REPORT.md", 2000),
    ("ARCHITECTURE.md", 300),
    ("BENCHMARKS.md", 400),
    ("CHANGELOG.md", 400),
    ("docs/known-defects.md", 250),
    ("tests/README.md", 250),
];
/// Folders with documents, besides the root and the crates.
const FOLDERS: [&str; 4] = ["benches", "docs", "fuzz", "tests"];

/// Folder of the decisions.
const DECISIONS: &str = "docs/decisions";
/// The headings of a decision, in order.
const DECISION_HEADINGS: [&str; 4] = ["Context", "Options", "Decision", "Consequences"];
/// Maximum number of lines of a decision.
const MAX_DECISION_LINES: usize = 80;
/// Words with which no title of a decision begins: it states the decision, and asks nothing.
const QUESTION_WORDS: [&str; 7] = ["What", "Who", "When", "Which", "Where", "How", "Whether"];

/// Keywords before the name of an item.
const KEYWORDS: [&str; 7] = ["fn", "struct", "enum", "trait", "const", "mod", "type"];

/// A document, with its path relative to the root of the repository.
pub(super) struct Document {
    pub(super) path: PathBuf,
    pub(super) text: String,
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
pub(super) fn documents() -> Vec<Document> {
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

/// Returns the faults of a decision's form.
fn form_faults(text: &str) -> Vec<String> {
    let mut faults = Vec::new();
    let title = text.lines().next().and_then(|line| line.strip_prefix("# "));
    let first_word = title.and_then(|title| title.split_whitespace().next());
    match first_word {
        None => faults.push("the first line is no title".to_owned()),
        Some(word) if QUESTION_WORDS.contains(&word) => {
            faults.push(format!("the title begins with {word}"));
        }
        Some(_) => {}
    }
    let headings: Vec<&str> = text
        .lines()
        .filter_map(|line| line.strip_prefix("## "))
        .collect();
    if headings != DECISION_HEADINGS {
        faults.push(format!("the headings are {headings:?}"));
    }
    let sections = text.split("\n## ").skip(1);
    let empty = sections.filter(|section| section.lines().skip(1).all(|line| line.is_empty()));
    faults.extend(
        empty.map(|section| format!("{} is empty", section.lines().next().unwrap_or_default())),
    );
    let lines = text.lines().count();
    if lines > MAX_DECISION_LINES {
        faults.push(format!("{lines} lines, at most {MAX_DECISION_LINES}"));
    }
    faults
}

#[test]
fn decisions_have_one_form() {
    let mut wrong = Vec::new();
    let mut count = 0;
    for document in documents() {
        let is_decision =
            document.path.starts_with(DECISIONS) && !document.path.ends_with("README.md");
        if is_decision {
            count += 1;
            let name = document.path.display();
            let faults = form_faults(&document.text).into_iter();
            wrong.extend(faults.map(|fault| format!("{name}: {fault}")));
        }
    }
    assert!(count > 30, "only {count} decisions were found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn faults_of_a_decisions_form_are_reported() {
    let complete = "# Cells\n\n## Context\n\na\n\n## Options\n\nb\n\n## Decision\n\nc\n\n## Consequences\n\nd\n";
    assert!(form_faults(complete).is_empty());
    let broken = [
        complete.replace("# Cells", "# When cells pay off"),
        complete.replace("# Cells\n", ""),
        complete.replace("\n## Consequences\n\nd\n", ""),
        complete.replace("## Options", "## Decision"),
        complete.replace("\nd\n", ""),
        complete.repeat(6),
    ];
    for text in broken {
        assert!(!form_faults(&text).is_empty(), "{text}");
    }
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
