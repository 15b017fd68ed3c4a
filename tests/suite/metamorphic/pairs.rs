//! Texts in `tests/pairs` that mean the same, drawn under two lights on the CPU, with cells and without.
//!
//! A file holds a class, which its first line names. `# name` begins an entry; its texts are parted by lines `=`.
//! A line `// fault: 12 pixels, …` in an entry says how many pixels differ in the worst picture, and what is to be
//! mended; `// excused: 12 pixels, since …` says why that is right.

use super::compare::compare;
use super::draw::draw;
use super::plain_way;
use sdfc_runtime::engine::{EngineKind, open};
use sdfc_runtime::frame::CellUse;
use std::fmt::Write as _;
use std::path::Path;

/// The least number of entries of a class.
const MIN_ENTRIES: usize = 10;
/// The camera of all texts.
const CAMERA: &str = "camera { from: [2.6, 2.2, 3.6], look: [0, -0.1, 0], fov: 42deg }\n";
/// A floor, on which shadows fall.
const FLOOR: &str = "plane(Y, at: -1.3).color(#808078)";
/// The lights under which texts are drawn.
const LIGHTS: [(&str, &str); 2] = [
    (
        "hard shadows",
        "light { dir: [-1, 2, 1.5], shadow: hard }\nrender { occlusion: off, far: 60 }\n",
    ),
    (
        "soft shadows and occlusion",
        "light { dir: [-1, 2, 1.5], shadow: soft(0.08) }\nrender { occlusion: five_tap, reach: 0.5, far: 60 }\n",
    ),
];

/// Texts that mean the same.
#[derive(Debug)]
struct Entry {
    name: String,
    texts: Vec<String>,
    /// The number of pixels that may differ.
    excused: usize,
}

/// The entries of a file.
fn entries(path: &Path) -> Vec<Entry> {
    let text = std::fs::read_to_string(path).expect("the file can be read");
    let mut lines = text.lines();
    let first = lines.next().unwrap_or_default();
    let is_sentence = first.starts_with("// ") && first.ends_with('.');
    assert!(is_sentence, "{}: {first}", path.display());
    let mut entries: Vec<Entry> = Vec::new();
    for line in lines {
        if let Some(name) = line.strip_prefix("# ") {
            entries.push(Entry {
                name: name.to_owned(),
                texts: vec![String::new()],
                excused: 0,
            });
            continue;
        }
        let entry = entries.last_mut().expect("`# name` begins an entry");
        if line == "=" {
            entry.texts.push(String::new());
        } else if let Some(excuse) = ["// fault: ", "// excused: "]
            .iter()
            .find_map(|word| line.strip_prefix(word))
        {
            let count = excuse
                .split(' ')
                .next()
                .and_then(|count| count.parse().ok());
            entry.excused = count.unwrap_or_else(|| panic!("{line}"));
        } else if let Some(text) = entry.texts.last_mut() {
            text.push_str(line);
            text.push('\n');
        }
    }
    entries
}

/// A text as a scene: its last expression stands on the floor.
fn on_floor(text: &str, head: &str) -> String {
    let lines: Vec<&str> = text.trim().lines().collect();
    let (statements, shape) = lines.split_at(lines.len() - 1);
    let statements = statements.join("\n");
    format!("{CAMERA}{head}{statements}\n({}) | {FLOOR}\n", shape[0])
}

/// Draws all texts of an entry, and tells which differ from the first.
fn examine(class: &str, entry: &Entry) -> String {
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    let mut report = String::new();
    let mut worst = 0;
    for (light, head) in LIGHTS {
        let mut pictures = Vec::new();
        for (index, text) in entry.texts.iter().enumerate() {
            for cells in [CellUse::Never, CellUse::Always] {
                let mut way = plain_way();
                way.cells = cells;
                let picture = draw(&mut *engine, &on_floor(text, head), &way);
                let picture =
                    picture.unwrap_or_else(|errors| panic!("{class}, {}: {errors}", entry.name));
                pictures.push((format!("text {index}, cells {cells:?}"), picture));
            }
        }
        let (first, others) = pictures.split_first().expect("there are texts");
        for (name, other) in others {
            let found = compare(&first.1, other);
            worst = worst.max(found.count());
            if found.count() > entry.excused || other.lost > 0 || first.1.lost > 0 {
                _ = writeln!(
                    report,
                    "{class}, {}, {light}, {name}: {found:?}, {} rays lost",
                    entry.name, other.lost
                );
            }
        }
    }
    if worst == 0 && entry.excused > 0 {
        _ = writeln!(
            report,
            "{class}, {}: {} pixels are excused, and none differ",
            entry.name, entry.excused
        );
    }
    report
}

#[test]
fn texts_that_mean_the_same_are_the_same_picture() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/pairs");
    let files = std::fs::read_dir(folder).expect("the folder can be read");
    let mut paths: Vec<_> = files
        .map(|file| file.expect("its entries too").path())
        .collect();
    paths.sort();
    let only = std::env::var("SDFC_ONLY").unwrap_or_default();
    let mut report = String::new();
    for path in paths {
        let class = crate::corpus::name(&path);
        let entries = entries(&path);
        assert!(entries.len() >= MIN_ENTRIES, "{class}: {}", entries.len());
        for entry in entries {
            assert!(entry.texts.len() > 1, "{class}, {}", entry.name);
            if format!("{class}, {}", entry.name).contains(&only) {
                report += &examine(&class, &entry);
            }
        }
    }
    assert!(report.is_empty(), "\n{report}");
}
