//! Equivalent texts in `tests/pairs`, drawn under two lights on the CPU, with cells and without.
//!
//! Each file contains one class, named by its first line. If that begins with "2-D", the texts are plane
//! figures, drawn without a floor. `# name` begins an entry; its texts are separated
//! by lines `=`. A line `// fault: 12 pixels, …` in an entry states how many pixels differ in the worst
//! picture and what must be fixed. `// excused: 12 pixels, since …` states why the difference is correct.

use super::compare::compare;
use super::draw::draw;
use super::plain_options;
use sdfc_runtime::engine::{EngineKind, open};
use sdfc_runtime::render::CellMode;
use std::fmt::Write as _;
use std::path::Path;

/// Minimum number of entries of a class.
const MIN_ENTRIES: usize = 10;
/// Camera of all texts.
const CAMERA: &str = "camera { from: [2.6, 2.2, 3.6], look: [0, -0.1, 0], fov: 42deg }\n";
/// Camera and head of plane figures.
const PLANE_HEAD: &str = "camera { look: [0, 0, 0], height: 3 }\n";
/// A floor that receives shadows.
const FLOOR: &str = "plane(Y, at: -1.3).color(#808078)";
/// Lights under which texts are drawn.
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

/// A group of equivalent texts.
#[derive(Debug)]
struct Entry {
    name: String,
    texts: Vec<String>,
    /// Number of pixels that may differ.
    excused: usize,
}

/// Returns the entries of a file, and whether they are plane figures.
fn entries(path: &Path) -> (Vec<Entry>, bool) {
    let text = std::fs::read_to_string(path).expect("the file can be read");
    let mut lines = text.lines();
    let first = lines.next().unwrap_or_default();
    let is_sentence = first.starts_with("// ") && first.ends_with('.');
    assert!(is_sentence, "{}: {first}", path.display());
    let is_plane = first.starts_with("// 2-D");
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
    (entries, is_plane)
}

/// Turns a text into a scene: a floor is added to its last expression.
fn on_floor(text: &str, head: &str) -> String {
    let lines: Vec<&str> = text.trim().lines().collect();
    let (statements, shape) = lines.split_at(lines.len() - 1);
    let statements = statements.join("\n");
    format!("{CAMERA}{head}{statements}\n({}) | {FLOOR}\n", shape[0])
}

/// Draws all texts of an entry and reports those that differ from the first.
fn examine(class: &str, entry: &Entry, is_plane: bool) -> String {
    let mut engine = open(EngineKind::Cpu).expect("there is always a CPU");
    let mut report = String::new();
    let mut worst = 0;
    let lights = if is_plane { &LIGHTS[..1] } else { &LIGHTS };
    for (light, head) in lights {
        let mut pictures = Vec::new();
        for (index, text) in entry.texts.iter().enumerate() {
            for cells in [CellMode::Never, CellMode::Always] {
                let mut options = plain_options();
                options.cells = cells;
                let scene = match is_plane {
                    true => format!("{PLANE_HEAD}{text}"),
                    false => on_floor(text, head),
                };
                let picture = draw(&mut *engine, &scene, &options);
                let picture =
                    picture.unwrap_or_else(|errors| panic!("{class}, {}: {errors}", entry.name));
                pictures.push((format!("text {index}, cells {cells:?}"), picture));
            }
        }
        let (first, others) = pictures.split_first().expect("there are texts");
        for (name, other) in others {
            let differences = compare(&first.1, other);
            worst = worst.max(differences.count());
            if differences.count() > entry.excused || other.lost > 0 || first.1.lost > 0 {
                _ = writeln!(
                    report,
                    "{class}, {}, {light}, {name}: {differences:?}, {} rays lost",
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
        let (entries, is_plane) = entries(&path);
        assert!(entries.len() >= MIN_ENTRIES, "{class}: {}", entries.len());
        for entry in entries {
            assert!(entry.texts.len() > 1, "{class}, {}", entry.name);
            if format!("{class}, {}", entry.name).contains(&only) {
                report += &examine(&class, &entry, is_plane);
            }
        }
    }
    assert!(report.is_empty(), "\n{report}");
}
