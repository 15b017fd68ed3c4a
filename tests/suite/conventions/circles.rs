//! Circles of files: each file can be read after those that it uses.

use super::{CRATES, Source, sources};
use std::collections::{BTreeMap, BTreeSet};

/// The path of a module within its crate.
type ModulePath = Vec<String>;

/// Circles that remain, each with its reason. None may be added or grow.
const REMAINING: [&str; 1] = [
    // Provided methods of `Real` are functions over `Real`, and over duals of it.
    "vm/src: dual elementary ellipsoid real",
];

/// The module that a file holds.
fn module_of(source: &Source, folder: &str) -> ModulePath {
    let path = source.path.strip_prefix(folder).expect("in its crate");
    let path = path.with_extension("");
    let mut names: ModulePath = path
        .iter()
        .map(|name| name.to_string_lossy().into_owned())
        .collect();
    if names.len() == 1 && matches!(names[0].as_str(), "lib" | "main") {
        names.clear();
    }
    names
}

/// The text without comments and without its tests.
pub(super) fn code(text: &str) -> String {
    let code = text.split("#[cfg(test)]\nmod tests {").next();
    code.unwrap_or_default()
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default())
        .collect::<Vec<_>>()
        .join("\n")
}

/// The paths of a tree of imports: `a::{b, c::d}` is `a::b` and `a::c::d`.
fn expanded(tree: &str) -> Vec<String> {
    let tree = tree.trim();
    let Some((prefix, rest)) = tree.split_once('{') else {
        let path = tree.split(" as ").next().unwrap_or_default();
        return vec![path.trim().to_owned()];
    };
    let inner = rest.trim_end().strip_suffix('}').unwrap_or(rest);
    let (mut parts, mut depth) = (vec![String::new()], 0);
    for c in inner.chars() {
        depth += i32::from(c == '{') - i32::from(c == '}');
        match (c, depth) {
            (',', 0) => parts.push(String::new()),
            _ => parts.last_mut().expect("a part").push(c),
        }
    }
    let parts = parts.iter().filter(|part| !part.trim().is_empty());
    parts
        .flat_map(|part| expanded(&format!("{prefix}{}", part.trim())))
        .collect()
}

/// The paths within the crate that a text names, in imports and in the code.
fn named_paths(code: &str) -> BTreeSet<String> {
    let mut paths = BTreeSet::new();
    let mut rest = code;
    while let Some(start) = rest.find("use ") {
        let is_word = rest[..start]
            .chars()
            .next_back()
            .is_none_or(|c| !c.is_alphanumeric() && c != '_');
        let tree = &rest[start + 4..];
        let end = tree.find(';').unwrap_or(tree.len());
        if is_word {
            paths.extend(expanded(&tree[..end]));
        }
        rest = &tree[end.min(tree.len())..];
    }
    for prefix in ["crate::", "super::"] {
        for (start, _) in code.match_indices(prefix) {
            let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
            let path = code[start..].split(|c| !is_word(c)).next();
            paths.extend(path.map(|path| path.trim_end_matches(':').to_owned()));
        }
    }
    paths
}

/// The module that a path leads to, as seen from another one.
fn target(path: &str, from: &ModulePath, modules: &BTreeSet<ModulePath>) -> Option<ModulePath> {
    let mut names = path.split("::").map(str::trim).peekable();
    let mut module = match *names.peek()? {
        "crate" => Vec::new(),
        "self" | "super" => from.clone(),
        _ => return None,
    };
    for name in names {
        match name {
            "crate" | "self" => continue,
            "super" => {
                module.pop();
                continue;
            }
            _ => module.push(name.to_owned()),
        }
        if !modules.contains(&module) {
            module.pop();
            break;
        }
    }
    modules.contains(&module).then_some(module)
}

/// The circles among modules: the strongly connected components of two and more.
fn circles(uses: &BTreeMap<ModulePath, BTreeSet<ModulePath>>) -> Vec<BTreeSet<ModulePath>> {
    let reached = |from: &ModulePath| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
        while let Some(module) = open.pop() {
            let next = uses.get(module).into_iter().flatten();
            open.extend(next.filter(|&module| seen.insert(module.clone())));
        }
        seen
    };
    let reach: BTreeMap<&ModulePath, BTreeSet<ModulePath>> = uses
        .keys()
        .map(|module| (module, reached(module)))
        .collect();
    let mut found: Vec<BTreeSet<ModulePath>> = Vec::new();
    for (&module, behind) in &reach {
        let is_new = !found.iter().any(|circle| circle.contains(module));
        if is_new && behind.contains(module) {
            let circle = behind.iter().filter(|other| reach[other].contains(module));
            found.push(circle.cloned().collect());
        }
    }
    found
}

#[test]
fn files_form_no_new_circles() {
    let mut found: Vec<String> = Vec::new();
    for (name, folder) in CRATES {
        let sources = sources(folder);
        let modules: BTreeSet<ModulePath> = sources
            .iter()
            .map(|source| module_of(source, folder))
            .collect();
        assert!(modules.len() > 3, "{name}: only {} files", modules.len());
        let mut uses = BTreeMap::new();
        for source in &sources {
            let own = module_of(source, folder);
            let paths = named_paths(&code(&source.text));
            let targets = paths.iter().filter_map(|path| target(path, &own, &modules));
            let targets: BTreeSet<ModulePath> = targets.filter(|target| *target != own).collect();
            uses.insert(own, targets);
        }
        for circle in circles(&uses) {
            let files: Vec<String> = circle.iter().map(|module| module.join("/")).collect();
            found.push(format!("{folder}: {}", files.join(" ")));
        }
    }
    assert_eq!(found, REMAINING);
}
