//! `sdfc verify`: a comparison of the pictures of all engines.

use super::camera::CameraArgs;
use crate::engine;
use crate::failure::{Failure, INPUT, on_each};
use crate::output;
use crate::progress::Progress;
use crate::scene::{self, BuildArgs};
use crate::terminal::Terminal;
use sdfc_io::png_encoding::encode_png;
use sdfc_runtime::comparison::{Report, compare_engines_with, difference_image, small_settings};
use sdfc_runtime::engine::{Engine, EngineError, EngineKind};
use sdfc_runtime::render::{RenderProgress, RenderSettings};
use sdfc_runtime::settings::{Overrides, resolve};
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Compare the engines on scenes: pixels, hits, depths, distances.
///
/// The exit code is 1 if engines differ by more than rounding explains. With --strict, it is 1 if
/// any bit of hit, depth, step count, normal, distance or gradient differs. Then the pictures and
/// their difference are written.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The scenes; `-` is standard input.
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    #[command(flatten)]
    build: BuildArgs,
    /// The engines; the others are compared with the first.
    #[arg(long, value_name = "ENGINES", value_delimiter = ',', value_parser = kind,
        default_value = "cpu,interp,wgsl")]
    engines: Vec<EngineKind>,
    #[command(flatten)]
    arithmetic: engine::ArithmeticArgs,
    /// Width and height of the pictures in pixels; by default the width is 160.
    #[arg(long, value_name = "WxH", value_parser = super::render::size)]
    size: Option<[u32; 2]>,
    #[command(flatten)]
    camera_changes: CameraArgs,
    /// Folder for the pictures of engines that differ.
    #[arg(short, long, value_name = "FOLDER", default_value = "out")]
    output: PathBuf,
    /// Time after which the comparison of a scene is given up: 90s. A proof by the engine reference can take minutes.
    #[arg(long, value_name = "TIME", value_parser = scene::seconds)]
    limit: Option<f64>,
    /// Show progress even where stderr is no terminal.
    #[arg(long)]
    progress: bool,
    /// Print all measurements as JSON.
    #[arg(long)]
    json: bool,
}

fn kind(name: &str) -> Result<EngineKind, String> {
    name.parse()
        .map_err(|error: sdfc_runtime::engine::UnknownEngine| error.to_string())
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<(), Failure> {
    let mut engines = arguments
        .engines
        .iter()
        .map(|kind| engine::open(*kind, arguments.arithmetic))
        .collect::<Result<Vec<_>, _>>()?;
    if arguments.arithmetic.arithmetic().is_strict() {
        // The description of the device names the method.
        for engine in &engines {
            terminal.note(&format!("{} on {}", engine.kind(), engine.device()));
        }
    }
    let mut reports = Vec::new();
    let verified = on_each(&arguments.scenes, terminal, |path| {
        let report = compare(path, arguments, &mut engines, terminal);
        if arguments.json {
            reports.push(as_json(path, &report));
        }
        let report = report?;
        if !arguments.json {
            output::print(format!("{}\n{report}\n", path.display()))?;
        }
        if report.passed() {
            return Ok(());
        }
        write_pictures(path, &report, &arguments.output, terminal)?;
        Err(Failure::AlreadyReported(INPUT))
    });
    if arguments.json {
        output::print_json(&reports)?;
    }
    verified
}

/// Compares a scene on all engines.
fn compare(
    path: &Path,
    arguments: &Arguments,
    engines: &mut [Box<dyn Engine>],
    terminal: &Terminal,
) -> Result<Report, Failure> {
    let overrides = Overrides {
        camera_changes: arguments.camera_changes.changes(),
        ..Overrides::default()
    };
    let build = arguments.build.for_camera(&overrides.camera_changes);
    let scene = scene::open(path, &build, terminal)?;
    let settings = resolve(scene.module(), &scene.uniform_values, &overrides)
        .map_err(|error| Failure::Input(format!("{}: {error}", path.display())))?;
    let settings = match arguments.size {
        Some(size) => RenderSettings {
            size,
            aa: 1,
            ..settings
        },
        None => small_settings(&settings),
    };
    let arithmetic = arguments.arithmetic.arithmetic();
    let progress = LimitedProgress {
        shown: Progress::new(terminal, path.display().to_string(), arguments.progress),
        started: Instant::now(),
        limit: arguments.limit,
    };
    let report = compare_engines_with(&scene.loaded(), engines, &settings, arithmetic, &progress);
    report.map_err(|error| match (error, arguments.limit) {
        (EngineError::Stopped, Some(limit)) => Failure::Input(format!(
            "{}: not compared within {limit} s: allow more with `--limit`, or draw less with `--size`",
            path.display()
        )),
        (error, _) => engine::to_failure(error),
    })
}

/// Progress that stops the work after a time.
struct LimitedProgress<'a> {
    shown: Progress<'a>,
    started: Instant,
    /// In seconds.
    limit: Option<f64>,
}

impl RenderProgress for LimitedProgress<'_> {
    fn report(&self, fraction: f32) -> ControlFlow<()> {
        self.shown.update(fraction);
        let elapsed = self.started.elapsed().as_secs_f64();
        match self.limit.is_some_and(|limit| elapsed > limit) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

/// Writes the pictures of engines that differ, and their differences.
fn write_pictures(
    path: &Path,
    report: &Report,
    folder: &Path,
    terminal: &Terminal,
) -> Result<(), Failure> {
    std::fs::create_dir_all(folder).map_err(|error| Failure::unwritable(folder, &error))?;
    let stem = path
        .file_stem()
        .unwrap_or("scene".as_ref())
        .display()
        .to_string();
    let [width, height] = report.size.map(|side| side as usize);
    let write = |suffix: &str, rgba: &[u8]| {
        let path = folder.join(format!("{stem}-{suffix}.png"));
        let bytes = encode_png([width, height], rgba).map_err(Failure::Input)?;
        output::write(&path, &bytes)?;
        terminal.note(&format!("wrote {}", path.display()));
        Ok(())
    };
    for (subject, frame) in report.engines.iter().zip(&report.images) {
        write(subject.kind.name(), &frame.rgba8())?;
    }
    for comparison in report
        .comparisons
        .iter()
        .filter(|comparison| !comparison.failures.is_empty())
    {
        if let Some([a, b]) = report.images_of(comparison) {
            let suffix = format!("{}-{}", comparison.reference, comparison.engine);
            write(&suffix, &difference_image(a, b))?;
        }
    }
    Ok(())
}

fn as_json(path: &Path, report: &Result<Report, Failure>) -> Value {
    let file = path.display().to_string();
    match report {
        Ok(report) => json!({ "file": file, "ok": report.passed(), "report": report }),
        Err(failure) => json!({ "file": file, "ok": false, "error": failure.to_string() }),
    }
}
