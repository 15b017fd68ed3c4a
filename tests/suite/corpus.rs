//! Scenes of the suites: `tests/scenes`, each of which covers one feature, and the examples.

use sdfc_compiler::compile::{self, Compiled, GeneratedSource};
use sdfc_compiler::elaborate::{Loader, Options, elaborate};
use sdfc_compiler::fidget_text::parse_fidget_text;
use sdfc_compiler::passes::PassOptions;
use sdfc_compiler::scene::Scene;
use sdfc_lang::{Diagnostics, Sources, Style};
use sdfc_runtime::engine::SceneInput;
use sdfc_shaders::assemble::SceneSource;
use std::path::{Path, PathBuf};

/// Files in the folder of a scene.
struct Folder(PathBuf);

impl Loader for Folder {
    fn load(&self, path: &str) -> Result<String, String> {
        std::fs::read_to_string(self.0.join(path)).map_err(|error| error.to_string())
    }
}

/// Returns the scenes of a folder of the repository, sorted.
pub(crate) fn scenes(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = std::fs::read_dir(&folder).expect("the folder can be read");
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("its entries too").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "sdf"))
        .collect();
    paths.sort();
    assert!(!paths.is_empty(), "{} has no scenes", folder.display());
    paths
}

/// Returns the scenes of `tests/scenes` and the examples. The short form has every second one, from index `first`.
pub(crate) fn scenes_on_gpu(first: usize) -> Vec<PathBuf> {
    let all = ["tests/scenes", "examples"].into_iter().flat_map(scenes);
    match std::env::var_os("SDFC_LONG") {
        Some(_) => all.collect(),
        None => all.skip(first).step_by(2).collect(),
    }
}

/// Returns the name of a scene.
pub(crate) fn name(path: &Path) -> String {
    path.file_stem()
        .expect("a scene has a name")
        .to_string_lossy()
        .into_owned()
}

/// Runs a function on a thread with the stack size of the command line.
pub(crate) fn on_large_stack<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(64 << 20);
        let handle = thread
            .spawn_scoped(scope, work)
            .expect("a thread can be started");
        handle
            .join()
            .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

/// Elaborates the scene of a file, which must have no errors.
pub(crate) fn scene(path: &Path) -> Scene {
    let text =
        std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut sources = Sources::new();
    let file = sources.add(name(path), text);
    if path.extension().is_some_and(|extension| extension == "vm") {
        let (scene, diagnostics) = parse_fidget_text(&sources, file);
        return scene.unwrap_or_else(|| panic!("{}: {diagnostics:?}", path.display()));
    }
    let folder = Folder(path.parent().expect("it lies in a folder").to_owned());
    let options = Options {
        loader: &folder,
        ..Options::default()
    };
    let (scene, diagnostics) = elaborate(&mut sources, file, &options);
    let diagnostics: Diagnostics = diagnostics.into_iter().collect();
    scene.unwrap_or_else(|| panic!("{}", diagnostics.render(&sources, Style::Plain)))
}

/// Compiles a text without imports, with the given passes.
pub(crate) fn compiled_text(text: &str, passes: PassOptions) -> Compiled {
    let mut sources = Sources::new();
    let file = sources.add("text", text.to_owned());
    let (scene, diagnostics) = elaborate(&mut sources, file, &Options::default());
    let scene = scene.unwrap_or_else(|| panic!("{diagnostics:?}"));
    let (compiled, diagnostics) = compile::compile(
        scene,
        &compile::Options {
            passes,
            ..compile::Options::default()
        },
    );
    compiled.unwrap_or_else(|| panic!("{diagnostics:?}"))
}

/// Compiles a scene with all passes.
pub(crate) fn compiled_scene(scene: Scene) -> Compiled {
    let (compiled, diagnostics) = compile::compile(scene, &compile::Options::default());
    compiled.unwrap_or_else(|| panic!("{diagnostics:?}"))
}

/// Compiles the scene of a file with the given passes.
pub(crate) fn compiled(path: &Path, passes: PassOptions) -> Compiled {
    let options = compile::Options {
        passes,
        ..compile::Options::default()
    };
    let (compiled, diagnostics) = compile::compile(scene(path), &options);
    compiled.unwrap_or_else(|| panic!("{}: {diagnostics:?}", path.display()))
}

/// Returns the input of every engine: a compiled scene, its uniform values and its generated code.
pub(crate) fn scene_input<'a>(
    compiled: &'a Compiled,
    uniform_values: &'a [f64],
    source: &'a GeneratedSource,
) -> SceneInput<'a> {
    SceneInput {
        module: &compiled.module,
        uniform_values,
        generated: SceneSource {
            text: &source.text,
            calls: &source.calls,
        },
    }
}
