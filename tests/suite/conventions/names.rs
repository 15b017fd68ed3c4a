//! One name for each type of the workspace.

use super::{CRATES, sources};
use std::collections::BTreeMap;

/// The words before a type's name.
const KEYWORDS: [&str; 5] = ["struct", "enum", "trait", "union", "type"];

/// The name of the type that a line at the top level of a file defines.
fn defined(line: &str) -> Option<&str> {
    // Indented definitions belong to a trait, a function or a macro.
    if line.starts_with(char::is_whitespace) {
        return None;
    }
    let mut words = line.split_whitespace();
    let mut word = words.next()?;
    if word.starts_with("pub") {
        word = words.next()?;
    }
    let name = KEYWORDS.contains(&word).then(|| words.next())??;
    name.split(|c: char| !c.is_alphanumeric() && c != '_')
        .next()
}

#[test]
fn no_two_crates_define_types_of_one_name() {
    let mut places: BTreeMap<String, BTreeMap<&str, String>> = BTreeMap::new();
    for (name, folder) in CRATES {
        for source in sources(folder) {
            for defined in source.text.lines().filter_map(defined) {
                let path = source.path.display().to_string();
                places
                    .entry(defined.to_owned())
                    .or_default()
                    .insert(name, path);
            }
        }
    }
    assert!(places.len() > 500, "only {} types were found", places.len());
    places.retain(|_, places| places.len() > 1);
    let lines: Vec<String> = places
        .iter()
        .map(|(name, places)| {
            let paths: Vec<&str> = places.values().map(String::as_str).collect();
            format!("{name}: {}", paths.join(", "))
        })
        .collect();
    assert!(lines.is_empty(), "{}\n{}", lines.len(), lines.join("\n"));
}
