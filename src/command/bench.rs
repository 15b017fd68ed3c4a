//! `sdfc bench`: the speed of drawing scenes, and the error of their pictures.

use super::camera::CameraArgs;
use crate::bench::scene_report::{MeasureOptions, SceneReport, devices, measure_scene};
use crate::bench::{BenchReport, charts, html, markdown, tolerance};
use crate::engine::{self, ArithmeticArgs};
use crate::failure::{Failure, on_each};
use crate::output;
use crate::progress::Progress;
use crate::scene::BuildArgs;
use crate::terminal::Terminal;
use sdfc_runtime::engine::{Engine, EngineKind};
use std::path::{Path, PathBuf};

/// Measure speed against error: draw scenes with many settings on each engine, and compare the
/// pictures with those of the engine reference.
///
/// One setting is changed at a time (where rays stop, how they step, how normals are found, the amount of
/// detail), and a few together. Without `--report`, `--markdown` or `--json` the tables are printed as
/// Markdown.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The scenes.
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    #[command(flatten)]
    build: BuildArgs,
    /// The engines; by default cpu, and interp and wgsl where there is a device.
    #[arg(long, value_name = "ENGINES", value_delimiter = ',', value_parser = kind)]
    engines: Vec<EngineKind>,
    /// Width of the pictures in pixels; their aspect ratio is the scene's.
    #[arg(long, value_name = "PIXELS", default_value_t = 960,
        value_parser = clap::value_parser!(u32).range(8..=4096))]
    width: u32,
    /// Number of pixels whose true depth is proved, in tiles all over the picture and denser at edges; all of a
    /// picture that has fewer.
    #[arg(long, value_name = "N", default_value_t = 4096,
        value_parser = clap::value_parser!(u32).range(16..))]
    samples: u32,
    #[command(flatten)]
    camera_changes: CameraArgs,
    /// Number of pictures whose median time is reported; fewer where they take seconds.
    #[arg(long, value_name = "N", default_value_t = 3,
        value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: u32,
    /// Maximum error in pixels, such as 0.5px; the fastest setting that keeps it is reported.
    #[arg(long, value_name = "PIXELS", value_parser = tolerance::pixels)]
    tolerance: Option<f64>,
    /// Write the report with charts as one HTML file.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Write the report as Markdown, and its chart beside it as an SVG file of the same name.
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// Print all measurements as JSON.
    #[arg(long)]
    json: bool,
}

/// Parses the name of an engine that draws pictures.
fn kind(name: &str) -> Result<EngineKind, String> {
    match name.parse() {
        Ok(EngineKind::Reference) => {
            Err("errors are measured against it: choose of cpu, interp and wgsl".to_owned())
        }
        Ok(kind) => Ok(kind),
        Err(sdfc_runtime::engine::UnknownEngine(name)) => Err(format!(
            "there is no engine `{name}`, only cpu, interp and wgsl"
        )),
    }
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<(), Failure> {
    let chart = arguments.markdown.as_deref().and_then(chart_path);
    for path in [&arguments.report, &arguments.markdown, &chart]
        .into_iter()
        .flatten()
    {
        output::check(path)?;
        output::check_differs(path, arguments.scenes.iter().map(PathBuf::as_path))?;
    }
    let outputs = [&arguments.report, &arguments.markdown, &chart];
    let outputs: Vec<&PathBuf> = outputs.into_iter().flatten().collect();
    if let Some(i) = (1..outputs.len()).find(|&i| outputs[..i].contains(&outputs[i])) {
        return Err(Failure::Input(format!(
            "{} would be written twice: give each report its own file",
            outputs[i].display()
        )));
    }
    let mut engines = engines(&arguments.engines, terminal)?;
    let options = MeasureOptions {
        width: arguments.width,
        samples: arguments.samples as usize,
        rounds: arguments.rounds as usize,
        tolerance: arguments.tolerance,
        camera_changes: arguments.camera_changes.changes(),
    };
    let mut scenes: Vec<SceneReport> = Vec::new();
    let measured = on_each(&arguments.scenes, terminal, |path| {
        let progress = Progress::new(terminal, path.display().to_string(), false);
        let report_progress = |fraction: f32| progress.update(fraction);
        let (build, engines) = (&arguments.build, &mut engines);
        scenes.push(measure_scene(
            path,
            build,
            engines,
            &options,
            terminal,
            &report_progress,
        )?);
        Ok(())
    });
    if scenes.is_empty() {
        return measured;
    }
    let report = BenchReport::new(command(), devices(&engines), &options, scenes);
    report_choices(&report, terminal);
    deliver(&report, arguments)?;
    measured
}

/// Opens the requested engines; without any, all that are available.
fn engines(requested: &[EngineKind], terminal: &Terminal) -> Result<Vec<Box<dyn Engine>>, Failure> {
    if !requested.is_empty() {
        let mut unique: Vec<EngineKind> = Vec::new();
        for kind in requested {
            if !unique.contains(kind) {
                unique.push(*kind);
            }
        }
        let open = |kind| engine::open(kind, ArithmeticArgs::default());
        return unique.into_iter().map(open).collect();
    }
    let mut opened = Vec::new();
    for kind in EngineKind::FAST {
        match engine::open(kind, ArithmeticArgs::default()) {
            Ok(engine) => opened.push(engine),
            Err(Failure::Environment(problem)) => {
                let first = problem.lines().next().unwrap_or_default();
                terminal.note(&format!("{first}; it is left out"));
            }
            Err(other) => return Err(other),
        }
    }
    Ok(opened)
}

/// Returns the command as it was given, without the path of the program.
fn command() -> String {
    let words = std::env::args().skip(1).map(|word| {
        let plain = |c: char| c.is_alphanumeric() || "-_./,=:+@%".contains(c);
        if !word.is_empty() && word.chars().all(plain) {
            word
        } else {
            format!("'{}'", word.replace('\'', "'\\''"))
        }
    });
    let words: Vec<String> = words.collect();
    format!("sdfc {}", words.join(" "))
}

/// Reports the chosen settings for the requested error.
fn report_choices(report: &BenchReport, terminal: &Terminal) {
    let Some(pixels) = report.tolerance else {
        return;
    };
    for (scene, choice) in markdown::chosen_settings(report) {
        let about = format!("{scene} on {}", choice.engine);
        if choice.kept {
            terminal.note(&format!(
                "{about}: {} is the fastest that keeps {pixels} px",
                choice.setting
            ));
        } else {
            terminal.warning(&format!(
                "{about}: no setting keeps {pixels} px, {} is nearest",
                choice.setting
            ));
        }
    }
}

/// Returns the file of the chart beside a report; `None` beside standard output.
fn chart_path(markdown: &Path) -> Option<PathBuf> {
    (markdown != Path::new("-")).then(|| markdown.with_extension("svg"))
}

/// Writes and prints the requested reports.
fn deliver(report: &BenchReport, arguments: &Arguments) -> Result<(), Failure> {
    let write = |to: &Path, text: String| output::deliver(Some(to), text.as_bytes(), true);
    let drawn = |chart: Result<String, String>| {
        chart.map_err(|error| Failure::Input(format!("a chart failed: {error}")))
    };
    if let Some(to) = &arguments.report {
        write(to, drawn(html::page(report))?)?;
    }
    if let Some(to) = &arguments.markdown {
        let chart = chart_path(to);
        if let Some(chart) = &chart {
            write(chart, drawn(charts::time_against_error(report).svg())?)?;
        }
        let name = chart.as_deref().and_then(Path::file_name);
        let name = name.map(|name| name.to_string_lossy());
        write(to, markdown::page(report, name.as_deref()))?;
    }
    if arguments.json {
        output::print_json(report)
    } else if arguments.report.is_none() && arguments.markdown.is_none() {
        output::print(markdown::page(report, None))
    } else {
        Ok(())
    }
}
