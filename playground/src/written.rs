//! How the values of a scene's params are written in its text, and the edits that write others.
//!
//! A value keeps the author's unit and form: `60mm` becomes `72mm`, `#3aa6ff` another colour of the
//! screen. All the text around it stays.

use sdfc_compiler::scene::Scene;
use sdfc_lang::ast::{self, Expr, ExprKind, ItemKind, Unit};
use sdfc_lang::{FileId, Sources, Span, parse};
use sdfc_shaders::tone;
use sdfc_vm::settings::ParamKind;
use sdfc_vm::vector::V3;
use std::collections::HashMap;

/// The unit that a param's numbers are written in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InUnit {
    /// The unit.
    pub unit: Unit,
    /// What one of it is in the scene's own: scene units, radians, seconds.
    pub factor: f64,
}

/// No unit.
const BARE: InUnit = InUnit {
    unit: Unit::None,
    factor: 1.0,
};

/// Where and how the value of a param is written.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// Where its value stands.
    pub span: Span,
    /// The unit of its numbers.
    pub unit: InUnit,
    /// Whether it is written as a colour of the screen, `#3aa6ff`.
    hex: bool,
}

/// How each param of a scene is written, in their order; nothing where it is not found.
pub fn written(scene: &Scene, sources: &Sources) -> Vec<Option<Written>> {
    let mut files: HashMap<FileId, Option<ast::File>> = HashMap::new();
    scene
        .params
        .iter()
        .map(|param| {
            let of = param.span.file;
            let file = files.entry(of).or_insert_with(|| parse(sources, of).0);
            let declared = file.as_ref()?.items.iter().find_map(|item| match &item.kind {
                ItemKind::Param(declared) if declared.name.span == param.span => Some(declared),
                _ => None,
            })?;
            let range = declared.range.as_ref().zip(param.range);
            // A zero does not tell its unit's size; an end of the range may.
            let known = [
                Some((&declared.value, param.default.first().copied())),
                range.map(|(range, values)| (&range.end, Some(values.1))),
                range.map(|(range, values)| (&range.start, Some(values.0))),
            ];
            let unit = known
                .into_iter()
                .flatten()
                .find_map(|(expr, value)| in_unit(expr, value?))
                .unwrap_or(BARE);
            Some(Written {
                span: declared.value.span,
                unit,
                hex: matches!(declared.value.kind, ExprKind::Color(_)),
            })
        })
        .collect()
}

/// The unit of a literal, which stands for this value.
fn in_unit(expr: &Expr, value: f64) -> Option<InUnit> {
    let (number, sign) = match &expr.kind {
        ExprKind::Number(number) => (number, 1.0),
        ExprKind::Unary(unary) => match &unary.operand.kind {
            ExprKind::Number(number) => (number, -1.0),
            _ => return None,
        },
        ExprKind::List(items) => return in_unit(items.first()?, value),
        ExprKind::Paren(inner) => return in_unit(inner, value),
        _ => return None,
    };
    let size = sign * number.value.to_f64();
    let factor = match number.unit {
        Unit::None => 1.0,
        _ if size == 0.0 || value == 0.0 => return None,
        _ => value / size,
    };
    (factor.is_finite() && factor > 0.0).then_some(InUnit {
        unit: number.unit,
        factor,
    })
}

/// A value as the language writes it.
pub fn text(kind: ParamKind, value: &[f64], written: Option<&Written>) -> String {
    let unit = written.map_or(BARE, |written| written.unit);
    let unit = match (kind, unit.unit) {
        (ParamKind::Angle, Unit::None) => InUnit {
            unit: Unit::Deg,
            factor: 1_f64.to_radians(),
        },
        (ParamKind::Time, Unit::None) => InUnit {
            unit: Unit::S,
            factor: 1.0,
        },
        _ => unit,
    };
    let number = |value: &f64| number(kind, value / unit.factor, unit.unit);
    match (kind, value) {
        (ParamKind::Bool, [value]) => (*value != 0.0).to_string(),
        (ParamKind::Color, [r, g, b]) => {
            let bytes = srgb([*r, *g, *b]);
            let [x, y, z] = bytes.map(|byte| format!("{byte:02x}"));
            if written.is_none_or(|written| written.hex) {
                format!("#{x}{y}{z}")
            } else {
                let [r, g, b] = [r, g, b].map(|v| short(*v));
                format!("rgb({r}, {g}, {b})")
            }
        }
        (_, [value]) => number(value),
        (_, values) => {
            let all: Vec<String> = values.iter().map(number).collect();
            format!("[{}]", all.join(", "))
        }
    }
}

/// A colour as bytes of the screen.
fn srgb([r, g, b]: [f64; 3]) -> [u8; 3] {
    let color = tone::encode::<f32>(V3::of(r as f32, g as f32, b as f32));
    [color.x, color.y, color.z].map(|channel| tone::to_byte(channel) as u8)
}

/// A number with its unit: whole where the kind is, else with a point, so that it stays what it is.
fn number(kind: ParamKind, value: f64, unit: Unit) -> String {
    let mut digits = short(value);
    let whole = !digits.contains(['.', 'e']);
    if whole && kind != ParamKind::Int && unit == Unit::None {
        digits.push_str(".0");
    }
    digits + unit.suffix()
}

/// A number with seven digits at most, as many as single precision has: division by a unit's size
/// leaves digits behind that nobody wrote.
fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.6e}").parse().unwrap_or(value);
    format!("{rounded}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdfc_compiler::elaborate::{Options, elaborate};

    const SCENE: &str = "/// How blended.
param goo = 0.35 in 0.0..1.0;
param count = 6 in 1..=24;
param tint: color = #3aa6ff;
param dark: color = rgb(0.1, 0.2, 0.3);
param width = 60mm in 30mm..120mm by 1mm;
param turn = 0deg in -90deg..=90deg;
param low = -2 in -4..4;
param on = true;
param shift: vec3 = [0.0, 1.5, 2];
sphere(width).rotate(y: turn).translate(shift)
";

    fn scene() -> (Scene, Sources) {
        let mut sources = Sources::new();
        let file = sources.add("a.sdf", SCENE);
        let (scene, found) = elaborate(&mut sources, file, &Options::default());
        let errors: Vec<_> = found.iter().map(|found| &found.message).collect();
        (scene.unwrap_or_else(|| panic!("{errors:?}")), sources)
    }

    #[test]
    fn values_are_written_as_their_author_did() {
        let (scene, sources) = scene();
        let written = written(&scene, &sources);
        let of = |name: &str, value: &[f64]| {
            let at = scene.params.iter().position(|param| param.name == name);
            let at = at.unwrap();
            text(scene.params[at].kind, value, written[at].as_ref())
        };
        let default = |name: &str| {
            let param = scene.params.iter().find(|param| param.name == name);
            of(name, &param.unwrap().default)
        };
        for (name, as_in_the_text) in [
            ("goo", "0.35"),
            ("count", "6"),
            ("tint", "#3aa6ff"),
            ("dark", "rgb(0.1, 0.2, 0.3)"),
            ("width", "60mm"),
            ("turn", "0deg"),
            ("low", "-2"),
            ("on", "true"),
            ("shift", "[0.0, 1.5, 2.0]"),
        ] {
            assert_eq!(default(name), as_in_the_text, "{name}");
        }
        let width = scene.params.iter().find(|param| param.name == "width");
        let millimetre = width.unwrap().default[0] / 60.0;
        assert_eq!(of("width", &[72.5 * millimetre]), "72.5mm");
        assert_eq!(of("turn", &[-0.785_398_163_397_448_3]), "-45deg");
        assert_eq!(of("goo", &[1.0]), "1.0");
        assert_eq!(of("tint", &[1.0, 0.0, 0.0]), "#ff0000");
        assert_eq!(of("on", &[0.0]), "false");
    }

    #[test]
    fn each_value_is_found_where_it_stands() {
        let (scene, sources) = scene();
        for (param, written) in scene.params.iter().zip(written(&scene, &sources)) {
            let written = written.unwrap();
            let value = sources.slice(written.span);
            let line = SCENE
                .lines()
                .find(|line| line.starts_with(&format!("param {}", param.name)));
            assert!(line.unwrap().contains(value), "{}: {value}", param.name);
        }
    }
}
