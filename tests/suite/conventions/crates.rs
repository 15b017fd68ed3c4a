//! The crates' dependencies on each other, against the table in ARCHITECTURE.md.

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;
use std::{env, fs};

/// The heading of the table's chapter.
const HEADING: &str = "## The crates";

/// The dependencies that the table allows: each row is `| crate | purpose | depends on |`, with names in backticks.
fn allowed(text: &str) -> BTreeMap<String, BTreeSet<String>> {
    let (_, chapter) = text.split_once(HEADING).expect("a chapter on the crates");
    let chapter = chapter.split("\n## ").next().unwrap_or_default();
    let mut rows = BTreeMap::new();
    for line in chapter.lines().filter(|line| line.starts_with("| `")) {
        let cells: Vec<&str> = line.split('|').collect();
        let names = |cell: &str| -> Vec<String> {
            let names = cell.split('`').skip(1).step_by(2);
            names.map(full_name).collect()
        };
        let name = names(cells[1]).remove(0);
        let last = cells[cells.len() - 2];
        rows.insert(name, names(last).into_iter().collect());
    }
    rows
}

/// The name of a package, from the short one that the documents use.
fn full_name(short: &str) -> String {
    match short {
        "sdfc" => short.to_owned(),
        short => format!("sdfc-{short}"),
    }
}

/// The dependencies on packages of the workspace, without those of tests.
fn declared() -> BTreeMap<String, BTreeSet<String>> {
    let cargo = env::var_os("CARGO").unwrap_or("cargo".into());
    let output = Command::new(cargo)
        .args([
            "metadata",
            "--format-version",
            "1",
            "--no-deps",
            "--offline",
        ])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs");
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("cargo's metadata");
    let packages = metadata["packages"].as_array().expect("packages");
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let mut found = BTreeMap::new();
    for package in packages {
        let dependencies = package["dependencies"].as_array().expect("dependencies");
        let own = dependencies
            .iter()
            .filter(|dependency| dependency["kind"].is_null())
            .map(|dependency| text(&dependency["name"]))
            .filter(|name| name == "sdfc" || name.starts_with("sdfc-"));
        found.insert(text(&package["name"]), own.collect());
    }
    found
}

#[test]
fn crates_depend_on_what_the_architecture_allows() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("ARCHITECTURE.md");
    let text = fs::read_to_string(path).expect("ARCHITECTURE.md");
    assert_eq!(allowed(&text), declared());
}
