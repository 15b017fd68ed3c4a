//! The list of faults: what each changes, where, and the tests that should notice it.

use std::path::PathBuf;

/// A deliberate fault.
#[derive(Debug)]
pub struct Fault {
    /// Its name on the command line and in the table.
    pub name: String,
    /// The behaviour that it breaks.
    pub summary: String,
    /// Every text that it changes.
    pub edits: Vec<Edit>,
    /// The tests that should notice it, the likeliest first.
    pub tests: Vec<Tests>,
}

/// One changed text.
#[derive(Debug)]
pub struct Edit {
    /// The file, from the root of the repository.
    pub file: PathBuf,
    /// The text in front of the changed one.
    pub before: String,
    /// The changed text.
    pub sound: String,
    /// Its replacement.
    pub broken: String,
    /// The text after it.
    pub after: String,
}

/// Tests of one binary.
#[derive(Clone, Debug, PartialEq)]
pub struct Tests {
    /// The binary without its hash: `suite`, `operations`, `sdfc_vm`.
    pub binary: String,
    /// Filters of names; all tests where there is none.
    pub filters: Vec<String>,
    /// Environment variables and their values.
    pub variables: Vec<(String, String)>,
}

impl Edit {
    /// Reports whether another edit changes the same text.
    pub fn is_at(&self, other: &Self) -> bool {
        let place = |edit: &Self| {
            let Self {
                file,
                before,
                sound,
                after,
                ..
            } = edit;
            [
                file.to_string_lossy().into_owned(),
                before.clone(),
                sound.clone(),
                after.clone(),
            ]
        };
        place(self) == place(other)
    }
}

impl Fault {
    /// The number by which the fault is chosen at run time: FNV-1a of its name, so that numbers stay when
    /// the list grows.
    pub fn number(&self) -> u32 {
        let step = |hash: u32, byte: u8| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193);
        self.name.bytes().fold(0x811c_9dc5, step)
    }
}

/// Parses the list. A fault begins with `name: summary`; indented lines give `in FILE`, `at TEXT` with
/// `⟦sound ⇒ broken⟧` in it, and `by BINARY FILTER…`
/// with perhaps `NAME=VALUE` among the filters. Lines with `#` are comments.
pub fn parse(text: &str) -> Result<Vec<Fault>, String> {
    let mut faults: Vec<Fault> = Vec::new();
    let mut file = PathBuf::new();
    for (line, number) in text.lines().zip(1..) {
        let wrong = |what: &str| Err(format!("line {number}: {what}: {line}"));
        if line.trim().is_empty() || line.starts_with('#') {
            continue;
        }
        if !line.starts_with(' ') {
            let Some((name, summary)) = line.split_once(": ") else {
                return wrong("`name: summary` expected");
            };
            faults.push(Fault {
                name: name.to_owned(),
                summary: summary.to_owned(),
                edits: Vec::new(),
                tests: Vec::new(),
            });
            continue;
        }
        let (Some(fault), Some((key, rest))) =
            (faults.last_mut(), line.trim_start().split_once(' '))
        else {
            return wrong("`in`, `at` or `by` under a fault expected");
        };
        match key {
            "in" => file = rest.into(),
            "at" => match edit(rest) {
                Some([before, sound, broken, after]) => fault.edits.push(Edit {
                    file: file.clone(),
                    before,
                    sound,
                    broken,
                    after,
                }),
                None => return wrong("`⟦sound ⇒ broken⟧` expected"),
            },
            "by" => {
                let mut words = rest.split_whitespace().map(str::to_owned);
                let binary = words.next().unwrap_or_default();
                let (set, filters): (Vec<_>, _) = words.partition(|word| word.contains('='));
                let pair = |word: &String| {
                    let (name, value) = word.split_once('=').unwrap_or_default();
                    (name.to_owned(), value.to_owned())
                };
                fault.tests.push(Tests {
                    binary,
                    filters,
                    variables: set.iter().map(pair).collect(),
                });
            }
            _ => return wrong("`in`, `at` or `by` expected"),
        }
    }
    let mut numbers: Vec<u32> = faults.iter().map(Fault::number).collect();
    numbers.sort_unstable();
    if numbers.windows(2).any(|pair| pair[0] == pair[1]) {
        return Err("two faults have the same number: rename one".to_owned());
    }
    match faults
        .iter()
        .find(|f| f.edits.is_empty() || f.tests.is_empty())
    {
        Some(fault) => Err(format!("{}: no text or no tests", fault.name)),
        None => Ok(faults),
    }
}

fn edit(text: &str) -> Option<[String; 4]> {
    let (before, rest) = text.split_once('⟦')?;
    let (changed, after) = rest.split_once('⟧')?;
    let (sound, broken) = changed.split_once(" ⇒ ")?;
    Some([before, sound, broken, after].map(str::to_owned))
}
