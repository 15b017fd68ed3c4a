//! `sdfc bench`: how fast scenes are drawn, and how far from the truth.

use crate::bench::study::{Options, SceneReport, devices, study};
use crate::bench::{Report, html, markdown, tolerance};
use crate::engine::{self, Tier};
use crate::failure::{Failure, on_each};
use crate::output;
use crate::progress::Progress;
use crate::scene::Build;
use crate::terminal::Terminal;
use sdfc_runtime::engine::{Engine, EngineKind};
use std::path::{Path, PathBuf};

/// Measure speed against error: draw scenes with many settings on each engine, and compare them with
/// what the engine reference proves.
///
/// One setting is changed at a time (where rays stop, how they step, how normals are found, how much
/// detail is kept), and a few together. Without `--report`, `--markdown` or `--json` the tables are
/// printed as Markdown.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The scenes.
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    #[command(flatten)]
    build: Build,
    /// The engines; without it, cpu, and interp and wgsl where there is a device.
    #[arg(long, value_name = "ENGINES", value_delimiter = ',', value_parser = kind)]
    engines: Vec<EngineKind>,
    /// The pictures' width in pixels; their shape is the scene's.
    #[arg(long, value_name = "PIXELS", default_value_t = 160,
        value_parser = clap::value_parser!(u32).range(8..=4096))]
    width: u32,
    /// A time is the median of so many pictures, or of fewer where they take seconds.
    #[arg(long, value_name = "N", default_value_t = 3,
        value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: u32,
    /// Take the fastest setting that keeps an error of so many pixels, such as 0.5px, and tell which
    /// it is.
    #[arg(long, value_name = "PIXELS", value_parser = tolerance::pixels)]
    tolerance: Option<f64>,
    /// Write the report with charts as one HTML file.
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Write the report as Markdown.
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// Print everything that was measured as JSON.
    #[arg(long)]
    json: bool,
}

/// The name of an engine that draws pictures.
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
    for path in [&arguments.report, &arguments.markdown]
        .into_iter()
        .flatten()
    {
        output::check(path)?;
    }
    let mut engines = engines(&arguments.engines, terminal)?;
    let options = Options {
        width: arguments.width,
        rounds: arguments.rounds as usize,
        tolerance: arguments.tolerance,
    };
    let mut scenes: Vec<SceneReport> = Vec::new();
    let measured = on_each(&arguments.scenes, terminal, |path| {
        let progress = Progress::new(terminal, path.display().to_string(), false);
        let told = |share: f32| progress.is_at(share);
        let (build, engines) = (&arguments.build, &mut engines);
        scenes.push(study(path, build, engines, &options, terminal, &told)?);
        Ok(())
    });
    if scenes.is_empty() {
        return measured;
    }
    let report = Report::of(command(), devices(&engines), &options, scenes);
    tell_choices(&report, terminal);
    deliver(&report, arguments)?;
    measured
}

/// Opens the engines that are asked for; if none are, those that can be.
fn engines(asked: &[EngineKind], terminal: &Terminal) -> Result<Vec<Box<dyn Engine>>, Failure> {
    if !asked.is_empty() {
        let mut once: Vec<EngineKind> = Vec::new();
        for kind in asked {
            if !once.contains(kind) {
                once.push(*kind);
            }
        }
        let open = |kind| engine::open(kind, Tier::default());
        return once.into_iter().map(open).collect();
    }
    let mut opened = Vec::new();
    for kind in EngineKind::FAST {
        match engine::open(kind, Tier::default()) {
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

/// The command as it was given, without the path of the program.
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

/// Says what was taken for the error that was asked for.
fn tell_choices(report: &Report, terminal: &Terminal) {
    let Some(pixels) = report.tolerance else {
        return;
    };
    for (scene, choice) in markdown::chosen(report) {
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

/// Writes and prints what is asked for.
fn deliver(report: &Report, arguments: &Arguments) -> Result<(), Failure> {
    let write = |to: &Path, text: String| output::deliver(Some(to), text.as_bytes(), true);
    if let Some(to) = &arguments.report {
        let page = html::page(report);
        let page = page.map_err(|error| Failure::Input(format!("a chart failed: {error}")))?;
        write(to, page)?;
    }
    if let Some(to) = &arguments.markdown {
        write(to, markdown::page(report))?;
    }
    if arguments.json {
        output::print_json(report)
    } else if arguments.report.is_none() && arguments.markdown.is_none() {
        output::print(markdown::page(report))
    } else {
        Ok(())
    }
}
