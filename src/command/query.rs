//! `sdfc query`: values of a scene at points, for scripts and tests.

use crate::engine::{self, ArithmeticArgs, EngineArg};
use crate::failure::{Failure, INPUT};
use crate::input;
use crate::output;
use crate::scene::{self, BuildArgs};
use crate::terminal::Terminal;
use sdfc_runtime::engine::FieldSample;
use serde_json::json;
use std::fmt::Write;
use std::io::IsTerminal;
use std::path::PathBuf;

/// Maximum number of reported lines with mistakes.
const MAX_REPORTED_LINES: usize = 20;

/// Read points, and print distance, gradient and material at each of them.
///
/// A line of standard input is a point, three numbers; `#` begins a comment. A line of output is
/// the distance, the gradient's three numbers, and the material's name or number. A field without a found slope
/// bound is divided by an estimate, stated or not: its value may exceed the distance.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The scene: .sdf, .sdfb or .vm.
    scene: PathBuf,
    #[command(flatten)]
    build: BuildArgs,
    /// Engine that evaluates.
    #[arg(long, value_enum, value_name = "ENGINE", default_value_t)]
    engine: EngineArg,
    #[command(flatten)]
    arithmetic: ArithmeticArgs,
    /// Print the values as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<(), Failure> {
    if input::is_standard(&arguments.scene) {
        return Err(Failure::Input(
            "the points are read from standard input: give the scene as a file".to_owned(),
        ));
    }
    let mut engine = engine::open_choice(arguments.engine, arguments.arithmetic)?;
    let build = arguments.build.for_engine(&*engine);
    let scene = scene::open(&arguments.scene, &build, terminal)?;
    if std::io::stdin().is_terminal() {
        terminal.note("write a point a line: x y z");
    }
    let points = points(&input::standard()?, scene.module().settings.is_2d, terminal)?;
    engine::load(&mut *engine, &scene)?;
    let samples = engine.query(&points).map_err(engine::to_failure)?;
    let materials = &scene.module().settings.materials;
    if arguments.json {
        let rows = points.iter().zip(&samples);
        let rows: Vec<_> = rows
            .map(|(point, sample)| as_json(point, sample, materials))
            .collect();
        return output::print_json(&rows);
    }
    let mut text = String::new();
    for FieldSample {
        distance,
        gradient: [x, y, z],
        surface,
    } in &samples
    {
        let material = match material(surface.id, materials) {
            (number, "") => number.to_string(),
            (_, name) => name.to_owned(),
        };
        let _ = writeln!(text, "{distance} {x} {y} {z} {material}");
    }
    output::print(text)
}

/// Parses the points of a text, a line each; the third coordinate is optional in the plane.
fn points(text: &str, is_2d: bool, terminal: &Terminal) -> Result<Vec<[f32; 3]>, Failure> {
    let mut points = Vec::new();
    let mut problems = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let content = line.split('#').next().unwrap_or_default().trim();
        if content.is_empty() {
            continue;
        }
        match point(content, is_2d) {
            Ok(point) => points.push(point),
            Err(problem) => {
                problems.push(format!("standard input, line {}: {problem}", number + 1))
            }
        }
    }
    if problems.is_empty() {
        return Ok(points);
    }
    for problem in problems.iter().take(MAX_REPORTED_LINES) {
        terminal.error(problem);
    }
    if problems.len() > MAX_REPORTED_LINES {
        terminal.note(&format!(
            "{} more lines are wrong",
            problems.len() - MAX_REPORTED_LINES
        ));
    }
    Err(Failure::AlreadyReported(INPUT))
}

fn point(content: &str, is_2d: bool) -> Result<[f32; 3], String> {
    let separators = |c: char| c.is_whitespace() || c == ',';
    let words: Vec<&str> = content
        .split(separators)
        .filter(|word| !word.is_empty())
        .collect();
    let number = |word: &str| match word.parse::<f32>() {
        Ok(number) if number.is_finite() => Ok(number),
        Ok(_) => Err(format!("`{word}` is not a finite number")),
        Err(_) => Err(format!("`{word}` is not a number")),
    };
    match words.as_slice() {
        [x, y, z] => Ok([number(x)?, number(y)?, number(z)?]),
        [x, y] if is_2d => Ok([number(x)?, number(y)?, 0.0]),
        several => Err(format!(
            "a point is three numbers, and here {} {}",
            if several.len() == 1 { "is" } else { "are" },
            several.len()
        )),
    }
}

/// Returns the number and the name of a material.
fn material(id: f32, names: &[String]) -> (usize, &str) {
    let number = id.round().max(0.0) as usize;
    (number, names.get(number).map_or("", String::as_str))
}

fn as_json(point: &[f32; 3], sample: &FieldSample, materials: &[String]) -> serde_json::Value {
    let (number, name) = material(sample.surface.id, materials);
    json!({
        "point": point,
        "distance": sample.distance,
        "gradient": sample.gradient,
        "material": { "id": number, "name": name, "albedo": sample.surface.albedo },
    })
}
