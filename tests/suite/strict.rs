//! Strict arithmetic: hit, depth, step count, normal, distances and gradients have the same bits on the
//! CPU, in the interpreter and in generated code.
//!
//! The long form, `SDFC_STRICT=long`, covers 2.6 million rays and 16 million values; its numbers are
//! printed with `--nocapture`. If `SDFC_SECOND_DEVICE` names the file of another Vulkan driver, all tests
//! also run on that driver.
//!
//! The portable form, used by backends other than Vulkan, is tested on a few scenes, and in the long form
//! on all of them.

mod constants;
mod elementary;
mod programs;

use crate::corpus::{compiled, name, on_large_stack, scenes};
use sdfc_compiler::compile::Compiled;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::comparison::{BitDifferences, Report, compare_engines_with};
use sdfc_runtime::engine::{Engine, EngineKind, SceneInput, open_with};
use sdfc_runtime::gpu::Arithmetic;
use sdfc_runtime::render::{CellMode, Image, Mode, RenderSettings};
use sdfc_runtime::settings::{Overrides, resolve};
use sdfc_shaders::assemble::SceneSource;
use sdfc_trials::skip::is_gpu_skipped;
use std::process::Command;

/// Environment variable with the file of another Vulkan driver.
const SECOND_DEVICE: &str = "SDFC_SECOND_DEVICE";

/// Reports whether the long form is selected.
fn is_long() -> bool {
    std::env::var("SDFC_STRICT").is_ok_and(|form| form == "long")
}

/// Opens the engines on a device with strict or fast arithmetic; `None` if GPU tests are skipped.
fn engines(arithmetic: Arithmetic) -> Option<Vec<Box<dyn Engine>>> {
    if is_gpu_skipped() {
        return None;
    }
    let open = |kind: EngineKind| {
        open_with(kind, arithmetic).unwrap_or_else(|error| panic!("{kind}: {error}"))
    };
    Some(EngineKind::FAST.into_iter().map(open).collect())
}

/// A scene with its source and its settings.
struct Case {
    compiled: Compiled,
    uniform_values: Vec<f64>,
    settings: RenderSettings,
}

impl Case {
    /// Creates a case without light and colours, which are not guaranteed.
    fn new(mut compiled: Compiled, size: [u32; 2]) -> Self {
        let uniform_values = compiled.module.update(0.0);
        let overrides = Overrides {
            size: Some(size),
            aa: Some(1),
            mode: Mode::Normal,
            ..Overrides::default()
        };
        let settings = resolve(&compiled.module, &uniform_values, &overrides);
        Self {
            compiled,
            uniform_values,
            settings: settings.expect("the scene has settings"),
        }
    }

    fn from_file(path: &std::path::Path, size: [u32; 2]) -> Self {
        Self::new(
            on_large_stack(|| compiled(path, PassOptions::default())),
            size,
        )
    }

    /// Compares all engines.
    fn compared(&self, engines: &mut [Box<dyn Engine>], arithmetic: Arithmetic) -> Report {
        let source = self.compiled.generated();
        let loaded = SceneInput {
            generated: SceneSource {
                text: &source.text,
                calls: &source.calls,
            },
            ..self.loaded()
        };
        let report = compare_engines_with(&loaded, engines, &self.settings, arithmetic, &|_| {});
        report.unwrap_or_else(|error| panic!("{error}"))
    }

    fn loaded(&self) -> SceneInput<'_> {
        SceneInput {
            module: &self.compiled.module,
            uniform_values: &self.uniform_values,
            generated: SceneSource::default(),
        }
    }
}

#[test]
fn every_scene_has_the_same_bits_on_every_engine() {
    have_the_same_bits(Arithmetic::Strict, |_| true);
}

/// The portable form. The scenes cover the most operations: smooth blends, raw fields, noise, bent and
/// repeated space, and shapes with divisions and square roots.
#[test]
fn scenes_have_the_same_bits_in_the_portable_form() {
    have_the_same_bits(Arithmetic::Portable, |name| {
        is_long() || PORTABLE.contains(&name)
    });
}

const PORTABLE: [&str; 7] = [
    "combine_smooth",
    "distance_changes",
    "domain_bent",
    "domain_repeat",
    "field_math",
    "gyroid",
    "solids_pointed",
];

/// Asserts equal bits on all engines for the selected scenes.
fn have_the_same_bits(arithmetic: Arithmetic, is_selected: impl Fn(&str) -> bool) {
    let Some(mut engines) = engines(arithmetic) else {
        return;
    };
    let size = if is_long() { [304, 192] } else { [72, 48] };
    let mut failures = Vec::new();
    let (mut rays, mut points) = (0, 0);
    let paths = [scenes("tests/scenes"), scenes("examples")].concat();
    for path in paths.iter().filter(|path| is_selected(&name(path))) {
        let case = Case::from_file(path, size);
        if case.compiled.module.settings.max_slope().is_infinite() {
            continue;
        }
        let report = case.compared(&mut engines, arithmetic);
        let bits = report.comparisons.iter().map(|found| &found.bits);
        let bits: Vec<&BitDifferences> = bits.flatten().collect();
        assert_eq!(bits.len(), 3);
        (rays, points) = (rays + bits[0].rays, points + bits[0].points);
        if !report.passed() {
            failures.push(format!("{}\n{report}", path.display()));
        }
    }
    eprintln!("{arithmetic:?}: {rays} rays and {points} points on each of three engines");
    assert!(rays > 0);
    assert!(failures.is_empty(), "{}", failures.join("\n\n"));
}

/// Without strict arithmetic, bits differ on the known devices; otherwise these tests would prove
/// nothing. A device without differences passes too.
#[test]
fn fast_arithmetic_differs_in_bits() {
    let Some(mut engines) = engines(Arithmetic::Default) else {
        return;
    };
    let device = engines[1].device();
    let paths = ["tests/scenes/combine_smooth.sdf", "examples/gyroid.sdf"];
    let differing = paths.map(|path| {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let report =
            Case::from_file(&root.join(path), [96, 64]).compared(&mut engines, Arithmetic::Strict);
        let bits = report
            .comparisons
            .iter()
            .filter_map(|found| found.bits.as_ref());
        let found: usize = bits.map(|b| b.depths + b.distances + b.gradients).sum();
        assert_eq!(found > 0, !report.passed(), "{report}");
        found
    });
    eprintln!("{differing:?} results differ without strict arithmetic on {device}");
    let known = device.contains("llvmpipe");
    assert!(!known || differing.iter().sum::<usize>() > 0, "{device}");
}

/// Pruned cells keep the bits of strict kernels, whether built on the CPU or the GPU.
#[test]
fn cells_keep_every_bit_of_strict_pictures() {
    keep_every_bit(Arithmetic::Strict, &["spheres_many", "combine_smooth"]);
    keep_every_bit(Arithmetic::Portable, &["combine_smooth"]);
}

fn keep_every_bit(arithmetic: Arithmetic, names: &[&str]) {
    let Some(mut engines) = engines(arithmetic) else {
        return;
    };
    let interp = &mut engines[1];
    assert_eq!(interp.kind(), EngineKind::Interp);
    for name in names {
        let paths = scenes("tests/scenes");
        let path = paths.iter().find(|path| crate::corpus::name(path) == *name);
        let case = Case::from_file(path.expect("the scene is there"), [96, 64]);
        interp.load(&case.loaded()).expect("it loads");
        let mut drawn = |cells| -> Image {
            let settings = RenderSettings {
                cells,
                ..case.settings.clone()
            };
            interp.render(&settings, &|_| {}).expect("it is drawn")
        };
        let without = drawn(CellMode::Never);
        for cells in [CellMode::Cpu, CellMode::Gpu] {
            let with = drawn(cells);
            assert!(with.stats.cells.count > 64, "{name} {cells:?}");
            let bits = |image: &Image| -> Vec<[u32; 5]> {
                let all = image.depth.iter().zip(&image.normal).zip(&image.steps);
                all.map(|((t, n), steps)| {
                    [
                        t.to_bits(),
                        *steps,
                        n[0].to_bits(),
                        n[1].to_bits(),
                        n[2].to_bits(),
                    ]
                })
                .collect()
            };
            assert!(bits(&with) == bits(&without), "{name} {cells:?}");
        }
    }
}

/// Runs all other tests of strict arithmetic on the driver that the variable names.
#[test]
fn a_second_device_gives_the_same_bits() {
    if is_gpu_skipped() {
        return;
    }
    let Ok(driver) = std::env::var(SECOND_DEVICE) else {
        eprintln!("skipped: {SECOND_DEVICE} names no second Vulkan driver");
        return;
    };
    let this = std::env::current_exe().expect("a test has a file");
    let output = Command::new(this)
        .args(["strict::", "--skip", "a_second_device", "--nocapture"])
        // The newer and the older name of the variable.
        .env("VK_DRIVER_FILES", &driver)
        .env("VK_ICD_FILENAMES", &driver)
        .env_remove(SECOND_DEVICE)
        .output()
        .expect("the test runs again");
    let said =
        [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    eprintln!("on {driver}:\n{}", said.concat());
    assert!(output.status.success(), "on {driver}");
}
