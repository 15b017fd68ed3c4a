//! `sdfc info`: the contents of a scene.

use crate::failure::Failure;
use crate::output;
use crate::rounding;
use crate::scene::{self, BuildArgs};
use crate::terminal::Terminal;
use sdfc_compiler::compile::operation_counts;
use sdfc_runtime::rounding::Rounding;
use sdfc_shaders::tone;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::program::{Module, Opcode};
use sdfc_vm::settings::{Param, ParamKind};
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::PathBuf;

/// Report the contents of a scene: params, parts, cameras, bounds, operations.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The scene: .sdf, .sdfb or .vm; `-` is standard input.
    scene: PathBuf,
    #[command(flatten)]
    build: BuildArgs,
    /// Print the contents as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> Result<(), Failure> {
    let opened = scene::open(&arguments.scene, &arguments.build, terminal)?;
    let rounding_error = rounding::for_scene(&opened);
    if arguments.json {
        output::print_json(&as_json(&opened, rounding_error.as_ref()))?;
    } else {
        output::print(page(&opened, rounding_error.as_ref()))?;
    }
    if let Some(warning) = rounding_error
        .as_ref()
        .and_then(|error| rounding::warning(&opened, error))
    {
        terminal.warning(&warning);
    }
    Ok(())
}

/// Returns the facts for people.
fn page(opened: &scene::OpenedScene, rounding_error: Option<&Rounding>) -> String {
    let module = opened.module();
    let settings = &module.settings;
    let needs = module.distance.requirements();
    let mut text = String::new();
    let mut fact = |name: &str, value: &str| {
        let _ = writeln!(text, "{name:11} {value}");
    };
    fact(
        "kind",
        if settings.is_2d {
            "a 2-D shape"
        } else {
            "a solid"
        },
    );
    fact("bounds", &corners(&settings.bounds));
    fact("slope", &slope(module));
    let lines = rounding_error
        .map(rounding::report_lines)
        .unwrap_or_default();
    for (i, line) in lines.iter().enumerate() {
        fact(if i == 0 { "rounding" } else { "" }, line);
    }
    fact(
        "program",
        &format!(
            "{} instructions, {} constants, stack of {}, {} slots{}",
            module.distance.code.len(),
            module.distance.pool.len() * 4,
            needs.depth,
            needs.slots,
            match &module.surface {
                Some(surface) => format!("; {} instructions with materials", surface.code.len()),
                None => String::new(),
            },
        ),
    );
    let counts = operation_counts(&opened.compiled.optimized);
    let counts: Vec<_> = counts
        .iter()
        .map(|(name, count)| format!("{count} {name}"))
        .collect();
    fact("operations", &counts.join(", "));
    let [width, height] = settings.render.size;
    fact(
        "picture",
        &format!("{width}x{height}, {0}x{0} samples", settings.render.aa),
    );
    if let Some(animation) = settings.animation {
        let repetition = if animation.repeats {
            ", again and again"
        } else {
            ""
        };
        fact(
            "animation",
            &format!(
                "{} s, {} fps{repetition}",
                animation.duration, animation.fps
            ),
        );
    }
    fact(
        "cameras",
        &names(settings.cameras.iter().map(|camera| camera.name.as_str())),
    );
    fact("lights", &settings.lights.len().to_string());
    fact(
        "materials",
        &names(settings.materials.iter().map(String::as_str)),
    );
    if !settings.parts.is_empty() {
        fact("parts", &settings.parts.join(", "));
    }
    for param in &settings.params {
        let _ = write!(
            text,
            "param       {} = {}",
            param.name,
            value(param.kind, &param.value)
        );
        if let Some((min, max)) = param.range {
            let dots = if param.inclusive { "..=" } else { ".." };
            let end = |number| value(param.kind, &[number]);
            let _ = write!(text, " in {}{dots}{}", end(min), end(max));
        }
        if let Some(step) = param.step {
            let _ = write!(text, " by {}", value(param.kind, &[step]));
        }
        text.push_str(if param.structural {
            "  structural"
        } else {
            "  live"
        });
        if !param.doc.is_empty() {
            let _ = write!(text, ": {}", param.doc.trim());
        }
        text.push('\n');
    }
    text
}

/// Joins names, and counts the nameless things.
fn names<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let list: Vec<_> = names.collect();
    let named: Vec<_> = list
        .iter()
        .copied()
        .filter(|name| !name.is_empty())
        .collect();
    match (list.len(), named.len()) {
        (count, 0) => count.to_string(),
        (count, named_count) if count == named_count => named.join(", "),
        (count, named_count) => format!(
            "{}, and {} without a name",
            named.join(", "),
            count - named_count
        ),
    }
}

fn corners(bounds: &Bounds) -> String {
    if bounds.is_empty() {
        return "empty".to_owned();
    }
    let corner = |point: [f64; 3]| format!("[{}]", point.map(rounded).join(", "));
    format!("{} to {}", corner(bounds.min), corner(bounds.max))
}

/// Formats a number with at most four decimals.
fn rounded(value: f64) -> String {
    let text = format!("{value:.4}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// Formats the value of a param as a scene writes it.
fn value(kind: ParamKind, numbers: &[f64]) -> String {
    match (kind, numbers) {
        (ParamKind::Bool, [truth]) => (*truth != 0.0).to_string(),
        (ParamKind::Angle, [radians]) => format!("{}deg", rounded(radians.to_degrees())),
        (ParamKind::Time, [seconds]) => format!("{}s", rounded(*seconds)),
        (ParamKind::Color, [r, g, b]) => color([*r, *g, *b]),
        (_, [number]) => rounded(*number),
        (_, several) => {
            format!(
                "[{}]",
                several
                    .iter()
                    .map(|n| rounded(*n))
                    .collect::<Vec<_>>()
                    .join(", ")
            )
        }
    }
}

/// Formats a linear colour in the notation of scenes, which is sRGB.
fn color(linear: [f64; 3]) -> String {
    let encoded = tone::encode::<f64>(V3::new(linear[0], linear[1], linear[2]));
    let [r, g, b] = [encoded.x, encoded.y, encoded.z].map(|channel| tone::to_byte(channel) as u8);
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn as_json(opened: &scene::OpenedScene, rounding_error: Option<&Rounding>) -> Value {
    let module = opened.module();
    let settings = &module.settings;
    let needs = module.distance.requirements();
    // JSON has no infinity: an unbounded side is null.
    let corner = |point: [f64; 3]| {
        point.map(|side| {
            if side.is_finite() {
                json!(side)
            } else {
                Value::Null
            }
        })
    };
    let counts = operation_counts(&opened.compiled.optimized);
    json!({
        "plane": settings.is_2d,
        "bounds": { "min": corner(settings.bounds.min), "max": corner(settings.bounds.max) },
        "divisor": divisor(module),
        "max_slope": module.settings.max_slope(),
        "rounding": rounding_error.map(rounding::as_json),
        "instructions": module.distance.code.len(),
        "surface_instructions": module.surface.as_ref().map(|surface| surface.code.len()),
        "constants": module.distance.pool.len() * 4,
        "depth": needs.depth,
        "slots": needs.slots,
        "operations": counts.into_iter().collect::<std::collections::BTreeMap<_, _>>(),
        "size": settings.render.size,
        "aa": settings.render.aa,
        "animation": settings.animation,
        "cameras": settings.cameras.iter().map(|camera| &camera.name).collect::<Vec<_>>(),
        "lights": settings.lights.len(),
        "materials": settings.materials,
        "parts": settings.parts,
        "params": settings.params.iter().map(param_json).collect::<Vec<_>>(),
    })
}

fn param_json(param: &Param) -> Value {
    json!({
        "name": param.name,
        "doc": param.doc,
        "kind": param.kind,
        "value": param.value,
        "default": param.default,
        "range": param.range,
        "inclusive": param.inclusive,
        "step": param.step,
        "structural": param.structural,
    })
}

/// Returns the largest divisor of a raw field near the scene.
fn divisor(module: &Module) -> f64 {
    let divisors = module.distance.code.iter().filter_map(|i| {
        let pool = &module.distance.pool[i.parameters as usize..];
        match i.code {
            Opcode::Op(Op::FieldDistance) => Some(1.0 / f64::from(pool[0][0])),
            // The inverse of the bound within the cube.
            Opcode::Op(Op::FieldGrowth) => Some(1.0 / f64::from(pool[0][3])),
            _ => None,
        }
    });
    divisors.fold(1.0, f64::max)
}

/// Describes the slope after division.
fn slope(module: &Module) -> String {
    let settings = &module.settings;
    let bound = match settings.max_slope() {
        bound if bound.is_infinite() => "unknown".to_owned(),
        bound if settings.slope_over_estimate.is_some() => {
            format!("at most {} by what the scene states", rounded(bound))
        }
        _ => "at most 1".to_owned(),
    };
    let divisor = divisor(module);
    match divisor <= 1.0 {
        true => bound,
        false => format!("{bound}, after division by up to {}", rounded(divisor)),
    }
}
