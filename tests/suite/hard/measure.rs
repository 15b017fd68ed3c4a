//! A hard case seen by a camera: drawn, and compared with the truth.

use crate::corpus::{compiled, compiled_text, name, on_large_stack};
use sdfc_compiler::compile::Compiled;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::engine::{EngineKind, Loaded, open};
use sdfc_runtime::frame::{CellUse, Frame, RenderSettings};
use sdfc_runtime::reference::{Errors, Options, Place, Truth, compare, trace};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use std::cell::OnceCell;
use std::fmt;
use std::path::Path;

/// A case from one of its cameras, with the truth.
pub(super) struct Shot {
    /// The scene and, where it has several, the camera: `tips/front`.
    pub(super) name: String,
    pub(super) compiled: Compiled,
    pub(super) outputs: Vec<f64>,
    pub(super) settings: RenderSettings,
    truth: OnceCell<Truth>,
}

impl Shot {
    /// Where its rays end.
    pub(super) fn truth(&self) -> &Truth {
        let options = Options::default();
        self.truth
            .get_or_init(|| trace(&self.compiled.module, &self.settings, &options))
    }
}

/// How far a picture is from the truth, and what it took.
pub(super) struct Measured {
    name: String,
    kind: EngineKind,
    cells: CellUse,
    pub(super) errors: Errors,
    /// Evaluations of the field to the end of rays, for each of them.
    pub(super) steps: f64,
    /// The smooth pixel whose depth is worst.
    worst: [usize; 2],
    pub(super) frame: Frame,
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
    /// Tells the numbers where they are asked for.
    pub(super) fn print(&self) {
        if std::env::var_os("SDFC_MEASURE").is_some() {
            eprintln!("{self}");
        }
    }
}

/// A scene's settings for a camera.
fn settings(compiled: &Compiled, outputs: &[f64], camera: &str, size: [u32; 2]) -> RenderSettings {
    let overrides = Overrides {
        size: Some(size),
        aa: Some(1),
        camera: (!camera.is_empty()).then(|| camera.to_owned()),
        ..Overrides::default()
    };
    let settings = resolve(&compiled.module, outputs, &overrides);
    settings.expect("the scene has settings")
}

fn shot(name: String, mut compiled: Compiled, camera: &str, size: [u32; 2]) -> Shot {
    let outputs = compiled.module.update(0.0);
    let settings = settings(&compiled, &outputs, camera, size);
    Shot {
        name,
        compiled,
        outputs,
        settings,
        truth: OnceCell::new(),
    }
}

/// A case from all of its cameras.
pub(super) fn shots(path: &Path, size: [u32; 2]) -> Vec<Shot> {
    let compile = || on_large_stack(|| compiled(path, PassOptions::default()));
    let cameras = compile().module.settings.cameras;
    let several = cameras.len() > 1;
    let of_camera = |camera: &str| {
        let scene = name(path);
        let name = if several {
            format!("{scene}/{camera}")
        } else {
            scene
        };
        shot(name, compile(), camera, size)
    };
    if cameras.is_empty() {
        return vec![of_camera("")];
    }
    cameras
        .iter()
        .map(|camera| of_camera(&camera.name))
        .collect()
}

/// The text of a case, with one of its lines as another one.
pub(super) fn changed(case: &str, from: &str, to: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/hard/{case}.sdf"));
    let text = std::fs::read_to_string(&path).expect("it can be read");
    assert!(text.contains(from), "{case} has no {from}");
    text.replace(from, to)
}

/// A scene's text, seen by its first camera.
pub(super) fn shot_of(name: &str, text: &str, size: [u32; 2]) -> Shot {
    let compiled = on_large_stack(|| compiled_text(text, PassOptions::default()));
    shot(name.to_owned(), compiled, "", size)
}

/// What an engine draws of a case.
pub(super) fn drawn(shot: &Shot, kind: EngineKind, settings: &RenderSettings) -> Frame {
    let generated = shot.compiled.generated();
    let loaded = Loaded {
        module: &shot.compiled.module,
        outputs: &shot.outputs,
        generated: SceneSource {
            text: &generated.text,
            calls: &generated.calls,
        },
    };
    let mut engine = open(kind).unwrap_or_else(|error| panic!("{kind}: {error}"));
    engine.load(&loaded).expect("it loads");
    engine.render(settings, &|_| {}).expect("it draws")
}

/// Draws a case and compares it.
pub(super) fn measured(shot: &Shot, kind: EngineKind, cells: CellUse) -> Measured {
    let settings = RenderSettings {
        cells,
        ..shot.settings.clone()
    };
    let frame = drawn(shot, kind, &settings);
    let steps: u64 = frame.steps.iter().map(|&n| u64::from(n)).sum();
    let off = |&at: &usize| match shot.truth().rays[at].depth {
        Some(t) if shot.truth().places[at] == Place::Smooth => {
            (f64::from(frame.depth[at]) - t).abs() / t
        }
        _ => 0.0,
    };
    let pixels = 0..frame.depth.len();
    let worst = pixels.max_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0);
    Measured {
        worst: [worst % frame.width, worst / frame.width],
        name: shot.name.clone(),
        kind,
        cells,
        errors: compare(shot.truth(), &frame),
        steps: steps as f64 / frame.steps.len() as f64,
        frame,
    }
}
