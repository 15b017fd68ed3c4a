//! Plants all faults at once into a copy of the checkout, as choices at run time (mutation schemata: R.
//! Untch and others, *Mutation Analysis Using Mutant Schemata*, 1993).
//!
//! In Rust the changed text must be an expression. In WGSL it is any text: kernels get it when they are
//! compiled.

use crate::entries::{Edit, Fault};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{fs, io};

/// The module that chooses, in the lowest crate.
const MODULE: &str = "vm/src/fault.rs";
/// The file that compiles kernels, and the line of it that reads their text.
const COMPILER: [&str; 3] = [
    "runtime/src/gpu/driver/kernel.rs",
    "let module = naga::front::wgsl::parse_str(source.wgsl)",
    "let module = naga::front::wgsl::parse_str(&sdfc_vm::fault::text(source.wgsl))",
];

/// Copies the tracked and new files of a checkout, with all faults in them.
pub fn plant(from: &Path, to: &Path, faults: &[Fault]) -> Result<(), String> {
    let mut files = BTreeMap::new();
    for path in listed(from)? {
        // A file that was deleted is still listed.
        if let Ok(bytes) = fs::read(from.join(&path)) {
            files.insert(path, bytes);
        }
    }
    let mut errors = String::new();
    let mut texts = String::new();
    for (edit, choices) in places(faults) {
        if let Err(error) = apply(&mut files, edit, &choices, &mut texts) {
            let _ = writeln!(errors, "{error}");
        }
    }
    if !errors.is_empty() {
        return Err(errors);
    }
    replace(
        &mut files,
        "vm/src/lib.rs",
        "pub mod apply;",
        "pub mod apply;\n/// Faults.\npub mod fault;",
    )?;
    let [file, old, new] = COMPILER;
    replace(&mut files, file, old, new)?;
    let module = include_str!("fault.rs.in").replace("TEXTS", &texts);
    files.insert(MODULE.into(), module.into_bytes());
    write_all(to, &files).map_err(|error| format!("{}: {error}", to.display()))
}

/// The files that git knows or would add.
fn listed(root: &Path) -> Result<Vec<PathBuf>, String> {
    let output = Command::new("git")
        .args(["ls-files", "-z", "-co", "--exclude-standard"])
        .current_dir(root)
        .output()
        .map_err(|error| format!("git: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let names = text.split('\0').filter(|name| !name.is_empty());
    Ok(names.map(PathBuf::from).collect())
}

type Files = BTreeMap<PathBuf, Vec<u8>>;

/// The changed places, each with the faults that change it and their texts.
fn places(faults: &[Fault]) -> Vec<(&Edit, Vec<(u32, &str)>)> {
    let mut places: Vec<(&Edit, Vec<(u32, &str)>)> = Vec::new();
    for fault in faults {
        for edit in &fault.edits {
            let choice = (fault.number(), edit.broken.as_str());
            match places.iter_mut().find(|(known, _)| known.is_at(edit)) {
                Some((_, choices)) => choices.push(choice),
                None => places.push((edit, vec![choice])),
            }
        }
    }
    places
}

/// Makes a change a choice; those of WGSL are added to `texts`.
fn apply(
    files: &mut Files,
    edit: &Edit,
    choices: &[(u32, &str)],
    texts: &mut String,
) -> Result<(), String> {
    let Edit {
        file,
        before,
        sound,
        after,
        ..
    } = edit;
    let old = format!("{before}{sound}{after}");
    if file
        .extension()
        .is_some_and(|extension| extension == "wgsl")
    {
        for (number, broken) in choices {
            let new = format!("{before}{broken}{after}");
            let _ = writeln!(texts, "    ({number}, {old:?}, {new:?}),");
        }
        // Kernels are changed when they are compiled, by the exact text.
        let (whole, range) = find(files, file, &old)?;
        return match whole[range] == old {
            true => Ok(()),
            false => Err(format!("{}: white space differs: {old}", file.display())),
        };
    }
    let module = if file.starts_with("vm") {
        "crate"
    } else {
        "sdfc_vm"
    };
    let mut choice = format!("{{ {sound} }}");
    for (number, broken) in choices {
        choice = format!("if {module}::fault::is({number}) {{ {broken} }} else {choice}");
    }
    replace(files, file, &old, &format!("{before}({choice}){after}"))
}

/// Returns the text of a file, and the range in it that equals another text up to white space.
fn find(files: &Files, file: &Path, text: &str) -> Result<(String, Range<usize>), String> {
    let bytes = files
        .get(file)
        .ok_or(format!("{} is missing", file.display()))?;
    let whole = String::from_utf8_lossy(bytes).into_owned();
    let dense: Vec<(usize, char)> = whole
        .char_indices()
        .filter(|(_, c)| !c.is_whitespace())
        .collect();
    let wanted: Vec<char> = text.chars().filter(|c| !c.is_whitespace()).collect();
    let is_equal = |window: &&[(usize, char)]| window.iter().map(|(_, c)| c).eq(&wanted);
    let matches: Vec<&[(usize, char)]> = dense.windows(wanted.len()).filter(is_equal).collect();
    match matches.as_slice() {
        [[(start, _), .., (last, end)]] => Ok((whole, *start..last + end.len_utf8())),
        _ => Err(format!(
            "{}: found {} times: {text}",
            file.display(),
            matches.len()
        )),
    }
}

fn replace(files: &mut Files, file: impl AsRef<Path>, old: &str, new: &str) -> Result<(), String> {
    let (mut whole, range) = find(files, file.as_ref(), old)?;
    whole.replace_range(range, new);
    files.insert(file.as_ref().into(), whole.into_bytes());
    Ok(())
}

/// Writes what differs, so that what stays is not compiled again, and removes what is no longer there.
fn write_all(to: &Path, files: &Files) -> io::Result<()> {
    for (path, bytes) in files {
        let path = to.join(path);
        if fs::read(&path).is_ok_and(|old| old == *bytes) {
            continue;
        }
        fs::create_dir_all(path.parent().unwrap_or(to))?;
        fs::write(path, bytes)?;
    }
    let mut folders = vec![to.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder)? {
            let path = entry?.path();
            let relative = path.strip_prefix(to).unwrap_or(&path);
            if relative == Path::new("target") {
                continue;
            }
            if path.is_dir() {
                folders.push(path);
            } else if !files.contains_key(relative) {
                fs::remove_file(path)?;
            }
        }
    }
    Ok(())
}
