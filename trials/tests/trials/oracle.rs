//! The oracle against closed forms and brute force, and the engines' values against the oracle.

#[path = "oracle/agreement.rs"]
mod agreement;
#[path = "oracle/closed_forms.rs"]
mod closed_forms;
#[path = "oracle/distances.rs"]
mod distances;
#[path = "oracle/paints.rs"]
mod paints;
#[path = "oracle/rays.rs"]
mod rays;

use sdfc_compiler::compile::{Compiled, compile};
use sdfc_compiler::elaborate::{Loader, Options, elaborate};
use sdfc_compiler::scene::Scene;
use sdfc_lang::Sources;
use sdfc_trials::oracle::Oracle;
use sdfc_trials::random::Random;
use std::path::{Path, PathBuf};

/// A point or a vector.
pub(super) type Point = [f64; 3];

/// Files that are imported from a folder.
struct Folder<'f>(&'f Path);

impl Loader for Folder<'_> {
    fn load(&self, path: &str) -> Result<String, String> {
        std::fs::read_to_string(self.0.join(path)).map_err(|error| error.to_string())
    }
}

/// The scene of a text that may import files of a folder, and what there is to say about it.
pub(super) fn elaborated(folder: &Path, text: &str) -> (Scene, Vec<String>) {
    let mut sources = Sources::new();
    let file = sources.add("scene", text);
    let options = Options {
        loader: &Folder(folder),
        ..Options::default()
    };
    let (scene, found) = elaborate(&mut sources, file, &options);
    let scene = scene.unwrap_or_else(|| panic!("{found:?}\n{text}"));
    let messages = found.into_iter().map(|diagnostic| diagnostic.message);
    (scene, messages.collect())
}

/// The scene of a text that may import files of a folder, unless something is wrong with it.
pub(super) fn elaborated_if_right(folder: &Path, text: &str) -> Option<Scene> {
    let mut sources = Sources::new();
    let file = sources.add("scene", text);
    let options = Options {
        loader: &Folder(folder),
        ..Options::default()
    };
    elaborate(&mut sources, file, &options).0
}

/// The scene of a text.
pub(super) fn scene(text: &str) -> Scene {
    elaborated(Path::new("."), text).0
}

/// The oracle of a scene's whole.
pub(super) fn oracle(scene: &Scene) -> Oracle {
    Oracle::new(scene, scene.root.expect("the scene has a shape"), 0.0)
}

/// The oracle of a text.
pub(super) fn oracle_of(text: &str) -> Oracle {
    oracle(&scene(text))
}

/// A scene for the engines.
pub(super) fn compiled(scene: Scene) -> Compiled {
    let (compiled, found) = compile(scene, &sdfc_compiler::compile::Options::default());
    let mut compiled = compiled.unwrap_or_else(|| panic!("{found:?}"));
    compiled.module.update(0.0);
    compiled
}

/// The scenes of the examples and of the tests.
pub(super) fn files() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut found = Vec::new();
    for folder in ["examples", "tests/scenes", "tests/hard"] {
        let entries = std::fs::read_dir(root.join(folder)).expect("the folder is there");
        found.extend(entries.map(|entry| entry.expect("an entry").path()));
    }
    found.retain(|path| path.extension().is_some_and(|e| e == "sdf"));
    found.sort();
    found
}

/// The scenes that strangers write.
pub(super) fn strangers() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/strangers");
    let folders = std::fs::read_dir(root).expect("the folder is there");
    let folders = folders.map(|entry| entry.expect("an entry").path());
    let mut found = Vec::new();
    for folder in folders.filter(|path| path.is_dir()) {
        let entries = std::fs::read_dir(folder).expect("the folder is there");
        found.extend(entries.map(|entry| entry.expect("an entry").path()));
    }
    found.retain(|path| path.extension().is_some_and(|e| e == "sdf"));
    found.sort();
    found
}

/// A file's scene and its name.
pub(super) fn read(path: &Path) -> (Scene, String) {
    let text = std::fs::read_to_string(path).expect("a scene");
    let scene = elaborated(path.parent().expect("a folder"), &text).0;
    let name = path.file_stem().expect("a name").to_string_lossy();
    (scene, name.into_owned())
}

/// A number from 0 to 1.
pub(super) fn unit(r: &mut Random) -> f64 {
    r.below(1 << 30) as f64 / f64::from(1 << 30)
}

/// A point of the cube of this half size.
pub(super) fn point(r: &mut Random, half: f64) -> Point {
    [0; 3].map(|_| half * (2.0 * unit(r) - 1.0))
}

/// A direction.
pub(super) fn direction(r: &mut Random) -> Point {
    loop {
        let v = point(r, 1.0);
        let length = norm(v);
        if (0.1..1.0).contains(&length) {
            return v.map(|x| x / length);
        }
    }
}

pub(super) fn norm(v: Point) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The point `by` times the vector away.
pub(super) fn beyond(p: Point, vector: Point, by: f64) -> Point {
    [0, 1, 2].map(|i| p[i] + by * vector[i])
}

/// A point moved towards the surface by the oracle's slope, as far as that leads.
fn near_surface(oracle: &Oracle, p: Point, longest: f64) -> Point {
    let mut p = p;
    for _ in 0..4 {
        let slope = oracle.gradient(p);
        let square = norm(slope).powi(2).max(1e-12);
        let by = oracle.value(p) / square;
        p = [0, 1, 2].map(|i| p[i] - (by * slope[i]).clamp(-longest, longest));
    }
    p
}
