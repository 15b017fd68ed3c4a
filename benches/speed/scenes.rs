//! The scenes of the benchmarks: the examples, and one of any size. That one has `count` primitives (sphere,
//! rotated box, torus and capsule in turn) in groups of five. Each group is joined by union, smooth union and
//! subtraction.

use sdfc_compiler::compile::{self, Compiled, GeneratedSource, compile};
use sdfc_compiler::elaborate::{self, elaborate};
use sdfc_lang::Sources;
use sdfc_runtime::engine::SceneInput;
use sdfc_runtime::render::RenderSettings;
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_vm::program::Module;
use std::fmt::Write;
use std::path::PathBuf;

/// Settings of a picture with a shadow and occlusion.
const SCENE_SETTINGS: &str = "\
camera { from: [0, 3, 12], look: [0, 0, 0], fov: 40deg }
light { dir: [-0.6, 0.8, 0.4], shadow: soft(0.03) }
render { size: [640, 360], aa: 1, occlusion: five_tap }
";

/// Returns the scene's text. `count` is a multiple of five.
pub(crate) fn text(count: usize) -> String {
    let mut text = String::from(SCENE_SETTINGS);
    let groups = count.div_ceil(5);
    let side = (groups as f64).cbrt().ceil() as usize;
    let cell = 8.0 / side as f64;
    for i in 0..count {
        // Groups are on a grid, and the members of a group are close enough to overlap.
        let (group, member) = (i / 5, i % 5);
        let cell_centre = |n: usize| ((n % side) as f64 + 0.5) * cell - 4.0;
        let offset = |n: usize| cell * 0.2 * ((member * n % 5) as f64 - 2.0) / 2.0;
        let position = [
            cell_centre(group) + offset(1),
            cell_centre(group / side) + offset(2),
            cell_centre(group / side / side) + offset(3),
        ];
        // Sizes differ, so that no two primitives are equal.
        let size = cell * (0.25 + 0.2 * (i * 7 % 11) as f64 / 11.0);
        text.push_str(match i % 5 {
            0 if i > 0 => "\n| (((",
            0 => "(((",
            1 => " | ",
            2 => ") |[0.1] ",
            3 => " | ",
            _ => ") - ",
        });
        let _ = match i % 4 {
            0 => write!(text, "sphere({:.4})", size / 2.0),
            1 => write!(text, "box({size:.4}).rotate({}deg, Y)", i * 13 % 90),
            2 => write!(text, "torus(r1: {:.4}, r2: {:.4})", size / 2.0, size / 8.0),
            _ => write!(text, "capsule(h: {size:.4}, r: {:.4})", size / 4.0),
        };
        let [x, y, z] = position;
        let _ = write!(text, ".translate({x:.3}, {y:.3}, {z:.3})");
        if i % 5 == 4 {
            text.push(')');
        }
    }
    text
}

/// Returns the examples in order of their names.
pub(crate) fn examples() -> Vec<PathBuf> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");
    let files = std::fs::read_dir(folder).expect("there are examples");
    let paths = files.map(|entry| entry.expect("a file").path());
    let mut scenes: Vec<_> = paths
        .filter(|path| path.extension().is_some_and(|extension| extension == "sdf"))
        .collect();
    scenes.sort();
    scenes
}

/// A scene for engines.
pub(crate) struct BenchScene {
    pub(crate) module: Module,
    pub(crate) uniform_values: Vec<f64>,
    generated: GeneratedSource,
}

impl BenchScene {
    /// Creates the scene at the beginning of its time.
    pub(crate) fn new(compiled: &Compiled) -> Self {
        let mut module = compiled.module.clone();
        let uniform_values = module.update(0.0);
        Self {
            module,
            uniform_values,
            generated: compiled.generated(),
        }
    }

    /// Returns what an engine loads.
    pub(crate) fn input(&self) -> SceneInput<'_> {
        SceneInput {
            module: &self.module,
            uniform_values: &self.uniform_values,
            generated: SceneSource {
                text: &self.generated.text,
                calls: &self.generated.calls,
            },
        }
    }

    /// Returns the settings of a picture.
    pub(crate) fn settings(&self, overrides: &Overrides) -> RenderSettings {
        resolve(&self.module, &self.uniform_values, overrides).expect("a view")
    }
}

/// Compiles a scene.
pub(crate) fn compile_scene(text: &str) -> Compiled {
    let mut sources = Sources::new();
    let file = sources.add("bench.sdf", text);
    let (scene, diagnostics) = elaborate(&mut sources, file, &elaborate::Options::default());
    let scene = scene.unwrap_or_else(|| panic!("{:?}", diagnostics.first()));
    let (compiled, diagnostics) = compile(scene, &compile::Options::default());
    compiled.unwrap_or_else(|| panic!("{:?}", diagnostics.first()))
}
