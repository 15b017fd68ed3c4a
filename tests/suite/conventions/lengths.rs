//! The lengths of functions, in Rust and in WGSL.

use super::circles::code;
use super::{CRATES, sources_of};
use std::collections::BTreeMap;
use std::path::Path;

/// Maximum number of lines of a function, with its signature.
const MAX_FUNCTION_LINES: usize = 100;

/// Longer functions that remain: path, name, and a number of lines that none may exceed. None may be added.
const REMAINING: [(&str, &str, usize); 19] = [
    ("compiler/src/compile.rs", "compile_with", 146),
    ("compiler/src/cutter_extension.rs", "extend_cutter", 125),
    (
        "compiler/src/cutter_extension/live.rs",
        "extent_on_side",
        128,
    ),
    (
        "compiler/src/elaborate/arguments.rs",
        "mismatch_diagnostic",
        119,
    ),
    ("compiler/src/elaborate/builtins/csg.rs", "csg_links", 112),
    ("compiler/src/lower.rs", "shape_without_underlay", 120),
    ("compiler/src/lower/step.rs", "step", 110),
    (
        "runtime/src/cpu/shadow/candidate_check.rs",
        "step_check",
        144,
    ),
    ("runtime/src/gpu/cell_builder.rs", "build", 107),
    ("runtime/src/render/prepare.rs", "prepare", 112),
    ("shaders/src/interpreter.rs", "interpreter", 147),
    (
        "shaders/src/interpreter/operation.rs",
        "operation_case",
        109,
    ),
    ("shaders/src/interpreter/tape.rs", "emit_clause", 144),
    ("shaders/src/kernels/occlusion.wgsl", "main", 104),
    ("shaders/src/kernels/shadow.wgsl", "main", 316),
    ("shaders/src/marching.rs", "sphere_step", 121),
    ("src/command/info.rs", "page", 102),
    ("trials/src/programs.rs", "program", 103),
    ("vm/src/tape/evaluator.rs", "run", 114),
];

/// The words that may precede `fn`.
const MODIFIERS: [&str; 5] = ["const", "unsafe", "async", "extern", "\"C\""];

/// The name of the function that begins in a line.
fn function_name(line: &str) -> Option<&str> {
    let mut words = line.split_whitespace();
    words
        .by_ref()
        .take_while(|&word| word != "fn")
        .all(|word| word.starts_with(['p', '@']) || MODIFIERS.contains(&word))
        .then_some(())?;
    let is_end = |c: char| !c.is_alphanumeric() && c != '_';
    words
        .next()?
        .split(is_end)
        .next()
        .filter(|name| !name.is_empty())
}

/// The indentation of a line.
fn indentation(line: &str) -> usize {
    line.len() - line.trim_start().len()
}

/// The functions of a text, with their numbers of lines. The layout of rustfmt is assumed: the last line of a
/// function is indented as its first one. No other line with that indentation ends a body or a declaration.
fn functions(text: &str) -> Vec<(&str, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let begins = lines.iter().enumerate();
    let begins = begins.filter_map(|(begin, line)| Some((begin, function_name(line)?)));
    begins
        .map(|(begin, name)| {
            let own = &lines[begin..];
            let ends = |line: &&str| {
                let line_end = line.trim_end();
                indentation(line) == indentation(own[0]) && line_end.ends_with(['}', ';'])
            };
            let end = own.iter().position(ends).unwrap_or(own.len() - 1);
            (name, end + 1)
        })
        .collect()
}

/// Reports whether a file contains nothing but tests.
fn is_test(path: &Path) -> bool {
    path.iter().any(|part| part == "tests") || path.ends_with("tests.rs")
}

#[test]
fn functions_have_at_most_a_hundred_lines() {
    let mut long: BTreeMap<(String, String), usize> = BTreeMap::new();
    let mut count = 0;
    for (_, folder) in CRATES {
        let files = ["rs", "wgsl"].into_iter();
        for source in files.flat_map(|extension| sources_of(folder, extension)) {
            if is_test(&source.path) {
                continue;
            }
            for (name, lines) in functions(&code(&source.text)) {
                count += 1;
                if lines > MAX_FUNCTION_LINES {
                    let key = (source.path.display().to_string(), name.to_owned());
                    let longest = long.entry(key).or_default();
                    *longest = lines.max(*longest);
                }
            }
        }
    }
    assert!(count > 3_000, "only {count} functions were found");
    let mut wrong = Vec::new();
    for (path, name, limit) in REMAINING {
        match long.remove(&(path.to_owned(), name.to_owned())) {
            Some(lines) if lines > limit => {
                wrong.push(format!("{path}: {name} has grown to {lines} lines"));
            }
            Some(_) => {}
            None => wrong.push(format!("{path}: {name} is not long: remove its line")),
        }
    }
    let added = long.iter();
    wrong.extend(added.map(|((path, name), lines)| format!("{path}: {name} has {lines} lines")));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn lengths_count_signatures_and_bodies() {
    let text = "
trait Measured {
    fn declared(
        &self,
    ) -> usize;
    const fn empty() {}
}
pub(crate) fn long(
    a: usize,
) -> usize
where
    usize: Copy,
{
    let inner = |fn_: usize| {
        fn_
    };
    inner(a)
}
@compute fn main() {
}
";
    let expected = [("declared", 3), ("empty", 1), ("long", 11), ("main", 2)];
    assert_eq!(functions(text), expected);
}
