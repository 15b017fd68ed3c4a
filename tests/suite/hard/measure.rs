//! Draws a hard case from a camera and compares it with the ground truth.

use crate::corpus::{compiled, compiled_text, name, on_large_stack};
use sdfc_compiler::compile::Compiled;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{EngineKind, SceneInput, open};
use sdfc_runtime::reference::{
    GroundTruth, PictureErrors, PixelClass, TraceOptions, compare, trace,
};
use sdfc_runtime::render::{CellMode, Image, RenderSettings};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use std::cell::OnceCell;
use std::fmt;
use std::path::Path;

/// A case from one of its cameras, with its ground truth.
pub(super) struct Shot {
    /// Name of the scene; with several cameras, also that of the camera: `tips/front`.
    pub(super) name: String,
    pub(super) compiled: Compiled,
    pub(super) uniform_values: Vec<f64>,
    pub(super) settings: RenderSettings,
    truth: OnceCell<GroundTruth>,
}

impl Shot {
    /// Returns the ground truth of its rays.
    pub(super) fn truth(&self) -> &GroundTruth {
        let options = TraceOptions::default();
        self.truth
            .get_or_init(|| trace(&self.compiled.module, &self.settings, &options))
    }
}

/// Errors of a picture and its cost.
pub(super) struct Measured {
    name: String,
    kind: EngineKind,
    cells: CellMode,
    pub(super) errors: PictureErrors,
    /// Mean number of field evaluations per ray.
    pub(super) steps: f64,
    /// The smooth pixel with the largest depth error.
    worst: [usize; 2],
    pub(super) image: Image,
}

impl fmt::Display for Measured {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let e = &self.errors;
        write!(
            f,
            "{:24} {:>6} {:7} wrong {:3} (+{} −{}) inside {:3}, depth p99 {:.1e} max {:.1e} at {:?}, normals p99 {:.4} max {:.3}, nan {}, cap {}, undecided {}, steps {:.1}",
            self.name,
            self.kind.to_string(),
            format!("{:?}", self.cells),
            e.mismatches(),
            e.false_hits,
            e.false_misses,
            e.mismatches_inside,
            e.depth_smooth.p99,
            e.depth_smooth.max,
            self.worst,
            e.normals.p99,
            e.normals.max,
            e.nans,
            e.step_caps,
            e.undecided,
            self.steps
        )
    }
}

impl Measured {
    /// Prints the numbers if `SDFC_MEASURE` is set.
    pub(super) fn print(&self) {
        if std::env::var_os("SDFC_MEASURE").is_some() {
            eprintln!("{self}");
        }
    }
}

/// Returns the settings of a scene for one of its cameras.
fn settings(
    compiled: &Compiled,
    uniform_values: &[f64],
    camera: &str,
    size: [u32; 2],
) -> RenderSettings {
    let overrides = Overrides {
        size: Some(size),
        aa: Some(1),
        camera: (!camera.is_empty()).then(|| camera.to_owned()),
        ..Overrides::default()
    };
    let settings = resolve(&compiled.module, uniform_values, &overrides);
    settings.expect("the scene has settings")
}

fn shot(name: String, mut compiled: Compiled, camera: &str, size: [u32; 2]) -> Shot {
    let uniform_values = compiled.module.update(0.0);
    let settings = settings(&compiled, &uniform_values, camera, size);
    Shot {
        name,
        compiled,
        uniform_values,
        settings,
        truth: OnceCell::new(),
    }
}

/// Returns a case from all of its cameras.
pub(super) fn shots(path: &Path, size: [u32; 2]) -> Vec<Shot> {
    let compile = || on_large_stack(|| compiled(path, PassOptions::default()));
    let cameras = compile().module.settings.cameras;
    let has_several_cameras = cameras.len() > 1;
    let shot_of_camera = |camera: &str| {
        let scene = name(path);
        let name = if has_several_cameras {
            format!("{scene}/{camera}")
        } else {
            scene
        };
        shot(name, compile(), camera, size)
    };
    if cameras.is_empty() {
        return vec![shot_of_camera("")];
    }
    cameras
        .iter()
        .map(|camera| shot_of_camera(&camera.name))
        .collect()
}

/// Returns the text of a case with a replaced part.
pub(super) fn changed(case: &str, from: &str, to: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/hard/{case}.sdf"));
    let text = std::fs::read_to_string(&path).expect("it can be read");
    assert!(text.contains(from), "{case} has no {from}");
    text.replace(from, to)
}

/// Returns a shot of a text from its first camera.
pub(super) fn shot_of(name: &str, text: &str, size: [u32; 2]) -> Shot {
    let compiled = on_large_stack(|| compiled_text(text, PassOptions::default()));
    shot(name.to_owned(), compiled, "", size)
}

/// Draws a case on an engine.
pub(super) fn drawn(shot: &Shot, kind: EngineKind, settings: &RenderSettings) -> Image {
    let generated = shot.compiled.generated();
    let loaded = SceneInput {
        module: &shot.compiled.module,
        uniform_values: &shot.uniform_values,
        generated: SceneSource {
            text: &generated.text,
            calls: &generated.calls,
        },
    };
    let mut engine = open(kind).unwrap_or_else(|error| panic!("{kind}: {error}"));
    engine.load(&loaded).expect("it loads");
    engine.render(settings, &|_| {}).expect("it draws")
}

/// Draws a case and compares it with the truth.
pub(super) fn measured(shot: &Shot, kind: EngineKind, cells: CellMode) -> Measured {
    let settings = RenderSettings {
        cells,
        ..shot.settings.clone()
    };
    let image = drawn(shot, kind, &settings);
    let steps: u64 = image.steps.iter().map(|&n| u64::from(n)).sum();
    let depth_error = |&index: &usize| match shot.truth().pixels[index].ray.depth {
        Some(t) if shot.truth().pixels[index].class == PixelClass::Smooth => {
            (f64::from(image.depth[index]) - t).abs() / t
        }
        _ => 0.0,
    };
    let pixels = 0..image.depth.len();
    let worst = pixels
        .max_by(|a, b| depth_error(a).total_cmp(&depth_error(b)))
        .unwrap_or(0);
    Measured {
        worst: [worst % image.width, worst / image.width],
        name: shot.name.clone(),
        kind,
        cells,
        errors: compare(shot.truth(), &image),
        steps: steps as f64 / image.steps.len() as f64,
        image,
    }
}
