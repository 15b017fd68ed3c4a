//! The oracle against closed forms and brute force, and the engines' values against the oracle.

#[path = "oracle/agreement.rs"]
mod agreement;
#[path = "oracle/closed_forms.rs"]
mod closed_forms;
#[path = "oracle/distances.rs"]
mod distances;
#[path = "oracle/materials.rs"]
mod materials;
#[path = "oracle/rays.rs"]
mod rays;

use sdfc_compiler::compile::{Compiled, compile};
use sdfc_compiler::elaborate::{Loader, Options, elaborate};
use sdfc_compiler::scene::Scene;
use sdfc_lang::Sources;
use sdfc_trials::oracle::Oracle;
pub(super) use sdfc_trials::oracle::{Point, norm, point_along};
use sdfc_trials::random::Random;
use std::path::{Path, PathBuf};

/// Loader of imported files from a folder.
struct FolderLoader<'f>(&'f Path);

impl Loader for FolderLoader<'_> {
    fn load(&self, path: &str) -> Result<String, String> {
        std::fs::read_to_string(self.0.join(path)).map_err(|error| error.to_string())
    }
}

/// Returns the scene of a text that may import files of a folder, and the messages about it.
pub(super) fn elaborate_in(folder: &Path, text: &str) -> (Scene, Vec<String>) {
    let mut sources = Sources::new();
    let file = sources.add("scene", text);
    let options = Options {
        loader: &FolderLoader(folder),
        ..Options::default()
    };
    let (scene, diagnostics) = elaborate(&mut sources, file, &options);
    let scene = scene.unwrap_or_else(|| panic!("{diagnostics:?}\n{text}"));
    let messages = diagnostics.into_iter().map(|diagnostic| diagnostic.message);
    (scene, messages.collect())
}

/// Returns the scene of a text that may import files of a folder, or `None` if it has errors.
pub(super) fn elaborate_if_valid(folder: &Path, text: &str) -> Option<Scene> {
    let mut sources = Sources::new();
    let file = sources.add("scene", text);
    let options = Options {
        loader: &FolderLoader(folder),
        ..Options::default()
    };
    elaborate(&mut sources, file, &options).0
}

/// Returns the scene of a text.
pub(super) fn scene(text: &str) -> Scene {
    elaborate_in(Path::new("."), text).0
}

/// Returns the oracle of a scene's root.
pub(super) fn oracle(scene: &Scene) -> Oracle {
    Oracle::new(scene, scene.root.expect("the scene has a shape"), 0.0)
}

/// Returns the oracle of a text.
pub(super) fn oracle_for_text(text: &str) -> Oracle {
    oracle(&scene(text))
}

/// Compiles a scene for the engines.
pub(super) fn compile_scene(scene: Scene) -> Compiled {
    let (compiled, diagnostics) = compile(scene, &sdfc_compiler::compile::Options::default());
    let mut compiled = compiled.unwrap_or_else(|| panic!("{diagnostics:?}"));
    compiled.module.update(0.0);
    compiled
}

/// Returns the scenes of the examples and of the tests.
pub(super) fn scene_files() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut paths = Vec::new();
    for folder in ["examples", "tests/scenes", "tests/hard"] {
        let entries = std::fs::read_dir(root.join(folder)).expect("the folder is there");
        paths.extend(entries.map(|entry| entry.expect("an entry").path()));
    }
    paths.retain(|path| path.extension().is_some_and(|e| e == "sdf"));
    paths.sort();
    paths
}

/// Returns the stranger scenes.
pub(super) fn stranger_files() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/strangers");
    let folders = std::fs::read_dir(root).expect("the folder is there");
    let folders = folders.map(|entry| entry.expect("an entry").path());
    let mut paths = Vec::new();
    for folder in folders.filter(|path| path.is_dir()) {
        let entries = std::fs::read_dir(folder).expect("the folder is there");
        paths.extend(entries.map(|entry| entry.expect("an entry").path()));
    }
    paths.retain(|path| path.extension().is_some_and(|e| e == "sdf"));
    paths.sort();
    paths
}

/// Reads a file's scene and its name.
pub(super) fn read_scene(path: &Path) -> (Scene, String) {
    let text = std::fs::read_to_string(path).expect("a scene");
    let scene = elaborate_in(path.parent().expect("a folder"), &text).0;
    let name = path.file_stem().expect("a name").to_string_lossy();
    (scene, name.into_owned())
}

/// Returns a random number from 0 to 1.
pub(super) fn unit_number(r: &mut Random) -> f64 {
    r.below(1 << 30) as f64 / f64::from(1 << 30)
}

/// Returns a random point of the cube of this half size.
pub(super) fn random_point(r: &mut Random, half_size: f64) -> Point {
    [0; 3].map(|_| half_size * (2.0 * unit_number(r) - 1.0))
}

/// Returns a random unit vector.
pub(super) fn random_direction(r: &mut Random) -> Point {
    loop {
        let v = random_point(r, 1.0);
        let length = norm(v);
        if (0.1..1.0).contains(&length) {
            return v.map(|x| x / length);
        }
    }
}

/// Moves a point towards the surface by 4 Newton steps with the oracle's gradient.
fn near_surface(oracle: &Oracle, p: Point, max_step: f64) -> Point {
    let mut p = p;
    for _ in 0..4 {
        let slope = oracle.gradient(p);
        let gradient_sq = norm(slope).powi(2).max(1e-12);
        let step = oracle.value(p) / gradient_sq;
        p = [0, 1, 2].map(|i| p[i] - (step * slope[i]).clamp(-max_step, max_step));
    }
    p
}
